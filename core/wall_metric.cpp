// Near the wall the metric has the frame (N, T1, T2) of the closest wall point. Its normal size follows the
// layers, its tangential sizes the curvature. Three things are added so that a mesh can meet it. Beside a
// sharp edge sizes start at the fan around the edge; beside a bend at those of the bend. Where further walls
// are in reach (concave corners, channels) the metrics of all of them are intersected, which makes the field
// continuous across the bisector. Away from edge, bend and bisector sizes grow by edge_growth per element:
// the layers' own growth would cost three times the cells on a body of many small facets and gains no
// quality.
#include "core/wall_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"

namespace lamina {
namespace {

constexpr double kUnbounded = 1e6;  // rate of growth when there is no gradation

// Chord of a curve that strays from it by h [eq. 29].
double chord_length(double curvature, double h) {
  if (curvature == 0.0) return std::numeric_limits<double>::infinity();
  return std::sqrt(2.0 * h / curvature + h * h);
}

// Sizes along the orthonormal vectors N, T1, T2.
Metric<3> framed(const Vec3& N, const Vec3& T1, const Vec3& T2, const Vec3& sizes) {
  Mat3 axes;
  axes.row(0) = N.transpose();
  axes.row(1) = T1.transpose();
  axes.row(2) = T2.transpose();
  return Metric<3>::from_frame(axes, sizes);
}

[[noreturn]] void reject(ErrorCode code, const std::string& message) { throw Error(code, message); }

std::string describe(const Box<3>& b) {
  return fmt::format("[{:g}, {:g}] x [{:g}, {:g}] x [{:g}, {:g}]", b.lo[0], b.hi[0], b.lo[1], b.hi[1],
                     b.lo[2], b.hi[2]);
}

void require_box(const char* name, const Box<3>& box) {
  if (!box.lo.allFinite() || !box.hi.allFinite() || (box.size().array() <= 0.0).any())
    reject(ErrorCode::kDomain,
           fmt::format("{} {} is empty: give x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1", name,
                       describe(box)));
}

void check(const BoundaryLayer& layer, const SizeOptions& s, const Box<3>& body) {
  if (!(s.h2 > layer.h_min))
    reject(
        ErrorCode::kParameter,
        fmt::format("--h2 = {:g} must exceed h_min = {:g}: raise --h2 or lower --hmin", s.h2, layer.h_min));
  if (!(s.h1 >= s.h2))
    reject(ErrorCode::kParameter, fmt::format("--h1 = {:g} must not be below --h2 = {:g}", s.h1, s.h2));
  require_box("--domain", s.domain);
  require_box("--box2", s.box2);
  if (s.box1) require_box("--box1", *s.box1);
  const Vec3 overlap = s.domain.hi.cwiseMin(body.hi) - s.domain.lo.cwiseMax(body.lo);
  if ((overlap.array() < 0.0).any())
    reject(ErrorCode::kDomain,
           fmt::format("the body {} lies outside the domain {}: enlarge --domain or check --unit",
                       describe(body), describe(s.domain)));
  if (!(s.growth_inside > 1.0 && s.growth_inside <= 4.0))
    reject(ErrorCode::kParameter, fmt::format("--growth-inside = {:g} must be in (1, 4]", s.growth_inside));
  if (s.mirrored_layers < 0 || s.mirrored_layers > 50)
    reject(ErrorCode::kParameter,
           fmt::format("--mirrored-layers = {} must be in [0, 50]", s.mirrored_layers));
  if (!(s.corner_elements >= 1.0 && s.corner_elements <= 16.0))
    reject(ErrorCode::kParameter,
           fmt::format("--corner-elements = {:g} must be in [1, 16]", s.corner_elements));
  if (!(s.edge_growth > 1.0 && s.edge_growth <= 4.0))
    reject(ErrorCode::kParameter, fmt::format("--edge-growth = {:g} must be in (1, 4]", s.edge_growth));
  for (const SizedBox& b : s.boxes) {
    require_box(fmt::format("--box {}", b.name).c_str(), b.box);
    if (!(b.size > 0.0 && std::isfinite(b.size)))
      reject(ErrorCode::kParameter, fmt::format("--box {}: size {:g} must be above 0", b.name, b.size));
  }
  if (s.gradation != 0.0 && !(s.gradation > 1.0 && s.gradation <= 4.0))
    reject(ErrorCode::kParameter,
           fmt::format("--gradation = {:g} must be 0 (off) or in (1, 4]", s.gradation));
}

}  // namespace

DomainFace domain_face(const Box<3>& domain, std::size_t face) {
  const int axis = static_cast<int>(face / 2);
  return face % 2 == 0 ? DomainFace{axis, domain.lo[axis], 1.0} : DomainFace{axis, domain.hi[axis], -1.0};
}

WallMetric::WallMetric(const WallField& wall, const BoundaryLayer& layer, const SizeOptions& sizes,
                       std::vector<const SizeField*> painted, const MetricField<3>* user)
    : wall_(&wall),
      layer_(layer),
      sizes_(sizes),
      painted_(std::move(painted)),
      user_(user),
      rate_(sizes.gradation > 0.0 ? std::log(sizes.gradation) : kUnbounded),
      edge_rate_(std::log(sizes.edge_growth)),
      inside_rate_(std::log(sizes.growth_inside)) {
  check(layer_, sizes_, wall.bounds());
  start_ = std::min(sizes_.h2, layer_size(layer_.top()));
  box1_ = sizes_.box1.value_or(sizes_.domain);
  for (std::size_t face = 0; face < 6; ++face) {
    constexpr double kFarAway = 1e100;
    if (!sizes_.walls[face]) continue;
    has_walls_ = true;
    const DomainFace f = domain_face(sizes_.domain, face);
    (f.inward > 0.0 ? box1_.lo : box1_.hi)[f.axis] = -f.inward * kFarAway;
  }
}

// h_min growth^(k-1) in layer k, or h_min + (growth - 1) height [section 3.2.2].
double WallMetric::layer_size(double height) const {
  if (sizes_.profile == Profile::kContinuous) return layer_.h_min + (layer_.growth - 1.0) * height;
  const double k = layer_.level_at(height);
  // On a level (up to rounding) the geometric mean of the layers below and above, so that an edge from level
  // to level has length 1.
  constexpr double kSlack = 1e-7;
  const double nearest = std::round(k);
  if (std::abs(k - nearest) < kSlack && nearest >= 1.0 && nearest < layer_.layers)
    return layer_.h_min * std::pow(layer_.growth, nearest - 0.5);
  return layer_.h_min * std::pow(layer_.growth, std::max(0.0, std::ceil(k - kSlack) - 1.0));
}

// The first layers mirrored, then growth by ln(growth_inside) per unit of depth, which doubles (for 2) from
// one element to the next.
double WallMetric::inside_size(double depth) const {
  const double mirrored = layer_.level(sizes_.mirrored_layers);
  if (depth <= mirrored) return std::min(sizes_.h2, layer_size(depth));
  const double last = layer_.h_min * std::pow(layer_.growth, std::max(0, sizes_.mirrored_layers - 1));
  return std::min(sizes_.h2, last + inside_rate_ * (depth - mirrored));
}

// Size far from all walls: h2 in Box2, growing geometrically to h1 at the border of the domain.
double WallMetric::far_size(const Vec3& x) const {
  const double d2 = sizes_.box2.outer_distance(x);
  if (d2 <= 0.0) return sizes_.h2;
  const double h = sizes_.h2 * std::pow(sizes_.h1 / sizes_.h2, d2 / (d2 + box1_.inner_distance(x)));
  return std::min(h,
                  sizes_.h2 + rate_ * d2);  // boxes that end close to each other leave no room for that rule
}

// Factor of the growth along edges at a depth inside the body, from 1 at the wall.
double WallMetric::hasty(double depth) const {
  constexpr double kMost = 3.0, kSpan = 4.0;  // kSpan: in first layers
  return 1.0 + (kMost - 1.0) * std::min(1.0, depth / (kSpan * layer_.h_min));
}

double WallMetric::normal_size(const Vec3& x, double phi) const { return normal_size(x, phi, far_size(x)); }

double WallMetric::normal_size(const Vec3& x, double phi, double far) const {
  if (phi <= 0.0) return inside_size(-phi);
  const double top = layer_.top();
  if (phi <= top) return std::min(sizes_.h2, layer_size(phi));
  const double above = phi - top;
  double h;
  if (sizes_.box2.outer_distance(x) > 0.0) {
    h = far;
  } else {
    h = start_ + (sizes_.h2 - start_) * above / (above + sizes_.box2.inner_distance(x));
  }
  return std::min(h, start_ + rate_ * above);
}

// The size along an arc around a sharp edge that gives a quarter of it corner_elements.
double WallMetric::corner_size(double hn, double phi) const {
  return std::max(hn, 0.5 * std::numbers::pi * (std::abs(phi) + hn) / sizes_.corner_elements);
}

// sqrt(2 R h + h^2) [eq. 29]. R is the radius of the wall plus, where level surfaces widen away from it, the
// distance to it: at a sharp edge (R = 0) this bounds the number of elements of the fan at every height.
// Inside, where sizes grow fast behind a chord, it strays by .65 h only: where it strays by h, no lattice of
// unit edges has cells better than .81 to .86 [apps/README.md]; by less, sizes grow faster through the wall.
// `graded` stands for the curvature of the wall where that falls too fast.
double WallMetric::tangential_size(double curvature, double graded, double hn, double phi,
                                   double largest) const {
  double h = largest;
  if (std::isinf(curvature)) {
    h = corner_size(hn, phi);
  } else if (graded != 0.0) {
    const double radius = 1.0 / graded, bulge = std::clamp(curvature * radius, -1.0, 1.0);
    h = chord_length(1.0 / (radius + std::max(0.0, bulge * phi)), chord_stray(hn, phi));
  }
  return std::clamp(h, hn, std::max(hn, largest));
}

// How far a chord may stray from a curved wall.
double WallMetric::chord_stray(double hn, double phi) const {
  if (sizes_.chord == Chord::kWall) return layer_.h_min;
  constexpr double kStrayInside = 0.65;  // reached at the depth of the first level
  const double first = std::clamp(-phi / layer_.h_min, 0.0, 1.0);
  return hn * (1.0 - first * (1.0 - kStrayInside));
}

WallMetric::Bounds WallMetric::bounds_at(const Vec3& x) const {
  const double far = far_size(x);
  // No size of a wall is larger: those of its layers end at h2, and h1 is not smaller.
  double painted = sizes_.h1;
  for (const SizedBox& b : sizes_.boxes)
    painted = std::min(painted, b.size + rate_ * b.box.outer_distance(x));
  for (const SizeField* field : painted_) painted = field->bound(x, rate_, painted);
  return {far, painted};
}

WallSizes WallMetric::wall_sizes(const Vec3& x, const WallPoint& wall, const Bounds& bounds) const {
  const double hn = normal_size(x, wall.phi, bounds.far);
  const auto size = [&](double curvature, double graded) {
    return std::min(bounds.painted, tangential_size(curvature, graded, hn, wall.phi, bounds.far));
  };
  const auto [k1, k2] =
      wall_->graded_curvatures(wall, std::sqrt(2.0 * chord_stray(hn, wall.phi)) / edge_rate_);
  return {std::min(bounds.painted, hn), size(wall.k1, k1), size(wall.k2, k2)};
}

// The metric of a bend, grown by the distance from it.
std::optional<WallMetric::Bounded> WallMetric::bend_metric(const WallPoint& wall, const WallBend& bend,
                                                           const WallSizes& sizes, double floor) const {
  if (!std::isfinite(bend.distance)) return {};
  const double grown = edge_rate_ * bend.distance, widest = std::max(sizes.ht1, sizes.ht2);
  const auto size = [&](double curvature) {
    return std::max(floor,
                    tangential_size(curvature, std::abs(curvature), sizes.hn, wall.phi, widest) + grown);
  };
  const double h1 = size(bend.k1);
  if (h1 >= std::max(widest, floor)) return {};
  const Vec3 across = bend.direction - bend.direction.dot(wall.N) * wall.N;
  if (across.norm() < 1e-6) return {};
  const Vec3 T1 = across.normalized();
  const double h2 = size(bend.k2);
  return Bounded{framed(wall.N, T1, wall.N.cross(T1), Vec3(std::max(sizes.hn, floor), h1, h2)),
                 std::min(h1, h2), std::max(h1, h2)};
}

// Beside a sharp edge: across it the size starts at that of the fan around it; along it the size grows away
// from the corners and resolves the curve of the edge, with which the frame turns.
std::optional<WallMetric::Bounded> WallMetric::edge_metric(const WallPoint& wall, const WallEdge& edge,
                                                           const WallSizes& sizes, double floor) const {
  if (!std::isfinite(edge.distance)) return {};
  const double angle = std::clamp(edge.angle, 0.1, 0.5 * std::numbers::pi);
  const double widest = std::max({sizes.ht1, sizes.ht2, floor});
  // Inside nobody needs the cells small: with the depth the fan widens as fast as layers may grow, and sizes
  // along the edge grow ever faster. (Across it, or away from bends, haste lets sizes jump: growth by 3.3.)
  const double depth = std::max(0.0, -wall.phi);
  const double fan = std::max({sizes.hn * 0.5 * std::numbers::pi / angle,
                               std::min(corner_size(sizes.hn, wall.phi), std::max(sizes.hn, widest)),
                               sizes.hn + inside_rate_ * depth});
  const double hn = std::max(sizes.hn, floor);
  const double across = std::max(fan + edge_rate_ * edge.distance, hn);
  if (across >= std::max(sizes.ht1, floor) && across >= std::max(sizes.ht2, floor)) return {};
  Vec3 along = edge.direction - edge.direction.dot(wall.N) * wall.N;
  constexpr double kAlongNormal = 1e-6;
  const bool corner = along.norm() < kAlongNormal;
  double length = std::min({fan + edge_rate_ * hasty(depth) * wall.corner_distance,
                            chord_length(edge.curvature, across), corner ? across : widest});
  along = corner ? wall.N.unitOrthogonal() : Vec3(along.normalized());
  length = std::max(length, hn);
  return Bounded{framed(wall.N, wall.N.cross(along), along, Vec3(hn, across, length)),
                 std::min(across, length), std::max(across, length)};
}

// Of edges and bends only what asks for less than `widest`.
WallMetric::Bounded WallMetric::wall_metric(const WallPoint& wall, const WallSizes& sizes, double floor,
                                            double widest) const {
  Vec3 h = Vec3(sizes.hn, sizes.ht1, sizes.ht2).cwiseMax(floor);
  const bool face = wall.feature == WallFeature::kFace;
  if (wall.feature == WallFeature::kEdge)
    h[2] =
        std::min({h[2], h[1] + edge_rate_ * wall.corner_distance, chord_length(wall.edge_curvature, h[1])});
  Bounded out{framed(wall.N, wall.T1, wall.T2, h), std::min(h[1], h[2]), std::min(widest, h.maxCoeff())};
  bool plain = true;
  const auto add = [&](const std::optional<Bounded>& other) {
    if (!other || other->least >= out.widest) return;
    out.metric = intersect(out.metric, other->metric);
    out.widest = std::min(out.widest, other->widest);
    plain = false;
  };
  add(bend_metric(wall, {wall.bend_distance, wall.bend_direction, wall.bend_k1, wall.bend_k2}, sizes, floor));
  if (face)
    add(edge_metric(wall, {wall.edge_distance, wall.edge_direction, wall.edge_curvature, wall.edge_angle},
                    sizes, floor));
  // Which of two is nearer must not decide about directions: all in reach take part.
  constexpr std::size_t kMost = 4;
  const auto reach = [&](double least) { return (out.widest - least) / edge_rate_; };
  const double fan = corner_size(sizes.hn, wall.phi);
  if (face && reach(fan) > wall.edge_distance) {
    std::array<WallEdge, kMost> edges;
    for (int i = 0, n = wall_->edges_beside(wall, reach(fan), edges); i < n; ++i)
      add(edge_metric(wall, edges[static_cast<std::size_t>(i)], sizes, floor));
  }
  if (reach(sizes.hn) > wall.bend_distance) {
    std::array<WallBend, kMost> bends;
    for (int i = 0, n = wall_->bends_beside(wall, reach(sizes.hn), bends); i < n; ++i)
      add(bend_metric(wall, bends[static_cast<std::size_t>(i)], sizes, floor));
  }
  return out;
}

// The distance beyond which a further wall cannot ask for less than `size` in its normal direction.
double WallMetric::reach(const Vec3& x, double size) const {
  if (size <= start_) return std::max(0.0, (size - layer_.h_min) / (layer_.growth - 1.0));
  const double u = std::min(0.5, (size - start_) / std::max(sizes_.h2 - start_, 1e-300));
  return layer_.top() + std::max(sizes_.box2.inner_distance(x) * u / (1.0 - u), (size - start_) / rate_);
}

Metric<3> WallMetric::metric(const Vec3& x, const WallPoint& body, const WallPoint& main,
                             std::span<const WallPoint> beside, double floor) const {
  const Bounds bounds = bounds_at(x);
  const WallSizes sizes = wall_sizes(x, main, bounds);
  const Bounded own = wall_metric(main, sizes, floor, std::numeric_limits<double>::infinity());
  Metric<3> m = own.metric;
  // Isotropic to within this ratio: no wall in another direction can matter.
  constexpr double kNearlyIsotropic = 1.5;
  const double isotropic = kNearlyIsotropic * std::max(sizes.hn, floor);
  if (std::max({sizes.ht1, sizes.ht2, floor}) <= isotropic) return m;
  double widest = own.widest;  // what edges, bends and other walls have left of the tangential sizes
  const auto limit = [&] {
    return std::min(reach(x, widest), std::abs(main.phi) + (widest - sizes.hn) / edge_rate_);
  };
  const auto add = [&](const WallPoint& other) {
    WallSizes s = wall_sizes(x, other, bounds);
    s.hn = std::max(s.hn, sizes.hn + edge_rate_ * (std::abs(other.phi) - std::abs(main.phi)));
    s.ht1 = std::max(s.ht1, s.hn);
    s.ht2 = std::max(s.ht2, s.hn);
    const Bounded bounded = wall_metric(other, s, floor, widest);
    m = intersect(m, bounded.metric);
    widest = std::min(widest, bounded.widest);
  };
  for (const WallPoint& wall : beside)
    if (widest > isotropic && std::abs(wall.phi) <= limit()) add(wall);
  if (widest <= isotropic) return m;
  constexpr int kMaxWalls = 4;
  std::array<WallPoint, kMaxWalls> others;
  const int count = wall_->others(x, body, limit(), others);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    if (std::abs(others[i].phi) <= limit()) add(others[i]);
  return m;
}

Metric<3> WallMetric::metric(const Vec3& x, const WallPoint& body, double floor) const {
  const Metric<3> m = walls_metric(x, body, floor);
  if (user_ == nullptr) return m;
  const Metric<3> wanted = user_->at(x);
  if (floor <= 0.0) return intersect(m, wanted);
  const Metric<3>::Principal p = wanted.principal();
  return intersect(m, Metric<3>::from_frame(p.axes, p.sizes.cwiseMax(floor)));
}

// The body and the faces of the domain that carry layers, which are walls like any part of it.
WallMetric::Walls WallMetric::list_walls(const Vec3& x, const WallPoint& body) const {
  Walls walls;
  auto& points = walls.points;
  std::size_t main = 0;
  points[walls.count++] = body;
  for (std::size_t face = 0; face < 6; ++face) {
    if (!sizes_.walls[face]) continue;
    WallPoint& point = points[walls.count];
    point = face_wall(x, face);
    // Inside the body nobody needs the face's layers: they fade with the depth.
    point.phi += std::max(0.0, -body.phi);
    if (std::abs(point.phi) < std::abs(points[main].phi)) main = walls.count;
    ++walls.count;
  }
  std::swap(points[0], points[main]);
  walls.on_face = main != 0;
  return walls;
}

Metric<3> WallMetric::walls_metric(const Vec3& x, const WallPoint& body, double floor) const {
  if (!has_walls_) return metric(x, body, body, {}, floor);
  const Walls walls = list_walls(x, body);
  return metric(x, body, walls.points[0], {walls.points.data() + 1, walls.count - 1}, floor);
}

WallPoint WallMetric::face_wall(const Vec3& x, std::size_t face) const {
  const auto [axis, plane, inward] = domain_face(sizes_.domain, face);
  WallPoint wall;
  wall.phi = std::abs(x[axis] - plane);
  wall.closest = x;
  wall.closest[axis] = plane;
  wall.N = inward * Vec3::Unit(axis);
  wall.T1 = Vec3::Unit((axis + 1) % 3);
  wall.T2 = wall.N.cross(wall.T1);
  return wall;
}

Metric<3> WallMetric::at_coarsened(const Vec3& x, double floor) const {
  return metric(x, wall_->at(x), floor);
}

std::optional<Level<3>> WallMetric::level(const Vec3& x, double floor) const {
  WallPoint wall = wall_->at(x);
  bool on_face = false;
  if (has_walls_) {
    const Walls walls = list_walls(x, wall);
    wall = walls.points[0];
    on_face = walls.on_face;
  }
  const double height = std::abs(wall.phi);
  const double side = wall.phi < 0.0 ? -1.0 : 1.0;
  const std::optional<int> number =
      layer_.nearest_level(height, side > 0.0 ? layer_.layers : sizes_.mirrored_layers, floor);
  if (!number) return std::nullopt;
  Level<3> level;
  level.number = static_cast<int>(side) * *number;
  const double thickness = layer_.h_min * std::pow(layer_.growth, *number);
  const double goal = side * layer_.level(std::abs(level.number));
  const Vec3 ray = x - wall.closest;
  level.normal = ray.norm() > 1e-6 * layer_.h_min ? Vec3(side * ray.normalized()) : wall.N;
  level.way = wall.closest + goal * level.normal - x;
  if (on_face) {
    level.metric = at_coarsened(x + level.way, floor);
  } else {
    wall.phi = goal;
    level.metric = metric(x + level.way, wall, floor);
  }
  constexpr double kOtherSizes = 0.6;
  if (level.metric.size_along(level.normal) < kOtherSizes * std::max(thickness, floor)) return std::nullopt;
  return level;
}

WallSample WallMetric::sample(const Vec3& x, const WallPoint& wall) const {
  WallSample s;
  s.wall = wall;
  static_cast<WallSizes&>(s) = sizes_at(x, wall);
  s.region = region(x, s.wall.phi);
  s.metric = metric(x, s.wall, 0.0);
  return s;
}

Region WallMetric::region(const Vec3& x, double phi) const {
  if (phi < 0.0) return Region::kInside;
  if (phi <= layer_.top()) return Region::kLayer;
  return sizes_.box2.contains(x) ? Region::kBox2 : Region::kBox1;
}

}  // namespace lamina
