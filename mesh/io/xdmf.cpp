#include "mesh/io/xdmf.h"

#ifdef LAMINA_HDF5

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <deque>
#include <map>
#include <memory>

#include "core/parallel.h"
#include "mesh/io/hdf5_file.h"
#include "mesh/io/text.h"
#include "mesh/io/xml.h"

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

/// Entry k of XDMF's XX XY XZ YY YZ ZZ stands at kOurPlace[k] in our xx xy yy xz yz zz.
constexpr std::array<int, 6> kOurPlace = {0, 1, 3, 2, 4, 5};
constexpr std::string_view kNameOf = "name of tag ";

fs::path data_file(fs::path path) { return path.replace_extension(".h5"); }

/// One <DataItem>.
struct DataItem {
  std::vector<std::size_t> shape;
  bool hdf = false;
  std::string_view text;
  std::size_t offset = 0;  ///< of the text
  [[nodiscard]] std::size_t size() const {
    std::size_t n = 1;
    for (const std::size_t s : shape) {
      if (s > 0 && n > std::size_t{1} << 40) return n;  // more than any file holds
      n *= s;
    }
    return shape.empty() ? 0 : n;
  }
};

struct Attribute {
  std::string name, type;
  bool on_cells = false;
  DataItem data;
};

struct Grid {
  std::string name, topology, geometry;
  std::size_t place = 0;
  std::optional<DataItem> cells, points;
  std::deque<Attribute> attributes;  ///< stay where they are while their data are read
  TagNames names;
};

class XdmfReader {
 public:
  XdmfReader(const Source& source, fs::path folder)
      : source_(source), folder_(std::move(folder)), xml_(source) {}

  AnyMesh read() {
    read_grids();
    const auto corners_of = [&](const Grid& g) -> int {
      if (g.topology == "tetrahedron") return 4;
      if (g.topology == "triangle") return 3;
      if (g.topology == "polyline") return 2;
      fail_unsupported(source_,
                       fmt::format("{}: topology \"{}\"; grids of tetrahedra, triangles or lines are read, "
                                   "one kind each",
                                   line_of(source_, g.place), shown(g.topology)));
    };
    const Grid* main = nullptr;
    for (const Grid& g : grids_)
      if (g.cells && g.points && (main == nullptr || corners_of(g) > corners_of(*main))) main = &g;
    if (main == nullptr) fail_unsupported(source_, "has no uniform grid with points and cells");
    read_points(*main);
    for (const Grid& g : grids_) {
      if (!g.cells) continue;
      const int corners = corners_of(g);
      const bool is_main = &g == main;
      if (!is_main && corners + 1 != corners_of(*main)) continue;
      if (corners == 4) add_cells(g, is_main, raw_.tets);
      if (corners == 3) add_cells(g, is_main, raw_.triangles);
      if (corners == 2) add_cells(g, is_main, raw_.edges);
    }
    return assemble(std::move(raw_), source_);
  }

 private:
  static std::string lower(std::string_view text) {
    std::string s(text);
    for (char& c : s)
      if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return s;
  }

  void read_grids() {
    bool is_xdmf = false;
    std::vector<Grid*> open;
    DataItem* item = nullptr;
    std::string_view parent;
    for (XmlEvent e = xml_.next(); e.kind != XmlEvent::Kind::kEnd; e = xml_.next()) {
      if (e.kind == XmlEvent::Kind::kText && item != nullptr) {
        item->text = e.text;
        item->offset = e.offset;
      }
      if (e.kind == XmlEvent::Kind::kClose) {
        if (e.name == "DataItem") item = nullptr;
        if (e.name == "Topology" || e.name == "Geometry" || e.name == "Attribute") parent = {};
        if (e.name == "Grid" && !open.empty()) open.pop_back();
      }
      if (e.kind != XmlEvent::Kind::kOpen) continue;
      is_xdmf = is_xdmf || e.name == "Xdmf";
      if (e.name == "Grid") {
        grids_.emplace_back();
        parent = {};
        open.push_back(&grids_.back());
        open.back()->name = xml_unescape(e.attribute("Name"));
        open.back()->place = e.offset;
      }
      if (open.empty()) continue;
      Grid& grid = *open.back();
      if (e.name == "Topology") {
        grid.topology = lower(e.attribute("TopologyType", e.attribute("Type")));
        parent = "Topology";
      } else if (e.name == "Geometry") {
        grid.geometry = lower(e.attribute("GeometryType", e.attribute("Type", "XYZ")));
        parent = "Geometry";
      } else if (e.name == "Attribute") {
        grid.attributes.push_back({xml_unescape(e.attribute("Name")),
                                   lower(e.attribute("AttributeType", e.attribute("Type", "Scalar"))),
                                   lower(e.attribute("Center", "Node")) == "cell",
                                   {}});
        parent = "Attribute";
      } else if (e.name == "Information") {
        read_name(grid, e);
      } else if (e.name == "DataItem" && item == nullptr) {
        item = place_of(grid, parent);
        if (item != nullptr) describe(e, *item);
      }
    }
    if (!is_xdmf) fail_format(source_, "line 1", "not an Xdmf file");
  }

