// A tree over pieces of a wall that finds those on which a closest point to x may lie: pieces within reach
// and with a normal that points to x.
//
// Each subtree knows its box and, for either side of the wall, a cone around its normals. It is left out when
// a plane parts them: a direction w that makes no obtuse angle with any normal of the cone, and in which all
// of the box lies beyond x. It is left out as well when all of its normals point in a direction that need not
// be found again, that of the wall below x, for example. The arithmetic is in single precision, four subtrees
// at once, and errs towards visiting too much.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/box_tree.h"
#include "vdb/detail/wide_tree.h"

namespace lamina::detail {

/// Directions around an axis.
struct Cone {
  std::array<float, 3> axis{};
  float cos_half = kNothing;

  static constexpr float kNothing = 2.0F, kEverything = -2.0F;
  static Cone nothing() { return {}; }
  static Cone everything() { return {{}, kEverything}; }
  static Cone around(const Vec3& direction);
  [[nodiscard]] bool holds_nothing() const { return cos_half > 1.0F; }
  /// Wider than a half space.
  [[nodiscard]] bool holds_all() const { return cos_half < 0.0F; }
  [[nodiscard]] Cone widened(double cos_by) const;
};

/// A cone around all of them.
Cone merge(std::span<const Cone> cones);

/// A piece of the wall: its box, and the cones of its normals to the front and to the back.
struct ConePiece {
  std::array<float, 3> lo, hi;
  std::array<Cone, 2> normals;
};

class ConeTree {
 public:
  /// `pieces` in the leaf order of `tree`, whose boxes hold them.
  ConeTree(const BoxTree& tree, std::span<const ConePiece> pieces);
  ConeTree() = default;

  /// Calls visit(position in leaf order) for every piece no farther than `reach` one of whose normals - to
  /// the front, to the back, or either - may point to x and differs by kKnownDegrees from the unit vector
  /// `known`, and for some others.
  template <class Visit>
  void visit_facing(const Vec3& x, double reach, bool front, bool back, const Vec3& known,
                    Visit&& visit) const;
  static constexpr double kKnownDegrees = 10.0;

 private:
  using Four = Eigen::Array4f;
  struct Cones {
    std::array<Four, 3> axis;
    Four tangent2;  ///< of the half angle, squared
    Four bias;      ///< added to margins: huge where the cone holds every direction, -huge where none
    Four known;     ///< cosine between axis and a known direction above which the cone holds nothing else
  };
  struct Node {
    std::array<Four, 3> lo, hi;
    std::array<Cones, 2> normals;
    std::array<std::int32_t, 4> child;  ///< >= 0: node; < 0: ~ position of a piece
    int count;
  };
  /// x - q for the points q of four boxes: its component of least size, and its range.
  struct Ways {
    std::array<Four, 3> nearest, least, most;
    Four squared;  ///< length of `nearest`
  };
  struct Subtree {
    std::int32_t code;
    std::array<Cone, 2> normals;
  };
  static Node make_node();
  Subtree build(const BoxTree& tree, std::span<const ConePiece> pieces, std::int32_t code);
  void put(Node& node, int at, const ConePiece& piece, std::int32_t child) const;
  static Ways ways_from(const Node& node, const Eigen::Array3f& below, const Eigen::Array3f& above);
  /// Negative where no q of the box has x in the cone of its normals.
  static Four margin(const Cones& cones, const Ways& ways);

  std::vector<Node> nodes_;
  double scale_ = 1.0;  ///< a power of two that brings coordinates near 1
  std::int32_t root_ = 0;
  bool empty_ = true;
};

inline ConeTree::Ways ConeTree::ways_from(const Node& node, const Eigen::Array3f& below,
                                          const Eigen::Array3f& above) {
  Ways way;
  way.squared.setZero();
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    way.least[a] = below[axis] - node.hi[a];
    way.most[a] = above[axis] - node.lo[a];
    way.nearest[a] = way.least[a].max(0.0F) + way.most[a].min(0.0F);
    way.squared += way.nearest[a] * way.nearest[a];
  }
  return way;
}

// The plane's normal w is the way from x to the nearest point of the box, turned towards the axis as far as
// the cone demands: any other choice were safe as well.
inline ConeTree::Four ConeTree::margin(const Cones& cones, const Ways& ways) {
  constexpr float kRounding = 5e-7F, kNoWay2 = 1e-12F;
  Four height = Four::Zero(), beside2 = Four::Zero();
  for (std::size_t a = 0; a < 3; ++a) height += ways.nearest[a] * cones.axis[a];
  std::array<Four, 3> beside;
  for (std::size_t a = 0; a < 3; ++a) {
    beside[a] = ways.nearest[a] - height * cones.axis[a];
    beside2 += beside[a] * beside[a];
  }
  const Four along = (cones.tangent2 * beside2 + kNoWay2 * ways.squared).sqrt().max(-height);
  Four beyond = Four::Zero(), size = Four::Zero();
  for (std::size_t a = 0; a < 3; ++a) {
    const Four w = along * cones.axis[a] - beside[a], one = w * ways.least[a], other = w * ways.most[a];
    beyond += one.max(other);
    size += one.abs().max(other.abs());
  }
  return beyond + kRounding * size + cones.bias;
}

template <class Visit>
void ConeTree::visit_facing(const Vec3& x, double reach, bool front, bool back, const Vec3& known,
                            Visit&& visit) const {
  if (empty_) return;
  constexpr double kMost = 1e12, kUlp = 1.2e-7;  // kMost: in sizes of the body
  constexpr float kAbove = 1.0F + 4e-6F, kDenormal = 1e-36F;
  Eigen::Array3f below, above;  // x in single precision, rounded both ways
  for (int a = 0; a < 3; ++a) {
    const double c = std::clamp(scale_ * x[a], -kMost, kMost), off = kUlp * std::abs(c);
    below[a] = static_cast<float>(c - off);
    above[a] = static_cast<float>(c + off);
  }
  const Eigen::Array3f way = known.cast<float>().array();
  const float most = static_cast<float>(std::min(scale_ * reach, 2.0 * kMost));
  const float most2 = most * most * kAbove + kDenormal;
  std::array<std::int32_t, 3 * kTreeStack + 4> stack;
  std::size_t depth = 0;
  stack[depth++] = root_;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      visit(static_cast<int>(~code));
      continue;
    }
    const Node& node = nodes_[static_cast<std::size_t>(code)];
    const Ways ways = ways_from(node, below, above);
    const Four within = most2 - ways.squared;
    Four verdict = Four::Constant(-1.0F);  // to be visited where it is not negative
    for (std::size_t side = front ? 0 : 1; side < (back ? 2U : 1U); ++side) {
      const Cones& cones = node.normals[side];
      const Four along = cones.axis[0] * way[0] + cones.axis[1] * way[1] + cones.axis[2] * way[2];
      const Four open = within.min(cones.known - along);
      if (open.maxCoeff() >= 0.0F) verdict = verdict.max(open.min(margin(cones, ways)));
    }
    for (int c = node.count; c-- > 0;)
      if (verdict[c] >= 0.0F) stack[depth++] = node.child[static_cast<std::size_t>(c)];
  }
}

}  // namespace lamina::detail
