#include "mesh/io/gmf_source.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

namespace lamina::io {
namespace {

constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

/// Keywords that are read; every other word starts a section to be skipped.
constexpr std::pair<std::string_view, Gmf> kKeywords[] = {
    {"Dimension", Gmf::kDimension},
    {"Vertices", Gmf::kVertices},
    {"Edges", Gmf::kEdges},
    {"Triangles", Gmf::kTriangles},
    {"Tetrahedra", Gmf::kTetrahedra},
    {"End", Gmf::kEnd},
    {"SolAtVertices", Gmf::kSolAtVertices},
    {"Corners", Gmf::kCorners},
    {"Ridges", Gmf::kRidges},
    {"RequiredVertices", Gmf::kRequiredVertices},
    {"RequiredEdges", Gmf::kRequiredEdges},
    {"RequiredTriangles", Gmf::kRequiredTriangles},
};

}  // namespace

bool is_binary_gmf(std::string_view bytes) {
  return bytes.size() >= 4 && (bytes.substr(0, 4) == std::string_view("\1\0\0\0", 4) ||
                               bytes.substr(0, 4) == std::string_view("\0\0\0\1", 4));
}

BinaryGmf::BinaryGmf(const Source& source) : source_(&source), section_end_(source.bytes.size()) {
  need(8);
  swap_ = source.bytes[0] == '\0';
  at_ = 4;
  version_ = get<std::int32_t>();
  if (version_ < 1 || version_ > 4)
    fail_unsupported(source, fmt::format("binary GMF version {}; versions 1 to 4 are read", version_));
  section_end_ = at_;
}

Gmf BinaryGmf::next_keyword() {
  if (section_end_ == 0 || section_end_ == source_->bytes.size()) return Gmf::kEnd;
  at_ = section_end_;
  const std::size_t start = at_;
  section_end_ = source_->bytes.size();
  need(4);
  const auto keyword = get<std::int32_t>();
  if (keyword == static_cast<std::int32_t>(Gmf::kEnd)) return Gmf::kEnd;
  need(version_ > 2 ? 8 : 4);
  const std::int64_t next = version_ > 2 ? get<std::int64_t>() : get<std::int32_t>();
  last_ = start;
  if (next == 0) {
    section_end_ = 0;  // the last section, ended by the file
  } else if (next < static_cast<std::int64_t>(at_) ||
             next > static_cast<std::int64_t>(source_->bytes.size())) {
    fail_format(*source_, place(),
                fmt::format("keyword {} says the next section starts at byte {}, which must lie in {}..{}",
                            keyword, next, at_, source_->bytes.size()));
  } else {
    section_end_ = static_cast<std::size_t>(next);
  }
  return static_cast<Gmf>(keyword);
}

int BinaryGmf::word() {
  need(4);
  return get<std::int32_t>();
}

std::int64_t BinaryGmf::count() {
  need(version_ > 3 ? 8 : 4);
  return integer();
}

void BinaryGmf::expect(std::int64_t records, int reals, int integers) {
  const std::int64_t size = reals * (version_ > 1 ? 8 : 4) + integers * (version_ > 3 ? 8 : 4);
  const auto end = static_cast<std::int64_t>(section_end_ == 0 ? source_->bytes.size() : section_end_);
  const std::int64_t left = (end - static_cast<std::int64_t>(at_)) / size;
  if (records < 0 || records > left || records > std::numeric_limits<Index>::max())
    fail_format(*source_, place(),
                fmt::format("a count of {}, but the section has room for {}", records, left));
}

void BinaryGmf::need(std::size_t bytes) {
  const std::size_t end = section_end_ == 0 ? source_->bytes.size() : section_end_;
  if (at_ > end || end - at_ < bytes)
    fail_format(*source_, byte_of(at_), "the section or the file ends here");
}

AsciiGmf::AsciiGmf(const Source& source) : text_(source, '#') {
  if (text_.word() != "MeshVersionFormatted")
    text_.fail("a GMF file starts with MeshVersionFormatted (ascii) or the number 1 (binary)");
  text_.integer();
}

Gmf AsciiGmf::next_keyword() {
  for (std::string_view t = text_.word(); !t.empty(); t = text_.word()) {
    if (!is_letter(t.front())) continue;
    for (const auto& [name, keyword] : kKeywords)
      if (t == name) return keyword;
  }
  return Gmf::kEnd;
}

}  // namespace lamina::io
