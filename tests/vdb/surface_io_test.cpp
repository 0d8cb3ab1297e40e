#include "vdb/surface_io.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <clocale>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "core/error.h"
#include "vdb/detail/surface_parse.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;
using Warnings = std::vector<std::string>;
using Parse = Surface (*)(std::string_view, const std::string&, Warnings&);

/// Runs `action`, which must throw Error with `code`; returns the message.
template <class Action>
std::string message_of(ErrorCode code, Action&& action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(static_cast<int>(e.code()), static_cast<int>(code)) << e.what();
    const std::string text = e.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << "a message is one line";
    return text;
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

bool has(const Warnings& warnings, const std::string& text) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

template <class T>
void put(std::string& bytes, T value, bool big = false) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof value);
  bytes.append(raw, sizeof value);
}

/// A tetrahedron as binary STL: `claimed` facets in the header, `held` in the file.
std::string binary_stl(std::uint32_t claimed, int held, const std::string& title = "a tetrahedron") {
  const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const int f[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  std::string bytes = title;
  bytes.resize(80, '\0');
  put(bytes, claimed);
  for (int t = 0; t < held; ++t) {
    bytes.append(12, '\0');
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) put(bytes, p[f[t % 4][k]][i]);
    bytes.append(2, '\0');
  }
  return bytes;
}

const char* const kAsciiStl =
    "solid  first part \n facet normal 0 0 -1\n  outer loop\n   vertex 0 0 0\n   vertex 0 1 0\n   vertex 1 0 "
    "0\n"
    "  endloop\n endfacet\n facet normal 0 -1 0\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 "
    "0 1\n"
    "  endloop\n endfacet\nendsolid first part\nsolid other\n facet normal -1 0 0\n  outer loop\n   vertex 0 "
    "0 0\n"
    "   vertex 0 0 1\n   vertex 0 1 0\n  endloop\n endfacet\n facet normal 1 1 1\n  outer loop\n   vertex 1 "
    "0 0\n"
    "   vertex 0 1 0\n   vertex 0 0 1\n  endloop\n endfacet\nendsolid other\n";

const char* const kObj =
    "# a tetrahedron\nmtllib x.mtl\no body\nv 0 0 0\nv 1 0 0\nv 0 1 0 1.0\nv 0 0 1 0.5 0.5 0.5\nvt 0 0\nvn 0 "
    "0 1\n"
    "f 1 3 2\nf 1/1 2/1 4/1\ng slant side\nusemtl red\nf -4//1 -1//1 -2//1\nf 2/1/1 3/1/1 \\\n 4/1/1\n";

std::string ply(const std::string& format) {
  const bool big = format == "binary_big_endian";
  std::string bytes = "ply\nformat " + format +
                      " 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty float y\n"
                      "property uchar red\nproperty short z\nelement edge 1\nproperty int a\nelement face 3\n"
                      "property list uchar int vertex_indices\nproperty float area\nelement face 1\n"
                      "property list ushort uint vertex_index\nend_header\n";
  if (format == "ascii")
    return bytes +
           "0 0 7 0\n1 0 7 0\n0 1.5 7 0\n0 0 7 1\n9\n3 0 2 1 0.5\n3 0 1 3 0.5\n3 0 3 2 0.5\n3 1 2 3\n";
  const double x[4] = {0, 1, 0, 0};
  const float y[4] = {0, 0, 1.5, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    put(bytes, x[i], big);
    put(bytes, y[i], big);
    bytes += '\7';
    put(bytes, static_cast<std::int16_t>(i == 3), big);
  }
  put(bytes, std::int32_t{9}, big);
  const std::int32_t f[3][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}};
  for (const auto& face : f) {
    bytes += '\3';
    for (const std::int32_t v : face) put(bytes, v, big);
    put(bytes, 0.5F, big);
  }
  put(bytes, std::uint16_t{3}, big);
  for (const std::uint32_t v : {1U, 2U, 3U}) put(bytes, v, big);
  return bytes;
}

