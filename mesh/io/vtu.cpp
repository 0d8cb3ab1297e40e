#include "mesh/io/vtu.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "mesh/io/raw.h"
#include "mesh/io/vtu_data.h"
#include "mesh/io/xml.h"

namespace lamina::io {
namespace {

/// Cell types of VTK.
enum VtkCell : std::uint8_t { kVtkVertex = 1, kVtkLine = 3, kVtkTriangle = 5, kVtkTetra = 10 };

/// Entry k of ParaView's XX YY ZZ XY YZ XZ stands at kOurPlace[k] in our xx xy yy xz yz zz.
constexpr std::array<int, 6> kOurPlace = {0, 2, 5, 1, 4, 3};

/// The XML part of a file: arrays described, not decoded.
struct Document {
  DataLayout layout;
  std::int64_t points = -1, cells = -1;
  std::vector<DataArray> point_data, cell_data, coordinates, topology;
};

constexpr std::pair<std::string_view, ScalarType> kTypes[] = {
    {"Int8", ScalarType::kInt8},       {"UInt8", ScalarType::kUInt8},   {"Int16", ScalarType::kInt16},
    {"UInt16", ScalarType::kUInt16},   {"Int32", ScalarType::kInt32},   {"UInt32", ScalarType::kUInt32},
    {"Int64", ScalarType::kInt64},     {"UInt64", ScalarType::kUInt64}, {"Float32", ScalarType::kFloat32},
    {"Float64", ScalarType::kFloat64},
};

/// Walks the elements of a .vtu down to the data arrays.
class DocumentReader {
 public:
  explicit DocumentReader(const Source& source) : source_(source), xml_(source) {}

  Document read() {
    for (XmlEvent e = xml_.next(); e.kind != XmlEvent::Kind::kEnd; e = xml_.next()) {
      if (e.kind != XmlEvent::Kind::kOpen) continue;
      if (e.name == "VTKFile") {
        read_header(e);
      } else if (e.name == "Piece") {
        read_piece(e);
      } else if (e.name == "FieldData") {
        skip(e);
      } else if (e.name == "AppendedData") {
        read_appended(e);
        break;
      }
    }
    if (!has_header_) fail_format(source_, "line 1", "not a VTKFile of type UnstructuredGrid");
    if (document_.points < 0) fail_format(source_, "end", "has no Piece");
    return std::move(document_);
  }

 private:
  [[noreturn]] void fail(const XmlEvent& e, const std::string& what) const {
    fail_format(source_, line_of(source_, e.offset), what);
  }

  std::int64_t number(const XmlEvent& e, std::string_view key, std::int64_t lowest, std::int64_t highest,
                      std::string_view fallback = {}) const {
    const std::string_view text = e.attribute(key, fallback);
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || value < lowest || value > highest)
      fail(e, fmt::format("attribute {} of <{}> must be a number in {}..{}", key, e.name.substr(0, 40),
                          lowest, highest));
    return value;
  }

  void read_header(const XmlEvent& e) {
    if (e.attribute("type") != "UnstructuredGrid")
      fail_unsupported(source_, "a VTKFile of another type than UnstructuredGrid");
    const std::string_view order = e.attribute("byte_order", "LittleEndian");
    const std::string_view word = e.attribute("header_type", "UInt32");
    const std::string_view compressor = e.attribute("compressor");
    if (order != "LittleEndian" && order != "BigEndian")
      fail(e, "byte_order must be LittleEndian or BigEndian");
    if (word != "UInt32" && word != "UInt64") fail(e, "header_type must be UInt32 or UInt64");
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      fail_unsupported(source_, "compressed by " + std::string(compressor.substr(0, 40)) +
                                    "; only vtkZLibDataCompressor is read");
    document_.layout.swap = order == "BigEndian";
    document_.layout.wide_header = word == "UInt64";
    document_.layout.compressed = !compressor.empty();
    has_header_ = true;
  }

  void read_piece(const XmlEvent& piece) {
    if (document_.points >= 0) fail_unsupported(source_, "holds several pieces; merge them first");
    constexpr std::int64_t most = std::numeric_limits<Index>::max();
    document_.points = number(piece, "NumberOfPoints", 0, most);
    document_.cells = number(piece, "NumberOfCells", 0, most);
    std::vector<DataArray>* group = nullptr;
    for (XmlEvent e = xml_.next(); !(e.kind == XmlEvent::Kind::kClose && e.name == "Piece");
         e = xml_.next()) {
      if (e.kind == XmlEvent::Kind::kOpen) {
        if (e.name == "PointData") group = &document_.point_data;
        if (e.name == "CellData") group = &document_.cell_data;
        if (e.name == "Points") group = &document_.coordinates;
        if (e.name == "Cells") group = &document_.topology;
        if (e.name == "DataArray" && group != nullptr) {
          group->push_back(read_array(e));
        } else if (e.name == "Array" || e.name == "FieldData") {
          skip(e);  // strings and the like
        }
      }
    }
  }

