// A tree of boxes with four children a node, for nearest-first searches: half the levels of a BoxTree, and
// the distances to four boxes for the price of one.
//
// Distances to boxes are computed in single precision and lowered by more than its rounding, so that no box
// is passed over that holds the answer. What is found is compared in double.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/box_tree.h"

namespace lamina::detail {

/// A child of a binary node.
struct BoxChild {
  const BoxNode* parent;
  int side;
  [[nodiscard]] std::int32_t code() const { return parent->child[side]; }
  [[nodiscard]] double half_area() const;
};

struct FourChildren {
  std::array<BoxChild, 4> child;
  std::size_t count;
};

/// What is below an inner node: its two children, of which the inner one with the largest box is replaced by
/// its own two until there are four.
FourChildren gather_four(const BoxTree& tree, std::int32_t node);

struct WideNode {
  std::array<Eigen::Array4f, 3> lo, hi;
  std::array<std::int32_t, 4> child;  ///< as of BoxNode; slots without a child hold an empty leaf
};

class WideTree {
 public:
  explicit WideTree(const BoxTree& tree);
  WideTree() = default;

  /// As visit_nearest of BoxTree.
  template <class Leaf>
  void visit_nearest(const double* x, double& best, double slack, Leaf&& leaf) const;
  [[nodiscard]] double bytes() const { return static_cast<double>(nodes_.size() * sizeof(WideNode)); }

 private:
  /// A point between two in single precision.
  struct Bracket {
    explicit Bracket(const double* x);
    float lo[3], hi[3];
  };
  struct Item {
    double d2;
    std::int32_t node;
  };
  static Eigen::Array4f child_distances(const WideNode& node, const Bracket& x);
  std::int32_t widen(const BoxTree& tree, std::int32_t code);

  std::vector<WideNode> nodes_;
  std::int32_t root_ = ~0;
};

inline WideTree::Bracket::Bracket(const double* x) {
  constexpr double kMost = 3e38, kUlp = 1.2e-7;
  for (int a = 0; a < 3; ++a) {
    const double c = std::clamp(x[a], -kMost, kMost), off = kUlp * std::abs(c);
    lo[a] = static_cast<float>(c - off);
    hi[a] = static_cast<float>(c + off);
  }
}

inline Eigen::Array4f WideTree::child_distances(const WideNode& node, const Bracket& x) {
  constexpr float kBelow = 1.0F - 2e-6F, kDenormal = 1e-36F;
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (std::size_t a = 0; a < 3; ++a) {
    const Eigen::Array4f outer = (node.lo[a] - x.hi[a]).max(x.lo[a] - node.hi[a]).max(0.0F);
    sum += outer * outer;
  }
  return sum.min(std::numeric_limits<float>::max()) * kBelow - kDenormal;
}

template <class Leaf>
void WideTree::visit_nearest(const double* x, double& best, double slack, Leaf&& leaf) const {
  const Bracket bracket(x);
  std::array<Item, 3 * kTreeStack + 4> stack;
  std::size_t depth = 0;
  std::int32_t code = root_;
  for (;;) {
    if (code < 0) {
      leaf(leaf_begin(code), leaf_count(code));
    } else {
      const WideNode& node = nodes_[static_cast<std::size_t>(code)];
      const Eigen::Array4f d2 = child_distances(node, bracket);
      const std::size_t first = depth;
      for (int c = 0; c < 4; ++c) {
        const Item item{slack * static_cast<double>(d2[c]), node.child[static_cast<std::size_t>(c)]};
        if (!(item.d2 < best)) continue;
        std::size_t at = depth++;  // farthest first
        for (; at > first && stack[at - 1].d2 < item.d2; --at) stack[at] = stack[at - 1];
        stack[at] = item;
      }
    }
    do {
      if (depth == 0) return;
      --depth;
    } while (!(stack[depth].d2 < best));
    code = stack[depth].node;
  }
}

}  // namespace lamina::detail