  static DataItem* place_of(Grid& grid, std::string_view parent) {
    if (parent == "Topology") return &grid.cells.emplace();
    if (parent == "Geometry") return &grid.points.emplace();
    return parent == "Attribute" ? &grid.attributes.back().data : nullptr;
  }

  static void read_name(Grid& grid, const XmlEvent& e) {
    std::string_view key = e.attribute("Name");
    if (key.substr(0, kNameOf.size()) != kNameOf) return;
    key.remove_prefix(kNameOf.size());
    Index tag = 0;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), tag);
    if (error == std::errc()) grid.names[tag] = xml_unescape(e.attribute("Value"));
  }

  void describe(const XmlEvent& e, DataItem& item) {
    const std::string format = lower(e.attribute("Format", "XML"));
    if (format != "hdf" && format != "xml")
      fail_unsupported(source_, fmt::format("{}: data in the form \"{}\"; HDF and XML are read",
                                            line_of(source_, e.offset), shown(format)));
    item.hdf = format == "hdf";
    const std::string_view shape = e.attribute("Dimensions");
    for (std::size_t at = 0; at < shape.size();) {
      if (shape[at] == ' ') {
        ++at;
        continue;
      }
      std::size_t n = 0;
      const auto [end, error] = std::from_chars(shape.data() + at, shape.data() + shape.size(), n);
      if (error != std::errc())
        fail_format(source_, line_of(source_, e.offset), "Dimensions must be numbers");
      item.shape.push_back(n);
      at = static_cast<std::size_t>(end - shape.data());
    }
  }

  [[noreturn]] void fail(const DataItem& item, const std::string& what) const {
    fail_format(source_, line_of(source_, item.offset), what);
  }

  /// The reader and the path inside of it that "file.h5:/path" names.
  std::pair<Hdf5Reader*, std::string> open(const DataItem& item) {
    std::string_view text = item.text;
    const auto blank = [](char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    const std::size_t colon = text.find(":/");
    if (colon == std::string_view::npos)
      fail(item, fmt::format("expected FILE.h5:/PATH, found \"{}\"", shown(text)));
    const std::string file = xml_unescape(text.substr(0, colon));
    auto& reader = readers_[file];
    if (!reader) reader = std::make_unique<Hdf5Reader>(folder_ / file);
    return {reader.get(), xml_unescape(text.substr(colon + 1))};
  }

  template <class T>
  std::vector<T> values(const DataItem& item, std::size_t expected) {
    if (item.size() != expected)
      fail(item, fmt::format("Dimensions give {} values, expected {}", item.size(), expected));
    if (item.hdf) {
      const auto [reader, path] = open(item);
      if constexpr (std::is_integral_v<T>) {
        return reader->integers(path, expected);
      } else {
        return reader->reals(path, expected);
      }
    }
    if (expected > item.text.size() / 2 + 1)
      fail(item, fmt::format("{} values in {} characters", expected, item.text.size()));
    TextSource text(source_);
    text.seek(item.offset);
    std::vector<T> list;
    list.reserve(expected);
    for (std::size_t i = 0; i < expected; ++i) {
      if constexpr (std::is_integral_v<T>) {
        list.push_back(text.integer());
      } else {
        list.push_back(text.real());
      }
    }
    return list;
  }

  void read_points(const Grid& g) {
    const std::size_t width = g.geometry == "xy" ? 2 : 3;
    if (g.geometry != "xy" && g.geometry != "xyz")
      fail_unsupported(source_, fmt::format("geometry \"{}\"; XY and XYZ are read", shown(g.geometry)));
    const std::size_t n = g.points->shape.empty() ? 0 : g.points->size() / width;
    if (n > static_cast<std::size_t>(std::numeric_limits<Index>::max())) fail(*g.points, "too many points");
    const std::vector<double> x = values<double>(*g.points, n * width);
    raw_.points.assign(n, Vec3::Zero());
    for (std::size_t i = 0; i < n * width; ++i) raw_.points[i / width][static_cast<int>(i % width)] = x[i];
  }

  static std::vector<Index> to_tags(const std::vector<std::int64_t>& values, const Source& source) {
    std::vector<Index> tags;
    tags.reserve(values.size());
    for (const std::int64_t v : values) tags.push_back(to_index(v, "tag", source, "Attribute"));
    return tags;
  }

  template <int N>
  void add_cells(const Grid& g, bool is_main, RawCells<N>& to) {
    to.place = line_of(source_, g.place);
    const std::size_t n = g.cells->size() / N;
    const std::vector<std::int64_t> corners = values<std::int64_t>(*g.cells, n * N);
    const std::size_t first = to.cells.size();
    to.cells.resize(first + n);
    for (std::size_t i = 0; i < n * N; ++i)
      to.cells[first + i / N][i % N] = to_index(corners[i], "point", source_, to.place);
    to.names.insert(g.names.begin(), g.names.end());
    for (const Attribute& a : g.attributes) {
      const bool tags = a.type == "scalar" && (a.name == "region" || (!is_main && a.on_cells));
      if (tags && a.on_cells) {
        const std::vector<Index> t = to_tags(values<std::int64_t>(a.data, n), source_);
        to.tags.resize(first);
        to.tags.insert(to.tags.end(), t.begin(), t.end());
      } else if (tags) {
        raw_.point_tags = to_tags(values<std::int64_t>(a.data, raw_.points.size()), source_);
      } else if (is_main) {
        (a.on_cells ? raw_.cell_fields : raw_.point_fields)
            .push_back(field(a, a.on_cells ? n : raw_.points.size()));
      }
    }
    if (!to.tags.empty()) to.tags.resize(to.cells.size());
  }

  MeshField field(const Attribute& a, std::size_t count) {
    const std::size_t width = count == 0 ? 1 : a.data.size() / count;
    if (width == 0 || width > 1024)
      fail(a.data, fmt::format("attribute {}: {} values for {} items", a.name, a.data.size(), count));
    MeshField f{a.name, static_cast<int>(width), values<double>(a.data, count * width)};
    if (a.type != "tensor6" || width != 6) return f;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<double, 6> ours;
      for (int k = 0; k < 6; ++k) ours[kOurPlace[k]] = f.values[6 * i + k];
      std::copy(ours.begin(), ours.end(), f.values.begin() + static_cast<std::ptrdiff_t>(6 * i));
    }
    return f;
  }

  const Source& source_;
  fs::path folder_;
  XmlScanner xml_;
  std::deque<Grid> grids_;
  std::map<std::string, std::unique_ptr<Hdf5Reader>> readers_;
  RawMesh raw_;
};

