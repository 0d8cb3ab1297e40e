// Stanford PLY, ascii and binary of both byte orders. The header declares elements in any order with any
// properties; wanted are x, y, z of `vertex` and the list vertex_indices (or vertex_index) of `face`, the
// rest is passed over. One value source per encoding hides the difference from the element loop.
#include <fmt/core.h>

#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/surface_parse.h"

namespace lamina::detail {
namespace {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };
enum class Encoding { kAscii, kLittle, kBig };

struct Property {
  std::string name;
  Type type = Type::kFloat;
  bool list = false;
  Type count_type = Type::kUint8;
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< bytes up to the data
};

[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw Error(ErrorCode::kFileFormat, fmt::format("{}: {}", name, what));
}

std::size_t width(Type type) {
  constexpr std::array<std::size_t, 8> kWidth{1, 1, 2, 2, 4, 4, 4, 8};
  return kWidth[static_cast<std::size_t>(type)];
}

bool parse_type(std::string_view text, Type& type) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (text == kNames[i][0] || text == kNames[i][1]) {
      type = static_cast<Type>(i);
      return true;
    }
  return false;
}

/// Reads header lines. Lines end as the first one does: \n, \r\n or \r.
class HeaderReader {
 public:
  HeaderReader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Header read();

 private:
  std::string_view line();
  void format(std::string_view arguments);
  void element(std::string_view arguments);
  void property(std::string_view arguments);

  std::string_view bytes_;
  const std::string& name_;
  std::string_view line_end_ = "\n";
  std::size_t at_ = 0;
  int line_number_ = 0;
  Header header_;
};

std::string_view HeaderReader::line() {
  const std::size_t end = bytes_.find(line_end_, at_);
  if (end == std::string_view::npos) fail(name_, "the PLY header has no end_header: cut short");
  const std::string_view result = bytes_.substr(at_, end - at_);
  at_ = end + line_end_.size();
  ++line_number_;
  return result;
}

void HeaderReader::format(std::string_view arguments) {
  const std::string_view kind = next_word(arguments);
  if (kind == "ascii")
    header_.encoding = Encoding::kAscii;
  else if (kind == "binary_little_endian")
    header_.encoding = Encoding::kLittle;
  else if (kind == "binary_big_endian")
    header_.encoding = Encoding::kBig;
  else
    fail(name_, fmt::format("unknown PLY format '{}' in line {}", printable(kind), line_number_));
}

void HeaderReader::element(std::string_view arguments) {
  Element element;
  element.name = next_word(arguments);
  const std::string_view count = next_word(arguments);
  if (!parse_integer(count, element.count) || element.count < 0)
    fail(name_, fmt::format("'{}' in line {} is not a number of elements", printable(count), line_number_));
  header_.elements.push_back(std::move(element));
}

void HeaderReader::property(std::string_view arguments) {
  if (header_.elements.empty())
    fail(name_, fmt::format("a property before any element in line {}", line_number_));
  Property property;
  std::string_view type = next_word(arguments);
  property.list = type == "list";
  bool known = true;
  if (property.list) {
    known = parse_type(next_word(arguments), property.count_type) && property.count_type != Type::kFloat &&
            property.count_type != Type::kDouble;
    type = next_word(arguments);
  }
  if (!known || !parse_type(type, property.type))
    fail(name_, fmt::format("unknown property type '{}' in line {}", printable(type), line_number_));
  property.name = next_word(arguments);
  header_.elements.back().properties.push_back(std::move(property));
}

Header HeaderReader::read() {
  if (bytes_.starts_with("ply\r\n"))
    line_end_ = "\r\n";
  else if (bytes_.starts_with("ply\r"))
    line_end_ = "\r";
  else if (!bytes_.starts_with("ply\n"))
    fail(name_, "not a PLY file: it does not begin with a line 'ply'");
  line();
  bool has_format = false;
  for (;;) {
    std::string_view rest = line();
    const std::string_view keyword = next_word(rest);
    if (keyword == "end_header") break;
    if (keyword == "format") {
      format(rest);
      has_format = true;
    } else if (keyword == "element") {
      element(rest);
    } else if (keyword == "property") {
      property(rest);
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      fail(name_,
           fmt::format("unknown PLY header keyword '{}' in line {}", printable(keyword), line_number_));
    }
  }
  if (!has_format) fail(name_, "the PLY header names no format");
  header_.size = at_;
  return std::move(header_);
}

