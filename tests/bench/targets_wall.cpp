// B1 to B5: normals, curvatures and directions against formulas. C1: the levels of layers.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/bench/target_bodies.h"
#include "tests/bench/targets.h"

namespace lamina::targets {
namespace {

constexpr double kHmin = 1e-5, kH2 = 0.1;  // of L, for what counts as flat
constexpr double kFlat = 2.0 * kHmin / (kH2 * kH2);
constexpr double kTilt = 1e-3;  // degrees
constexpr double kClear = 5.0;  // voxels a plane face is judged away from its end

struct Errors {
  std::vector<double> normal, curvature, direction;  // degrees, % of the larger curvature, degrees
  std::size_t bad = 0;                               // not finite
  std::string where;                                 // of the largest error of curvature
  double worst = -1.0;
};

double degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

Errors measure(const Body& body, const LevelSet& ls, std::size_t n) {
  Errors e;
  WallSampler wall(body.surface, 11);
  const double L = body.surface.bounds().size().maxCoeff();
  for (std::size_t i = 0; i < n; ++i) {
    const WallSampler::Sample s = wall.next();
    const std::optional<Truth> truth = body.truth(s.q, s.normal);
    if (!truth) continue;
    const WallPoint w = ls.at(s.q + 1e-4 * L * s.normal);
    const auto finite = [&](const Vec3& v) { return v.allFinite(); };
    if (!finite(w.N) || !finite(w.T1) || !std::isfinite(w.k1) || !std::isfinite(w.k2)) {
      ++e.bad;
      continue;
    }
    e.normal.push_back(degrees_between(w.N, truth->N));
    const double most = std::max(std::abs(truth->k1), std::abs(truth->k2));
    const auto [low, high] = std::minmax(w.k1, w.k2);
    const auto [true_low, true_high] = std::minmax(truth->k1, truth->k2);
    const double off = 100.0 * std::max(std::abs(low - true_low), std::abs(high - true_high)) / most;
    e.curvature.push_back(off);
    if (off > e.worst) {
      e.worst = off;
      e.where = fmt::format("max {:.3g} % at ({:.3g}, {:.3g}, {:.3g})", off, s.q[0], s.q[1], s.q[2]);
    }
    if (std::abs(truth->k1 - truth->k2) > 0.1 * most && !truth->T1.isZero()) {
      const double angle = degrees_between(w.T1, truth->T1);
      e.direction.push_back(std::min(angle, 180.0 - angle));
    }
  }
  return e;
}

void report(Table& table, const Body& body, const Errors& e, double normal_p99, double median, double p99) {
  if (normal_p99 > 0.0)
    table.at_most("B1", body.name + ": normal, p99", quantile(e.normal, 0.99), normal_p99, " deg",
                  fmt::format("median {:.2g}", quantile(e.normal, 0.5)));
  if (median > 0.0)
    table.at_most("B2", body.name + ": curvature, median", quantile(e.curvature, 0.5), median, " %");
  if (p99 > 0.0)
    table.at_most("B2", body.name + ": curvature, p99", quantile(e.curvature, 0.99), p99, " %", e.where);
}

// Largest curvature and normal error on plane faces, away from their ends.
struct Flats {
  double curvature = 0.0, normal = 0.0;
  std::size_t points = 0, bent = 0, tilted = 0;  // of all points: with a curvature or normal beyond the bar
  Vec3 worst = Vec3::Zero();                     // where the curvature is largest
};
template <class Margin>
Flats flats(const Surface& s, const LevelSet& ls, std::size_t n, Margin&& margin) {
  Flats f;
  WallSampler wall(s, 12);
  const double L = s.bounds().size().maxCoeff();
  for (std::size_t i = 0; i < n; ++i) {
    const WallSampler::Sample at = wall.next();
    if (margin(at.q, at.normal) < kClear * ls.report().voxel) continue;
    ++f.points;
    const WallPoint w = ls.at(at.q + 1e-4 * L * at.normal);
    const double k = std::abs(w.k1) * L, tilt = degrees_between(w.N, at.normal);
    f.bent += k > kFlat;
    f.tilted += tilt > kTilt;
    if (k > f.curvature) f.worst = at.q;
    f.curvature = std::max(f.curvature, k);
    f.normal = std::max(f.normal, tilt);
  }
  return f;
}

void report_flats(Table& table, const std::string& name, const Flats& f, bool normals) {
  if (normals)
    table.at_most("B1", name + ": normal on plane faces, max", f.normal, kTilt, " deg",
                  fmt::format("{} of {} points beyond", f.tilted, f.points));
  table.at_most("B3", name + ": |k| on plane faces, max", f.curvature, kFlat, " / L",
                fmt::format("{} of {} beyond, worst at ({:.3g}, {:.3g}, {:.3g})", f.bent, f.points,
                            f.worst[0], f.worst[1], f.worst[2]));
}

// Levels x_k = q + H_k n over points q inside facets of a body without concave parts in reach.
void layer_rows(Table& table, const Body& body, const LevelSet& ls) {
  const double L = body.surface.bounds().size().maxCoeff();
  WallSampler wall(body.surface, 13);
  double level = 0.0, frame = 0.0;
  for (std::size_t i = 0; i < table.count(2000, 200); ++i) {
    const WallSampler::Sample s = wall.next();
    if (!body.truth(s.q, s.normal)) continue;
    std::optional<WallPoint> first;
    double height = 0.0, step = kHmin * L;
    for (int k = 0; k < 20; ++k, step *= 1.2) {
      height += step;
      const WallPoint w = ls.at(s.q + height * s.normal);
      level = std::max(level, std::abs(w.phi - height) / L);
      if (!first) first = w;
      frame = std::max({frame, (w.N - first->N).norm(),
                        std::abs(w.k1 - first->k1) * L / (1.0 + std::abs(w.k1) * L),
                        std::abs(w.k2 - first->k2) * L / (1.0 + std::abs(w.k2) * L)});
    }
  }
  table.at_most("C1", body.name + ": |phi(x_k) - H_k| of 20 layers", level, 1e-12, " L");
  table.at_most("C1", body.name + ": change of N, k1, k2 along a ray", frame, 1e-8, "");
}

}  // namespace

void wall_rows(Table& table) {
  struct Bars {
    Body body;
    double normal, median, p99;
    bool directions, layers;
  };
  const Bars all[] = {
      {sphere_body(16), 0.1, 0.5, 2.0, false, true},     {sphere_body(6), 0.0, 2.0, 3.0, false, false},
      {cylinder_body(100), 0.05, 0.3, 1.0, true, false}, {torus_body(), 0.15, 0.5, 1.5, true, false},
      {ellipsoid_body(), 0.0, 1.0, 5.0, false, true},    {round_cube_body(), 0.0, 0.0, 1.0, true, false},
      {naca_body(), 0.7, 0.5, 10.0, false, true}};
  const std::size_t n = table.count(40000, 4000);
  std::size_t bad = 0, asked = 0;
  for (const Bars& bars : all) {
    const LevelSet ls = LevelSet::from_surface(bars.body.surface, {});
    const Errors e = measure(bars.body, ls, n);
    bad += e.bad;
    asked += e.curvature.size() + e.bad;
    report(table, bars.body, e, bars.normal, bars.median, bars.p99);
    if (bars.directions)
      table.at_most("B4", bars.body.name + ": principal direction, p95", quantile(e.direction, 0.95), 1.0,
                    " deg", fmt::format("{} points", e.direction.size()));
    if (bars.layers) layer_rows(table, bars.body, ls);
    if (bars.body.name.starts_with("round cube"))
      report_flats(
          table, bars.body.name,
          flats(bars.body.surface, ls, n, [](const Vec3& q, const Vec3&) { return round_cube_margin(q); }),
          true);
  }
  table.row("B2", "curvatures and frames that are not finite", "0", fmt::format("{} of {}", bad, asked),
            bad == 0);
  const Surface ahmed = shape("ahmed"), cube = shape("cube");
  report_flats(table, "ahmed", flats(ahmed, LevelSet::from_surface(ahmed, {}), n, ahmed_margin), true);
  report_flats(table, "cube",
               flats(cube, LevelSet::from_surface(cube, {}), n,
                     [](const Vec3& q, const Vec3&) { return cube_margin(q); }),
               false);
  const Body noisy = noisy_torus_body();
  const Errors e = measure(noisy, LevelSet::from_surface(noisy.surface, {}), n);
  table.at_most("B5", noisy.name + ": curvature, median", quantile(e.curvature, 0.5), 3.0, " %",
                fmt::format("p99 {:.3g}", quantile(e.curvature, 0.99)));
  table.at_most("B5", noisy.name + ": normal, p99", quantile(e.normal, 0.99), 1.0, " deg");
}

}  // namespace lamina::targets
