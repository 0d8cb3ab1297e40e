// Other walls in reach. A point q of the wall is a local minimum of the distance from x when it is the
// closest point of its facet and no neighbour of the feature it lies on comes closer. Subtrees are skipped by
// distance and - what makes it cheap along a plain wall - when no normal below them points towards x: at a
// local minimum x lies in the hull of the normals around q. Facets at rims and where more than two meet allow
// every direction. Corners and edges are looked for at one of their facets only, and on the side to which
// they stand out: from within a convex body none of them is a minimum.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "vdb/detail/facet_wall.h"

namespace lamina::detail {
namespace {

constexpr double kSeparation = 0.98480775301220806;  // cosine of ConeTree::kKnownDegrees

// The facet of a corner or edge that speaks for all around it: the first one on the wall.
Index spokesman(const SignRule& sign, std::span<const Index> corners) {
  for (const Index c : corners)
    if (sign.on_wall(c / 4)) return c / 4;
  return kNone;
}

// Boxes of the leaves by the position of what they hold; without limits where the root is a leaf.
struct LeafBoxes {
  std::vector<std::array<float, 3>> lo, hi;
};

LeafBoxes leaf_boxes(const BoxTree& tree) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  LeafBoxes boxes{{tree.ids.size(), {-kFar, -kFar, -kFar}}, {tree.ids.size(), {kFar, kFar, kFar}}};
  for (const BoxNode& node : tree.nodes)
    for (std::size_t c = 0; c < 2; ++c) {
      const std::int32_t child = node.child[c];
      for (int k = child < 0 ? leaf_begin(child) : 0, n = child < 0 ? leaf_count(child) : 0; n > 0; ++k, --n)
        for (std::size_t a = 0; a < 3; ++a) {
          boxes.lo[static_cast<std::size_t>(k)][a] = node.lo[a][c];
          boxes.hi[static_cast<std::size_t>(k)][a] = node.hi[a][c];
        }
    }
  return boxes;
}

}  // namespace

// The directions in which a facet may be seen as a local minimum, from its front and from its back: its
// normal and, for the edges and corners that it speaks for, the normals around them where they stand out to
// that side. A flat face beside a sharp edge so keeps its one direction, except in one row of facets.
std::array<Cone, 2> FacetWall::normals_of(Index facet) const {
  constexpr double kFlat = 1e-5;
  constexpr double kWider = 0.9999;  // cosine: covers kFlat, single precision, and rounding at slivers
  const std::size_t t = static_cast<std::size_t>(facet);
  std::array<std::vector<Cone>, 2> sides;
  bool all = false;
  const auto add = [&](std::size_t side, Index other) {
    const Vec3& n = topology_.normals[static_cast<std::size_t>(other)];
    all = all || n.isZero();
    sides[side].push_back(Cone::around(side == 0 ? n : Vec3(-n)));
  };
  for (const std::size_t side : {0u, 1u}) add(side, facet);
  for (std::size_t k = 0; k < 3; ++k) {
    const Edge& e = topology_.edges[static_cast<std::size_t>(topology_.facet_edges[t][k])];
    const std::span<const Index> half = topology_.half_edges_of(e);
    if (spokesman(sign_, half) == facet) {
      all = all || !e.regular;
      if (std::abs(e.angle) > kFlat)
        for (const Index h : half) add(e.angle > 0.0 ? 0 : 1, h / 4);
    }
    const std::span<const Index> star = topology_.star_of(surface_.triangles[t][k]);
    if (spokesman(sign_, star) != facet) continue;
    std::array<bool, 2> stands_out{};
    for (const Index c : star)
      for (const Index side : {c % 4, (c % 4 + 2) % 3}) {
        const std::size_t id = static_cast<std::size_t>(
            topology_.facet_edges[static_cast<std::size_t>(c / 4)][static_cast<std::size_t>(side)]);
        const Edge& spoke = topology_.edges[id];
        all = all || !spoke.regular;
        stands_out[0] = stands_out[0] || spoke.angle > kFlat;
        stands_out[1] = stands_out[1] || spoke.angle < -kFlat;
      }
    for (const std::size_t side : {0u, 1u})
      if (stands_out[side])
        for (const Index c : star) add(side, c / 4);
  }
  if (all) return {Cone::everything(), Cone::everything()};
  return {merge(sides[0]).widened(kWider), merge(sides[1]).widened(kWider)};
}

std::vector<ConePiece> FacetWall::make_pieces() const {
  const BoxTree& tree = bvh_.tree();
  const LeafBoxes leaves = leaf_boxes(tree);
  std::vector<ConePiece> pieces(tree.ids.size());
  for_each_index(pieces.size(), [&](std::size_t k) {
    // A long facet is entered by several boxes: each stands for the part of the facet in it.
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) {
      const Index v = surface_.triangles[static_cast<std::size_t>(tree.ids[k])][i];
      corners[i] = surface_.points[static_cast<std::size_t>(v)] - bvh_.origin();
    }
    const BoxRef whole = BoxRef::around(corners.data(), 3, tree.ids[k]);
    ConePiece& piece = pieces[k];
    for (std::size_t a = 0; a < 3; ++a) {
      piece.lo[a] = std::max(whole.lo[a], leaves.lo[k][a]);
      piece.hi[a] = std::min(whole.hi[a], leaves.hi[k][a]);
    }
    piece.normals = normals_of(tree.ids[k]);
  });
  return pieces;
}

