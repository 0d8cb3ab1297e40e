#include "apps/pipeline/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "apps/pipeline/detail/json.h"
#include "core/words.h"

namespace lamina {
namespace {

double percent(std::int64_t part, std::int64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

std::int64_t region_count(const Report& r, Region region) {
  return r.region_cells[static_cast<std::size_t>(region)];
}

Json cells_json(const Report& r) {
  const auto entry = [&](std::int64_t n) { return Json{{"count", n}, {"percent", percent(n, r.cells())}}; };
  return {{"total", entry(r.cells())},
          {"box2", entry(r.box2_cells())},
          {"layer", entry(region_count(r, Region::kLayer))},
          {"inside", entry(region_count(r, Region::kInside))}};
}

Json worst_json(const Report& r) {
  Json out = worst_cells_json(r.score);
  for (std::size_t i = 0; i < std::min(out.size(), r.worst_regions.size()); ++i)
    out[i]["region"] = kRegionNames[static_cast<std::size_t>(r.worst_regions[i])];
  return out;
}

Json sizes_json(const SizeOptions& s) {
  return {{"h2", s.h2}, {"h1", s.h1}, {"box2", to_json(s.box2)}, {"domain", to_json(s.domain)}};
}

}  // namespace

std::string version() { return LAMINA_VERSION; }

std::int64_t Report::cells() const {
  return std::accumulate(region_cells.begin(), region_cells.end(), std::int64_t{0});
}

std::int64_t Report::box2_cells() const { return cells() - region_count(*this, Region::kBox1); }

std::vector<std::pair<std::string, std::string>> layer_rows(const LayerScore& s) {
  return {{"on levels", fmt::format("{:.1f} % of the {} points in layers, mean offset {:.3f} of a layer",
                                    percent(s.on_level, s.points), s.points, s.mean_offset)},
          {"on the wall",
           fmt::format("{} points, {:.1f} % of the ideal number", s.on_wall, 100.0 * s.wall_share())},
          {"aligned edges", fmt::format("{:.1f} %, {:.1f} % of what right columns have",
                                        100.0 * s.aligned_share(), 100.0 * s.aligned_of_ideal())}};
}

std::vector<std::string> missed_properties(const Score& score) {
  std::vector<std::string> missed;
  if (!(score.unit_share >= kWantedUnitShare))
    missed.push_back(fmt::format("unit edges: {:.1f} %, wanted at least {:.0f} %", 100.0 * score.unit_share,
                                 100.0 * kWantedUnitShare));
  if (!(score.quality_min >= kWantedQuality)) {
    const Vec3 x = score.worst.empty() ? Vec3::Zero() : score.worst.front().center;
    missed.push_back(fmt::format("worst quality: {:.3g} near ({:.6g}, {:.6g}, {:.6g}), wanted at least {:g}",
                                 score.quality_min, x[0], x[1], x[2], kWantedQuality));
  }
  return missed;
}

std::vector<std::string> missed_at_wall(const WallFit& wall, double h_min) {
  std::vector<std::string> missed;
  const auto at = [](const Vec3& x) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", x[0], x[1], x[2]); };
  const WallFit::Worst& worst = wall.to_mesh.distance > wall.to_wall.distance ? wall.to_mesh : wall.to_wall;
  if (!(worst.distance <= kWantedWallFit * h_min))
    missed.push_back(
        fmt::format("wall: the mesh's strays from the body's by {:.3g} = {:.2f} h_min near {}, wanted at "
                    "most {:g} h_min where it is smooth",
                    worst.distance, worst.distance / h_min, at(worst.at), kWantedWallFit));
  if (wall.straddling > 0)
    missed.push_back(
        fmt::format("interface: {} the wall with an edge longer than {:g} in its metric, the longest "
                    "{:.1f} near {}",
                    counted(wall.straddling, "cell straddles", "cells straddle"), WallFit::kTooLong,
                    wall.worst.front().length, at(wall.worst.front().at)));
  return missed;
}

std::string wall_text(const WallFit& wall, double h_min) {
  return fmt::format(
      "off the body's by {:.3f} h_min at most, the body's off it by {:.3f}; {} too large there",
      wall.to_wall.distance / h_min, wall.to_mesh.distance / h_min,
      counted(wall.straddling, "cell", "cells"));
}

std::string report_json(const Report& r) {
  Json json = {
      {"lamina", r.version},
      {"case", to_json(r.resolved.c)},
      {"layer", to_json(r.resolved.layer)},
      {"sizes", sizes_json(r.resolved.sizes)},
      {"body",
       {{"file", r.resolved.c.body.string()},
        {"bounds", to_json(r.resolved.body_bounds)},
        {"surface", r.kind == BodyKind::kSurface ? to_json(r.surface) : Json()},
        {"profile", r.kind == BodyKind::kProfile ? to_json(r.outline) : Json()},
        {"level_set", to_json(r.level_set)}}},
      {"cells", cells_json(r)},
      {"expected_cells", r.expected_cells},
      {"points", r.points},
      {"facets", r.facets},
      {"levels", to_json(r.levels)},
      {"wall", to_json(r.wall)},
      {"mesh_hash", fmt::format("{:016x}", r.mesh_hash)},
      {"validation", to_json(r.validation)},
      {"score", to_json(r.score)},
      {"worst_cells", worst_json(r)},
  };
  append_outcome(json, r);
  return json_text(json);
}

std::string report_table(const Report& r) {
  const BoundaryLayer& b = r.resolved.layer;
  std::string out;
  const auto row = [&](const char* name, const std::string& text) {
    out += fmt::format("{:<14}{}\n", name, text);
  };
  const auto count = [&](const char* name, std::int64_t n) {
    row(name, fmt::format("{:>12} {:>6.1f} %", n, percent(n, r.cells())));
  };
  row("layers",
      fmt::format("{} of growth {:g}: h_min {:.4g}, top {:.4g}", b.layers, b.growth, b.h_min, b.top()));
  row("points", fmt::format("{:>12}", r.points));
  count("cells", r.cells());
  count("  in Box2", r.box2_cells());
  count("  in layers", region_count(r, Region::kLayer));
  count("  inside", region_count(r, Region::kInside));
  for (const auto& [name, text] : layer_rows(r.levels)) row(name.c_str(), text);
  row("wall", wall_text(r.wall, b.h_min));
  row("unit edges", fmt::format("{:.1f} %, metric lengths {:.3g} to {:.3g}", 100.0 * r.score.unit_share,
                                r.score.length_min, r.score.length_max));
  row("quality", fmt::format("worst {:.3g}, mean {:.3f}", r.score.quality_min, r.score.quality_mean));
  row("aspect", fmt::format("largest {:.4g}, 99 % below {:.4g}", r.score.aspect_max, r.score.aspect_p99));
  row("time", cost_text(r.stages, r.threads));
  for (const auto& file : r.files) row("file", file.string());
  return out;
}

}  // namespace lamina