template <int D>
class XdmfWriter {
 public:
  XdmfWriter(Hdf5Writer& data, const Mesh<D>& mesh, std::string file)
      : data_(data), mesh_(mesh), file_(std::move(file)) {}

  std::string write() {
    xml_ = "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n";
    const std::size_t n = mesh_.points.size();
    data_.write("/mesh/geometry", n == 0 ? nullptr : mesh_.points[0].data(), n, D);
    begin("mesh", mesh_.cells, mesh_.cell_names);
    tags("region", "/mesh/region", mesh_.cell_tags, true);
    tags("region", "/mesh/point_region", mesh_.point_tags, false);
    for (const MeshField& f : mesh_.point_fields) field(f, n, false);
    for (const MeshField& f : mesh_.cell_fields) field(f, mesh_.cells.size(), true);
    xml_ += "    </Grid>\n";
    if (!mesh_.facets.empty()) {
      begin("facet_tags", mesh_.facets, mesh_.facet_names);
      tags("facet_tags", "/facet_tags/values",
           mesh_.facet_tags.empty() ? std::vector<Index>(mesh_.facets.size(), 0) : mesh_.facet_tags, true);
      xml_ += "    </Grid>\n";
    }
    return xml_ + "  </Domain>\n</Xdmf>\n";
  }

 private:
  void item(const std::string& path, const char* kind, int precision, const std::string& shape) {
    xml_ += fmt::format(
        "        <DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" Format=\"HDF\">{}:{}"
        "</DataItem>\n",
        shape, kind, precision, xml_escape(file_), path);
  }

