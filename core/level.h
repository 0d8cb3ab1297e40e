// The surfaces between thin layers along a wall.
#pragma once

#include "core/metric.h"

namespace lamina {

/// The surface of a stack of thin layers that is nearest to a point.
template <int D>
struct Level {
  int number = 0;                  ///< 0: the wall; negative on its other side
  Vec<D> way = Vec<D>::Zero();     ///< from the point to the level
  Vec<D> normal = Vec<D>::Zero();  ///< unit normal of the level
  Metric<D> metric;                ///< at the end of the way
};

}  // namespace lamina
