// Where the curvature of a wall falls faster than elements can grow: the border of a fillet and a flat face,
// a ridge one facet wide.
//
// Between the corners of a facet curvature is interpolated, so it jumps at edges only where the facets beside
// them have shapes of their own, and falls steeply where one facet spans a bend and a flat. Such edges and
// vertices are sources: around them sizes start at those of the bend.
#pragma once

#include <vector>

#include "core/field.h"
#include "vdb/detail/curvature.h"
#include "vdb/detail/seeded_segments.h"
#include "vdb/detail/segment_minima.h"
#include "vdb/detail/topology.h"

namespace lamina::detail {

class Bends {
 public:
  Bends() = default;
  Bends(const Surface& surface, const Topology& topology, const Curvature& curvature);

  /// Fills bend_distance, bend_direction, bend_k1 and bend_k2 of `wall`, whose closest point lies on `facet`.
  void describe(const Surface& surface, Index facet, WallPoint& wall) const;
  /// As WallField::bends_beside().
  int beside(const WallPoint& wall, double reach, std::span<WallBend> out) const;

 private:
  struct Bend {
    Vec3 direction;  ///< of k1
    double k1, k2;
  };
  std::vector<Bend> bends_;
  SeededSegments segments_;
  SegmentMinima minima_;
};

}  // namespace lamina::detail
