// Curvatures of a wall as sizes can follow them.
//
// The chord of [eq. 29] is sqrt(2 h / k): where the curvature k of a smooth wall passes through zero it has
// no limit, and a short way beside it is small. Here sqrt(1 / k) grows from vertex to vertex by at most the
// distance over a given length, from the least value around. That length is sqrt(2 h) over the growth of
// sizes per unit of length: the larger the sizes, the farther a bend is felt. Values are kept for lengths
// that double, and interpolated between them.
#pragma once

#include <array>
#include <vector>

#include "vdb/detail/curvature.h"

namespace lamina::detail {

class GradedCurvature {
 public:
  GradedCurvature() = default;
  GradedCurvature(const Surface& surface, const Curvature& curvature);

  [[nodiscard]] bool empty() const { return values_.empty(); }
  /// Magnitudes that stand for k1 and k2 at barycentric coordinates of a facet, 1/length. `root`: distance
  /// over which sqrt(1 / k) may grow by 1, in sqrt(length).
  [[nodiscard]] std::array<double, 2> at(const std::array<Index, 3>& shapes,
                                         const std::array<double, 3>& bary, double root) const;

 private:
  static constexpr int kLevels = 14;
  using Values = std::array<std::array<float, 2>, kLevels>;  // sqrt(1 / k1), sqrt(1 / k2)
  double first_ = 1.0;                                       // length of level 0
  std::vector<Values> values_;                               // per shape
};

}  // namespace lamina::detail
