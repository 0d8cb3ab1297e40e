#include "apps/pipeline/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/detail/quadrature.h"
#include "apps/pipeline/text.h"
#include "core/planar.h"

namespace lamina {
namespace {

std::vector<Spot> costly_spots(const std::map<detail::Cell, detail::Cost>& costs,
                               double cells_per_complexity) {
  std::vector<Spot> spots;
  for (const auto& [cell, cost] : costs) {
    const double sum = cost.sum();
    if (!(sum > 0.0)) continue;
    const auto most = std::max_element(cost.by_cause.begin(), cost.by_cause.end()) - cost.by_cause.begin();
    spots.push_back({cost.moment / sum, static_cast<Cause>(most), cells_per_complexity * sum});
  }
  constexpr std::size_t kShown = 5;
  std::stable_sort(spots.begin(), spots.end(),
                   [](const Spot& a, const Spot& b) { return a.cells > b.cells; });
  if (spots.size() > kShown) spots.resize(kShown);
  return spots;
}

}  // namespace

Prediction predict(const WallMetric& metric, Progress* progress, double leaves_across) {
  const detail::Sums sums = detail::integrate_density(metric, leaves_across, progress);
  const int D = dimension_of(metric.sizes().domain);
  const double per_complexity = D == 2 ? kTrianglesPerComplexity : kCellsPerComplexity;
  Prediction p;
  for (std::size_t i = 0; i < 4; ++i) {
    p.complexity += sums.complexity[i];
    p.region_complexity[i] = sums.complexity[i];
    p.region_cells[i] = per_complexity * sums.complexity[i] * std::exp(D * sums.excess(i));
    p.cells += p.region_cells[i];
  }
  p.points = p.cells / (D == 2 ? 2.0 : kCellsPerPoint);
  p.spots = costly_spots(sums.costs, p.cells / std::max(p.complexity, 1e-300));
  p.gap = sums.gap;
  p.thickness = sums.thickness;
  p.evaluations = sums.evaluations;
  return p;
}

const char* cause_text(Cause cause) {
  constexpr std::array<const char*, detail::kCauses> kTexts = {
      "layers over a flat wall",    "curvature", "the border of a bend", "a sharp edge",
      "a sharp edge along a curve", "a corner",  "another wall"};
  return kTexts[static_cast<std::size_t>(cause)];
}

std::vector<std::string> limits_of_input(const ResolvedCase& r, const Body& body, const Prediction& p) {
  std::vector<std::string> out;
  const double h_min = r.layer.h_min;
  const auto place = [](const Vec3& x) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", x[0], x[1], x[2]); };
  if (body.surface.facet_sag > h_min)
    out.push_back(
        fmt::format("facets sag up to {:.3g}, {:.3g} times h_min: the first layers follow the facets, not "
                    "the shape they stand for; triangulate finer",
                    body.surface.facet_sag, body.surface.facet_sag / h_min));
  constexpr double kFineVoxel = 100.0;  // of h_min: a spline through smooth values is that good
  const double voxel = body.level_set.report().voxel;
  if (body.kind == BodyKind::kVdb && voxel > kFineVoxel * h_min)
    out.push_back(
        fmt::format("a voxel of {:.3g} is {:.3g} times h_min: what the body has below a voxel is not in the "
                    "grid; resample it finer, or raise --hmin",
                    voxel, voxel / h_min));
  if (p.gap.width < 2.0 * r.layer.top())
    out.push_back(fmt::format(
        "a gap of {:.3g} near {} is narrower than the layers of both its walls, {:.3g}: they meet "
        "in its middle",
        p.gap.width, place(p.gap.place), 2.0 * r.layer.top()));
  const double mirrored = 2.0 * r.layer.level(r.sizes.mirrored_layers);
  if (p.thickness.width < mirrored)
    out.push_back(
        fmt::format("the body is {:.3g} thick near {}, less than the layers inside it, {:.3g}: elements "
                    "there see both its sides",
                    p.thickness.width, place(p.thickness.place), mirrored));
  return out;
}

Prediction fit_to_target(ResolvedCase& r, const Body& body, Progress* progress) {
  Prediction p = predict(wall_metric(body, r), progress);
  if (!r.c.target_cells) return p;
  const double target = *r.c.target_cells, h2 = r.sizes.h2, h1 = r.sizes.h1;
  constexpr double kClose = 0.03, kMostScale = 30.0;
  constexpr int kSteps = 12;
  // Below, the normal sizes of the layers would outgrow h2; above, h1 the domain.
  double low = std::log(std::max(1.0 / kMostScale, 1.01 * r.layer.h_min / h2)), high = std::log(kMostScale),
         at = 0.0;
  const double side = r.sizes.domain.size().minCoeff();
  for (int step = 0; step < kSteps && std::abs(p.cells / target - 1.0) > kClose; ++step) {
    (p.cells > target ? low : high) = at;
    at = 0.5 * (low + high);
    r.sizes.h2 = std::min(h2 * std::exp(at), side);
    r.sizes.h1 = std::clamp(h1 * std::exp(at), r.sizes.h2, std::max(r.sizes.h2, side));
    p = predict(wall_metric(body, r), progress);
  }
  r.c.h2 = r.sizes.h2;
  r.c.h1 = r.sizes.h1;
  r.c.target_cells.reset();  // a second run from the resolved case changes nothing
  r.warnings.push_back(fmt::format(
      "--target-cells {:g}: h2 {:.4g} instead of {:.4g}, h1 {:.4g} instead of {:.4g}: about {:.3g} cells{}",
      target, r.sizes.h2, h2, r.sizes.h1, h1, p.cells,
      std::abs(p.cells / target - 1.0) <= 2.0 * kClose ? ""
      : p.cells > target ? "; the layers alone need more than the target: raise --hmin or lower --layers"
                         : "; no coarser or finer is possible"));
  return p;
}

std::string plan_text(const ResolvedCase& r, const Prediction& p) {
  const BoundaryLayer& b = r.layer;
  std::string out = fmt::format(
      "Re {:g}  L {:g}  C_F {}\nh_min {:.6g}  delta {:.6g}  {} layers of growth {:g}, top at {:.6g}\n"
      "h2 {:g} in Box2 {}\nh1 {:g} in domain {}\n\n layer       height         size\n",
      b.reynolds, b.length,
      b.skin_friction > 0.0 ? fmt::format("{:.4g}", b.skin_friction) : "not used (h_min given)", b.h_min,
      b.delta, b.layers, b.growth, b.top(), r.sizes.h2, box_text(r.sizes.box2), r.sizes.h1,
      box_text(r.sizes.domain));
  for (int k = 1; k <= b.layers; ++k)
    out += fmt::format("{:>6} {:>12.6g} {:>12.6g}\n", k, b.level(k), b.h_min * std::pow(b.growth, k - 1));
  const auto row = [&](const char* name, double n) {
    out += fmt::format("{:<12}{:>14.3g} {:>6.1f} %\n", name, n, 100.0 * n / std::max(p.cells, 1.0));
  };
  const auto& cells = p.region_cells;
  out += fmt::format("\nexpected, within some 15 % of the mesh:\n{:<12}{:>14.3g}\n", "points", p.points);
  row("cells", p.cells);
  row("  in Box2", cells[0] + cells[1] + cells[2]);
  row("  in layers", cells[1]);
  row("  inside", cells[0]);
  out += fmt::format("{:<12}{:>12.3g} s on one core, {:.3g} GB\n\nmost costly:\n", "time", p.seconds(),
                     1e-9 * p.bytes());
  for (const Spot& spot : p.spots)
    out += fmt::format("{:>5.1f} % near ({:.4g}, {:.4g}, {:.4g}): {}\n",
                       100.0 * spot.cells / std::max(p.cells, 1.0), spot.place[0], spot.place[1],
                       spot.place[2], cause_text(spot.cause));
  return out;
}

std::string plan_json(const ResolvedCase& r, const Prediction& p) {
  Json layers = Json::array();
  for (int k = 1; k <= r.layer.layers; ++k)
    layers.push_back({{"layer", k},
                      {"height", r.layer.level(k)},
                      {"size", r.layer.h_min * std::pow(r.layer.growth, k - 1)}});
  const auto& cells = p.region_cells;
  Json spots = Json::array();
  for (const Spot& spot : p.spots)
    spots.push_back({{"place", {spot.place[0], spot.place[1], spot.place[2]}},
                     {"cells", spot.cells},
                     {"cause", cause_text(spot.cause)}});
  const auto passage = [](const Passage& at) {
    if (!std::isfinite(at.width)) return Json();
    return Json{{"width", at.width}, {"place", {at.place[0], at.place[1], at.place[2]}}};
  };
  return json_text({{"lamina", version()},
                    {"case", to_json(r.c)},
                    {"layer", to_json(r.layer)},
                    {"layers", layers},
                    {"sizes",
                     {{"h2", r.sizes.h2},
                      {"h1", r.sizes.h1},
                      {"box2", to_json(r.sizes.box2)},
                      {"domain", to_json(r.sizes.domain)}}},
                    {"expected",
                     {{"complexity", p.complexity},
                      {"points", p.points},
                      {"cells",
                       {{"total", p.cells},
                        {"box2", cells[0] + cells[1] + cells[2]},
                        {"layer", cells[1]},
                        {"inside", cells[0]}}}}},
                    {"seconds", p.seconds()},
                    {"bytes", p.bytes()},
                    {"most_costly", spots},
                    {"narrowest_gap", passage(p.gap)},
                    {"smallest_thickness", passage(p.thickness)},
                    {"evaluations", p.evaluations},
                    {"warnings", r.warnings}});
}

}  // namespace lamina