/// Parses, cleans and expects a closed tetrahedron of the given volume; returns the surface.
Surface expect_tetrahedron(Parse parse, const std::string& bytes, double volume, Warnings& warnings) {
  Surface s = parse(bytes, "t", warnings);
  EXPECT_EQ(s.tags.size(), s.triangles.size());
  const SurfaceReport r = clean(s, "t");
  EXPECT_EQ(r.triangles, 4);
  EXPECT_EQ(r.points, 4);
  EXPECT_TRUE(r.watertight());
  EXPECT_EQ(r.flipped, 0);
  EXPECT_NEAR(r.volume, volume, 1e-15);
  return s;
}

TEST(ParseNumber, Forms) {
  const auto value = [](const char* text) {
    double v = -77.0;
    EXPECT_TRUE(detail::parse_number(text, v)) << text;
    return v;
  };
  EXPECT_EQ(value("1.5"), 1.5);
  EXPECT_EQ(value("+1.5E+01"), 15.0);
  EXPECT_EQ(value("-.5"), -0.5);
  EXPECT_EQ(value("1e400"), HUGE_VAL);
  EXPECT_EQ(value("-1e400"), -HUGE_VAL);
  EXPECT_EQ(value("1e-400"), 0.0);
  EXPECT_TRUE(std::isnan(value("NaN")));
  EXPECT_TRUE(std::isinf(value("-inf")));
  double v = 3.0;
  for (const char* text : {"", "+", "+-1", "1,5", "1.5x", "0x10", "--1", "e5", "1.#QNAN"})
    EXPECT_FALSE(detail::parse_number(text, v)) << text;
  EXPECT_EQ(v, 3.0);
}

TEST(ParseNumber, IgnoresTheLocale) {
  const char* const decimal_comma = std::setlocale(LC_ALL, "de_DE.UTF-8");
  double v = 0.0;
  EXPECT_TRUE(detail::parse_number("1.5", v));
  EXPECT_EQ(v, 1.5);
  std::setlocale(LC_ALL, "C");
  if (decimal_comma == nullptr) GTEST_SKIP() << "no locale with a decimal comma is installed";
}

TEST(Printable, CleansForeignText) {
  EXPECT_EQ(detail::printable("plain"), "plain");
  EXPECT_EQ(detail::printable("\xe6\x9c\x88\xe7\x90\x83"), "\xe6\x9c\x88\xe7\x90\x83");
  EXPECT_EQ(detail::printable("a\xff\x01z\xe6\x9c"), "a??z??");
  EXPECT_EQ(detail::printable("\xc0\x80\xed\xa0\x80\xf5"), "??????");  // overlong, surrogate, beyond Unicode
  EXPECT_EQ(detail::printable(std::string(300, 'x')).size(), 200u);
}

TEST(ReadStl, BinaryAndAsciiGiveTheSame) {
  Warnings warnings;
  const Surface b = expect_tetrahedron(detail::parse_stl, binary_stl(4, 4), 1.0 / 6.0, warnings);
  const Surface a = expect_tetrahedron(detail::parse_stl, kAsciiStl, 1.0 / 6.0, warnings);
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(b.tag_names, std::vector<std::string>{"surface"});
  EXPECT_EQ(a.tag_names, (std::vector<std::string>{"first part", "other"}));
  EXPECT_EQ(a.tags, (std::vector<Index>{0, 0, 1, 1}));
}

TEST(ReadStl, BinaryThatBeginsWithSolid) {
  Warnings warnings;
  expect_tetrahedron(detail::parse_stl, binary_stl(4, 4, "solid facet normal"), 1.0 / 6.0, warnings);
  EXPECT_TRUE(warnings.empty());
  // Wrong count as well: the zeros of the records tell it from text.
  expect_tetrahedron(detail::parse_stl, binary_stl(9, 4, "solid x"), 1.0 / 6.0, warnings);
  EXPECT_TRUE(has(warnings, "promises 9 facets, the file holds 4"));
}

TEST(ReadStl, BinaryCounts) {
  Warnings warnings;
  for (const std::uint32_t claimed : {0U, 2U, 5U, 0xFFFFFFFFU}) {
    warnings.clear();
    expect_tetrahedron(detail::parse_stl, binary_stl(claimed, 4), 1.0 / 6.0, warnings);
    EXPECT_EQ(warnings.size(), 1u) << claimed;
  }
  warnings.clear();
  expect_tetrahedron(detail::parse_stl, binary_stl(4, 4) + "trailer", 1.0 / 6.0, warnings);
  EXPECT_TRUE(has(warnings, "7 bytes behind the last facet"));
  warnings.clear();
  const std::string cut = binary_stl(4, 4).substr(0, 84 + 3 * 50 + 17);
  EXPECT_EQ(detail::parse_stl(cut, "cut", warnings).triangles.size(), 3u);
  EXPECT_TRUE(has(warnings, "cut short"));
}

