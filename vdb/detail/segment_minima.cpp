#include "vdb/detail/segment_minima.h"

#include <algorithm>
#include <cmath>

namespace lamina::detail {

SegmentMinima::SegmentMinima(std::span<const Vec3> points, std::span<const std::array<Index, 2>> ends) {
  const auto point = [&](Index v) -> const Vec3& { return points[static_cast<std::size_t>(v)]; };
  std::vector<std::pair<Index, Index>> at;  // vertex, segment
  std::vector<BoxRef> refs;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto [a, b] = ends[i];
    const auto id = static_cast<Index>(i);
    at.emplace_back(a, id);
    if (b != a) at.emplace_back(b, id);
    const Vec3 along = point(b) - point(a);
    segments_.push_back({point(a), along, along.squaredNorm()});
    const std::array<Vec3, 2> both{point(a), point(b)};
    refs.push_back(BoxRef::around(both.data(), 2, id));
  }
  std::sort(at.begin(), at.end());
  joints_.resize(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k) {
      const Index v = ends[i][k];
      Joint& joint = joints_[i][k];
      joint.begin = static_cast<Index>(beyond_.size());
      for (auto s = std::lower_bound(at.begin(), at.end(), std::pair{v, Index{0}});
           s != at.end() && s->first == v; ++s) {
        if (s->second == static_cast<Index>(i)) continue;
        joint.speaks = joint.speaks && s->second > static_cast<Index>(i);
        const std::array<Index, 2>& other = ends[static_cast<std::size_t>(s->second)];
        beyond_.push_back(point(other[other[0] == v ? 1 : 0]));
      }
      joint.count = static_cast<Index>(beyond_.size()) - joint.begin;
    }
  BoxTree tree = build_box_tree(std::move(refs));
  nodes_.resize(tree.nodes.size());
  root_ = tree.root;
  ids_ = std::move(tree.ids);
  if (!ids_.empty()) spread_over(tree, root_);
}

// The smallest cone around two; cones wider than a quarter turn hold everything.
SegmentMinima::Spread SegmentMinima::join(const Spread& a, const Spread& b) {
  if (a.sine >= 1.0 || b.sine >= 1.0) return {};
  const Vec3 other = a.axis.dot(b.axis) < 0.0 ? Vec3(-b.axis) : b.axis;
  const Vec3 axis = (a.axis + other).normalized();
  const auto angle = [&](const Vec3& v, double sine) {
    return std::asin(std::min(1.0, v.cross(axis).norm())) + std::asin(sine);
  };
  const double half = std::max(angle(a.axis, a.sine), angle(other, b.sine));
  constexpr double kWide = 1.5;
  if (half >= kWide) return {};
  return {axis, std::sin(half)};
}

SegmentMinima::Spread SegmentMinima::spread_over(const BoxTree& tree, std::int32_t code) {
  if (code >= 0) {
    const BoxNode& boxes = tree.nodes[static_cast<std::size_t>(code)];
    std::array<Spread, 2> spread;
    for (int c = 0; c < 2; ++c) {
      spread[static_cast<std::size_t>(c)] = spread_over(tree, boxes.child[c]);
      Node& node = nodes_[static_cast<std::size_t>(code)];
      const Spread& own = spread[static_cast<std::size_t>(c)];
      for (std::size_t a = 0; a < 3; ++a) {
        const double lo = static_cast<double>(boxes.lo[a][c]), hi = static_cast<double>(boxes.hi[a][c]);
        node.center[a][c] = 0.5 * (lo + hi);
        node.half[a][c] = 0.5 * (hi - lo);
        node.axis[a][c] = own.axis[static_cast<Eigen::Index>(a)];
      }
      node.sine2[c] = own.sine * own.sine;
      node.child[static_cast<std::size_t>(c)] = boxes.child[c];
    }
    return join(spread[0], spread[1]);
  }
  // A vertex where a curve turns is a minimum seen from between the directions beside it.
  constexpr double kRounding = 1e-6;
  Spread all;
  bool first = true;
  const auto add = [&](const Vec3& way) {
    const double length = way.norm();
    const Spread own = length > 0.0 ? Spread{way / length, kRounding} : Spread{};
    all = first ? own : join(all, own);
    first = false;
  };
  for (int i = leaf_begin(code), n = leaf_count(code); n > 0; ++i, --n) {
    const auto id = static_cast<std::size_t>(ids_[static_cast<std::size_t>(i)]);
    const Segment& s = segments_[id];
    add(s.along);
    for (std::size_t k = 0; k < 2; ++k) {
      const Joint& joint = joints_[id][k];
      if (joint.count == 0) add(Vec3::Zero());  // the end of a curve is seen from anywhere
      const Vec3 end = k == 0 ? s.from : Vec3(s.from + s.along);
      for (Index j = joint.begin; joint.speaks && j < joint.begin + joint.count; ++j)
        add(beyond_[static_cast<std::size_t>(j)] - end);
    }
  }
  return all;
}

bool SegmentMinima::minimum(Index segment, const Vec3& x, SegmentHit& hit) const {
  const auto id = static_cast<std::size_t>(segment);
  const Segment& s = segments_[id];
  const Vec3 way = x - s.from;
  const double t = s.length2 > 0.0 ? std::clamp(way.dot(s.along) / s.length2, 0.0, 1.0) : 0.0;
  const Vec3 offset = way - t * s.along;
  hit = {offset.squaredNorm(), segment, t};
  if (t > 0.0 && t < 1.0) return true;
  const Joint& joint = joints_[id][t > 0.0 ? 1 : 0];
  const Vec3 end = t > 0.0 ? Vec3(s.from + s.along) : s.from;
  if (!joint.speaks) return false;
  for (Index j = joint.begin; j < joint.begin + joint.count; ++j)
    if (offset.dot(beyond_[static_cast<std::size_t>(j)] - end) > 0.0) return false;
  return true;
}

}  // namespace lamina::detail
