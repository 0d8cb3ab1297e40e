#include "apps/pipeline/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "apps/pipeline/detail/json.h"

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

LevelFit fit_levels(const BoundaryLayer& layer, const std::vector<double>& phi) {
  constexpr double kOnLevel = 0.05;
  LevelFit fit;
  for (const double height : phi) {
    if (height < -kOnLevel * layer.h_min || height > layer.top()) continue;
    const double k = layer.level_at(std::max(height, 0.0));
    const double offset = std::abs(k - std::round(k));
    ++fit.points;
    fit.mean_offset += offset;
    if (offset > kOnLevel) continue;
    ++fit.on_level;
    fit.on_wall += k < 0.5;
  }
  if (fit.points > 0) fit.mean_offset /= static_cast<double>(fit.points);
  return fit;
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
      {"levels",
       {{"points", r.levels.points},
        {"on_level", r.levels.on_level},
        {"on_wall", r.levels.on_wall},
        {"mean_offset", r.levels.mean_offset}}},
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
  row("on levels",
      fmt::format("{:.1f} % of the {} points in layers, mean offset {:.3f} of a layer",
                  percent(r.levels.on_level, r.levels.points), r.levels.points, r.levels.mean_offset));
  row("unit edges", fmt::format("{:.1f} %, metric lengths {:.3g} to {:.3g}", 100.0 * r.score.unit_share,
                                r.score.length_min, r.score.length_max));
  row("quality", fmt::format("worst {:.3g}, mean {:.3f}", r.score.quality_min, r.score.quality_mean));
  row("aspect", fmt::format("largest {:.4g}, 99 % below {:.4g}", r.score.aspect_max, r.score.aspect_p99));
  row("time", cost_text(r.stages, r.threads));
  for (const auto& file : r.files) row("file", file.string());
  return out;
}

}  // namespace lamina