/// Values of an ascii body.
class AsciiSource {
 public:
  explicit AsciiSource(std::string_view bytes) : bytes_(bytes) {}
  /// False at the end of the file or where a word is not a number.
  bool next(Type /*type*/, double& value) { return parse_number(next_word(bytes_), value); }
  bool skip(Type type, std::int64_t count) {
    double ignored = 0.0;
    for (std::int64_t i = 0; i < count; ++i)
      if (!next(type, ignored)) return false;
    return true;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }

 private:
  std::string_view bytes_;
};

/// Values of a binary body.
class BinarySource {
 public:
  BinarySource(std::string_view bytes, bool swap) : bytes_(bytes), swap_(swap) {}
  bool next(Type type, double& value) {
    const std::size_t size = width(type);
    if (bytes_.size() < size) return false;
    std::array<char, 8> raw{};
    for (std::size_t i = 0; i < size; ++i) raw[swap_ ? size - 1 - i : i] = bytes_[i];
    bytes_.remove_prefix(size);
    value = decode(type, raw.data());
    return true;
  }
  bool skip(Type type, std::int64_t count) {
    const std::size_t size = width(type);
    if (count > static_cast<std::int64_t>(bytes_.size() / size)) return false;
    bytes_.remove_prefix(static_cast<std::size_t>(count) * size);
    return true;
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }

 private:
  template <class T>
  static double as(const char* raw) {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }
  static double decode(Type type, const char* raw) {
    switch (type) {
      case Type::kInt8:
        return as<std::int8_t>(raw);
      case Type::kUint8:
        return as<std::uint8_t>(raw);
      case Type::kInt16:
        return as<std::int16_t>(raw);
      case Type::kUint16:
        return as<std::uint16_t>(raw);
      case Type::kInt32:
        return as<std::int32_t>(raw);
      case Type::kUint32:
        return as<std::uint32_t>(raw);
      case Type::kFloat:
        return as<float>(raw);
      case Type::kDouble:
        return as<double>(raw);
    }
    return 0.0;
  }

  std::string_view bytes_;
  bool swap_;
};

/// Reads the elements of one body. Each function returns false where the body ends or breaks.
template <class Source>
class BodyReader {
 public:
  BodyReader(Source source, const std::string& name) : source_(source), name_(name) {}

  /// Returns a warning when the body ends early, else an empty text.
  std::string read(const Header& header, Surface& surface);
  Flaw few_corners;

 private:
  bool read_vertex(const Element& element, Surface& surface);
  bool read_face(const Element& element, Surface& surface);
  bool read_list(const Property& property, bool keep);
  bool skip_element(const Element& element);

  Source source_;
  const std::string& name_;
  std::vector<Index> corners_;
};

template <class Source>
bool BodyReader<Source>::read_list(const Property& property, bool keep) {
  double count = 0.0;
  if (!source_.next(property.count_type, count) || !(count >= 0.0) || count > 4294967295.0) return false;
  const auto n = static_cast<std::int64_t>(count);
  if (!keep) return source_.skip(property.type, n);
  corners_.clear();
  for (std::int64_t i = 0; i < n; ++i) {
    double index = 0.0;
    if (!source_.next(property.type, index)) return false;
    const bool whole = index >= 0.0 && index < std::numeric_limits<Index>::max() &&
                       index == static_cast<double>(static_cast<Index>(index));
    corners_.push_back(whole ? static_cast<Index>(index) : kNone);  // dropped with the other bad corners
  }
  return true;
}

template <class Source>
bool BodyReader<Source>::skip_element(const Element& element) {
  for (const Property& property : element.properties)
    if (property.list ? !read_list(property, false) : !source_.skip(property.type, 1)) return false;
  return true;
}

template <class Source>
bool BodyReader<Source>::read_vertex(const Element& element, Surface& surface) {
  Vec3 p = Vec3::Zero();
  for (const Property& property : element.properties) {
    double value = 0.0;
    if (property.list ? !read_list(property, false) : !source_.next(property.type, value)) return false;
    if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
      p[property.name[0] - 'x'] = value;
  }
  surface.points.push_back(p);
  return true;
}