// Does the wall come closer to x on the way from the closest point of a facet into one of its neighbours?
// Cheap and certain when true; false decides nothing.
bool FacetWall::descends(const TriangleHit& hit) const {
  const double least = 2e-6 * std::sqrt(hit.d2);
  const auto towards = [&](Index v) {
    const Vec3 way = surface_.points[static_cast<std::size_t>(v)] - hit.point;
    return hit.offset.dot(way) > least * way.norm();
  };
  const std::array<Index, 3>& corners = surface_.triangles[static_cast<std::size_t>(hit.triangle)];
  if (hit.feature >= kCorner0) {
    const Index v = corners[static_cast<std::size_t>(hit.feature - kCorner0)];
    for (const Index c : topology_.star_of(v)) {
      const std::array<Index, 3>& t = surface_.triangles[static_cast<std::size_t>(c / 4)];
      if (towards(t[static_cast<std::size_t>((c % 4 + 1) % 3)]) ||
          towards(t[static_cast<std::size_t>((c % 4 + 2) % 3)]))
        return true;
    }
  } else if (hit.feature >= kEdge0) {
    const std::array<Index, 3>& edges = topology_.facet_edges[static_cast<std::size_t>(hit.triangle)];
    const Edge& e =
        topology_.edges[static_cast<std::size_t>(edges[static_cast<std::size_t>(hit.feature - kEdge0)])];
    for (const Index h : topology_.half_edges_of(e))
      if (towards(
              surface_.triangles[static_cast<std::size_t>(h / 4)][static_cast<std::size_t>((h % 4 + 2) % 3)]))
        return true;
  }
  return false;
}

bool FacetWall::is_local_minimum(const Vec3& x, const TriangleHit& hit) const {
  const std::size_t t = static_cast<std::size_t>(hit.triangle);
  const double limit = hit.d2 * (1.0 - 1e-12);
  const auto closer = [&](Index facet) {
    const std::array<Index, 3>& v = surface_.triangles[static_cast<std::size_t>(facet)];
    const auto p = [&](std::size_t k) -> const Vec3& {
      return surface_.points[static_cast<std::size_t>(v[k])];
    };
    return facet != hit.triangle && closest_on_triangle(p(0), p(1), p(2), x).d2 < limit;
  };
  // A rim is no end of the wall where another facet goes on behind it.
  const auto goes_on = [&](Index edge) {
    const Index partner = topology_.edges[static_cast<std::size_t>(edge)].partner;
    return partner != kNone && closer(partner);
  };
  if (hit.feature >= kCorner0) {
    const Index v = surface_.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)];
    if (spokesman(sign_, topology_.star_of(v)) != hit.triangle || descends(hit)) return false;
    for (const Index c : topology_.star_of(v)) {
      const std::array<Index, 3>& edges = topology_.facet_edges[static_cast<std::size_t>(c / 4)];
      if (closer(c / 4) || goes_on(edges[static_cast<std::size_t>(c % 4)]) ||
          goes_on(edges[static_cast<std::size_t>((c % 4 + 2) % 3)]))
        return false;
    }
  } else if (hit.feature >= kEdge0) {
    const Index id = topology_.facet_edges[t][static_cast<std::size_t>(hit.feature - kEdge0)];
    const std::span<const Index> half =
        topology_.half_edges_of(topology_.edges[static_cast<std::size_t>(id)]);
    if (spokesman(sign_, half) != hit.triangle || descends(hit)) return false;
    for (const Index h : half)
      if (closer(h / 4)) return false;
    if (goes_on(id)) return false;
  }
  return true;
}

// The wall must face x, so that the space in front of it is of the kind x is in: its other side is not seen.
bool FacetWall::faces(const TriangleHit& hit, double sign) const {
  const double front = sign_.side(surface_, topology_, hit);
  return front == 0.0 || front == sign;
}

void FacetWall::collect(const Vec3& x, double sign, double reach, const Vec3& main,
                        std::vector<Candidate>& out) const {
  const bool front = sign > 0.0 || !sign_.oriented(), back = sign < 0.0 || !sign_.oriented();
  cones_.visit_facing(x - bvh_.origin(), reach, front, back, -main, [&](int slot) {
    const TriangleHit hit = bvh_.on_slot(slot, x);
    if (hit.d2 > reach * reach) return;
    const double d = std::sqrt(hit.d2);
    const Vec3 to = d > tiny_ ? Vec3(-hit.offset / d)
                              : Vec3(-sign * topology_.normals[static_cast<std::size_t>(hit.triangle)]);
    if (to.dot(main) > kSeparation || !is_local_minimum(x, hit)) return;
    out.push_back({hit.d2, hit, to});
  });
}

int FacetWall::others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const {
  if (out.empty() || !(std::abs(nearest.phi) <= reach)) return 0;
  const double sign = nearest.phi < 0.0 ? -1.0 : 1.0;
  Vec3 main = nearest.closest - x;
  main = main.norm() > tiny_ ? Vec3(main.normalized()) : Vec3(-sign * nearest.N);
  thread_local std::vector<Candidate> found;
  found.clear();
  collect(x, sign, reach, main, found);
  std::sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return a.d2 != b.d2 ? a.d2 < b.d2 : a.hit.triangle < b.hit.triangle;
  });
  int count = 0;
  std::array<Vec3, 16> kept;
  const int most = static_cast<int>(std::min(out.size(), kept.size()));
  for (const Candidate& c : found) {
    if (count == most) break;
    bool apart = true;
    for (int i = 0; i < count; ++i)
      apart = apart && c.direction.dot(kept[static_cast<std::size_t>(i)]) <= kSeparation;
    if (!apart || !faces(c.hit, sign)) continue;
    kept[static_cast<std::size_t>(count)] = c.direction;
    out[static_cast<std::size_t>(count++)] = describe(c.hit, sign);
  }
  return count;
}

}  // namespace lamina::detail
