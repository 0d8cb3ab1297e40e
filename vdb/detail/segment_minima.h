// Segments of curves on a wall at which the distance from a point has a local minimum.
//
// Curves are followed from segment to segment: where two share a vertex, the nearest point of one is no
// minimum when the distance falls on into the other. Subtrees are skipped by distance and - what makes it
// cheap along a long curve - when none of their segments can be at right angles to the way to x.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "core/box_tree.h"
#include "vdb/detail/bvh.h"

namespace lamina::detail {

/// Puts `item` into the `count` ones of `out`, the nearest first, where it is no farther than `reach`. Where
/// there is no more room the farthest is lost, and nothing beyond the last need be looked for.
template <class Item>
void keep_nearest(const Item& item, std::span<Item> out, std::size_t& count, double& reach) {
  if (item.distance > reach || out.empty()) return;
  if (count < out.size()) ++count;
  std::size_t at = count - 1;
  for (; at > 0 && out[at - 1].distance > item.distance; --at) out[at] = out[at - 1];
  out[at] = item;
  if (count == out.size()) reach = out.back().distance;
}

class SegmentMinima {
 public:
  /// `ends`: vertices of each segment, equal where it is a point; `points` by vertex.
  SegmentMinima(std::span<const Vec3> points, std::span<const std::array<Index, 2>> ends);
  SegmentMinima() = default;

  /// Calls visit(hit) for all minima no farther than `reach`, each once. It may lower `reach` on the way.
  template <class Visit>
  void visit(const Vec3& x, const double& reach, Visit&& visit) const;

 private:
  /// Directions of the segments of a subtree, up to sign.
  struct Spread {
    Vec3 axis = Vec3::Zero();
    double sine = 1.0;  ///< of the half angle; 1 where any direction may occur
  };
  using Two = Eigen::Array2d;
  /// Boxes and spreads of two subtrees.
  struct Node {
    std::array<Two, 3> center, half, axis;
    Two sine2;  ///< squared
    std::array<std::int32_t, 2> child;
  };
  struct Segment {
    Vec3 from, along;
    double length2;
  };
  /// The other ends of the segments that meet one in its end.
  struct Joint {
    Index begin = 0, count = 0;
    bool speaks = true;  ///< it is the first of them
  };
  Spread spread_over(const BoxTree& tree, std::int32_t code);
  static Spread join(const Spread& a, const Spread& b);
  [[nodiscard]] bool minimum(Index segment, const Vec3& x, SegmentHit& hit) const;

  std::vector<Node> nodes_;
  std::vector<Index> ids_;  ///< in leaf order
  std::int32_t root_ = 0;
  std::vector<Segment> segments_;
  std::vector<std::array<Joint, 2>> joints_;
  std::vector<Vec3> beyond_;
};

template <class Visit>
void SegmentMinima::visit(const Vec3& x, const double& reach, Visit&& visit) const {
  if (ids_.empty()) return;
  std::array<std::int32_t, kTreeStack> stack;
  std::size_t depth = 0;
  stack[depth++] = root_;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      SegmentHit hit;
      for (int i = leaf_begin(code), n = leaf_count(code); n > 0; ++i, --n)
        if (minimum(ids_[static_cast<std::size_t>(i)], x, hit) && hit.d2 <= reach * reach) visit(hit);
      continue;
    }
    // A segment at right angles to the way to x lies in the plane across the axis, or by the sine off it.
    const Node& node = nodes_[static_cast<std::size_t>(code)];
    Two near2 = Two::Zero(), far2 = Two::Zero(), along = Two::Zero(), slack = Two::Zero();
    for (std::size_t a = 0; a < 3; ++a) {
      const Two way = node.center[a] - x[static_cast<Eigen::Index>(a)], off = way.abs();
      const Two outer = (off - node.half[a]).max(0.0), most = off + node.half[a];
      near2 += outer * outer;
      far2 += most * most;
      along += way * node.axis[a];
      slack += node.half[a] * node.axis[a].abs();
    }
    const Two beyond = (along.abs() - slack).max(0.0);
    const Two margin = (reach * reach - near2).min(node.sine2 * far2 - beyond * beyond);
    const std::size_t first = near2[1] < near2[0] ? 1 : 0;
    for (const std::size_t c : {1 - first, first})
      if (margin[static_cast<Eigen::Index>(c)] >= 0.0) stack[depth++] = node.child[c];
  }
}

}  // namespace lamina::detail