  DataArray read_array(const XmlEvent& e) {
    DataArray array;
    array.place = e.offset;
    array.name = xml_unescape(e.attribute("Name"));
    const auto* type = std::find_if(std::begin(kTypes), std::end(kTypes),
                                    [&](const auto& t) { return t.first == e.attribute("type"); });
    if (type == std::end(kTypes)) fail(e, "a data array of unknown type");
    array.type = type->second;
    array.components = static_cast<int>(number(e, "NumberOfComponents", 1, 1024, "1"));
    const std::string_view format = e.attribute("format", "ascii");
    if (format == "appended") {
      array.encoding = DataArray::Encoding::kAppended;
      array.offset =
          static_cast<std::uint64_t>(number(e, "offset", 0, std::numeric_limits<std::int64_t>::max()));
    } else if (format == "binary" || format == "ascii") {
      array.encoding = format == "ascii" ? DataArray::Encoding::kAscii : DataArray::Encoding::kInline;
    } else {
      fail(e, "the format of a data array must be ascii, binary or appended");
    }
    array.text = skip(e);
    return array;
  }

  /// Passes over the rest of an element; returns the text directly inside it (the longest, where children
  /// part it).
  std::string_view skip(const XmlEvent&) {
    std::string_view text;
    for (int depth = 1; depth > 0;) {
      const XmlEvent e = xml_.next();
      if (e.kind == XmlEvent::Kind::kOpen) ++depth;
      if (e.kind == XmlEvent::Kind::kClose) --depth;
      if (e.kind == XmlEvent::Kind::kText && depth == 1 && e.text.size() > text.size()) text = e.text;
    }
    return text;
  }

  void read_appended(const XmlEvent& e) {
    const std::string_view encoding = e.attribute("encoding", "base64");
    if (encoding != "raw" && encoding != "base64")
      fail(e, "the encoding of the appended data must be raw or base64");
    const std::size_t underscore = source_.bytes.find_first_not_of(" \t\r\n", xml_.position());
    if (underscore == std::string_view::npos || source_.bytes[underscore] != '_')
      fail(e, "appended data must start with an underscore");
    document_.layout.base64 = encoding == "base64";
    document_.layout.appended = source_.bytes.substr(underscore + 1);
  }

  const Source& source_;
  XmlScanner xml_;
  Document document_;
  bool has_header_ = false;
};

const DataArray& find_array(const Source& source, const std::vector<DataArray>& arrays, const char* name) {
  for (const DataArray& a : arrays)
    if (a.name == name) return a;
  fail_format(source, "Cells", fmt::format("the array \"{}\" is missing", name));
}

/// Sorts the cells of the file by kind.
struct Topology {
  std::vector<std::uint8_t> types;
  std::vector<std::int64_t> offsets;
  std::vector<Index> connectivity;

