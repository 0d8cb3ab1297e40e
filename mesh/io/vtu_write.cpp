// The writing half of mesh/io/vtu.h: arrays are compressed first, since the XML in front of them holds their
// offsets.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "core/parallel.h"
#include "mesh/io/vtu.h"
#include "mesh/io/vtu_data.h"
#include "mesh/io/xml.h"

namespace lamina::io {
namespace {

static_assert(std::endian::native == std::endian::little, "files are declared little-endian");

constexpr std::uint8_t kVtkVertex = 1, kVtkLine = 3, kVtkTriangle = 5, kVtkTetra = 10;

/// Place in our xx xy yy (xz yz zz) of ParaView's XX YY ZZ XY YZ XZ; -1: zero.
template <int D>
constexpr std::array<int, 6> kTensorSource =
    D == 3 ? std::array<int, 6>{0, 2, 5, 1, 4, 3} : std::array<int, 6>{0, 2, -1, 1, -1, -1};

/// Collects the elements and the data of a file.
class Appendix {
 public:
  explicit Appendix(bool compress) : compress_(compress) {}

  /// Adds an array of n values; get(i) is value i. What `get` refers to must live until write().
  template <class T, class Get>
  void add(const char* type, const std::string& attributes, std::size_t n, Get get) {
    add_filled(type, attributes, n, sizeof(T), [get](std::size_t begin, std::size_t end, char* to) {
      for (std::size_t i = begin; i < end; ++i) {
        const T value = static_cast<T>(get(i));
        std::memcpy(to + (i - begin) * sizeof(T), &value, sizeof(T));
      }
    });
  }
  /// The same for values that lie in memory as they are stored.
  template <class T>
  void add_flat(const char* type, const std::string& attributes, std::size_t n, const T* values) {
    add_filled(type, attributes, n, sizeof(T), [values](std::size_t begin, std::size_t end, char* to) {
      std::memcpy(to, values + begin, (end - begin) * sizeof(T));
    });
  }
  void line(std::string_view text) { xml_.append(text).append("\n"); }

  void write(OutputFile& out) const {
    out.write(xml_);
    out.write("_");
    for (const EncodedArray& a : arrays_) a.write(out);
  }

 private:
  void add_filled(const char* type, const std::string& attributes, std::size_t n, std::size_t size,
                  const FillValues& fill) {
    arrays_.push_back(encode_values(n, size, fill, compress_));
    xml_ += fmt::format("        <DataArray type=\"{}\" {} format=\"appended\" offset=\"{}\"/>\n", type,
                        attributes, offset_);
    offset_ += arrays_.back().size();
  }

  bool compress_;
  std::string xml_;
  std::vector<EncodedArray> arrays_;
  std::uint64_t offset_ = 0;
};

/// Writes one mesh. Facets, edges and corners, where wanted, are cells behind ours in this order: the numbers
/// of cells stay.
template <int D>
class VtuWriter {
 public:
  VtuWriter(const Mesh<D>& mesh, VtuOptions options)
      : mesh_(mesh),
        facets_(options.facets ? mesh.facets.size() : 0),
        edges_(options.facets ? mesh.edges.size() : 0),
        corners_(options.facets ? mesh.corners.size() : 0),
        more_(facets_ + edges_ + corners_),
        options_(options),
        to_(options.compress) {}

  void write(OutputFile& out) {
    to_.line("<?xml version=\"1.0\"?>");
    to_.line(
        fmt::format("<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
                    "header_type=\"UInt64\"{}>",
                    options_.compress ? " compressor=\"vtkZLibDataCompressor\"" : ""));
    to_.line("  <UnstructuredGrid>");
    to_.line(fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh_.points.size(),
                         mesh_.cells.size() + more_));
    to_.line("      <PointData>");
    if (options_.facets && !mesh_.point_tags.empty())
      to_.add_flat("Int32", kRegion, mesh_.points.size(), mesh_.point_tags.data());
    for (const MeshField& f : mesh_.point_fields) field(f, mesh_.points.size(), 0);
    to_.line("      </PointData>\n      <CellData>");
    regions();
    for (const MeshField& f : mesh_.cell_fields) field(f, mesh_.cells.size(), more_);
    to_.line("      </CellData>\n      <Points>");
    points();
    to_.line("      </Points>\n      <Cells>");
    const std::size_t corners = mesh_.cells.size() * (D + 1) + facets_ * D + edges_ * 2 + corners_;
    if (corners <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
      topology<std::int32_t>("Int32");
    } else {
      topology<std::int64_t>("Int64");
    }
    to_.line("      </Cells>\n    </Piece>\n  </UnstructuredGrid>");
    to_.line("  <AppendedData encoding=\"raw\">");
    to_.write(out);
    out.write("\n  </AppendedData>\n</VTKFile>\n");
  }

 private:
  static constexpr const char* kRegion = "Name=\"region\"";

