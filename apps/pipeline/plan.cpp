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
//   5. A leaf beside a face of the domain that carries layers, farther than `band` from the body, stands for
//   its column normal to that face, cut at the layer levels.
#include "apps/pipeline/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "apps/pipeline/detail/json.h"
#include "core/parallel.h"

namespace lamina {
namespace {

constexpr double kNearRatio = 0.5;  // half diagonal of a leaf against its distance from the wall
constexpr int kRootCells = 6;       // of the octree, along the domain's longest side
constexpr int kRayIntervals = 14;   // on each side of the wall, within the layer

struct Leaf {
  Vec3 center;
  Vec3 half;  // half sizes
};

constexpr std::size_t kCauses = 6;

/// Complexity of a part of space by cause, and its first moment.
struct Cost {
  std::array<double, kCauses> by_cause{};
  Vec3 moment = Vec3::Zero();

  [[nodiscard]] double sum() const {
    double total = 0.0;
    for (const double c : by_cause) total += c;
    return total;
  }
  void add(const Cost& other) {
    for (std::size_t i = 0; i < kCauses; ++i) by_cause[i] += other.by_cause[i];
    moment += other.moment;
  }
};

/// What the metric asks for at a sample beyond the plain layers over a flat wall.
Cause cause_of(const WallMetric& metric, const WallSample& s) {
  const WallPoint& w = s.wall;
  if (w.feature == WallFeature::kCorner) return Cause::kCorner;
  if (w.feature == WallFeature::kEdge) return Cause::kSharpEdge;
  const double plain = 1.0 / (s.hn * s.ht1 * s.ht2);
  const bool more = s.metric.sqrt_det() > 2.0 * plain;
  const double widest = std::max(s.ht1, s.ht2);
  if (more && w.corner_distance < widest) return Cause::kCorner;
  if (more && w.edge_distance < widest) return Cause::kSharpEdge;
  if (more && w.bend_distance < widest) return Cause::kBend;
  if (more) return Cause::kOtherWall;
  return s.ht1 < 0.5 * metric.sizes().h2 ? Cause::kCurvature : Cause::kFlatWall;
}

void narrow(Passage& a, const Passage& b) {
  if (b.width < a.width) a = b;
}

using Cell = std::array<int, 3>;

/// Sums of one leaf or of many.
struct Sums {
  std::array<double, 4> complexity{};
  std::map<Cell, Cost> costs;
  Passage gap, thickness;
  std::int64_t evaluations = 0;

  void scale(double factor) {
    for (double& c : complexity) c *= factor;
    for (auto& [cell, cost] : costs) {
      for (double& c : cost.by_cause) c *= factor;
      cost.moment *= factor;
    }
  }
  friend Sums operator+(Sums a, const Sums& b) {
    for (std::size_t i = 0; i < 4; ++i) a.complexity[i] += b.complexity[i];
    for (const auto& [cell, cost] : b.costs) a.costs[cell].add(cost);
    narrow(a.gap, b.gap);
    narrow(a.thickness, b.thickness);
    a.evaluations += b.evaluations;
    return a;
  }
};

/// Adds samples of a metric to sums.
class Sampler {
 public:
  explicit Sampler(const WallMetric& metric)
      : metric_(metric), cell_(metric.wall().bounds().size().maxCoeff() / kSpotsAcross) {}

  [[nodiscard]] const WallMetric& metric() const { return metric_; }
  void add(Sums& sums, const Vec3& x, const WallSample& s, double weight) const {
    const double c = weight * s.metric.sqrt_det();
    sums.complexity[static_cast<std::size_t>(s.region)] += c;
    if (s.region == Region::kBox1 || s.region == Region::kBox2)
      return;  // far leaves are no places, they are wide
    const Eigen::Vector3i at = ((x - metric_.wall().bounds().lo) / cell_).array().floor().cast<int>();
    Cost& cost = sums.costs[{at[0], at[1], at[2]}];
    cost.by_cause[static_cast<std::size_t>(cause_of(metric_, s))] += c;
    cost.moment += c * x;
  }
  /// Looks for a wall on the other side of x.
  void look_across(Sums& sums, const Vec3& x, const WallPoint& wall) const {
    const double reach = 2.0 * metric_.layer().top();
    if (std::abs(wall.phi) > 0.5 * reach) return;
    std::array<WallPoint, 4> others;
    const int count = metric_.wall().others(x, wall, reach, others);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      constexpr double kFacing = -0.7;  // cosine between the normals
      if (others[i].N.dot(wall.N) > kFacing) continue;
      narrow(wall.phi > 0.0 ? sums.gap : sums.thickness, {(others[i].closest - wall.closest).norm(), x});
    }
  }

 private:
  static constexpr double kSpotsAcross = 8.0;
  const WallMetric& metric_;
  double cell_;
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

/// Heights between which the density is integrated: layer levels (every few of them), then growing by half up
/// to `band`.
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
double integrate_side(const Sampler& sampler, const Ray& ray, double side, const std::vector<double>& levels,
                      Sums& sums) {
  const WallMetric& metric = sampler.metric();
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
      sampler.add(sums, x, s, weight);
      volume += weight;
    }
  }
  return volume;
}

Sums integrate_ray(const Sampler& sampler, const Vec3& x, const WallPoint& wall,
                   const std::vector<double>& levels, double weight) {
  const WallMetric& metric = sampler.metric();
  Ray ray{wall.closest, wall.N, wall.feature, wall.k1, wall.k2};
  if (std::abs(wall.phi) > 1e-12 * metric.sizes().domain.diagonal())
    ray.direction = ((x - wall.closest) / wall.phi).normalized();
  if (!std::isfinite(ray.k1) || !std::isfinite(ray.k2)) ray.k1 = ray.k2 = 0.0;
  Sums sums;
  double volume = 0.0;
  const bool face = ray.feature == WallFeature::kFace;
  if (face || wall.phi > 0.0) volume += integrate_side(sampler, ray, 1.0, levels, sums);
  if (face || wall.phi <= 0.0) volume += integrate_side(sampler, ray, -1.0, levels, sums);
  if (volume <= 0.0) {  // the ray ends at once: the sample stands for itself
    sampler.add(sums, x, metric.sample(x), weight);
    ++sums.evaluations;
    return sums;
  }
  sums.scale(weight / volume);
  return sums;
}

