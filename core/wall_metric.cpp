// Near the wall the metric has the frame (N, T1, T2) of the closest wall point. Its normal size follows the
// layers, its tangential sizes the curvature. Two things are added so that a mesh can meet it. Sizes across a
// sharp edge start at the fan around the edge. Where further walls are in reach (concave corners, channels)
// the metrics of all of them are intersected, which makes the field continuous across the bisector. Away from
// the edge and from the bisector both grow by edge_growth per element: the layers' own growth would cost
// three times the cells on a body of many small facets and gains no quality.
#include "core/wall_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace lamina {
namespace {

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
  if (s.gradation != 0.0 && !(s.gradation > 1.0 && s.gradation <= 4.0))
    reject(ErrorCode::kParameter,
           fmt::format("--gradation = {:g} must be 0 (off) or in (1, 4]", s.gradation));
}

}  // namespace

WallMetric::WallMetric(const WallField& wall, const BoundaryLayer& layer, const SizeOptions& sizes,
                       std::vector<const SizeField*> painted)
    : wall_(&wall),
      layer_(layer),
      sizes_(sizes),
      painted_(std::move(painted)),
      edge_rate_(std::log(sizes.edge_growth)) {
  check(layer_, sizes_, wall.bounds());
}

// h_min growth^(k-1) in layer k, or h_min + (growth - 1) height [section 3.2.2].
double WallMetric::layer_size(double height) const {
  if (sizes_.profile == Profile::kContinuous) return layer_.h_min + (layer_.growth - 1.0) * height;
  // A height on a level (up to rounding) belongs to the layer below.
  constexpr double kSlack = 1e-9;
  const double k = std::log1p(height * (layer_.growth - 1.0) / layer_.h_min) / std::log(layer_.growth);
  return layer_.h_min * std::pow(layer_.growth, std::max(0.0, std::ceil(k - kSlack) - 1.0));
}

// The first layers mirrored, then growth by ln(growth_inside) per unit of depth, which doubles (for 2) from
// one element to the next.
double WallMetric::inside_size(double depth) const {
  const double mirrored = layer_.level(sizes_.mirrored_layers);
  if (depth <= mirrored) return std::min(sizes_.h2, layer_size(depth));
  const double last = layer_.h_min * std::pow(layer_.growth, std::max(0, sizes_.mirrored_layers - 1));
  return std::min(sizes_.h2, last + std::log(sizes_.growth_inside) * (depth - mirrored));
}

double WallMetric::normal_size(const Vec3& x, double phi) const {
  if (phi <= 0.0) return inside_size(-phi);
  const double top = layer_.top();
  if (phi <= top) return std::min(sizes_.h2, layer_size(phi));
  const double start = std::min(sizes_.h2, layer_.top_size());
  const double d2 = sizes_.box2.outer_distance(x);
  double h;
  if (d2 > 0.0) {
    const double d1 = sizes_.domain.inner_distance(x);
    h = sizes_.h2 * std::pow(sizes_.h1 / sizes_.h2, d2 / (d2 + d1));
  } else {
    const double above = phi - top;
    h = start + (sizes_.h2 - start) * above / (above + sizes_.box2.inner_distance(x));
  }
  // Boxes that end close to the body or to each other leave no room for the rule above.
  if (sizes_.gradation > 0.0) {
    const double rate = std::log(sizes_.gradation);
    h = std::min(h, start + rate * (phi - top));
    if (d2 > 0.0) h = std::min(h, sizes_.h2 + rate * d2);
  }
  return h;
}

// sqrt(2 R h + h^2) [eq. 29]. R is the radius of the wall plus, where level surfaces widen away from it, the
// distance to it: at a sharp edge (R = 0) this bounds the number of elements of the fan at every height.
double WallMetric::tangential_size(double curvature, double hn, double phi) const {
  double h = sizes_.h2;
  if (std::isinf(curvature)) {
    h = 0.5 * std::numbers::pi * (std::abs(phi) + hn) / sizes_.corner_elements;
  } else if (curvature != 0.0) {
    const double radius = 1.0 / std::abs(curvature) + (curvature * phi > 0.0 ? std::abs(phi) : 0.0);
    h = std::sqrt(2.0 * radius * hn + hn * hn);
  }
  return std::clamp(h, hn, std::max(hn, sizes_.h2));
}

WallMetric::Sizes WallMetric::painted_sizes(const Vec3& x, Sizes s) const {
  constexpr double kNoSpread = 1e6;  // rate that keeps a painted size within its voxel
  const double rate = sizes_.gradation > 0.0 ? std::log(sizes_.gradation) : kNoSpread;
  double bound = std::max({s.hn, s.ht1, s.ht2});
  for (const SizeField* field : painted_) bound = field->bound(x, rate, bound);
  return {std::min(s.hn, bound), std::min(s.ht1, bound), std::min(s.ht2, bound)};
}

