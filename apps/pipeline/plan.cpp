// The density sqrt(det M) spans ten orders of magnitude within a layer that is thinner than any affordable
// sampling of space, so space is sampled coarsely and the neighbourhood of the wall along rays:
//   1. An octree over the domain, refined until a cell is small against its distance from the wall, or `band`
//   small.
//   2. One jittered sample x per leaf, of weight w = the leaf's volume.
//   3. A sample farther than `band` from the wall counts with w sqrt(det M)(x).
//   4. A nearer one stands for its wall-normal ray: its share of the wall is w / (integral of J over the
//   ray), where
//      J(t) is the volume swept at height t, (1 + k1 t)(1 + k2 t) above a face, t above a sharp edge, t^2
//      above a corner. The density is integrated along the ray by Gauss points between layer levels. The ray
//      ends where another part of the wall is nearer. This is unbiased whatever the wall's shape.
#include "apps/pipeline/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "apps/pipeline/detail/json.h"
#include "core/parallel.h"

namespace lamina {
namespace {

constexpr double kLeavesAcross = 24.0;  // wall leaves along the body's longest extent
constexpr double kNearRatio = 0.5;      // half diagonal of a leaf against its distance from the wall
constexpr int kRootCells = 6;           // of the octree, along the domain's longest side
constexpr int kRayIntervals = 14;       // on each side of the wall, within the layer

struct Leaf {
  Vec3 center;
  Vec3 half;  // half sizes
};

/// Sums of one leaf or of many.
struct Sums {
  std::array<double, 4> complexity{};
  std::int64_t evaluations = 0;

  void add(const WallSample& s, double weight) {
    complexity[static_cast<std::size_t>(s.region)] += weight * s.metric.sqrt_det();
    ++evaluations;
  }
  friend Sums operator+(Sums a, const Sums& b) {
    for (std::size_t i = 0; i < 4; ++i) a.complexity[i] += b.complexity[i];
    a.evaluations += b.evaluations;
    return a;
  }
};

/// Uniform in [0, 1), a function of its arguments alone (splitmix64).
double uniform(std::uint64_t id, std::uint64_t axis) {
  std::uint64_t z = (3 * id + axis + 1) * 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

std::vector<Leaf> roots(const Box<3>& domain) {
  const Vec3 size = domain.size();
  const double target = size.maxCoeff() / kRootCells;
  const Eigen::Vector3i n = (size / target).array().ceil().max(1.0).cast<int>();
  const Vec3 cell = size.array() / n.cast<double>().array();
  std::vector<Leaf> out;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i)
        out.push_back({domain.lo + cell.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5)), 0.5 * cell});
  return out;
}

std::vector<Leaf> octree(const WallMetric& metric, double smallest, const Progress* progress) {
  std::vector<Leaf> leaves, level = roots(metric.sizes().domain);
  while (!level.empty()) {
    if (progress != nullptr) progress->check_cancelled();
    std::vector<char> split(level.size());
    for_each_index(
        level.size(),
        [&](std::size_t i) {
          const double radius = level[i].half.norm();
          const double distance = std::abs(metric.wall().phi(level[i].center));
          split[i] = 2.0 * level[i].half.maxCoeff() > smallest && radius > kNearRatio * distance ? 1 : 0;
        },
        64);
    std::vector<Leaf> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      if (split[i] == 0) {
        leaves.push_back(level[i]);
        continue;
      }
      const Vec3 half = 0.5 * level[i].half;
      for (int child = 0; child < 8; ++child)
        next.push_back(
            {level[i].center + half.cwiseProduct(Vec3((child & 1) != 0 ? 1 : -1, (child & 2) != 0 ? 1 : -1,
                                                      (child & 4) != 0 ? 1 : -1)),
             half});
    }
    level = std::move(next);
  }
  return leaves;
}

/// Heights between which the density is integrated: layer levels (every few of them), then doubling up to
/// `band`.
std::vector<double> ray_levels(const BoundaryLayer& layer, double band) {
  std::vector<double> t{0.0};
  const int stride = (layer.layers + kRayIntervals - 1) / kRayIntervals;
  for (int k = stride; k <= layer.layers && layer.level(k) < band; k += stride) t.push_back(layer.level(k));
  double step = std::max(t.size() > 1 ? t.back() - t[t.size() - 2] : layer.h_min, 1e-3 * band);
  while (t.back() + 1.5 * step < band) {
    t.push_back(t.back() + step);
    step *= 1.5;
  }
  t.push_back(band);
  return t;
}

struct Ray {
  Vec3 foot, direction;  // direction into the fluid
  WallFeature feature;
  double k1, k2;

  [[nodiscard]] double swept(double t) const {
    if (feature == WallFeature::kEdge) return std::abs(t);
    if (feature == WallFeature::kCorner) return t * t;
    return std::max(0.0, (1.0 + k1 * t) * (1.0 + k2 * t));
  }
};

/// One side (+1 fluid, -1 body) of a ray: adds density and swept volume; returns the latter.
double integrate_side(const WallMetric& metric, const Ray& ray, double side,
                      const std::vector<double>& levels, Sums& sums) {
  constexpr double kGauss = 0.21132486540518713;  // abscissae of the two-point rule on [0, 1]
  constexpr double kSameFoot = 0.03;  // relative error of the distance that still means the same foot
  double volume = 0.0;
  for (std::size_t j = 0; j + 1 < levels.size(); ++j) {
    const double length = levels[j + 1] - levels[j];
    for (const double at : {kGauss, 1.0 - kGauss}) {
      const double t = side * (levels[j] + at * length);
      const Vec3 x = ray.foot + t * ray.direction;
      const double weight = 0.5 * length * ray.swept(t);
      if (!metric.sizes().domain.contains(x)) {
        volume += weight;
        continue;
      }
      const WallSample s = metric.sample(x);
      ++sums.evaluations;
      if (std::abs(s.wall.phi - t) > kSameFoot * std::abs(t)) return volume;
      sums.complexity[static_cast<std::size_t>(s.region)] += weight * s.metric.sqrt_det();
      volume += weight;
    }
  }
  return volume;
}