TEST(ReadStl, AsciiDialects) {
  std::string crlf, upper, one_line;
  for (const char c : std::string(kAsciiStl)) {
    crlf += c == '\n' ? "\r\n" : c == ' ' ? "\t" : std::string(1, c);
    upper += c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  }
  for (const std::string& text :
       {crlf, upper, "\xef\xbb\xbf" + std::string(kAsciiStl), "\n\n " + std::string(kAsciiStl)}) {
    Warnings warnings;
    expect_tetrahedron(detail::parse_stl, text, 1.0 / 6.0, warnings);
    EXPECT_TRUE(warnings.empty()) << text;
  }
  one_line =
      "solid\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet endsolid";
  Warnings warnings;
  const Surface s = detail::parse_stl(one_line, "one", warnings);
  EXPECT_EQ(s.triangles.size(), 1u);
  EXPECT_EQ(s.tag_names, std::vector<std::string>{"surface"});
}

TEST(ReadStl, AsciiFlawsAreCountedWithTheirLine) {
  const std::string good = "facet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  Warnings warnings;
  Surface s =
      detail::parse_stl("solid s\n" + good + "facet\nouter loop\nvertex 0 0 0\nvertex 1 0\nvertex 0 1 0\n" +
                            "endloop\nendfacet\n" + good + "endsolid s\n",
                        "s.stl", warnings);
  EXPECT_EQ(s.triangles.size(), 2u);
  EXPECT_EQ(warnings,
            Warnings{"s.stl: line 12: facet dropped: a coordinate is missing or not a number (1 in all)"});
  warnings.clear();
  // Without the closing keywords a facet ends where the next begins.
  s = detail::parse_stl(
      "solid s\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n" + good + "endsolid", "s",
      warnings);
  EXPECT_EQ(s.triangles.size(), 2u);
  EXPECT_TRUE(warnings.empty());
}

TEST(ReadStl, AsciiCutAnywhereKeepsWholeFacets) {
  const std::string text = kAsciiStl;
  const std::size_t first_end = text.find("endloop") + 7;
  for (std::size_t size = 1; size < text.size(); ++size) {
    Warnings warnings;
    if (size < first_end) {
      EXPECT_THROW(detail::parse_stl(text.substr(0, size), "cut", warnings), Error) << size;
      continue;
    }
    const Surface s = detail::parse_stl(text.substr(0, size), "cut", warnings);
    std::size_t whole = 0;
    for (std::size_t at = text.find("endloop"); at != std::string::npos && at + 7 <= size;
         at = text.find("endloop", at + 1))
      ++whole;
    EXPECT_EQ(s.triangles.size(), whole) << size;
  }
}

TEST(ReadStl, Errors) {
  Warnings w;
  const auto message = [&](ErrorCode code, const std::string& bytes) {
    return message_of(code, [&] { detail::parse_stl(bytes, "x.stl", w); });
  };
  EXPECT_NE(message(ErrorCode::kSurfaceEmpty, "").find("x.stl: the file is empty"), std::string::npos);
  EXPECT_NE(message(ErrorCode::kFileFormat, "hello").find("neither binary nor ascii STL"), std::string::npos);
  EXPECT_NE(message(ErrorCode::kFileFormat, std::string(40, '\0')).find("40 bytes"), std::string::npos);
  message(ErrorCode::kSurfaceEmpty, binary_stl(0, 0));
  message(ErrorCode::kSurfaceEmpty, binary_stl(7, 0));
  message(ErrorCode::kSurfaceEmpty, "solid s\nendsolid s\n");
  EXPECT_NE(
      message(ErrorCode::kFileFormat,
              "solid s\nfacet\nouter loop\nvertex 0,5 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n")
          .find("line 4 reads 'vertex 0,5 0 0'"),
      std::string::npos);
  EXPECT_NE(message(ErrorCode::kFileFormat, "solid s\nlorem ipsum\n").find("line 2 reads 'lorem"),
            std::string::npos);
  std::string noise = "\x1f\x8b";
  std::mt19937 random(1);
  while (noise.size() < 5000) noise += static_cast<char>(random());
  EXPECT_NE(message(ErrorCode::kFileFormat, noise).find("gzip"), std::string::npos);
}

