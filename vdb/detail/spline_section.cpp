// Where the triangles of the zero set cut the plane, points are spread evenly and moved in the plane onto the
// zero set of the spline itself, so that neither voxels nor its triangles show in the curvature. Of a rough
// grid, curvature is that of the blurred values.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/spline_wall.h"

namespace lamina::detail {
namespace {

constexpr double kSpacing = 0.5;  // voxels between points: what the zero set bends within a voxel stays
constexpr double kLeast = 12.0;   // points around a curve, however small
constexpr double kSpeck = 2.0;    // voxels around a curve that a grid cannot tell from none
constexpr double kCrowded = 0.4;  // times the spacing; points that meet at a tip may have passed each other
constexpr double kTurn = std::numbers::pi / 6.0;  // from point to point; a spline would overshoot beyond

/// Length of a closed polygon up to each of its points, and in all.
std::vector<double> lengths(const std::vector<Vec2>& polygon) {
  const std::size_t n = polygon.size();
  std::vector<double> at(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) at[i + 1] = at[i] + (polygon[(i + 1) % n] - polygon[i]).norm();
  return at;
}

/// Points on a closed polygon, equally far apart along it.
std::vector<Vec2> spread(const std::vector<Vec2>& polygon, const std::vector<double>& at, double spacing) {
  const std::size_t n = polygon.size();
  const double count = std::round(at[n] / spacing);
  std::vector<Vec2> out;
  std::size_t edge = 0;
  for (double k = 0.0; k < count; ++k) {
    const double s = at[n] * k / count;
    while (edge + 1 < n && at[edge + 1] <= s) ++edge;
    const double length = at[edge + 1] - at[edge];
    const double u = length > 0.0 ? (s - at[edge]) / length : 0.0;
    out.push_back((1.0 - u) * polygon[edge] + u * polygon[(edge + 1) % n]);
  }
  return out;
}

/// Whether the points tell how the curve bends between them.
bool is_resolved(const std::vector<Vec2>& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 a = p[(i + 1) % n] - p[i], b = p[(i + 2) % n] - p[(i + 1) % n];
    if (a.dot(b) < std::cos(kTurn) * a.norm() * b.norm()) return false;
  }
  return true;
}

}  // namespace

bool SplineWall::settle_in_plane(int axis, Vec3& q) const {
  constexpr int kSteps = 30;
  constexpr double kSettled = 1e-12, kStray = 0.5;  // voxels
  const Vec3 start = q;
  const double settled = kSettled * voxel_ + 1e-15 * q.cwiseAbs().maxCoeff();
  for (int step = 0; step < kSteps; ++step) {
    const Sample s = sample(values_, q);
    Vec3 g = s.g;
    g[axis] = 0.0;
    const double g2 = g.squaredNorm();
    if (!(g2 > 0.0)) return false;
    Vec3 dq = -s.f / g2 * g;
    const double length = dq.norm();
    if (length > voxel_) dq *= voxel_ / length;
    q += dq;
    if (!((q - start).norm() < kStray * voxel_)) return false;
    if (length <= settled) return true;
  }
  return false;
}

double SplineWall::curvature_in_plane(int axis, const Vec3& q) const {
  const Sample s = sample(blur_passes_ > 0 ? blurred_ : values_, q);
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  const double g = std::hypot(s.g[a], s.g[b]), sharpest = kSharpest / voxel_;
  if (!(g > 0.0)) return sharpest;
  const double bend =
      s.g[b] * s.g[b] * s.H(a, a) - 2.0 * s.g[a] * s.g[b] * s.H(a, b) + s.g[a] * s.g[a] * s.H(b, b);
  return std::clamp(bend / (g * g * g), -sharpest, sharpest);
}

Outline SplineWall::section(int axis, double offset, const std::string& name,
                            std::vector<std::string>& warnings) const {
  const Outline cut = slice(facets_.surface(), axis, offset, name);
  const int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
  Outline outline;
  for (const OutlineCurve& curve : cut.curves) {
    if (!curve.closed)
      throw Error(ErrorCode::kSurfaceInvalid,
                  fmt::format("{}: the wall ends at ({:g}, {:g}) of the section, where its grid does: the "
                              "level set must go around the body",
                              name, curve.points.front()[0], curve.points.front()[1]));
    const std::vector<double> at = lengths(curve.points);
    if (at.back() < kSpeck * voxel_) continue;
    const double spacing = std::min(kSpacing * voxel_, at.back() / kLeast);
    OutlineCurve settled;
    for (Vec2 x : spread(curve.points, at, spacing)) {
      Vec3 q = Vec3::Constant(offset);
      q[across] = x[0];
      q[up] = x[1];
      if (settle_in_plane(axis, q)) x = {q[across], q[up]};
      if (!settled.points.empty() && !((x - settled.points.back()).norm() > kCrowded * spacing)) continue;
      settled.points.push_back(x);
      if (blur_passes_ > 0) settled.curvature.push_back(curvature_in_plane(axis, q));
    }
    settled.smooth = blur_passes_ == 0 && is_resolved(settled.points);
    outline.curves.push_back(std::move(settled));
  }
  const auto left_out = static_cast<std::int64_t>(cut.curves.size() - outline.curves.size());
  const std::string specks =
      fmt::format("{} of the section no longer than two voxels", counted(left_out, "curve"));
  if (outline.curves.empty())
    throw Error(ErrorCode::kDomain, fmt::format("{}: --slice {}={:g} only grazes the body: {}, and no other",
                                                name, "xyz"[axis], offset, specks));
  if (left_out > 0) warnings.push_back(fmt::format("{}: {} left out", name, specks));
  return outline;
}

}  // namespace lamina::detail
