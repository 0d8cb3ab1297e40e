// Nearest segments as seen from the facets of a surface.
#pragma once

#include <array>
#include <vector>

#include "vdb/detail/bvh.h"
#include "vdb/surface.h"

namespace lamina::detail {

/// A search for a point on facet t starts from the nearest segments of the corners of t, known beforehand:
/// that bound is so tight that the tree walk visits a handful of nodes.
class SeededSegments {
 public:
  SeededSegments() = default;
  SeededSegments(const Surface& surface, const std::vector<std::array<Vec3, 2>>& segments);

  /// REQUIRES x on `facet` of the surface it was made for, and !empty().
  [[nodiscard]] SegmentHit closest(const Surface& surface, Index facet, const Vec3& x) const;
  [[nodiscard]] const SegmentBvh& tree() const { return tree_; }
  [[nodiscard]] bool empty() const { return tree_.empty(); }

 private:
  SegmentBvh tree_;
  std::vector<Index> nearest_;  ///< per vertex
};

}  // namespace lamina::detail
