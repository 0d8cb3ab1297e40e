// `lamina info FILE`: what is in a surface, a level set or a mesh.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"
#include "vdb/inspect.h"
#include "vdb/level_set.h"
#include "vdb/outline.h"
#include "vdb/surface_io.h"

namespace lamina::cli {
namespace {

/// What `lamina info` was told.
struct InfoRequest {
  std::string file;
  bool json = false;
  std::optional<double> h_min;
  std::string unit;  ///< empty: not given
};

/// The case's option --unit: its names of units and what they mean.
const CaseOption& unit_option() {
  const std::vector<CaseOption>& all = case_options();
  return *std::find_if(all.begin(), all.end(), [](const CaseOption& o) { return o.flags == "--unit"; });
}

double metres_per(const std::string& unit) {
  Case c;
  unit_option().set(c, unit);
  return unit_scale(c.unit);
}

/// Bodies that people mesh are between a centimetre and a hundred metres long; beyond, another unit is
/// likelier.
constexpr double kSmallBody = 1e-2, kLargeBody = 100.0;

/// The extent in metres for each unit that makes this one a body that people mesh, the likeliest first: that
/// is the order of the option.
Json unit_alternatives(double extent) {
  Json out = Json::object();
  for (const std::string& unit : unit_option().choices) {
    const double metres = extent * metres_per(unit);
    if (extent > kLargeBody && metres >= kSmallBody && metres <= kLargeBody) out[unit] = metres;
  }
  return out;
}

std::string unit_guess(double extent, const Json& alternatives) {
  if (extent < kSmallBody)
    return fmt::format(
        "perhaps metres of a very small body; if a body of {:g} m was meant, as when millimetres were "
        "converted twice, scale it by 1000 before export",
        extent * 1e3);
  if (extent <= kLargeBody) return "perhaps metres";
  std::string words;
  for (const auto& [unit, metres] : alternatives.items())
    words += fmt::format("{}{:.4g} m with --unit {}", words.empty() ? "perhaps not metres: " : ", ",
                         metres.get<double>(), unit);
  return words.empty() ? "no unit makes it a body of a likely size" : words;
}

template <int D>
Json bounds_json(const Box<D>& b) {
  Json out = Json::array();
  for (int k = 0; k < D; ++k) out.push_back(b.lo[k]);
  for (int k = 0; k < D; ++k) out.push_back(b.hi[k]);
  return out;
}

/// Warnings that only say again what was repaired.
void drop_told_repairs(const std::string& path, SurfaceReport& report) {
  for (const std::string& repair : report.repairs) std::erase(report.warnings, path + ": " + repair);
}

Json surface_info(const InfoRequest& request) {
  const std::string& path = request.file;
  std::vector<std::string> warnings;
  Surface surface = read_surface(path, warnings);
  if (!request.unit.empty())
    for (Vec3& x : surface.points) x *= metres_per(request.unit);
  SurfaceReport report = clean(surface, path);
  drop_told_repairs(path, report);
  report.warnings.insert(report.warnings.begin(), warnings.begin(), warnings.end());
  const Box<3> bounds = surface.bounds();
  const double extent = bounds.size().maxCoeff();
  Json out = {{"kind", "surface"}, {"file", path}, {"bounds", to_json(bounds)}, {"extent", extent}};
  if (request.unit.empty()) {
    const Json alternatives = unit_alternatives(extent);
    out["unit_guess"] = unit_guess(extent, alternatives);
    out["unit_alternatives"] = alternatives;
  } else {
    out["unit"] = request.unit;
  }
  out.update(to_json(report));
  out.update(to_json(inspect(surface, report, {.h_min = request.h_min})));
  Json names = Json::array();
  for (const std::string& name : surface.tag_names) names.push_back(name);
  out["groups"] = names;
  return out;
}

Json profile_json(const InfoRequest& request) {
  Outline outline = read_outline(request.file);
  if (!request.unit.empty())
    for (OutlineCurve& curve : outline.curves)
      for (Vec2& x : curve.points) x *= metres_per(request.unit);
  const OutlineReport report = clean(outline, request.file);
  const LevelSet wall = LevelSet::from_outline(outline, {}, request.file);
  Json out = {{"kind", "profile"},
              {"file", request.file},
              {"bounds", bounds_json<2>({wall.bounds().lo.head<2>(), wall.bounds().hi.head<2>()})},
              {"extent", wall.bounds().size().maxCoeff()},
              {"corners", wall.report().sharp_edges}};
  out.update(to_json(report));
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
          {"edges", mesh.edges.size()},
          {"corners", mesh.corners.size()},
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

/// Sentences go one a line below their name.
bool is_list_of_sentences(const Json& value) {
  return value.is_array() && std::any_of(value.begin(), value.end(), [](const Json& x) {
           return x.is_string() && x.get<std::string>().find(' ') != std::string::npos;
         });
}

/// JSON as indented "name: value" lines; what is empty or null is left out, elements of lists go by their
/// name.
void print_plain(const Json& json, int indent) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_null() || (value.is_structured() && value.empty())) continue;
    if (json.is_object() && name == "name") continue;
    if (is_list_of_sentences(value)) {
      fmt::print("{:{}}{}\n", "", indent, name);
      for (const Json& sentence : value) fmt::print("{:{}}{}\n", "", indent + 2, plain(sentence));
      continue;
    }
    const bool nested = value.is_object() || (value.is_array() && value.front().is_object());
    const std::string label = value.is_object() && value.contains("name") ? plain(value["name"]) : name;
    fmt::print("{:{}}{:<{}} {}\n", "", indent, label, std::max(1, 22 - indent), nested ? "" : plain(value));
    if (nested) print_plain(value, indent + 2);
  }
}

