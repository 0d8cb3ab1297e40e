// `lamina info FILE`: what is in a surface, a level set or a mesh.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"
#include "vdb/level_set.h"
#include "vdb/surface_io.h"

namespace lamina::cli {
namespace {

/// Bodies that people mesh are between a centimetre and a hundred metres long; beyond, another unit is
/// likelier.
std::string unit_guess(double extent) {
  if (extent > 100.0) return fmt::format("perhaps millimetres ({:g} m with --unit mm)", extent * 1e-3);
  if (extent < 1e-2) return "perhaps metres of a very small body";
  return "perhaps metres";
}

template <int D>
Json bounds_json(const Box<D>& b) {
  Json out = Json::array();
  for (int k = 0; k < D; ++k) out.push_back(b.lo[k]);
  for (int k = 0; k < D; ++k) out.push_back(b.hi[k]);
  return out;
}

Json surface_info(const std::string& path) {
  std::vector<std::string> warnings;
  Surface surface = read_surface(path, warnings);
  SurfaceReport report = clean(surface, path);
  report.warnings.insert(report.warnings.begin(), warnings.begin(), warnings.end());
  const Box<3> bounds = surface.bounds();
  Json out = {{"kind", "surface"},
              {"file", path},
              {"bounds", to_json(bounds)},
              {"extent", bounds.size().maxCoeff()},
              {"unit_guess", unit_guess(bounds.size().maxCoeff())}};
  out.update(to_json(report));
  Json names = Json::array();
  for (const std::string& name : surface.tag_names) names.push_back(name);
  out["groups"] = names;
  return out;
}

Json vdb_json(const std::string& path) {
  Json grids = Json::array();
  for (const VdbGridInfo& g : vdb_info(path))
    grids.push_back({{"name", g.name},
                     {"type", g.type},
                     {"class", g.grid_class},
                     {"voxel", g.voxel},
                     {"active_voxels", g.active_voxels},
                     {"background", g.background},
                     {"min", g.min},
                     {"max", g.max},
                     {"bounds", to_json(g.bounds)},
                     {"transform", g.transform}});
  return {{"kind", "vdb"}, {"file", path}, {"grids", grids}};
}

Json fields_json(const std::vector<MeshField>& fields) {
  Json out = Json::array();
  for (const MeshField& f : fields) {
    const auto [lo, hi] = std::minmax_element(f.values.begin(), f.values.end());
    Json entry = {{"name", f.name}, {"components", f.components}};
    if (!f.values.empty()) {
      entry["min"] = *lo;
      entry["max"] = *hi;
    }
    out.push_back(entry);
  }
  return out;
}

Json tags_json(const std::vector<Index>& tags) {
  std::map<Index, std::int64_t> counts;
  for (const Index tag : tags) ++counts[tag];
  Json out = Json::object();
  for (const auto& [tag, count] : counts) out[std::to_string(tag)] = count;
  return out;
}

template <int D>
Json mesh_json(const std::string& path, const Mesh<D>& mesh) {
  Box<D> bounds;
  for (const Vec<D>& x : mesh.points) bounds.extend(x);
  return {{"kind", "mesh"},
          {"file", path},
          {"dimension", D},
          {"points", mesh.points.size()},
          {"cells", mesh.cells.size()},
          {"facets", mesh.facets.size()},
          {"bounds", bounds_json<D>(bounds)},
          {"cell_tags", tags_json(mesh.cell_tags)},
          {"facet_tags", tags_json(mesh.facet_tags)},
          {"point_fields", fields_json(mesh.point_fields)},
          {"cell_fields", fields_json(mesh.cell_fields)},
          {"validation", to_json(validate<D>(mesh))}};
}

/// A value that is no object, in one line.
std::string plain(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& x : value) text += (text.empty() ? "" : "  ") + plain(x);
  return text;
}

/// JSON as indented "name: value" lines; what is empty or null is left out, elements of lists go by their
/// name.
void print_plain(const Json& json, int indent) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_null() || (value.is_structured() && value.empty())) continue;
    if (json.is_object() && name == "name") continue;
    const bool nested = value.is_object() || (value.is_array() && value.front().is_object());
    const std::string label = value.is_object() && value.contains("name") ? plain(value["name"]) : name;
    fmt::print("{:{}}{:<{}} {}\n", "", indent, label, std::max(1, 22 - indent), nested ? "" : plain(value));
    if (nested) print_plain(value, indent + 2);
  }
}

Json file_info(const std::string& path) {
  if (is_surface_file(path)) return surface_info(path);
  if (lower_extension(path) == ".vdb") return vdb_json(path);
  if (is_readable_mesh(path))
    return std::visit([&](const auto& mesh) { return mesh_json(path, mesh); }, read_mesh(path));
  const MappedFile exists(path);  // a missing file or a folder is the better message
  throw Error(ErrorCode::kFileUnsupported,
              fmt::format("{}: unknown kind of file; known are .stl .obj .ply .vdb .vtu .mesh .meshb", path));
}

}  // namespace

void add_info(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("info", "What is in a surface, a level set or a mesh file");
  app->footer("Example:\n  lamina info wing.stl --json");
  struct State {
    std::string file;
    bool json = false;
  };
  auto state = std::make_shared<State>();
  app->add_option("FILE", state->file, ".stl .obj .ply .vdb .vtu .mesh .meshb")->required();
  app->add_flag("--json", state->json, "print JSON");
  commands.push_back({app, [state] {
                        const Json json = file_info(state->file);
                        if (state->json)
                          fmt::print("{}", json_text(json));
                        else
                          print_plain(json, 0);
                        return kDone;
                      }});
}

}  // namespace lamina::cli
