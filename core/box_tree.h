// A binary tree of axis-aligned boxes over primitives of any kind, and its nearest-first traversal.
//
// Nodes hold the boxes of both children in single precision rounded outward, so that a box never excludes
// what it holds; all arithmetic on them is double. The tree is split by the surface area heuristic over 16
// bins.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/types.h"

namespace lamina::detail {

/// Box of a primitive on entry to the build.
struct BoxRef {
  float lo[3], hi[3];
  Index id;

  /// The smallest float box that holds the points.
  static BoxRef around(const Vec3* points, int count, Index id);
};

struct BoxNode {
  float lo[3][2], hi[3][2];  ///< [axis][child]
  std::int32_t child[2];     ///< >= 0: inner node; < 0: leaf, see leaf_begin and leaf_count
};

inline int leaf_begin(std::int32_t child) { return static_cast<int>(~child) >> 3; }
inline int leaf_count(std::int32_t child) { return static_cast<int>(~child) & 7; }

struct BoxTree {
  std::vector<BoxNode> nodes;  ///< node 0 is the root when there are any
  std::vector<Index> ids;      ///< primitive ids in leaf order; an id may occur in several leaves
  std::int32_t root = 0;       ///< 0, or a leaf when all primitives fit into one

  [[nodiscard]] bool empty() const { return ids.empty(); }
};

/// Leaves hold at most 4 primitives. GUARANTEES the same tree for every thread count.
BoxTree build_box_tree(std::vector<BoxRef> refs);

inline constexpr int kTreeStack = 128;  ///< the build bounds the depth of a tree below this

/// Squared distances from x to both child boxes.
inline void child_distances(const BoxNode& node, const double* x, double* d2) {
  d2[0] = d2[1] = 0.0;
  for (int a = 0; a < 3; ++a) {
    for (int c = 0; c < 2; ++c) {
      const double below = static_cast<double>(node.lo[a][c]) - x[a];
      const double above = x[a] - static_cast<double>(node.hi[a][c]);
      const double outer = std::max(std::max(below, above), 0.0);
      d2[c] += outer * outer;
    }
  }
}

/// Visits leaves nearest first; `leaf(begin, count)` lowers `best` (a squared distance), subtrees whose
/// squared distance times `slack` is not below `best` are skipped.
template <class Leaf>
void visit_nearest(const BoxTree& tree, const double* x, double& best, double slack, Leaf&& leaf) {
  if (tree.empty()) return;
  struct Item {
    double d2;
    std::int32_t node;
  } stack[kTreeStack];
  int depth = 0;
  std::int32_t node = tree.root;
  for (;;) {
    if (node < 0) {
      leaf(leaf_begin(node), leaf_count(node));
    } else {
      const BoxNode& n = tree.nodes[static_cast<std::size_t>(node)];
      double d2[2];
      child_distances(n, x, d2);
      const int near = d2[1] < d2[0] ? 1 : 0;
      if (d2[1 - near] * slack < best) stack[depth++] = {d2[1 - near], n.child[1 - near]};
      if (d2[near] * slack < best) {
        node = n.child[near];
        continue;
      }
    }
    do {
      if (depth == 0) return;
      --depth;
    } while (!(stack[depth].d2 * slack < best));
    node = stack[depth].node;
  }
}

}  // namespace lamina::detail
