// Meshes of the plane and of space under one roof: walls and their metric are those of space, and a plane
// mesh is its section z = 0. There nothing changes along z, boxes go on forever, and z is a principal
// direction of every metric, which the section leaves out.
#pragma once

#include "core/level.h"
#include "core/metric.h"
#include "core/types.h"

namespace lamina {

/// Where boxes end that go on forever.
inline constexpr double kEndless = 1e100;

/// A box of the plane.
inline Box<3> endless(const Vec2& lo, const Vec2& hi) {
  return {{lo[0], lo[1], -kEndless}, {hi[0], hi[1], kEndless}};
}
inline bool is_planar(const Box<3>& box) { return box.lo[2] == -kEndless && box.hi[2] == kEndless; }
inline int dimension_of(const Box<3>& box) { return is_planar(box) ? 2 : 3; }

template <int D>
Vec3 in_space(const Vec<D>& x) {
  if constexpr (D == 2) {
    return {x[0], x[1], 0.0};
  } else {
    return x;
  }
}

template <int D>
Vec<D> section(const Vec3& x) {
  return x.head<D>();
}
template <int D>
Box<D> section(const Box<3>& box) {
  return {box.lo.head<D>(), box.hi.head<D>()};
}
/// REQUIRES z to be a principal direction where D = 2.
template <int D>
Metric<D> section(const Metric<3>& m) {
  if constexpr (D == 2) {
    return Metric<2>::from_factor(m.factor().topLeftCorner<2, 2>());
  } else {
    return m;
  }
}
template <int D>
Level<D> section(const Level<3>& level) {
  return {level.number, section<D>(level.way), section<D>(level.normal), section<D>(level.metric)};
}

}  // namespace lamina
