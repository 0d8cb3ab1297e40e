#include "tests/bench/target_truth.h"

#include <algorithm>
#include <cmath>

namespace lamina::targets {
namespace {

using Real = long double;
using V = Eigen::Matrix<Real, 3, 1>;

Real to_segment(const V& a, const V& b, const V& x) {
  const V e = b - a;
  const Real l2 = e.squaredNorm();
  const Real t = l2 > 0 ? std::clamp<Real>((x - a).dot(e) / l2, 0, 1) : 0;
  return (x - a - t * e).norm();
}

Real to_triangle(const V& a, const V& b, const V& c, const V& x) {
  const V n = (b - a).cross(c - a);
  const Real n2 = n.squaredNorm();
  if (n2 > 0) {
    const bool inside = (b - a).cross(x - a).dot(n) >= 0 && (c - b).cross(x - b).dot(n) >= 0 &&
                        (a - c).cross(x - c).dot(n) >= 0;
    if (inside) return std::abs((x - a).dot(n)) / std::sqrt(n2);
  }
  return std::min({to_segment(a, b, x), to_segment(b, c, x), to_segment(c, a, x)});
}

}  // namespace

BruteDistance::BruteDistance(const Surface& surface) : surface_(surface) {
  for (const auto& t : surface.triangles) {
    const auto p = [&](int k) -> const Vec3& {
      return surface.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])];
    };
    const Vec3 center = (p(0) + p(1) + p(2)) / 3.0;
    balls_.push_back(
        {center, std::max({(p(0) - center).norm(), (p(1) - center).norm(), (p(2) - center).norm()})});
  }
}

long double BruteDistance::operator()(const Vec3& x) const {
  double reach = 1e300;  // no triangle farther than this matters
  for (const Ball& b : balls_) reach = std::min(reach, (x - b.center).norm() + b.radius);
  reach *= 1.0 + 1e-12;
  const V at = x.cast<Real>();
  Real best = INFINITY;
  for (std::size_t i = 0; i < balls_.size(); ++i) {
    if ((x - balls_[i].center).norm() - balls_[i].radius > reach) continue;
    const auto& t = surface_.triangles[i];
    const auto p = [&](std::size_t k) -> V {
      return surface_.points[static_cast<std::size_t>(t[k])].cast<Real>();
    };
    best = std::min(best, to_triangle(p(0), p(1), p(2), at));
  }
  return best;
}

RayInside::RayInside(const Surface& surface) {
  Eigen::Matrix<Real, 3, 1> w(0.5377L, 0.3119L, 0.7833L), u(0.2221L, -0.9131L, 0.1713L);
  w.normalize();
  u = (u - w * w.dot(u)).normalized();
  const Eigen::Matrix<Real, 3, 1> v = w.cross(u);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      axes_[i][k] = (i == 0 ? u : i == 1 ? v : w)[static_cast<Eigen::Index>(k)];
  Real hi[2] = {-INFINITY, -INFINITY};
  lo_[0] = lo_[1] = INFINITY;
  for (const auto& t : surface.triangles) {
    std::array<Flat, 3> flat;
    for (std::size_t k = 0; k < 3; ++k) {
      flat[k] = turn(surface.points[static_cast<std::size_t>(t[k])]);
      for (std::size_t i = 0; i < 2; ++i) {
        lo_[i] = std::min(lo_[i], flat[k][i]);
        hi[i] = std::max(hi[i], flat[k][i]);
      }
    }
    triangles_.push_back(flat);
  }
  n_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(triangles_.size()))), 1, 500);
  for (int i = 0; i < 2; ++i) step_[i] = (hi[i] - lo_[i]) / n_ * (1 + 1e-9L);
  bins_.resize(static_cast<std::size_t>(n_) * static_cast<std::size_t>(n_));
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    int first[2], last[2];
    for (std::size_t i = 0; i < 2; ++i) {
      const auto [least, most] = std::minmax({triangles_[t][0][i], triangles_[t][1][i], triangles_[t][2][i]});
      first[i] = std::max(0, static_cast<int>((least - lo_[i]) / step_[i]) - 1);
      last[i] = std::min(n_ - 1, static_cast<int>((most - lo_[i]) / step_[i]) + 1);
    }
    for (int i = first[0]; i <= last[0]; ++i)
      for (int j = first[1]; j <= last[1]; ++j)
        bins_[static_cast<std::size_t>(i * n_ + j)].push_back(static_cast<std::uint32_t>(t));
  }
}

RayInside::Flat RayInside::turn(const Vec3& x) const {
  Flat f{};
  for (std::size_t i = 0; i < 3; ++i) f[i] = axes_[i][0] * x[0] + axes_[i][1] * x[1] + axes_[i][2] * x[2];
  return f;
}

int RayInside::winding(const Vec3& x) const {
  const Flat p = turn(x);
  int cell[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const Real c = (p[i] - lo_[i]) / step_[i];
    if (!(c >= 0 && c < n_)) return 0;
    cell[i] = static_cast<int>(c);
  }
  int sum = 0;
  for (const std::uint32_t t : bins_[static_cast<std::size_t>(cell[0] * n_ + cell[1])]) {
    const auto& q = triangles_[t];
    // Areas of p with the three edges: of one sign when the ray's line meets the triangle.
    Real area[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Flat &a = q[k], &b = q[(k + 1) % 3];
      area[k] = (a[0] - p[0]) * (b[1] - p[1]) - (b[0] - p[0]) * (a[1] - p[1]);
    }
    const bool left = area[0] > 0 && area[1] > 0 && area[2] > 0;
    const bool right = area[0] < 0 && area[1] < 0 && area[2] < 0;
    if (!left && !right) continue;
    const Real height =
        (area[1] * q[0][2] + area[2] * q[1][2] + area[0] * q[2][2]) / (area[0] + area[1] + area[2]);
    if (height > p[2]) sum += left ? 1 : -1;  // leaves through a triangle that faces along the ray
  }
  return sum;
}

}  // namespace lamina::targets