template <class Source>
bool BodyReader<Source>::read_face(const Element& element, Surface& surface) {
  for (const Property& property : element.properties) {
    const bool wanted =
        property.list && (property.name == "vertex_indices" || property.name == "vertex_index");
    if (property.list ? !read_list(property, wanted) : !source_.skip(property.type, 1)) return false;
    if (!wanted) continue;
    check_index_range(surface.triangles.size() + corners_.size(), name_, "triangles");
    if (corners_.size() < 3) few_corners.note(0);
    add_fan(surface, corners_, 0);
  }
  return true;
}

template <class Source>
std::string BodyReader<Source>::read(const Header& header, Surface& surface) {
  for (const Element& element : header.elements) {
    if (element.properties.empty()) continue;  // takes no bytes, so its count says nothing
    const bool vertex = element.name == "vertex", face = element.name == "face";
    if (vertex)
      check_index_range(surface.points.size() + static_cast<std::uint64_t>(element.count), name_, "points");
    for (std::int64_t i = 0; i < element.count; ++i) {
      if (vertex ? read_vertex(element, surface) : face ? read_face(element, surface) : skip_element(element))
        continue;
      return fmt::format(
          "{}: cut short or corrupt in {} {} of {}, {} bytes before the end; what came before is kept", name_,
          printable(element.name), i + 1, element.count, source_.left());
    }
  }
  return {};
}

void check_header(const Header& header, const std::string& name) {
  const Element* vertex = nullptr;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") vertex = &element;
    if (element.name == "tristrips")
      throw Error(ErrorCode::kFileUnsupported,
                  fmt::format("{}: PLY triangle strips are not read; save it with faces", name));
  }
  if (vertex == nullptr) fail(name, "the PLY header declares no element 'vertex'");
  for (const char* axis : {"x", "y", "z"}) {
    bool found = false;
    for (const Property& property : vertex->properties)
      found = found || (property.name == axis && !property.list);
    if (!found) fail(name, fmt::format("the PLY element 'vertex' has no property '{}'", axis));
  }
}

template <class Source>
void read_body(Source source, const Header& header, const std::string& name, Surface& surface,
               std::vector<std::string>& warnings) {
  BodyReader<Source> reader(source, name);
  const std::string cut = reader.read(header, surface);
  const std::int64_t dropped = drop_bad_corners(surface);
  if (surface.triangles.empty()) {
    if (!cut.empty()) fail(name, cut.substr(name.size() + 2) + ", but no whole face is among it");
    if (dropped > 0)
      fail(name, fmt::format("no usable face: all {} triangles name points beyond the {} of the file",
                             dropped, surface.points.size()));
    throw Error(ErrorCode::kSurfaceEmpty,
                fmt::format("{}: a PLY file with {} and no face", name,
                            counted(static_cast<std::int64_t>(surface.points.size()), "point")));
  }
  if (!cut.empty()) warnings.push_back(cut);
  if (dropped > 0) warnings.push_back(bad_corners_warning(name, dropped, surface.points.size()));
  if (reader.few_corners.count > 0)
    warnings.push_back(fmt::format("{}: {} dropped: fewer than three corners", name,
                                   counted(reader.few_corners.count, "face")));
}

}  // namespace

Surface parse_ply(std::string_view bytes, const std::string& name, std::vector<std::string>& warnings) {
  if (bytes.empty())
    throw Error(ErrorCode::kSurfaceEmpty, fmt::format("{}: the file is empty (0 bytes)", name));
  const Header header = HeaderReader(bytes, name).read();
  check_header(header, name);
  const std::string_view body = bytes.substr(header.size);
  Surface surface;
  surface.tag_names.emplace_back(kDefaultTag);
  if (header.encoding == Encoding::kAscii) {
    read_body(AsciiSource(body), header, name, surface, warnings);
  } else {
    const bool swap = (header.encoding == Encoding::kLittle) != (std::endian::native == std::endian::little);
    read_body(BinarySource(body, swap), header, name, surface, warnings);
  }
  return surface;
}

}  // namespace lamina::detail
