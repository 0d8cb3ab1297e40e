// As in WideTree each node takes two levels of the binary tree; the pieces of a leaf are children as well.
#include "vdb/detail/cone_tree.h"

#include <numbers>

namespace lamina::detail {
namespace {

// cos(a + b) for angles in [0, pi] whose sum may exceed pi: then -1.
double cos_sum(double cos_a, double cos_b) {
  if (cos_a <= -cos_b) return -1.0;
  const double sa = std::sqrt(std::max(0.0, 1.0 - cos_a * cos_a)),
               sb = std::sqrt(std::max(0.0, 1.0 - cos_b * cos_b));
  return cos_a * cos_b - sa * sb;
}

Vec3 axis_of(const Cone& c) { return {c.axis[0], c.axis[1], c.axis[2]}; }

Cone make_cone(const Vec3& axis, double cosine) {
  constexpr double kWidest = 1e-3;  // cosine: wider ones part nothing
  if (cosine < kWidest) return Cone::everything();
  return {{static_cast<float>(axis[0]), static_cast<float>(axis[1]), static_cast<float>(axis[2])},
          static_cast<float>(cosine)};
}

}  // namespace

Cone Cone::around(const Vec3& direction) { return make_cone(direction, 1.0); }

Cone Cone::widened(double cos_by) const {
  return holds_nothing() || holds_all() ? *this : make_cone(axis_of(*this), cos_sum(cos_half, cos_by));
}

Cone merge(std::span<const Cone> cones) {
  Vec3 axis = Vec3::Zero();
  bool empty = true;
  for (const Cone& c : cones) {
    if (c.holds_nothing()) continue;
    if (c.holds_all()) return Cone::everything();
    empty = false;
    axis += axis_of(c);
  }
  if (empty) return Cone::nothing();
  if (axis.norm() < 1e-3) return Cone::everything();
  axis.normalize();
  constexpr double kRounding = 1e-6;
  double cosine = 1.0;
  for (const Cone& c : cones)
    if (!c.holds_nothing())
      cosine = std::min(cosine,
                        cos_sum(std::clamp(axis.dot(axis_of(c)), -1.0, 1.0), double{c.cos_half}) - kRounding);
  return make_cone(axis, cosine);
}

ConeTree::ConeTree(const BoxTree& tree, std::span<const ConePiece> pieces) {
  if (tree.empty()) return;
  empty_ = false;
  float most = 0.0F;
  for (const ConePiece& piece : pieces)
    for (std::size_t a = 0; a < 3; ++a) most = std::max({most, std::abs(piece.lo[a]), std::abs(piece.hi[a])});
  if (most > 0.0F) scale_ = std::exp2(-std::ceil(std::log2(double{most})));
  nodes_.reserve(pieces.size() / 2 + 1);
  root_ = build(tree, pieces, tree.root).code;
}

void ConeTree::put(Node& node, int at, const ConePiece& piece, std::int32_t child) const {
  for (std::size_t a = 0; a < 3; ++a) {
    node.lo[a][at] = static_cast<float>(scale_ * piece.lo[a]);
    node.hi[a][at] = static_cast<float>(scale_ * piece.hi[a]);
  }
  for (std::size_t side = 0; side < 2; ++side) {
    const Cone& from = piece.normals[side];
    Cones& to = node.normals[side];
    constexpr float kHuge = 1e37F;
    const bool plain = !from.holds_all() && !from.holds_nothing();
    for (std::size_t a = 0; a < 3; ++a) to.axis[a][at] = plain ? from.axis[a] : 0.0F;
    const float cos2 = from.cos_half * from.cos_half;
    to.tangent2[at] = plain ? std::max(0.0F, 1.0F - cos2) / cos2 : 0.0F;
    constexpr double kRadians = std::numbers::pi / 180.0, kRounding = 0.1;  // kRounding: degrees
    const double beside = (kKnownDegrees - kRounding) * kRadians - std::acos(std::min(1.0F, from.cos_half));
    to.known[at] = plain && beside > 0.0 ? static_cast<float>(std::cos(beside)) : 2.0F;
    to.bias[at] = plain ? 0.0F : from.holds_all() ? kHuge : -kHuge;
  }
  node.child[static_cast<std::size_t>(at)] = child;
}

ConeTree::Node ConeTree::make_node() {
  Node node;
  node.lo.fill(Four::Zero());
  node.hi.fill(Four::Zero());
  for (Cones& c : node.normals) {
    c.axis.fill(Four::Zero());
    c.tangent2 = c.bias = c.known = Four::Zero();
  }
  node.child.fill(0);
  node.count = 0;
  return node;
}

ConeTree::Subtree ConeTree::build(const BoxTree& tree, std::span<const ConePiece> pieces, std::int32_t code) {
  if (code < 0 && leaf_count(code) == 1)
    return {~leaf_begin(code), pieces[static_cast<std::size_t>(leaf_begin(code))].normals};
  const std::size_t at = nodes_.size();
  nodes_.push_back(make_node());
  Node node = make_node();
  std::array<std::array<Cone, 4>, 2> below;
  const auto add = [&](const ConePiece& piece, std::int32_t child) {
    for (std::size_t side = 0; side < 2; ++side)
      below[side][static_cast<std::size_t>(node.count)] = piece.normals[side];
    put(node, node.count++, piece, child);
  };
  if (code < 0) {
    for (int k = leaf_begin(code); k < leaf_begin(code) + leaf_count(code); ++k)
      add(pieces[static_cast<std::size_t>(k)], ~k);
  } else {
    const auto [child, count] = gather_four(tree, code);
    for (std::size_t c = 0; c < count; ++c) {
      const Subtree subtree = build(tree, pieces, child[c].code());
      ConePiece piece{{}, {}, subtree.normals};
      for (std::size_t a = 0; a < 3; ++a) {
        piece.lo[a] = child[c].parent->lo[a][child[c].side];
        piece.hi[a] = child[c].parent->hi[a][child[c].side];
      }
      add(piece, subtree.code);
    }
  }
  nodes_[at] = node;
  const std::size_t count = static_cast<std::size_t>(node.count);
  return {static_cast<std::int32_t>(at), {merge({below[0].data(), count}), merge({below[1].data(), count})}};
}

}  // namespace lamina::detail