/// The leaf's column normal to a face of the domain that carries layers, through x.
Sums integrate_column(const Sampler& sampler, const Leaf& leaf, const Vec3& x, std::size_t face) {
  const WallMetric& metric = sampler.metric();
  const int axis = static_cast<int>(face / 2);
  const Box<3>& domain = metric.sizes().domain;
  const double plane = face % 2 == 0 ? domain.lo[axis] : domain.hi[axis], out = face % 2 == 0 ? 1.0 : -1.0;
  const double near = std::max(0.0, out * (leaf.center[axis] - plane) - leaf.half[axis]);
  const double far = near + 2.0 * leaf.half[axis];
  const double weight = 8.0 * leaf.half.prod() / (far - near);
  Sums sums;
  double from = near;
  for (int k = 1; from < far; ++k) {
    const bool layered = k <= metric.layer().layers;
    const double to =
        layered ? std::min(metric.layer().level(k), far) : std::min(1.5 * from + metric.layer().h_min, far);
    if (to <= from) continue;
    Vec3 at = x;
    at[axis] = plane + out * 0.5 * (from + to);
    sampler.add(sums, at, metric.sample(at), weight * (to - from));
    ++sums.evaluations;
    from = to;
  }
  return sums;
}

/// The face of the domain with layers that a leaf touches, or 6.
std::size_t face_beside(const WallMetric& metric, const Leaf& leaf) {
  const SizeOptions& o = metric.sizes();
  for (std::size_t face = 0; face < 6; ++face) {
    const int axis = static_cast<int>(face / 2);
    const double room = face % 2 == 0 ? leaf.center[axis] - leaf.half[axis] - o.domain.lo[axis]
                                      : o.domain.hi[axis] - leaf.center[axis] - leaf.half[axis];
    if (o.walls[face] && room < 0.5 * leaf.half[axis]) return face;
  }
  return 6;
}

Sums integrate_leaf(const Sampler& sampler, const Leaf& leaf, std::size_t index,
                    const std::vector<double>& levels) {
  const Vec3 offset(uniform(index, 0), uniform(index, 1), uniform(index, 2));
  const Vec3 x = leaf.center + leaf.half.cwiseProduct(2.0 * offset - Vec3::Ones());
  const double weight = 8.0 * leaf.half.prod();
  const WallSample s = sampler.metric().sample(x);
  Sums sums;
  const std::size_t face = face_beside(sampler.metric(), leaf);
  if (std::abs(s.wall.phi) < levels.back())
    sums = integrate_ray(sampler, x, s.wall, levels, weight);
  else if (face < 6)
    sums = integrate_column(sampler, leaf, x, face);
  else
    sampler.add(sums, x, s, weight);
  ++sums.evaluations;
  sampler.look_across(sums, x, s.wall);
  return sums;
}

std::vector<Spot> costly_spots(const std::map<Cell, Cost>& costs) {
  std::vector<Spot> spots;
  for (const auto& [cell, cost] : costs) {
    const double sum = cost.sum();
    if (!(sum > 0.0)) continue;
    const auto most = std::max_element(cost.by_cause.begin(), cost.by_cause.end()) - cost.by_cause.begin();
    spots.push_back({cost.moment / sum, static_cast<Cause>(most), kCellsPerComplexity * sum});
  }
  constexpr std::size_t kShown = 5;
  std::stable_sort(spots.begin(), spots.end(),
                   [](const Spot& a, const Spot& b) { return a.cells > b.cells; });
  if (spots.size() > kShown) spots.resize(kShown);
  return spots;
}

}  // namespace

Prediction predict(const WallMetric& metric, Progress* progress, double leaves_across) {
  const double smallest = metric.wall().bounds().size().maxCoeff() / leaves_across;
  const double band = 0.5 * smallest;
  const std::vector<Leaf> leaves = octree(metric, smallest, progress);
  const std::vector<double> levels = ray_levels(metric.layer(), band);
  const Sampler sampler(metric);
  const Sums sums = reduce(
      leaves.size(), Sums(),
      [&](std::size_t begin, std::size_t end) {
        Sums part;
        if (progress != nullptr) progress->check_cancelled();
        for (std::size_t i = begin; i < end; ++i) part = part + integrate_leaf(sampler, leaves[i], i, levels);
        return part;
      },
      [](const Sums& x, const Sums& y) { return x + y; }, 32);
  Prediction p;
  for (std::size_t i = 0; i < 4; ++i) {
    p.complexity += sums.complexity[i];
    p.region_cells[i] = kCellsPerComplexity * sums.complexity[i];
  }
  p.cells = kCellsPerComplexity * p.complexity;
  p.points = kPointsPerComplexity * p.complexity;
  p.spots = costly_spots(sums.costs);
  p.gap = sums.gap;
  p.thickness = sums.thickness;
  p.evaluations = sums.evaluations;
  return p;
}

const char* cause_text(Cause cause) {
  constexpr std::array<const char*, kCauses> kTexts = {"layers over a flat wall",
                                                       "curvature",
                                                       "the border of a bend",
                                                       "a sharp edge",
                                                       "a corner",
                                                       "another wall"};
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
  if (body.from_vdb && voxel > kFineVoxel * h_min)
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
