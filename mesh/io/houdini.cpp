#include "mesh/io/houdini.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "mesh/io/records.h"
#include "mesh/io/text.h"

namespace lamina::io {
namespace {

using Json = nlohmann::json;

std::string quoted(const std::string& text) {
  return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

class GeoWriter {
 public:
  GeoWriter(OutputFile& out, const Mesh<3>& mesh) : out_(out), mesh_(mesh) {}

  void write() {
    const std::size_t tets = mesh_.cells.size(), polygons = mesh_.facets.size();
    out_.write(fmt::format(
        "[\n\"fileversion\",\"18.5.0\",\n\"hasindex\",false,\n\"pointcount\",{},\n\"vertexcount\",{},\n"
        "\"primitivecount\",{},\n\"info\",{{\"software\":\"Lamina\"}},\n",
        mesh_.points.size(), 4 * tets + 3 * polygons, tets + polygons));
    topology();
    out_.write("\"attributes\",[\n\"pointattributes\",[\n");
    attribute("P", "fpreal64", 3, mesh_.points.size(),
              [&](std::size_t i, int k, Records& to) { real(mesh_.points[i][k], "coordinate", to); });
    if (!mesh_.point_tags.empty())
      tags(mesh_.points.size(), [&](std::size_t i) { return mesh_.point_tags[i]; });
    for (const MeshField& f : mesh_.point_fields) field(f, mesh_.points.size(), 0);
    out_.write("\n],\n\"primitiveattributes\",[\n");
    first_ = true;
    if (!mesh_.cell_tags.empty() || !mesh_.facet_tags.empty())
      tags(tets + polygons, [&](std::size_t i) {
        const std::vector<Index>& list = i < tets ? mesh_.cell_tags : mesh_.facet_tags;
        return list.empty() ? 0 : list[i < tets ? i : i - tets];
      });
    for (const MeshField& f : mesh_.cell_fields) field(f, tets, polygons);
    out_.write(fmt::format(
        "\n]\n],\n\"primitives\",[\n[[\"type\",\"Tetrahedron_run\"],[\"startvertex\",0,\"nprimitives\",{}]]",
        tets));
    if (polygons > 0)
      out_.write(fmt::format(
          ",\n[[\"type\",\"Polygon_run\"],[\"startvertex\",{},\"nprimitives\",{},\"nvertices_rle\",[3,{}]]]",
          4 * tets, polygons, polygons));
    out_.write("\n]\n]\n");
  }

 private:
  static void real(double v, const char* what, Records& to) {
    if (!std::isfinite(v))
      throw Error(ErrorCode::kParameter, fmt::format("a {} is {}: .geo holds finite numbers", what, v));
    to.real(v);
  }

  void topology() {
    out_.write("\"topology\",[\"pointref\",[\"indices\",[");
    write_records(out_, mesh_.cells.size(), [&](std::size_t i, Records& to) {
      for (int k = 0; k < 4; ++k) {
        to.text(i + static_cast<std::size_t>(k) > 0 ? "," : "");
        to.integer(mesh_.cells[i][k]);
      }
      to.character('\n');
    });
    write_records(out_, mesh_.facets.size(), [&](std::size_t i, Records& to) {
      for (const int k : {0, 2, 1}) {
        to.character(',');
        to.integer(mesh_.facets[i][k]);
      }
      to.character('\n');
    });
    out_.write("]]],\n");
  }

  template <class Value>
  void attribute(const std::string& name, std::string_view storage, int size, std::size_t n, Value&& value) {
    out_.write(fmt::format(
        "{}[[\"scope\",\"public\",\"type\",\"numeric\",\"name\",{},\"options\",{{}}],[\"size\",{},"
        "\"storage\","
        "\"{}\",\"defaults\",[\"size\",1,\"storage\",\"{}\",\"values\",[0]],\"values\",[\"size\",{},"
        "\"storage\",\"{}\",\"{}\",[",
        first_ ? "" : ",\n", quoted(name), size, storage, storage, size, storage,
        size == 1 ? "arrays" : "tuples"));
    first_ = false;
    if (size == 1) out_.write("[");
    write_records(out_, n, [&](std::size_t i, Records& to) {
      if (i > 0) to.character(',');
      if (size > 1) to.character('[');
      for (int k = 0; k < size; ++k) {
        if (k > 0) to.character(',');
        value(i, k, to);
      }
      if (size > 1) to.character(']');
      to.character('\n');
    });
    out_.write(size == 1 ? "]]]]]" : "]]]]");
  }

  template <class Tag>
  void tags(std::size_t n, Tag&& tag) {
    attribute("region", "int32", 1, n, [&](std::size_t i, int, Records& to) { to.integer(tag(i)); });
  }

  void field(const MeshField& f, std::size_t count, std::size_t more) {
    const auto size = static_cast<std::size_t>(f.components);
    attribute(f.name, "fpreal64", f.components, count + more, [&](std::size_t i, int k, Records& to) {
      real(i < count ? f.values[i * size + static_cast<std::size_t>(k)] : 0.0, "value of a field", to);
    });
  }

  OutputFile& out_;
  const Mesh<3>& mesh_;
  bool first_ = true;
};

class GeoReader {
 public:
  explicit GeoReader(const Source& source) : source_(source) {}

  AnyMesh read() {
    if (source_.bytes.substr(0, 4) == "\x7fNSJ")
      fail_unsupported(source_, "is a binary .bgeo; save it as ascii .geo");
    Json root;
    try {
      root = Json::parse(source_.bytes.begin(), source_.bytes.end());
    } catch (const Json::parse_error& e) {
      fail_format(source_, byte_of(e.byte), "not the JSON of a .geo file");
    } catch (const Json::exception&) {
      fail("not the JSON of a .geo file: a number is too large");
    }
    const Json& indices = key(key(key(root, "topology"), "pointref"), "indices");
    corners_ = integers(indices, "indices");
    points_ = static_cast<std::size_t>(number(key(root, "pointcount"), "pointcount"));
    const Json& attributes = key(root, "attributes");
    read_primitives(key(root, "primitives"));
    for (const Json& a : list(find(attributes, "pointattributes"))) read_attribute(a, points_, true);
    if (raw_.points.empty() && points_ > 0) fail("has no attribute P");
    for (const Json& a : list(find(attributes, "primitiveattributes")))
      read_attribute(a, raw_.tets.cells.size() + raw_.triangles.cells.size(), false);
    return assemble(std::move(raw_), source_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { fail_format(source_, "content", what); }

  /// Maps are written as lists of keys and values.
  static const Json* find(const Json& map, std::string_view name) {
    if (map.is_object()) {
      const auto at = map.find(name);
      return at == map.end() ? nullptr : &*at;
    }
    if (!map.is_array()) return nullptr;
    for (std::size_t i = 0; i + 1 < map.size(); i += 2)
      if (map[i].is_string() && map[i].get_ref<const std::string&>() == name) return &map[i + 1];
    return nullptr;
  }
  const Json& key(const Json& map, std::string_view name) const {
    const Json* found = find(map, name);
    if (found == nullptr) fail(fmt::format("\"{}\" is missing", name));
    return *found;
  }
  static const Json& list(const Json* json) {
    static const Json none = Json::array();
    return json == nullptr || !json->is_array() ? none : *json;
  }
  std::int64_t number(const Json& json, std::string_view what) const {
    if (!json.is_number_integer() || json.get<std::int64_t>() < 0 ||
        json.get<std::int64_t>() > std::numeric_limits<Index>::max())
      fail(fmt::format("\"{}\" must be a count", what));
    return json.get<std::int64_t>();
  }
  std::vector<Index> integers(const Json& json, std::string_view what) const {
    std::vector<Index> values;
    values.reserve(json.size());
    for (const Json& v : json) {
      if (!v.is_number_integer()) fail(fmt::format("\"{}\" must hold integers", what));
      values.push_back(to_index(v.get<std::int64_t>(), "number", source_, std::string(what)));
    }
    return values;
  }
  static std::string text(const Json* json) {
    return json != nullptr && json->is_string() ? json->get<std::string>() : "";
  }

  template <int N>
  void add_run(const Json& run, RawCells<N>& to, const std::array<int, N>& order) {
    const auto first = static_cast<std::size_t>(number(key(run, "startvertex"), "startvertex"));
    const auto n = static_cast<std::size_t>(number(key(run, "nprimitives"), "nprimitives"));
    if (first > corners_.size() || n > (corners_.size() - first) / N)
      fail(fmt::format("a run of {} primitives from vertex {} of {}", n, first, corners_.size()));
    to.place = "primitives";
    for (std::size_t i = 0; i < n; ++i) {
      std::array<Index, N> cell;
      for (int k = 0; k < N; ++k) cell[k] = corners_[first + i * N + static_cast<std::size_t>(order[k])];
      to.cells.push_back(cell);
    }
  }

  void read_primitives(const Json& runs) {
    for (const Json& run : runs) {
      if (!run.is_array() || run.size() != 2) fail("a primitive that is not a run");
      const std::string type = text(find(run[0], "type"));
      if (type == "Tetrahedron_run" && raw_.triangles.cells.empty()) {
        add_run<4>(run[1], raw_.tets, {0, 1, 2, 3});
      } else if (type == "Polygon_run") {
        const std::vector<Index> lengths = integers(list(find(run[1], "nvertices_rle")), "nvertices_rle");
        for (std::size_t i = 0; i < lengths.size(); i += 2)
          if (lengths[i] != 3)
            fail_unsupported(source_, fmt::format("polygons of {} corners; triangles are read", lengths[i]));
        add_run<3>(run[1], raw_.triangles, {0, 2, 1});
      } else {
        fail_unsupported(source_,
                         fmt::format("primitives of type \"{}\"; Tetrahedron_run, then Polygon_run are read",
                                     shown(type)));
      }
    }
  }

  /// Values of an attribute: "tuples" of vectors or "arrays" by component.
  std::vector<double> values(const Json& data, std::size_t size, std::size_t count,
                             const std::string& name) const {
    std::vector<double> out;
    const Json* tuples = find(data, "tuples");
    const Json& rows = tuples != nullptr ? list(tuples) : list(find(data, "arrays"));
    if (rows.size() != (tuples != nullptr ? count : size))
      fail(fmt::format("attribute \"{}\" has another number of values than items", shown(name)));
    out.assign(count * size, 0.0);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (rows[r].size() != (tuples != nullptr ? size : count))
        fail(fmt::format("attribute \"{}\" has another number of values than items", shown(name)));
      for (std::size_t c = 0; c < rows[r].size(); ++c) {
        if (!rows[r][c].is_number()) fail(fmt::format("attribute \"{}\" must hold numbers", shown(name)));
        out[tuples != nullptr ? r * size + c : c * size + r] = rows[r][c].get<double>();
      }
    }
    return out;
  }

  void read_attribute(const Json& attribute, std::size_t count, bool of_points) {
    if (!attribute.is_array() || attribute.size() != 2) fail("an attribute without two parts");
    if (text(find(attribute[0], "type")) != "numeric") return;  // strings have no place in a mesh
    const std::string name = text(find(attribute[0], "name"));
    const Json& data = key(attribute[1], "values");
    const auto size = static_cast<std::size_t>(number(key(data, "size"), "size"));
    if (size < 1 || size > 1024) fail(fmt::format("attribute \"{}\" of size {}", shown(name), size));
    std::vector<double> v = values(data, size, count, name);
    if (of_points && name == "P") {
      if (size < 3) fail("the attribute P must have three components");
      for (std::size_t i = 0; i < count; ++i)
        raw_.points.emplace_back(v[i * size], v[i * size + 1], v[i * size + 2]);
    } else if (name == "region" && size == 1) {
      const std::size_t tets = raw_.tets.cells.size();
      for (std::size_t i = 0; i < count; ++i) {
        const Index tag =
            to_index(static_cast<std::int64_t>(std::clamp(v[i], -1e18, 1e18)), "tag", source_, "region");
        (of_points ? raw_.point_tags : (i < tets ? raw_.tets.tags : raw_.triangles.tags)).push_back(tag);
      }
    } else {
      const std::size_t kept = of_points ? count : raw_.tets.cells.size();
      v.resize(kept * size);
      (of_points ? raw_.point_fields : raw_.cell_fields)
          .push_back({name, static_cast<int>(size), std::move(v)});
    }
  }

  const Source& source_;
  std::vector<Index> corners_;
  std::size_t points_ = 0;
  RawMesh raw_;
};

}  // namespace

AnyMesh parse_geo(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  return GeoReader(source).read();
}

void write_geo(WriteJob& job, const Mesh<3>& mesh) { GeoWriter(job.files.add(job.path), mesh).write(); }

}  // namespace lamina::io