WallMetric::Sizes WallMetric::wall_sizes(const Vec3& x, const WallPoint& wall) const {
  Sizes s;
  s.hn = normal_size(x, wall.phi);
  if (sizes_.box2.outer_distance(x) > 0.0 && wall.phi > layer_.top()) {
    s.ht1 = s.ht2 = s.hn;
  } else {
    s.ht1 = tangential_size(wall.k1, s.hn, wall.phi);
    s.ht2 = tangential_size(wall.k2, s.hn, wall.phi);
  }
  return painted_.empty() ? s : painted_sizes(x, s);
}

Metric<3> WallMetric::wall_metric(const WallPoint& wall, const Sizes& sizes, double floor) const {
  Mat3 axes;
  axes.row(0) = wall.N.transpose();
  axes.row(1) = wall.T1.transpose();
  axes.row(2) = wall.T2.transpose();
  const Vec3 h = Vec3(sizes.hn, sizes.ht1, sizes.ht2).cwiseMax(floor);
  const Metric<3> base = Metric<3>::from_frame(axes, h);
  if (wall.feature != WallFeature::kFace || !std::isfinite(wall.edge_distance)) return base;
  // Across a nearby sharp edge the size starts at that of the fan around it; along the edge nothing is asked.
  const double angle = std::clamp(wall.edge_angle, 0.1, 0.5 * std::numbers::pi);
  const double fan = sizes.hn * 0.5 * std::numbers::pi / angle;
  const double across = std::max(fan + edge_rate_ * wall.edge_distance, floor);
  if (across >= h[1] && across >= h[2]) return base;
  Vec3 along = wall.edge_direction - wall.edge_direction.dot(wall.N) * wall.N;
  constexpr double kAlongNormal = 1e-6;
  if (along.norm() < kAlongNormal) {  // a corner: both directions
    return Metric<3>::from_frame(axes, h.cwiseMin(Vec3(h[0], across, across)));
  }
  along.normalize();
  axes.row(1) = wall.N.cross(along).transpose();
  axes.row(2) = along.transpose();
  return intersect(base,
                   Metric<3>::from_frame(axes, Vec3(h[0], std::max(across, h[0]), std::max(h[1], h[2]))));
}

// The distance beyond which a further wall cannot ask for less than `size` in its normal direction.
double WallMetric::reach(const Vec3& x, double size) const {
  const double top_size = layer_.top_size();
  if (size <= top_size) return std::max(0.0, (size - layer_.h_min) / (layer_.growth - 1.0));
  const double u = std::min(0.5, (size - top_size) / std::max(sizes_.h2 - top_size, 1e-300));
  return layer_.top() + sizes_.box2.inner_distance(x) * u / (1.0 - u);
}

Metric<3> WallMetric::metric(const Vec3& x, const WallPoint& wall, const Sizes& sizes, double floor) const {
  Metric<3> m = wall_metric(wall, sizes, floor);
  const double widest = std::max({sizes.ht1, sizes.ht2, floor});
  // Isotropic to within this ratio: no wall in another direction can matter.
  constexpr double kNearlyIsotropic = 1.5;
  if (widest <= kNearlyIsotropic * std::max(sizes.hn, floor)) return m;
  constexpr int kMaxWalls = 4;
  std::array<WallPoint, kMaxWalls> others;
  const double limit = std::min(reach(x, widest), std::abs(wall.phi) + (widest - sizes.hn) / edge_rate_);
  const int count = wall_->others(x, wall, limit, others);
  for (int i = 0; i < count; ++i) {
    const WallPoint& other = others[i];
    Sizes s = wall_sizes(x, other);
    s.hn = std::max(s.hn, sizes.hn + edge_rate_ * (std::abs(other.phi) - std::abs(wall.phi)));
    s.ht1 = std::max(s.ht1, s.hn);
    s.ht2 = std::max(s.ht2, s.hn);
    m = intersect(m, wall_metric(other, s, floor));
  }
  return m;
}

Metric<3> WallMetric::at_coarsened(const Vec3& x, double floor) const {
  const WallPoint wall = wall_->at(x);
  return metric(x, wall, wall_sizes(x, wall), floor);
}

WallSample WallMetric::sample(const Vec3& x) const {
  WallSample s;
  s.wall = wall_->at(x);
  const Sizes sizes = wall_sizes(x, s.wall);
  s.hn = sizes.hn;
  s.ht1 = sizes.ht1;
  s.ht2 = sizes.ht2;
  s.region = region(x, s.wall.phi);
  s.metric = metric(x, s.wall, sizes, 0.0);
  return s;
}

Region WallMetric::region(const Vec3& x, double phi) const {
  if (phi < 0.0) return Region::kInside;
  if (phi <= layer_.top()) return Region::kLayer;
  return sizes_.box2.contains(x) ? Region::kBox2 : Region::kBox1;
}

}  // namespace lamina
