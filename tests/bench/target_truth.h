// Slow answers that share no code with the library: distances to all triangles in long double, and insides by
// counting the triangles a ray crosses.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vdb/surface.h"

namespace lamina::targets {

/// Distance from x to the nearest triangle, in long double; triangles whose bounding ball lies farther than
/// one already seen are skipped.
class BruteDistance {
 public:
  explicit BruteDistance(const Surface& surface);
  [[nodiscard]] long double operator()(const Vec3& x) const;

 private:
  struct Ball {
    Vec3 center;
    double radius;
  };
  const Surface& surface_;
  std::vector<Ball> balls_;
};

/// Winding number of closed oriented triangles by the signed crossings of a ray in a direction of no special
/// position. Triangles are binned in the plane across it; crossings are decided in long double.
class RayInside {
 public:
  explicit RayInside(const Surface& surface);
  /// Number of shells around x, cavities subtracted.
  [[nodiscard]] int winding(const Vec3& x) const;

 private:
  using Flat = std::array<long double, 3>;  // two coordinates across the ray, one along it
  [[nodiscard]] Flat turn(const Vec3& x) const;
  [[nodiscard]] std::size_t bin(long double u, long double v) const;

  std::array<std::array<long double, 3>, 3> axes_;
  std::vector<std::array<Flat, 3>> triangles_;
  std::vector<std::vector<std::uint32_t>> bins_;
  long double lo_[2], step_[2];
  int n_ = 1;
};

}  // namespace lamina::targets