Sums integrate_ray(const WallMetric& metric, const Vec3& x, const WallPoint& wall,
                   const std::vector<double>& levels, double weight) {
  Ray ray{wall.closest, wall.N, wall.feature, wall.k1, wall.k2};
  if (std::abs(wall.phi) > 1e-12 * metric.sizes().domain.diagonal())
    ray.direction = ((x - wall.closest) / wall.phi).normalized();
  if (!std::isfinite(ray.k1) || !std::isfinite(ray.k2)) ray.k1 = ray.k2 = 0.0;
  Sums sums;
  double volume = 0.0;
  const bool face = ray.feature == WallFeature::kFace;
  if (face || wall.phi > 0.0) volume += integrate_side(metric, ray, 1.0, levels, sums);
  if (face || wall.phi <= 0.0) volume += integrate_side(metric, ray, -1.0, levels, sums);
  if (volume <= 0.0) {  // the ray ends at once: the sample stands for itself
    sums.add(metric.sample(x), weight);
    return sums;
  }
  for (double& c : sums.complexity) c *= weight / volume;
  return sums;
}

}  // namespace

Prediction predict(const WallMetric& metric, Progress* progress) {
  const double smallest = metric.wall().bounds().size().maxCoeff() / kLeavesAcross;
  const double band = 0.5 * smallest;
  const std::vector<Leaf> leaves = octree(metric, smallest, progress);
  const std::vector<double> levels = ray_levels(metric.layer(), band);
  const Sums sums = reduce(
      leaves.size(), Sums(),
      [&](std::size_t begin, std::size_t end) {
        Sums part;
        if (progress != nullptr) progress->check_cancelled();
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3 offset(uniform(i, 0), uniform(i, 1), uniform(i, 2));
          const Vec3 x = leaves[i].center + leaves[i].half.cwiseProduct(2.0 * offset - Vec3::Ones());
          const double weight = 8.0 * leaves[i].half.prod();
          const WallSample s = metric.sample(x);
          if (std::abs(s.wall.phi) < band)
            part = part + integrate_ray(metric, x, s.wall, levels, weight);
          else
            part.add(s, weight);
        }
        return part;
      },
      [](const Sums& a, const Sums& b) { return a + b; }, 32);
  Prediction p;
  for (std::size_t i = 0; i < 4; ++i) {
    p.complexity += sums.complexity[i];
    p.region_cells[i] = kCellsPerComplexity * sums.complexity[i];
  }
  p.cells = kCellsPerComplexity * p.complexity;
  p.points = kPointsPerComplexity * p.complexity;
  p.evaluations = sums.evaluations;
  return p;
}

std::string plan_text(const ResolvedCase& r, const Prediction& p) {
  const BoundaryLayer& b = r.layer;
  const auto box = [](const Box<3>& x) {
    return fmt::format("{:g} {:g} {:g}  {:g} {:g} {:g}", x.lo[0], x.lo[1], x.lo[2], x.hi[0], x.hi[1],
                       x.hi[2]);
  };
  std::string out = fmt::format(
      "Re {:g}  L {:g}  C_F {}\nh_min {:.6g}  delta {:.6g}  {} layers of growth {:g}, top at {:.6g}\n"
      "h2 {:g} in Box2 {}\nh1 {:g} in domain {}\n\n layer       height         size\n",
      b.reynolds, b.length,
      b.skin_friction > 0.0 ? fmt::format("{:.4g}", b.skin_friction) : "not used (h_min given)", b.h_min,
      b.delta, b.layers, b.growth, b.top(), r.sizes.h2, box(r.sizes.box2), r.sizes.h1, box(r.sizes.domain));
  for (int k = 1; k <= b.layers; ++k)
    out += fmt::format("{:>6} {:>12.6g} {:>12.6g}\n", k, b.level(k), b.h_min * std::pow(b.growth, k - 1));
  const auto row = [&](const char* name, double n) {
    out += fmt::format("{:<12}{:>14.3g} {:>6.1f} %\n", name, n, 100.0 * n / std::max(p.cells, 1.0));
  };
  const auto& cells = p.region_cells;
  out += fmt::format("\nexpected, within some 20 % of a mesh of unit edges:\n{:<12}{:>14.3g}\n", "points",
                     p.points);
  row("cells", p.cells);
  row("  in Box2", cells[0] + cells[1] + cells[2]);
  row("  in layers", cells[1]);
  row("  inside", cells[0]);
  return out;
}

std::string plan_json(const ResolvedCase& r, const Prediction& p) {
  Json layers = Json::array();
  for (int k = 1; k <= r.layer.layers; ++k)
    layers.push_back({{"layer", k},
                      {"height", r.layer.level(k)},
                      {"size", r.layer.h_min * std::pow(r.layer.growth, k - 1)}});
  const auto& cells = p.region_cells;
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
                    {"evaluations", p.evaluations},
                    {"warnings", r.warnings}});
}

}  // namespace lamina