  template <std::size_t N>
  void begin(const std::string& name, const std::vector<std::array<Index, N>>& cells, const TagNames& names) {
    constexpr const char* kinds[] = {"PolyLine", "Triangle", "Tetrahedron"};
    const std::string path = fmt::format("/{}/topology", name);
    data_.write(path, cells.empty() ? nullptr : cells[0].data(), cells.size(), N);
    xml_ += fmt::format("    <Grid Name=\"{}\" GridType=\"Uniform\">\n", name);
    for (const auto& [tag, text] : names)
      xml_ +=
          fmt::format("      <Information Name=\"{}{}\" Value=\"{}\"/>\n", kNameOf, tag, xml_escape(text));
    xml_ +=
        fmt::format("      <Topology TopologyType=\"{}\" NumberOfElements=\"{}\" NodesPerElement=\"{}\">\n",
                    kinds[N - 2], cells.size(), N);
    item(path, "Int", 4, fmt::format("{} {}", cells.size(), N));
    xml_ += fmt::format("      </Topology>\n      <Geometry GeometryType=\"{}\">\n", D == 2 ? "XY" : "XYZ");
    item("/mesh/geometry", "Float", 8, fmt::format("{} {}", mesh_.points.size(), D));
    xml_ += "      </Geometry>\n";
  }

  void attribute(const std::string& name, const char* type, bool on_cells) {
    xml_ += fmt::format("      <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">\n",
                        xml_escape(name), type, on_cells ? "Cell" : "Node");
  }

  void tags(const std::string& name, const std::string& path, const std::vector<Index>& values,
            bool on_cells) {
    if (values.empty()) return;
    data_.write(path, values.data(), values.size(), 0);
    attribute(name, "Scalar", on_cells);
    item(path, "Int", 4, fmt::format("{}", values.size()));
    xml_ += "      </Attribute>\n";
  }

  void field(const MeshField& f, std::size_t count, bool on_cells) {
    const auto n = static_cast<std::size_t>(f.components);
    const bool tensor = f.components == kSymSize<D>, vector = f.components == D;
    const std::size_t stored = tensor ? 6 : (vector ? 3 : n);
    const std::string path = fmt::format("/fields/{}{}", on_cells ? 'c' : 'p', fields_++);
    if (!tensor && stored == n) {
      data_.write(path, f.values.data(), count, n == 1 ? 0 : n);
    } else {
      std::vector<double> values(count * stored, 0.0);
      for_each_index(count, [&](std::size_t i) {
        for (std::size_t k = 0; k < stored; ++k) {
          const auto from = tensor ? static_cast<std::size_t>(kOurPlace[k]) : k;
          // In 2D our xx xy yy are the first three of six.
          if (from < n) values[i * stored + k] = f.values[i * n + from];
        }
      });
      data_.write(path, values.data(), count, stored);
    }
    attribute(f.name, tensor ? "Tensor6" : (vector ? "Vector" : (n == 1 ? "Scalar" : "Matrix")), on_cells);
    item(path, "Float", 8, n == 1 ? fmt::format("{}", count) : fmt::format("{} {}", count, stored));
    xml_ += "      </Attribute>\n";
  }

  Hdf5Writer& data_;
  const Mesh<D>& mesh_;
  std::string file_, xml_;
  int fields_ = 0;
};

}  // namespace

AnyMesh parse_xdmf(std::string_view bytes, const std::string& name, const fs::path& folder) {
  const Source source{bytes, name};
  return XdmfReader(source, folder).read();
}

AnyMesh read_xdmf(const fs::path& path) {
  const MappedFile file(path);
  return parse_xdmf(file.bytes(), path.string(), path.parent_path());
}

template <int D>
void write_xdmf(WriteJob& job, const Mesh<D>& mesh) {
  const fs::path target = data_file(job.path);
  OutputFile& data = job.files.add(target);
  Hdf5Writer writer(data.temporary_path(), target);
  const std::string xml = XdmfWriter<D>(writer, mesh, target.filename().string()).write();
  writer.close();
  job.files.add(job.path).write(xml);
}

std::vector<fs::path> xdmf_files(const fs::path& path) { return {data_file(path), path}; }

template void write_xdmf<2>(WriteJob&, const Mesh<2>&);
template void write_xdmf<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io

#endif
