// Where the linear interpolation of a scalar over a simplex is zero.
//
// A value of zero counts as positive, so that a facet on which the scalar vanishes belongs to one of its two
// cells, the one on the negative side.
#pragma once

#include <array>

#include "mesh/mesh.h"

namespace lamina {

/// A segment (D = 2), or a triangle or quadrilateral (D = 3) with its corners in order around it.
template <int D>
struct ZeroPiece {
  std::array<Vec<D>, 2 * (D - 1)> corners;
  int count = 0;  ///< of corners; 0: the scalar does not change its sign

  [[nodiscard]] Vec<D> centroid() const {
    Vec<D> sum = Vec<D>::Zero();
    for (int i = 0; i < count; ++i) sum += corners[i];
    return sum / count;
  }
  /// Normal to the piece, as long as its length (D = 2) or area (D = 3); of either sign.
  [[nodiscard]] Vec<D> area() const {
    if constexpr (D == 2) {
      const Vec2 e = corners[1] - corners[0];
      return {e[1], -e[0]};
    } else {
      Vec3 sum = Vec3::Zero();
      for (int i = 2; i < count; ++i)
        sum += 0.5 * Vec3(corners[i - 1] - corners[0]).cross(Vec3(corners[i] - corners[0]));
      return sum;
    }
  }
};

/// REQUIRES finite values.
template <int D>
ZeroPiece<D> zero_piece(const std::array<Vec<D>, D + 1>& x, const std::array<double, D + 1>& value) {
  std::array<int, D + 1> above, below;
  int n = 0, m = 0;
  for (int i = 0; i <= D; ++i) (value[i] >= 0.0 ? above[n++] : below[m++]) = i;
  ZeroPiece<D> piece;
  const auto add = [&](int i, int j) {
    const double t = value[i] / (value[i] - value[j]);
    piece.corners[piece.count++] = x[i] + t * (x[j] - x[i]);
  };
  if (n == 2 && m == 2) {
    add(above[0], below[0]);
    add(above[0], below[1]);
    add(above[1], below[1]);
    add(above[1], below[0]);
  } else {
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < m; ++j) add(above[i], below[j]);
  }
  return piece;
}

/// The same of one cell; `value` holds one for each point.
template <int D>
ZeroPiece<D> zero_piece(const Mesh<D>& mesh, const std::vector<double>& value, std::size_t cell) {
  std::array<Vec<D>, D + 1> x;
  std::array<double, D + 1> v;
  for (int i = 0; i <= D; ++i) {
    x[i] = mesh.points[mesh.cells[cell][i]];
    v[i] = value[mesh.cells[cell][i]];
  }
  return zero_piece<D>(x, v);
}

}  // namespace lamina