TEST(ReadObj, TetrahedronWithGroups) {
  Warnings warnings;
  const Surface s = expect_tetrahedron(detail::parse_obj, kObj, 1.0 / 6.0, warnings);
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  EXPECT_EQ(s.tag_names, (std::vector<std::string>{"body", "slant side"}));
  EXPECT_EQ(s.tags, (std::vector<Index>{0, 0, 1, 1}));
}

TEST(ReadObj, PolygonsAreFanned) {
  Warnings warnings;
  const Surface s =
      detail::parse_obj("v 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4 5\n", "p", warnings);
  EXPECT_EQ(s.triangles, (std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(ReadObj, FlawsLeaveTheRest) {
  Warnings warnings;
  Surface s = detail::parse_obj(
      "v 0 0 0\nv 1 0 0\nv oops 0 0\nv 0 1 0\nf 1 2 4\nf 1 2 3\nf 1 2 9\nf 1 2\nf 1 x 2\nf -9 1 "
      "2\nnonsense\n",
      "o", warnings);
  EXPECT_EQ(s.triangles.size(), 2u);
  const SurfaceReport r = clean(s, "o");
  EXPECT_EQ(r.nonfinite, 1);
  EXPECT_EQ(r.triangles, 1);
  EXPECT_TRUE(has(warnings, "o: line 3: point without three coordinates"));
  EXPECT_TRUE(has(warnings, "o: line 9: face dropped: an index cannot be read"));
  EXPECT_TRUE(has(warnings, "(2 in all)"));
  EXPECT_TRUE(has(warnings, "o: line 8: face dropped: fewer than three corners"));
  EXPECT_TRUE(has(warnings, "o: line 11: unknown statement"));
  EXPECT_TRUE(has(warnings, "1 triangle dropped: it names points beyond the 4 of the file"));
}

TEST(ReadObj, Errors) {
  Warnings w;
  const auto message = [&](ErrorCode code, const std::string& bytes) {
    return message_of(code, [&] { detail::parse_obj(bytes, "x.obj", w); });
  };
  message(ErrorCode::kSurfaceEmpty, " \n");
  message(ErrorCode::kSurfaceEmpty, "v 0 0 0\n");
  message(ErrorCode::kFileFormat, "hello world\n");
  message(ErrorCode::kFileFormat, std::string("v 0\0 0", 6));
  EXPECT_NE(message(ErrorCode::kFileFormat, "v 0 0 0\nf 1 2 3\n").find("beyond the 1"), std::string::npos);
}

TEST(ReadPly, AsciiAndBothByteOrdersGiveTheSame) {
  std::vector<Surface> read;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    Warnings warnings;
    read.push_back(expect_tetrahedron(detail::parse_ply, ply(format), 0.25, warnings));
    EXPECT_TRUE(warnings.empty()) << format;
  }
  EXPECT_EQ(read[0].points, read[1].points);
  EXPECT_EQ(read[0].points, read[2].points);
  EXPECT_EQ(read[0].triangles, read[1].triangles);
  EXPECT_EQ(read[0].triangles, read[2].triangles);
}

TEST(ReadPly, LineEndsOfTheHeader) {
  for (const char* end : {"\r\n", "\r"}) {
    std::string bytes;
    const std::string original = ply("binary_big_endian");
    const std::size_t body = original.find("end_header\n") + 11;
    for (const char c : original.substr(0, body)) bytes += c == '\n' ? end : std::string(1, c);
    Warnings warnings;
    expect_tetrahedron(detail::parse_ply, bytes + original.substr(body), 0.25, warnings);
  }
}

TEST(ReadPly, CutBodyKeepsWholeFaces) {
  const std::string bytes = ply("binary_little_endian");
  const std::size_t body = bytes.find("end_header\n") + 11;
  for (std::size_t size = body; size < bytes.size(); ++size) {
    Warnings warnings;
    const std::size_t vertices = 4 * 15 + 4, face = 17;
    const std::size_t data = size - body;
    // The indices of a face are whole 4 bytes before its last property is.
    const std::size_t whole = data < vertices ? 0 : std::min<std::size_t>((data - vertices + 4) / face, 3);
    if (whole == 0) {
      EXPECT_NE(message_of(ErrorCode::kFileFormat,
                           [&] { detail::parse_ply(bytes.substr(0, size), "cut", warnings); })
                    .find("cut short"),
                std::string::npos);
    } else {
      EXPECT_EQ(detail::parse_ply(bytes.substr(0, size), "cut", warnings).triangles.size(), whole) << size;
      EXPECT_TRUE(has(warnings, "cut short"));
    }
  }
}

TEST(ReadPly, ClaimedCountsCostNothing) {
  Warnings w;
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
      "property float y\nproperty float z\nelement face 4000000000000000000\n"
      "property list uint int vertex_indices\nelement nothing 9000000000000000000\nend_header\n";
  message_of(ErrorCode::kFileFormat, [&] { detail::parse_ply(head + "abc", "x", w); });
  const std::string list =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
  message_of(ErrorCode::kFileFormat, [&] { detail::parse_ply(list + std::string(16, '\xff'), "x", w); });
  message_of(ErrorCode::kFileUnsupported, [&] {
    detail::parse_ply(
        "ply\nformat ascii 1.0\nelement vertex 3000000000\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n",
        "x", w);
  });
}

TEST(ReadPly, Errors) {
  Warnings w;
  const auto message = [&](ErrorCode code, const std::string& bytes) {
    return message_of(code, [&] { detail::parse_ply(bytes, "x.ply", w); });
  };
  const std::string xyz = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  message(ErrorCode::kSurfaceEmpty, "");
  message(ErrorCode::kFileFormat, "plyx\n");
  message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\n");
  message(ErrorCode::kFileFormat, "ply\nend_header\n");
  message(ErrorCode::kFileFormat, "ply\nformat klingon 1.0\nend_header\n");
  message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\nproperty float x\nend_header\n");
  message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n");
  message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n");
  message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\n" + face);
  EXPECT_NE(message(ErrorCode::kFileFormat,
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n")
                .find("no property 'y'"),
            std::string::npos);
  message(ErrorCode::kSurfaceEmpty, "ply\nformat ascii 1.0\n" + xyz + "end_header\n0 0 0 1 0 0 0 1 0");
  EXPECT_NE(
      message(ErrorCode::kFileFormat, "ply\nformat ascii 1.0\n" + xyz + face + "0 0 0 1 0 0 0 1 0 3 0 1 7")
          .find("beyond the 3"),
      std::string::npos);
  message(ErrorCode::kFileUnsupported, "ply\nformat ascii 1.0\n" + xyz + "element tristrips 1\nend_header\n");
}

/// Whatever the bytes, a parser returns a consistent surface or throws Error.
void expect_consistent(Parse parse, const std::string& bytes) {
  Warnings warnings;
  try {
    Surface s = parse(bytes, "m", warnings);
    ASSERT_FALSE(s.triangles.empty());
    ASSERT_EQ(s.tags.size(), s.triangles.size());
    for (const auto& t : s.triangles)
      for (const Index v : t) ASSERT_LT(static_cast<std::size_t>(v), s.points.size());
    for (const Index tag : s.tags) ASSERT_LT(static_cast<std::size_t>(tag), s.tag_names.size());
    clean(s, "m");
  } catch (const Error& e) {
    ASSERT_NE(static_cast<int>(e.code()), static_cast<int>(ErrorCode::kInternal)) << e.what();
  }
}

TEST(ReadSurface, AnyPrefixAndAnyMutationIsSurvived) {
  const std::pair<Parse, std::string> seeds[] = {{detail::parse_stl, binary_stl(4, 4)},
                                                 {detail::parse_stl, kAsciiStl},
                                                 {detail::parse_obj, kObj},
                                                 {detail::parse_ply, ply("ascii")},
                                                 {detail::parse_ply, ply("binary_little_endian")},
                                                 {detail::parse_ply, ply("binary_big_endian")}};
  for (const auto& [parse, bytes] : seeds) {
    for (std::size_t size = 0; size <= bytes.size(); ++size) expect_consistent(parse, bytes.substr(0, size));
    for (unsigned seed = 0; seed < 2000; ++seed) {
      SCOPED_TRACE(seed);
      std::mt19937 random(seed);
      std::string mutant = bytes;
      for (unsigned i = 0, n = 1 + random() % 4; i < n; ++i)
        mutant[random() % mutant.size()] = static_cast<char>(random());
      expect_consistent(parse, mutant);
    }
  }
}

class SurfaceFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "lamina-surface-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    std::error_code ec;
    fs::remove_all(folder_, ec);
  }
  fs::path folder_;
};

/// The volatile float keeps the rounding: the vectorizer of GCC 12 drops double -> float -> double from
/// neighbouring values at -O2 and above.
double through_float(double v) {
  volatile float f = static_cast<float>(v);
  return f;
}

TEST_F(SurfaceFile, WriteThenReadIsExactInFloat) {
  const Surface s = make_shape("torus", {});
  write_stl(folder_ / "t.stl", s);
  EXPECT_EQ(fs::file_size(folder_ / "t.stl"), 84 + 50 * s.triangles.size());
  Warnings warnings;
  const Surface back = read_surface(folder_ / "t.stl", warnings);
  EXPECT_TRUE(warnings.empty());
  ASSERT_EQ(back.triangles.size(), s.triangles.size());
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& exact = s.points[static_cast<std::size_t>(s.triangles[t][k])];
      const Vec3& read = back.points[static_cast<std::size_t>(back.triangles[t][k])];
      for (int i = 0; i < 3; ++i) ASSERT_EQ(read[i], through_float(exact[i]));
    }
  write_stl(folder_ / "again.stl", back);
  Surface twice = read_surface(folder_ / "again.stl", warnings);
  EXPECT_EQ(twice.points, back.points);
}

