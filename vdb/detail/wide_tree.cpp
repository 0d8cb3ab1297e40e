// Each node takes two levels of a binary tree.
#include "vdb/detail/wide_tree.h"

namespace lamina::detail {
namespace {

constexpr float kNowhere = 3e38F;

}  // namespace

double BoxChild::half_area() const {
  double e[3];
  for (int a = 0; a < 3; ++a) e[a] = double(parent->hi[a][side]) - parent->lo[a][side];
  return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

FourChildren gather_four(const BoxTree& tree, std::int32_t node) {
  const BoxNode& top = tree.nodes[static_cast<std::size_t>(node)];
  FourChildren four{{BoxChild{&top, 0}, BoxChild{&top, 1}}, 2};
  auto& [child, count] = four;
  while (count < 4) {
    std::size_t widest = count;
    for (std::size_t c = 0; c < count; ++c)
      if (child[c].code() >= 0 && (widest == count || child[c].half_area() > child[widest].half_area()))
        widest = c;
    if (widest == count) break;
    const BoxNode& inner = tree.nodes[static_cast<std::size_t>(child[widest].code())];
    child[widest] = {&inner, 0};
    child[count++] = {&inner, 1};
  }
  return four;
}

WideTree::WideTree(const BoxTree& tree) {
  if (tree.empty()) return;
  nodes_.reserve(tree.nodes.size() / 2 + 1);
  root_ = widen(tree, tree.root);
}

std::int32_t WideTree::widen(const BoxTree& tree, std::int32_t code) {
  if (code < 0) return code;
  const auto [child, count] = gather_four(tree, code);
  const std::size_t at = nodes_.size();
  WideNode node;
  node.lo.fill(Eigen::Array4f::Constant(kNowhere));
  node.hi.fill(Eigen::Array4f::Constant(kNowhere));
  node.child.fill(~0);
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t a = 0; a < 3; ++a) {
      node.lo[a][static_cast<Eigen::Index>(c)] = child[c].parent->lo[a][child[c].side];
      node.hi[a][static_cast<Eigen::Index>(c)] = child[c].parent->hi[a][child[c].side];
    }
  nodes_.push_back(node);
  for (std::size_t c = 0; c < count; ++c) {
    const std::int32_t below = widen(tree, child[c].code());
    nodes_[at].child[c] = below;
  }
  return static_cast<std::int32_t>(at);
}

}  // namespace lamina::detail
