// The density sqrt(det M) spans ten orders of magnitude within a layer that is thinner than any affordable
// sampling of space, so space is sampled coarsely and the neighbourhood of the wall along rays:
//   1. An octree over the domain, refined until a cell is small against its distance from the wall, or `band`
//   small.
//   2. One sample x per leaf, of weight w = the leaf's volume. Beside an edge or a corner the density on the
//   wall grows as 1 / r or 1 / r^2 down to h_min, and every octave of r counts the same: a uniform x would
//   hardly ever find the inner ones, and when it does stand for as many cells as the whole body. There x is
//   found by drawing octants, see choose(), and w divided by the probability of what was drawn.
//   3. A sample farther than `band` from the wall counts with w sqrt(det M)(x).
//   4. A nearer one stands for its wall-normal ray: its share of the wall is w / (integral of J over the
//   ray), where J(t) is the volume swept at height t, (1 + k1 t)(1 + k2 t) above a face, t above a sharp
//   edge, t^2 above a corner. The density is integrated along the ray by a random point between each two
//   layer levels, all of which have the wall point of x; of kDrawn intervals in a row one is drawn for all of
//   them. The ray ends where another part of the wall is nearer. This is unbiased whatever the wall's shape.
//   5. A leaf beside a face of the domain that carries layers, farther than `band` from the body, stands for
//   its column normal to that face, cut at the layer levels.
//   6. At one point in eight the excess of a unit edge is measured, see Sums::excess().
#include "apps/pipeline/detail/quadrature.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "core/planar.h"

namespace lamina::detail {
namespace {

constexpr double kNearRatio = 0.5;  // half diagonal of a leaf against its distance from the wall
constexpr int kRootCells = 6;       // of the octree, along the domain's longest side
constexpr int kRayIntervals = 6;    // on each side of the wall, within the layer
constexpr std::size_t kDrawn = 2;   // intervals of which one is looked at

template <int D>
struct Leaf {
  Vec<D> center;
  Vec<D> half;  // half sizes