void check_h_min(const InfoRequest& request) {
  if (request.h_min && !(*request.h_min > 0.0 && std::isfinite(*request.h_min)))
    throw Error(ErrorCode::kUsage, fmt::format("--hmin = {:g} is out of range: must be > 0", *request.h_min));
}

/// --hmin and --unit say something of facets only.
void refuse_surface_options(const InfoRequest& request) {
  for (const auto& [flag, given] :
       {std::pair{"--hmin", request.h_min.has_value()}, std::pair{"--unit", !request.unit.empty()}})
    if (given)
      throw Error(
          ErrorCode::kUsage,
          fmt::format("{}: {} is for surfaces, which are .stl, .obj and .ply files", request.file, flag));
}

Json file_info(const InfoRequest& request) {
  const std::string& path = request.file;
  check_h_min(request);
  if (is_surface_file(path)) return surface_info(request);
  if (is_outline_file(path) && !request.h_min) return profile_json(request);
  refuse_surface_options(request);
  if (lower_extension(path) == ".vdb") return vdb_json(path);
  if (is_readable_mesh(path))
    return std::visit([&](const auto& mesh) { return mesh_json(path, mesh); }, read_mesh(path));
  const MappedFile exists(path);  // a missing file or a folder is the better message
  throw Error(ErrorCode::kFileUnsupported,
              fmt::format("{}: unknown kind of file; known are .stl .obj .ply .vdb .dat .csv .txt {}", path,
                          readable_mesh_suffixes()));
}

}  // namespace

void add_info(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("info", "What is in a surface, a level set or a mesh file");
  app->footer("Examples:\n  lamina info wing.stl --json\n  lamina info wing.stl --unit mm --hmin 1e-4");
  auto state = std::make_shared<InfoRequest>();
  app->add_option("FILE", state->file, ".stl .obj .ply .vdb .dat .csv .txt " + readable_mesh_suffixes())
      ->required();
  app->add_flag("--json", state->json, "print JSON");
  app->add_option("--hmin", state->h_min,
                  "surfaces: height of the first layer that the facets are to carry (unit of the file, "
                  "metres with --unit; > 0)")
      ->type_name("H");
  app->add_option("--unit", state->unit,
                  "surfaces: unit of the file's coordinates; lengths are told in metres")
      ->type_name("UNIT")
      ->check(CLI::IsMember(unit_option().choices));
  commands.push_back({app, [state] {
                        const Json json = file_info(*state);
                        if (state->json)
                          fmt::print("{}", json_text(json));
                        else
                          print_plain(json, 0);
                        return kDone;
                      }});
}

}  // namespace lamina::cli
