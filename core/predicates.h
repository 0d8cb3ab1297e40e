// Orientation predicates with an exact sign: a floating-point filter first, expansion arithmetic
// [Shewchuk1997] when the filter cannot decide. Built without contraction; the sign is a function of the
// coordinates alone.
#pragma once

#include "core/types.h"

namespace lamina {

/// > 0 when a, b, c turn counter-clockwise, < 0 clockwise, 0 collinear. The sign is exact; the value is twice
/// the signed area up to rounding (barring overflow and underflow of products of coordinate differences).
double orient2d(const Vec2& a, const Vec2& b, const Vec2& c);

/// > 0 when (b - a, c - a, d - a) is right-handed: a positive tetrahedron. The sign is exact; the value is
/// six times the signed volume up to rounding.
double orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Orientation of a simplex of D + 1 points.
template <int D>
double orient(const std::array<Vec<D>, D + 1>& x) {
  if constexpr (D == 2) {
    return orient2d(x[0], x[1], x[2]);
  } else {
    return orient3d(x[0], x[1], x[2], x[3]);
  }
}

}  // namespace lamina