  /// `more`: items behind that have no value.
  void field(const MeshField& f, std::size_t count, std::size_t more) {
    const auto n = static_cast<std::size_t>(f.components);
    const double* v = f.values.data();
    const double none = std::numeric_limits<double>::quiet_NaN();
    const std::string name = xml_escape(f.name);
    if (f.components == kSymSize<D>) {
      to_.add<double>(
          "Float64",
          fmt::format(
              "Name=\"{}\" NumberOfComponents=\"6\" ComponentName0=\"XX\" ComponentName1=\"YY\" "
              "ComponentName2=\"ZZ\" ComponentName3=\"XY\" ComponentName4=\"YZ\" ComponentName5=\"XZ\"",
              name),
          (count + more) * 6, [=](std::size_t i) {
            const int k = kTensorSource<D>[i % 6];
            if (i >= count * 6) return none;
            return k < 0 ? 0.0 : v[i / 6 * n + static_cast<std::size_t>(k)];
          });
      return;
    }
    const std::size_t stored = D == 2 && n == 2 ? 3 : n;
    const std::string attributes = stored == 1
                                       ? fmt::format("Name=\"{}\"", name)
                                       : fmt::format("Name=\"{}\" NumberOfComponents=\"{}\"", name, stored);
    if (stored == n && more == 0) return to_.add_flat("Float64", attributes, count * n, v);
    to_.add<double>("Float64", attributes, (count + more) * stored, [=](std::size_t i) {
      if (i >= count * stored) return none;
      return i % stored < n ? v[i / stored * n + i % stored] : 0.0;
    });
  }

  void regions() {
    const bool tagged = more_ > 0 || !mesh_.cell_tags.empty();
    if (!tagged) return;
    if (more_ == 0) return to_.add_flat("Int32", kRegion, mesh_.cells.size(), mesh_.cell_tags.data());
    const auto tag = [](const std::vector<Index>& tags, std::size_t i) { return tags.empty() ? 0 : tags[i]; };
    to_.add<std::int32_t>("Int32", kRegion, mesh_.cells.size() + more_, [this, tag](std::size_t i) {
      if (i < mesh_.cells.size()) return tag(mesh_.cell_tags, i);
      i -= mesh_.cells.size();
      if (i < facets_) return tag(mesh_.facet_tags, i);
      i -= facets_;
      if (i < edges_) return tag(mesh_.edge_tags, i);
      return tag(mesh_.point_tags, static_cast<std::size_t>(mesh_.corners[i - edges_]));
    });
  }

  void points() {
    const std::size_t n = mesh_.points.size();
    const char* attributes = "Name=\"Points\" NumberOfComponents=\"3\"";
    if constexpr (D == 3) {
      static_assert(sizeof(Vec3) == 3 * sizeof(double));
      to_.add_flat("Float64", attributes, n * 3, n == 0 ? nullptr : mesh_.points[0].data());
    } else {
      to_.add<double>("Float64", attributes, n * 3, [this](std::size_t i) {
        const auto k = static_cast<int>(i % 3);
        return k < D ? mesh_.points[i / 3][k] : 0.0;
      });
    }
  }

  template <class T>
  void topology(const char* type) {
    constexpr std::size_t corners = D + 1;
    const std::size_t cells = mesh_.cells.size();
    const char* attributes = "Name=\"connectivity\"";
    if (more_ == 0 && std::is_same_v<T, Index>) {
      to_.add_flat(type, attributes, cells * corners, cells == 0 ? nullptr : mesh_.cells[0].data());
    } else {
      to_.add<T>(type, attributes, cells * corners + facets_ * D + edges_ * 2 + corners_,
                 [this, cells](std::size_t i) {
                   if (i < cells * corners) return mesh_.cells[i / corners][i % corners];
                   i -= cells * corners;
                   if (i < facets_ * D) return mesh_.facets[i / D][i % D];
                   i -= facets_ * D;
                   return i < edges_ * 2 ? mesh_.edges[i / 2][i % 2] : mesh_.corners[i - edges_ * 2];
                 });
    }
    to_.add<T>(type, "Name=\"offsets\"", cells + more_, [this, cells](std::size_t i) {
      if (i < cells) return (i + 1) * corners;
      i -= cells;
      const std::size_t facets = std::min(i + 1, facets_);
      const std::size_t edges = std::min(i + 1 - facets, edges_);
      return cells * corners + facets * D + edges * 2 + (i + 1 - facets - edges);
    });
    to_.add<std::uint8_t>("UInt8", "Name=\"types\"", cells + more_, [this, cells](std::size_t i) {
      constexpr std::uint8_t cell = D == 2 ? kVtkTriangle : kVtkTetra,
                             facet = D == 2 ? kVtkLine : kVtkTriangle;
      if (i < cells) return cell;
      i -= cells;
      return i < facets_ ? facet : i < facets_ + edges_ ? kVtkLine : kVtkVertex;
    });
  }

  const Mesh<D>& mesh_;
  std::size_t facets_, edges_, corners_, more_;
  VtuOptions options_;
  Appendix to_;
};

}  // namespace

template <int D>
void write_vtu(OutputFile& out, const Mesh<D>& mesh, VtuOptions options) {
  VtuWriter<D>(mesh, options).write(out);
}

template void write_vtu<2>(OutputFile&, const Mesh<2>&, VtuOptions);
template void write_vtu<3>(OutputFile&, const Mesh<3>&, VtuOptions);

}  // namespace lamina::io