TEST_F(SurfaceFile, WrittenNormalsPointOutward) {
  write_stl(folder_ / "c.stl", make_shape("cube", {}));
  std::ifstream in(folder_ / "c.stl", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  for (std::size_t t = 0; t < 12; ++t) {
    float v[12];
    std::memcpy(v, bytes.data() + 84 + 50 * t, sizeof v);
    EXPECT_FLOAT_EQ(v[0] * v[0] + v[1] * v[1] + v[2] * v[2], 1.0F);
    EXPECT_FLOAT_EQ(v[0] * v[3] + v[1] * v[4] + v[2] * v[5], 0.25F);  // half the edge
  }
}

TEST_F(SurfaceFile, WriteErrors) {
  Surface s = make_shape("cube", {});
  message_of(ErrorCode::kFileWrite, [&] { write_stl(folder_ / "no" / "c.stl", s); });
  s.points[0][0] = 1e39;
  EXPECT_NE(message_of(ErrorCode::kFileWrite, [&] { write_stl(folder_ / "c.stl", s); }).find("1e+39"),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "c.stl"));
}

TEST_F(SurfaceFile, ReadsByExtension) {
  EXPECT_TRUE(is_surface_file("a.STL"));
  EXPECT_TRUE(is_surface_file("a.obj"));
  EXPECT_TRUE(is_surface_file("x/a.Ply"));
  EXPECT_FALSE(is_surface_file("a.vdb"));
  EXPECT_FALSE(is_surface_file("stl"));
  Warnings w;
  std::ofstream(folder_ / "t.OBJ") << kObj;
  std::ofstream(folder_ / "t.ply", std::ios::binary) << ply("binary_big_endian");
  std::ofstream(folder_ / "t.step") << "x";
  EXPECT_EQ(read_surface(folder_ / "t.OBJ", w).triangles.size(), 4u);
  EXPECT_EQ(read_surface(folder_ / "t.ply", w).triangles.size(), 4u);
  message_of(ErrorCode::kFileUnsupported, [&] { read_surface(folder_ / "t.step", w); });
  message_of(ErrorCode::kFileMissing, [&] { read_surface(folder_ / "absent.stl", w); });
  message_of(ErrorCode::kFileMissing, [&] { read_surface(folder_, w); });
}

}  // namespace
}  // namespace lamina