  [[nodiscard]] std::int64_t begin(std::size_t cell) const { return cell == 0 ? 0 : offsets[cell - 1]; }
};

int corners_of(std::uint8_t type) {
  switch (type) {
    case kVtkVertex:
      return 1;
    case kVtkLine:
      return 2;
    case kVtkTriangle:
      return 3;
    case kVtkTetra:
      return 4;
    default:
      return 0;
  }
}

Topology read_topology(const Source& source, const Document& d) {
  Topology t;
  const auto n = static_cast<std::size_t>(d.cells);
  t.types = read_values<std::uint8_t>(source, d.layout, find_array(source, d.topology, "types"), n);
  t.offsets = read_values<std::int64_t>(source, d.layout, find_array(source, d.topology, "offsets"), n);
  for (std::size_t i = 0; i < n; ++i) {
    const int corners = corners_of(t.types[i]);
    if (corners == 0)
      fail_unsupported(
          source, fmt::format("cell {} (counted from 0) has VTK type {}; tetrahedra (10), triangles (5), "
                              "lines (3) and vertices (1) are read",
                              i, t.types[i]));
    if (t.offsets[i] != t.begin(i) + corners)
      fail_format(source, "Cells",
                  fmt::format("cell {} (counted from 0) of type {} ends at offset {}, expected {}", i,
                              t.types[i], t.offsets[i], t.begin(i) + corners));
  }
  const std::size_t length = n == 0 ? 0 : static_cast<std::size_t>(t.offsets.back());
  t.connectivity =
      read_values<Index>(source, d.layout, find_array(source, d.topology, "connectivity"), length);
  return t;
}

template <int N>
void gather(const Topology& t, std::uint8_t type, const std::vector<Index>& tags, RawCells<N>& raw) {
  raw.place = "Cells";
  const std::size_t n = t.types.size();
  const auto same = static_cast<std::size_t>(std::count(t.types.begin(), t.types.end(), type));
  if (same == 0) return;
  std::vector<Index> which;
  if (same < n) {
    which.reserve(same);
    for (std::size_t i = 0; i < n; ++i)
      if (t.types[i] == type) which.push_back(static_cast<Index>(i));
  }
  raw.cells.resize(same);
  if (!tags.empty()) raw.tags.resize(same);
  for_each_index(
      same,
      [&](std::size_t k) {
        const std::size_t cell = which.empty() ? k : static_cast<std::size_t>(which[k]);
        const std::int64_t begin = t.begin(cell);
        for (int j = 0; j < N; ++j) raw.cells[k][j] = t.connectivity[begin + j];
        if (!tags.empty()) raw.tags[k] = tags[cell];
      },
      65536);
}

MeshField read_field(const Source& source, const Document& d, const DataArray& array, std::size_t count) {
  MeshField field{array.name, array.components, {}};
  field.values = read_values<double>(source, d.layout, array, count * array.components);
  if (array.components != 6) return field;
  for_each_index(
      count,
      [&](std::size_t i) {
        std::array<double, 6> ours;
        for (int k = 0; k < 6; ++k) ours[kOurPlace[k]] = field.values[i * 6 + k];
        std::copy(ours.begin(), ours.end(), field.values.begin() + static_cast<std::ptrdiff_t>(i * 6));
      },
      65536);
  return field;
}

/// Keeps the values of the cells of one type.
void keep_type(MeshField& field, const std::vector<std::uint8_t>& types, std::uint8_t type) {
  const auto n = static_cast<std::size_t>(field.components);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (types[i] != type) continue;
    for (std::size_t k = 0; k < n; ++k) field.values[kept * n + k] = field.values[i * n + k];
    ++kept;
  }
  field.values.resize(kept * n);
}

}  // namespace

AnyMesh parse_vtu(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  const Document d = DocumentReader(source).read();
  const auto points = static_cast<std::size_t>(d.points), cells = static_cast<std::size_t>(d.cells);
  RawMesh raw;
  if (d.coordinates.size() != 1 || d.coordinates[0].components != 3)
    fail_format(source, "Points", "needs one array of 3 components");
  {
    const std::vector<double> x = read_values<double>(source, d.layout, d.coordinates[0], 3 * points);
    raw.points.resize(points);
    for_each_index(
        points,
        [&](std::size_t i) {
          raw.points[i] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
        },
        65536);
  }
  const Topology topology = read_topology(source, d);
  std::vector<Index> tags;
  for (const DataArray& a : d.cell_data)
    if (a.name == "region" && a.components == 1) tags = read_values<Index>(source, d.layout, a, cells);
  gather(topology, kVtkTetra, tags, raw.tets);
  gather(topology, kVtkTriangle, tags, raw.triangles);
  gather(topology, kVtkLine, tags, raw.edges);
  RawCells<1> vertices;
  gather(topology, kVtkVertex, tags, vertices);
  const std::uint8_t type = raw.tets.cells.empty() ? kVtkTriangle : kVtkTetra;
  for (const DataArray& a : d.point_data) {
    if (a.name == "region" && a.components == 1 && is_integer(a.type)) {
      raw.point_tags = read_values<Index>(source, d.layout, a, points);
      continue;
    }
    raw.point_fields.push_back(read_field(source, d, a, points));
  }
  for (const DataArray& a : d.cell_data) {
    if (a.name == "region" && a.components == 1) continue;
    raw.cell_fields.push_back(read_field(source, d, a, cells));
    keep_type(raw.cell_fields.back(), topology.types, type);
  }
  add_corners(vertices, raw);
  return assemble(std::move(raw), source);
}

}  // namespace lamina::io