  [[nodiscard]] double volume() const { return (2.0 * half).prod(); }
};

/// sqrt(det M) of the section that is meshed.
template <int D>
double density(const WallSample& s) {
  return section<D>(s.metric).sqrt_det();
}

/// Is it the curve of the edge beside a sample that sizes along the edge resolve?
bool edge_is_curved(const WallMetric& metric, const WallSample& s) {
  const WallPoint& w = s.wall;
  const double rate = std::log(metric.sizes().edge_growth);
  const double across = w.feature == WallFeature::kEdge ? s.ht1 : s.hn + rate * w.edge_distance;
  const double straight = std::min(metric.sizes().h2, across + rate * w.corner_distance);
  return 2.0 * across < 0.25 * w.edge_curvature * straight * straight;  // chord below half of it
}

/// What the metric asks for at a sample beyond the plain layers over a flat wall.
template <int D>
Cause cause_of(const WallMetric& metric, const WallSample& s) {
  const WallPoint& w = s.wall;
  if (w.feature == WallFeature::kCorner) return Cause::kCorner;
  const Cause edge = edge_is_curved(metric, s) ? Cause::kCurvedEdge : Cause::kSharpEdge;
  if (w.feature == WallFeature::kEdge) return edge;
  const double plain = 1.0 / (s.hn * s.ht1 * (D == 3 ? s.ht2 : 1.0));
  const bool more = density<D>(s) > 2.0 * plain;
  const double widest = std::max(s.ht1, s.ht2);
  if (more && w.corner_distance < widest) return Cause::kCorner;
  if (more && w.edge_distance < widest) return edge;
  if (more && w.bend_distance < widest) return Cause::kBend;
  if (more) return Cause::kOtherWall;
  return s.ht1 < 0.5 * metric.sizes().h2 ? Cause::kCurvature : Cause::kFlatWall;
}

/// Uniform in [0, 1), a function of its arguments alone (splitmix64).
double uniform(std::uint64_t id, std::uint64_t axis) {
  std::uint64_t z = (3 * id + axis + 1) * 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// A number that hardly two points share.
std::uint64_t point_id(const Vec3& x) {
  std::uint64_t id = 0;
  for (int i = 0; i < 3; ++i) id = (id ^ std::bit_cast<std::uint64_t>(x[i])) * 0xff51afd7ed558ccdull;
  return id ^ (id >> 32);
}

/// A direction, uniform on the sphere or circle, a function of the point alone.
template <int D>
Vec<D> direction_at(const Vec3& x) {
  const std::uint64_t id = point_id(x);
  if constexpr (D == 2) {
    const double angle = 2.0 * std::numbers::pi * uniform(id, 1);
    return {std::cos(angle), std::sin(angle)};
  }
  const double z = 2.0 * uniform(id, 0) - 1.0, angle = 2.0 * std::numbers::pi * uniform(id, 1);
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return Vec3(r * std::cos(angle), r * std::sin(angle), z).head<D>();
}

/// Adds samples of a metric to sums.
template <int D>
class Sampler {
 public:
  explicit Sampler(const WallMetric& metric)
      : metric_(metric), cell_(metric.wall().bounds().size().maxCoeff() / kSpotsAcross) {}

  [[nodiscard]] const WallMetric& metric() const { return metric_; }
  void add(Sums& sums, const Vec3& x, const WallSample& s, double weight) const {
    const double c = weight * density<D>(s);
    const auto region = static_cast<std::size_t>(s.region);
    ++sums.evaluations;
    sums.complexity[region] += c;
    if (uniform(point_id(x), 2) < kMeasuredShare) measure_edge(sums, region, x, s.metric, c);
    if (s.region == Region::kBox1 || s.region == Region::kBox2)
      return;  // far leaves are no places, they are wide
    const Eigen::Vector3i at = ((x - metric_.wall().bounds().lo) / cell_).array().floor().cast<int>();
    Cost& cost = sums.costs[{at[0], at[1], at[2]}];
    cost.by_cause[static_cast<std::size_t>(cause_of<D>(metric_, s))] += c;
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
  static constexpr double kMeasuredShare = 0.125;

  /// The edge in a random direction whose middle is x and whose length there is 1.
  void measure_edge(Sums& sums, std::size_t region, const Vec3& x, const Metric<3>& m, double weight) const {
    const Vec<D> edge =
        section<D>(m).factor().template triangularView<Eigen::Upper>().solve(direction_at<D>(x));
    const Vec3 a = x - 0.5 * in_space<D>(edge), b = x + 0.5 * in_space<D>(edge);
    const Box<3>& domain = metric_.sizes().domain;
    if (!domain.contains(a) || !domain.contains(b)) return;
    sums.evaluations += 2;
    sums.measured[region] += weight;
    sums.log_length[region] += weight * std::log(edge_length(a, metric_.at(a), b, metric_.at(b)));
  }

  const WallMetric& metric_;
  double cell_;
};

template <int D>
std::vector<Leaf<D>> roots(const Box<D>& domain) {
  const Vec<D> size = domain.size();
  const double target = size.maxCoeff() / kRootCells;
  const Eigen::Matrix<int, D, 1> n = (size / target).array().ceil().max(1.0).template cast<int>();
  const Vec<D> cell = size.array() / n.template cast<double>().array();
  std::vector<Leaf<D>> out;
  for (int id = 0; id < n.prod(); ++id) {
    Vec<D> at;
    for (int i = 0, rest = id; i < D; rest /= n[i++]) at[i] = rest % n[i] + 0.5;
    out.push_back({domain.lo + cell.cwiseProduct(at), 0.5 * cell});
  }
  return out;
}

/// Half of it in every direction, by the bits of `child` in [0, 2^D).
template <int D>
Leaf<D> octant(const Leaf<D>& leaf, int child) {
  const Vec<D> half = 0.5 * leaf.half;
  Vec<D> sign;
  for (int i = 0; i < D; ++i) sign[i] = (child >> i & 1) != 0 ? 1.0 : -1.0;
  return {leaf.center + half.cwiseProduct(sign), half};
}

template <int D>
std::vector<Leaf<D>> octree(const WallMetric& metric, double smallest, const Progress* progress) {
  std::vector<Leaf<D>> leaves, level = roots<D>(section<D>(metric.sizes().domain));
  while (!level.empty()) {
    if (progress != nullptr) progress->check_cancelled();
    std::vector<char> split(level.size());
    for_each_index(
        level.size(),
        [&](std::size_t i) {
          const double radius = level[i].half.norm();
          const double distance = metric.wall().distance(in_space<D>(level[i].center), 0.0);
          split[i] = 2.0 * level[i].half.maxCoeff() > smallest && radius > kNearRatio * distance ? 1 : 0;
        },
        64);
    std::vector<Leaf<D>> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      if (split[i] == 0) {
        leaves.push_back(level[i]);
        continue;
      }
      for (int child = 0; child < 1 << D; ++child) next.push_back(octant<D>(level[i], child));
    }
    level = std::move(next);
  }
  return leaves;
}

/// Heights between which the density is integrated: layer levels (every few of them), then growing by kGrow
/// up to `band`.
std::vector<double> ray_levels(const BoundaryLayer& layer, double band) {
  std::vector<double> t{0.0};
  const int stride = (layer.layers + kRayIntervals - 1) / kRayIntervals;
  for (int k = stride; k <= layer.layers && layer.level(k) < band; k += stride) t.push_back(layer.level(k));
  double step = std::max(t.size() > 1 ? t.back() - t[t.size() - 2] : layer.h_min, 1e-3 * band);
  constexpr double kGrow = 2.0;
  while (t.back() + kGrow * step < band) {
    t.push_back(t.back() + step);
    step *= kGrow;
  }
  t.push_back(band);
  return t;
}

template <int D>
struct Ray {
  WallPoint wall;  ///< of the point that the ray was drawn for
  Vec3 direction;  ///< into the fluid
  std::uint64_t id;
  WallFeature foot;  ///< what the foot lies on

  [[nodiscard]] Vec3 at(double t) const { return wall.closest + t * direction; }
  /// The drawn point has its foot here, so that the wall's centre of curvature is not between: an estimate
  /// that says so is none.
  [[nodiscard]] double curvature(double k) const {
    return std::isfinite(k) && 1.0 + k * wall.phi > 0.0 ? k : 0.0;
  }
  [[nodiscard]] double swept(double t) const {
    if (foot == WallFeature::kEdge) return std::abs(t);
    if (foot == WallFeature::kCorner) return t * t;
    return std::max(0.0, (1.0 + curvature(wall.k1) * t) * (D == 3 ? 1.0 + curvature(wall.k2) * t : 1.0));
  }
};

/// What the closest point lies on. WallPoint::feature tells edges and corners that stand out towards x only;
/// but where edges of both kinds meet, or more than two facets, rays fan out from others as well.
WallFeature foot_of(const WallPoint& wall, double tiny) {
  if (wall.feature != WallFeature::kFace) return wall.feature;
  if (wall.corner_distance <= tiny) return WallFeature::kCorner;
  return wall.edge_distance <= tiny ? WallFeature::kEdge : WallFeature::kFace;
}

/// Is a distance that of a foot at a height t?
bool same_foot(double distance, double t) {
  constexpr double kSameFoot = 0.03;  // relative error
  return std::abs(distance - std::abs(t)) <= kSameFoot * std::abs(t);
}

/// One side (+1 fluid, -1 body) of a ray: adds density and swept volume; returns the latter. All of the ray
/// has the wall point of the foot, so that only distances are looked up on the way.
template <int D>
double integrate_side(const Sampler<D>& sampler, const Ray<D>& ray, double side,
                      const std::vector<double>& levels, Sums& sums) {
  const WallMetric& metric = sampler.metric();
  const bool drawn_here = side * ray.wall.phi > 0.0;
  double volume = 0.0;
  for (std::size_t j = 0; j + 1 < levels.size(); ++j) {
    const double length = levels[j + 1] - levels[j];
    const double t = side * (levels[j] + uniform(ray.id + j, side > 0.0 ? 0 : 1) * length);
    const Vec3 x = ray.at(t);
    // The other side of the wall may be no other side: of a sheet, or within another part of the body.
    if (j == 0 && !drawn_here) {
      const double phi = metric.wall().phi(x);
      if (!(phi * side >= 0.0 && same_foot(std::abs(phi), t))) return volume;
    }
    const double weight = length * ray.swept(t);
    if (!metric.sizes().domain.contains(x)) {
      volume += weight;
      continue;
    }
    // Below the point that the ray was drawn for, a difference of the feet is rounding.
    if (side * t > side * ray.wall.phi && !same_foot(metric.wall().distance(x, 0.0), t)) return volume;
    volume += weight;
    const std::size_t first = j - j % kDrawn, row = std::min(kDrawn, levels.size() - 1 - first);
    const double drawn = uniform(~ray.id + first, side > 0.0 ? 0 : 1) * static_cast<double>(row);
    if (static_cast<std::size_t>(drawn) != j - first) continue;
    WallPoint wall = ray.wall;
    wall.phi = t;
    sampler.add(sums, x, metric.sample(x, wall), static_cast<double>(row) * weight);
  }
  return volume;
}

template <int D>
Sums integrate_ray(const Sampler<D>& sampler, const Vec3& x, const WallPoint& wall,
                   const std::vector<double>& levels, double weight) {
  const WallMetric& metric = sampler.metric();
  constexpr double kTiny = 1e-9;  // of the body
  Ray<D> ray{wall, wall.N, point_id(x), foot_of(wall, kTiny * metric.wall().bounds().diagonal())};
  if (std::abs(wall.phi) > 1e-12 * section<D>(metric.sizes().domain).diagonal())
    ray.direction = ((x - wall.closest) / wall.phi).normalized();
  Sums sums;
  double volume = 0.0;
  const bool face = ray.foot == WallFeature::kFace;
  if (face || wall.phi > 0.0) volume += integrate_side<D>(sampler, ray, 1.0, levels, sums);
  if (face || wall.phi <= 0.0) volume += integrate_side<D>(sampler, ray, -1.0, levels, sums);
  if (volume <= 0.0) {  // the ray ends at once: the sample stands for itself
    sampler.add(sums, x, metric.sample(x), weight);
    return sums;
  }
  sums.scale(weight / volume);
  return sums;
}

/// The leaf's column normal to a face of the domain that carries layers, through x.
template <int D>
Sums integrate_column(const Sampler<D>& sampler, const Leaf<D>& leaf, const Vec3& x, std::size_t face) {
  const WallMetric& metric = sampler.metric();
  const auto [axis, plane, inward] = domain_face(metric.sizes().domain, face);
  const double near = std::max(0.0, inward * (leaf.center[axis] - plane) - leaf.half[axis]);
  const double far = near + 2.0 * leaf.half[axis];
  const double weight = leaf.volume() / (far - near);
  Sums sums;
  double from = near;
  for (int k = 1; from < far; ++k) {
    const bool layered = k <= metric.layer().layers;
    const double to =
        layered ? std::min(metric.layer().level(k), far) : std::min(1.5 * from + metric.layer().h_min, far);
    if (to <= from) continue;
    Vec3 at = x;
    at[axis] = plane + inward * 0.5 * (from + to);
    sampler.add(sums, at, metric.sample(at), weight * (to - from));
    from = to;
  }
  return sums;
}

/// The face of the domain with layers that a leaf touches, or 6.
template <int D>
std::size_t face_beside(const WallMetric& metric, const Leaf<D>& leaf) {
  const SizeOptions& o = metric.sizes();
  for (std::size_t face = 0; face < std::size_t{2 * D}; ++face) {
    const auto [axis, plane, inward] = domain_face(o.domain, face);
    const double room = inward * (leaf.center[axis] - plane) - leaf.half[axis];
    if (o.walls[face] && room < 0.5 * leaf.half[axis]) return face;
  }
  return 6;
}

/// What a box of a radius around x counts for, per unit of volume and up to a common factor; from the wall
/// point of x alone, which costs less than the metric. Sizes are those at a height of `height`. Of the ray of
/// an edge or a corner the swept volume leaves a share of t or t^2, times 4 and 11 for the fan.
template <int D>
double guess(const WallMetric& metric, const Vec3& x, const WallPoint& w, double radius, double height,
             double band) {
  const SizeOptions& o = metric.sizes();
  const double rate = std::log(o.edge_growth);
  const auto chord = [&](double k) {
    return std::isfinite(k) && k != 0.0 ? std::min(o.h2, std::sqrt(2.0 * height / std::abs(k))) : o.h2;
  };
  // Size at a distance d from where it is `height` and grows, or its harmonic mean over a box that reaches
  // there.
  const auto size = [&](double d, double largest) {
    const double h = std::min(largest, height + rate * std::max(d, radius));
    return d < radius ? h / (1.0 + std::log1p(rate * radius / height)) : h;
  };
  if (std::abs(w.phi) >= band) return 1.0 / (metric.normal_size(x, w.phi) * o.h2 * (D == 3 ? o.h2 : 1.0));
  const double t = height / band, layers = height / (band * metric.normal_size(x, height));
  const double h1 = chord(w.k1), h2 = chord(w.k2);
  if (w.feature == WallFeature::kCorner) return 11.0 * t * t * layers / (height * height);
  if (w.feature == WallFeature::kEdge)
    return 4.0 * t * layers / (height * (D == 3 ? size(w.corner_distance, o.h2) : 1.0));
  if constexpr (D == 2) return layers / size(w.edge_distance, h1);
  return layers / (size(w.edge_distance, h1) * size(std::max(w.corner_distance, w.edge_distance), h2));
}

/// Whether an edge or a corner is near a leaf beside the wall.
bool beside_edge(const WallPoint& w, double radius, double band) {
  return std::abs(w.phi) <= band + radius &&
         (w.feature != WallFeature::kFace || std::min(w.edge_distance, w.corner_distance) < 2.0 * radius);
}

/// A point of a leaf and the factor by which it counts more than the leaf's volume.
template <int D>
struct Choice {
  Vec<D> x;
  double factor = 1.0;
};

/// A point of the leaf. Towards edges and corners it is found by halving: an octant is drawn by what the
/// octants will count for, until it is small against its distance from them. (On which side of the wall they
/// lie matters little for that and may cost much to tell.)
template <int D>
Choice<D> choose(const WallMetric& metric, const Leaf<D>& leaf, WallPoint w, std::size_t index, double height,
                 double band) {
  constexpr double kDoubt = 0.25;  // part of the probability that does not trust the guess
  constexpr std::uint64_t kDepth = 64;
  constexpr std::size_t kParts = std::size_t{1} << D;
  Leaf<D> box = leaf;
  double factor = 1.0;
  for (std::uint64_t depth = 1; depth < kDepth; ++depth) {
    const double radius = box.half.norm();
    if (radius < height || !beside_edge(w, radius, band)) break;
    std::array<Leaf<D>, kParts> octants;
    std::array<WallPoint, kParts> walls;
    std::array<double, kParts> share;
    double sum = 0.0;
    for (std::size_t i = 0; i < kParts; ++i) {
      octants[i] = octant<D>(box, static_cast<int>(i));
      const Vec3 center = in_space<D>(octants[i].center);
      walls[i] = metric.wall().at_side(center, 1.0);
      share[i] = guess<D>(metric, center, walls[i], 0.5 * radius, height, band);
      sum += share[i];
    }
    for (double& p : share) p = (1.0 - kDoubt) * p / sum + kDoubt / kParts;
    double left = uniform(index * kDepth + depth, 0);
    std::size_t i = 0;
    while (i + 1 < kParts && left >= share[i]) left -= share[i++];
    factor /= kParts * share[i];
    box = octants[i];
    w = walls[i];
  }
  const std::uint64_t id = index * kDepth;
  const Vec3 offset(uniform(id, 0), uniform(id, 1), uniform(id, 2));
  return {box.center + box.half.cwiseProduct(section<D>(Vec3(2.0 * offset - Vec3::Ones()))), factor};
}

template <int D>
Sums integrate_leaf(const Sampler<D>& sampler, const Leaf<D>& leaf, std::size_t index,
                    const std::vector<double>& levels) {
  constexpr std::size_t kDraws = 4;  // beside edges
  const WallMetric& metric = sampler.metric();
  const double band = levels.back();
  const double height = std::min(levels[std::min<std::size_t>(3, levels.size() - 1)], 0.25 * band);
  const std::size_t face = face_beside<D>(metric, leaf);
  const WallPoint center = metric.wall().at_side(in_space<D>(leaf.center), 1.0);
  const std::size_t draws = beside_edge(center, leaf.half.norm(), band) ? kDraws : 1;
  Sums sums;
  for (std::size_t draw = 0; draw < draws; ++draw) {
    const Choice<D> chosen = choose<D>(metric, leaf, center, index * kDraws + draw, height, band);
    const double factor = chosen.factor / static_cast<double>(draws);
    const double weight = factor * leaf.volume();
    const Vec3 x = in_space<D>(chosen.x);
    const WallSample s = metric.sample(x);
    Sums one;
    if (std::abs(s.wall.phi) < band) {
      one = integrate_ray<D>(sampler, x, s.wall, levels, weight);
    } else if (face < 6) {
      one = integrate_column<D>(sampler, leaf, x, face);
      one.scale(factor);
    } else {
      sampler.add(one, x, s, weight);
    }
    sampler.look_across(one, x, s.wall);
    sums = std::move(sums) + one;
  }
  return sums;
}

}  // namespace

void Sums::scale(double factor) {
  for (std::array<double, 4>* values : {&complexity, &measured, &log_length})
    for (double& c : *values) c *= factor;
  for (auto& [cell, cost] : costs) {
    for (double& c : cost.by_cause) c *= factor;
    cost.moment *= factor;
  }
}

Sums operator+(Sums a, const Sums& b) {
  for (std::size_t i = 0; i < 4; ++i) {
    a.complexity[i] += b.complexity[i];
    a.measured[i] += b.measured[i];
    a.log_length[i] += b.log_length[i];
  }
  for (const auto& [cell, cost] : b.costs) a.costs[cell].add(cost);
  narrow(a.gap, b.gap);
  narrow(a.thickness, b.thickness);
  a.evaluations += b.evaluations;
  return a;
}

namespace {

template <int D>
Sums integrate(const WallMetric& metric, double leaves_across, const Progress* progress) {
  const double smallest = metric.wall().bounds().size().maxCoeff() / leaves_across;
  const double band = 0.5 * smallest;
  const std::vector<Leaf<D>> leaves = octree<D>(metric, smallest, progress);
  const std::vector<double> levels = ray_levels(metric.layer(), band);
  const Sampler<D> sampler(metric);
  return reduce(
      leaves.size(), Sums(),
      [&](std::size_t begin, std::size_t end) {
        Sums part;
        if (progress != nullptr) progress->check_cancelled();
        for (std::size_t i = begin; i < end; ++i)
          part = std::move(part) + integrate_leaf<D>(sampler, leaves[i], i, levels);
        return part;
      },
      [](const Sums& x, const Sums& y) { return x + y; }, 32);
}

}  // namespace

Sums integrate_density(const WallMetric& metric, double leaves_across, const Progress* progress) {
  return is_planar(metric.sizes().domain) ? integrate<2>(metric, leaves_across, progress)
                                          : integrate<3>(metric, leaves_across, progress);
}

}  // namespace lamina::detail
