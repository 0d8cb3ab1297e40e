// The closest point q of x solves x = q + t grad f(q), f(q) = 0: Newton steps on (q, t), started at the
// closest point of the zero set's triangles, which lies within a fraction of a voxel. Where the steps do not
// settle - at a kink of a rough grid - the start is moved onto the zero set along the gradient instead.
#include "vdb/detail/spline_wall.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lamina::detail {
namespace {

constexpr int kSteps = 12;
constexpr double kSettled = 1e-12;     // of a voxel, plus rounding of the coordinates
constexpr double kStray = 2.0;         // voxels the closest point may move away from the start
constexpr std::size_t kProbes = 2000;  // points of the wall at which blurs are compared
constexpr double kFlat = 0.02;         // curvature times voxel below which a wall counts as flat
constexpr double kAgree = 0.1;         // median relative difference of curvatures that needs no more blur
constexpr int kMostBlur = 2;           // passes; more would see the end of the band
constexpr double kNoFeatures = 2.0 * std::numbers::pi;

}  // namespace

SplineWall::SplineWall(LoadedGrid grid)
    : values_(std::move(grid.values)),
      lattice_(grid.lattice),
      to_index_(grid.lattice.A.inverse()),
      voxel_(std::cbrt(std::abs(grid.lattice.A.determinant()))),
      facets_(std::move(grid.wall), kNoFeatures) {
  choose_blur();
  values_.prefilter(2);
}

double SplineWall::blur() const { return kGaussianSigma * std::sqrt(blur_passes_); }

// Median relative difference of the curvatures of two grids over points of the wall.
double SplineWall::disagreement(const SparseGrid& a, const SparseGrid& b) const {
  const std::vector<Vec3>& points = facets_.surface().points;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kProbes);
  std::vector<double> off;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const auto shape = [&](const SparseGrid& grid) -> Mat3 {
      const Sample s = sample(grid, points[i]);
      const double g = s.g.norm();
      if (!(g > 0.0)) return Mat3::Zero();
      const Mat3 p = Mat3::Identity() - s.g * s.g.transpose() / (g * g);
      return p * s.H * p / g;
    };
    const Mat3 sa = shape(a), sb = shape(b);
    off.push_back((sa - sb).norm() / std::max({sa.norm(), sb.norm(), kFlat / voxel_}));
  }
  if (off.empty()) return 0.0;
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return *middle;
}

// Blurs until a further pass would change little: facets and noise fade in one or two, true curvature does
// not.
void SplineWall::choose_blur() {
  SparseGrid current = values_;
  current.prefilter(2);
  blurred_ = values_;
  for (blur_passes_ = 0; blur_passes_ < kMostBlur; ++blur_passes_) {
    blurred_.blur();
    if (disagreement(current, blurred_) < kAgree) break;
    current = blurred_;
  }
  blurred_ = blur_passes_ > 0 ? std::move(current) : SparseGrid();
}

SplineWall::Sample SplineWall::sample(const SparseGrid& grid, const Vec3& x) const {
  const SplineSample s = grid.spline(to_index_ * (x - lattice_.origin));
  return {s.f, to_index_.transpose() * s.g, to_index_.transpose() * s.H * to_index_};
}

bool SplineWall::newton(const Vec3& x, Vec3& q) const {
  const Vec3 start = q;
  const double settled = kSettled * voxel_ + 1e-15 * q.cwiseAbs().maxCoeff();
  double t = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    const Sample s = sample(values_, q);
    const double g2 = s.g.squaredNorm();
    if (!(g2 > 0.0)) return false;
    if (step == 0) t = (x - q).dot(s.g) / g2;
    const Mat3 k = Mat3::Identity() + t * s.H;
    const Mat3 inverse = k.inverse();
    const Vec3 r = q - x + t * s.g;
    const double down = s.g.dot(inverse * s.g);
    if (!(k.determinant() > 0.0) || !(down > 0.0)) return false;
    const double dt = (s.f - s.g.dot(inverse * r)) / down;
    Vec3 dq = -inverse * (r + s.g * dt);
    const double length = dq.norm();
    if (!std::isfinite(length)) return false;
    if (length > voxel_) dq *= voxel_ / length;
    q += dq;
    t += dt;
    if ((q - start).norm() > kStray * voxel_) return false;
    if (length <= settled) return true;
  }
  return false;
}

SplineWall::Foot SplineWall::foot(const Vec3& x, const Vec3& start) const {
  Vec3 q = start;
  if (!newton(x, q)) {
    q = start;
    for (int step = 0; step < kSteps; ++step) {
      const Sample s = sample(values_, q);
      const double g2 = s.g.squaredNorm();
      if (!(g2 > 0.0)) break;
      Vec3 dq = -s.f / g2 * s.g;
      const double length = dq.norm();
      if (!(length < voxel_) || (q + dq - start).norm() > kStray * voxel_) break;
      q += dq;
      if (length < 1e-10 * voxel_) break;
    }
  }
  const double d = (x - q).norm();
  return {q, (x - q).dot(sample(values_, q).g) < 0.0 ? -d : d};
}

WallPoint SplineWall::describe(const Foot& foot) const {
  WallPoint w;
  w.phi = foot.phi;
  w.closest = foot.q;
  Sample s = sample(blur_passes_ > 0 ? blurred_ : values_, foot.q);
  if (!(s.g.norm() > 0.0)) s = sample(values_, foot.q);
  const double g = s.g.norm();
  w.reliability = 0.0;
  if (!(g > 0.0)) return w;
  const Frame f = principal_frame(s.g / g, to_sym<3>(s.H / g));
  w.N = f.N;
  w.T1 = f.T1;
  w.T2 = f.T2;
  const double sharpest = kSharpest / voxel_;
  w.k1 = std::clamp(f.k1, -sharpest, sharpest);
  w.k2 = std::clamp(f.k2, -sharpest, sharpest);
  w.reliability = reliability(f.k1 * voxel_ * std::max(1.0, blur()), 0.0);
  return w;
}

double SplineWall::phi(const Vec3& x) const { return foot(x, facets_.closest_point(x)).phi; }

WallPoint SplineWall::at(const Vec3& x) const { return describe(foot(x, facets_.closest_point(x))); }

int SplineWall::others(const Vec3& x, const WallPoint& nearest, double reach,
                       std::span<WallPoint> out) const {
  const int count = facets_.others(x, nearest, reach + 0.5 * voxel_, out);
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Foot f = foot(x, out[static_cast<std::size_t>(i)].closest);
    if (std::abs(f.phi) > reach || (f.phi < 0.0) != (nearest.phi < 0.0)) continue;
    out[static_cast<std::size_t>(kept++)] = describe(f);
  }
  return kept;
}

}  // namespace lamina::detail
