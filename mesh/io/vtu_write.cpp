// The writing half of mesh/io/vtu.h: arrays are compressed first, since the XML in front of them holds their
// offsets.
#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "mesh/io/vtu.h"
#include "mesh/io/vtu_data.h"
#include "mesh/io/xml.h"

namespace lamina::io {
namespace {

static_assert(std::endian::native == std::endian::little, "files are declared little-endian");

constexpr std::uint8_t kVtkTriangle = 5, kVtkTetra = 10;

/// Place in our xx xy yy (xz yz zz) of ParaView's XX YY ZZ XY YZ XZ; -1: zero.
template <int D>
constexpr std::array<int, 6> kTensorSource =
    D == 3 ? std::array<int, 6>{0, 2, 5, 1, 4, 3} : std::array<int, 6>{0, 2, -1, 1, -1, -1};

/// Collects the elements and the data of a file.
class Appendix {
 public:
  /// Adds an array of n values; get(i) is value i.
  template <class T, class Get>
  void add(const char* type, const std::string& attributes, std::size_t n, Get&& get) {
    arrays_.push_back(encode_values(n, sizeof(T), [&](std::size_t begin, std::size_t end, char* to) {
      for (std::size_t i = begin; i < end; ++i) {
        const T value = static_cast<T>(get(i));
        std::memcpy(to + (i - begin) * sizeof(T), &value, sizeof(T));
      }
    }));
    xml_ += fmt::format("        <DataArray type=\"{}\" {} format=\"appended\" offset=\"{}\"/>\n", type,
                        attributes, offset_);
    offset_ += arrays_.back().size();
  }
  void line(std::string_view text) { xml_.append(text).append("\n"); }

  void write(OutputFile& out) const {
    out.write(xml_);
    out.write("_");
    for (const EncodedArray& a : arrays_) {
      out.write(a.header.data(), 8 * a.header.size());
      for (const std::string& b : a.blocks) out.write(b);
    }
  }

 private:
  std::string xml_;
  std::vector<EncodedArray> arrays_;
  std::uint64_t offset_ = 0;
};

template <int D>
void add_field(Appendix& to, const MeshField& field, std::size_t count) {
  const auto n = static_cast<std::size_t>(field.components);
  const std::string name = xml_escape(field.name);
  if (field.values.size() != count * n)
    throw Error(ErrorCode::kParameter, fmt::format("field \"{}\" holds {} values, expected {} x {}",
                                                   field.name, field.values.size(), count, n));
  if (field.components == kSymSize<D>) {
    to.add<double>(
        "Float64",
        fmt::format("Name=\"{}\" NumberOfComponents=\"6\" ComponentName0=\"XX\" ComponentName1=\"YY\" "
                    "ComponentName2=\"ZZ\" ComponentName3=\"XY\" ComponentName4=\"YZ\" ComponentName5=\"XZ\"",
                    name),
        count * 6, [&](std::size_t i) {
          const int k = kTensorSource<D>[i % 6];
          return k < 0 ? 0.0 : field.values[i / 6 * n + static_cast<std::size_t>(k)];
        });
  } else if (D == 2 && field.components == 2) {
    to.add<double>("Float64", fmt::format("Name=\"{}\" NumberOfComponents=\"3\"", name), count * 3,
                   [&](std::size_t i) { return i % 3 == 2 ? 0.0 : field.values[i / 3 * 2 + i % 3]; });
  } else {
    to.add<double>("Float64", fmt::format("Name=\"{}\" NumberOfComponents=\"{}\"", name, n), count * n,
                   [&](std::size_t i) { return field.values[i]; });
  }
}

template <class T, int D>
void add_topology(Appendix& to, const char* type, const Mesh<D>& mesh) {
  constexpr std::size_t corners = D + 1;
  to.add<T>(type, "Name=\"connectivity\"", mesh.cells.size() * corners,
            [&](std::size_t i) { return mesh.cells[i / corners][i % corners]; });
  to.add<T>(type, "Name=\"offsets\"", mesh.cells.size(), [](std::size_t i) { return (i + 1) * corners; });
}

}  // namespace

template <int D>
void write_vtu(OutputFile& out, const Mesh<D>& mesh) {
  Appendix to;
  to.line("<?xml version=\"1.0\"?>");
  to.line(
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" "
      "compressor=\"vtkZLibDataCompressor\">");
  to.line("  <UnstructuredGrid>");
  to.line(fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh.points.size(),
                      mesh.cells.size()));
  to.line("      <PointData>");
  for (const MeshField& f : mesh.point_fields) add_field<D>(to, f, mesh.points.size());
  to.line("      </PointData>\n      <CellData>");
  if (!mesh.cell_tags.empty())
    to.add<std::int32_t>("Int32", "Name=\"region\"", mesh.cells.size(),
                         [&](std::size_t i) { return mesh.cell_tags[i]; });
  for (const MeshField& f : mesh.cell_fields) add_field<D>(to, f, mesh.cells.size());
  to.line("      </CellData>\n      <Points>");
  to.add<double>("Float64", "Name=\"Points\" NumberOfComponents=\"3\"", mesh.points.size() * 3,
                 [&](std::size_t i) {
                   const auto k = static_cast<int>(i % 3);
                   return k < D ? mesh.points[i / 3][k] : 0.0;
                 });
  to.line("      </Points>\n      <Cells>");
  const bool narrow =
      mesh.cells.size() * (D + 1) <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
  if (narrow) {
    add_topology<std::int32_t>(to, "Int32", mesh);
  } else {
    add_topology<std::int64_t>(to, "Int64", mesh);
  }
  to.add<std::uint8_t>("UInt8", "Name=\"types\"", mesh.cells.size(),
                       [](std::size_t) { return D == 2 ? kVtkTriangle : kVtkTetra; });
  to.line("      </Cells>\n    </Piece>\n  </UnstructuredGrid>");
  to.line("  <AppendedData encoding=\"raw\">");
  to.write(out);
  out.write("\n  </AppendedData>\n</VTKFile>\n");
}

template void write_vtu<2>(OutputFile&, const Mesh<2>&);
template void write_vtu<3>(OutputFile&, const Mesh<3>&);

}  // namespace lamina::io
