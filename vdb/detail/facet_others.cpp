// Other walls in reach. A point q of the wall is a local minimum of the distance from x when it is the
// closest point of its facet and no neighbour of the feature it lies on comes closer. Subtrees are skipped by
// distance and - what makes it cheap along a plain wall - when no normal below them points towards x: at a
// local minimum x lies in the hull of the normals around q. Facets at rims and where more than two meet allow
// every direction.
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "vdb/detail/facet_wall.h"

namespace lamina::detail {
namespace {

constexpr double kSeparation = 0.98480775301220806;  // cos 10 degrees
constexpr float kAnyDirection = -2.0F;

// cos(a + b) for angles in [0, pi] whose sum may exceed pi: then -1.
double cos_sum(double cos_a, double cos_b) {
  if (cos_a <= -cos_b) return -1.0;
  const double sa = std::sqrt(std::max(0.0, 1.0 - cos_a * cos_a)),
               sb = std::sqrt(std::max(0.0, 1.0 - cos_b * cos_b));
  return cos_a * cos_b - sa * sb;
}

}  // namespace

FacetWall::Cone FacetWall::merge(std::span<const Cone> parts) {
  constexpr Cone kAny{{0.0F, 0.0F, 1.0F}, kAnyDirection};
  Vec3 axis = Vec3::Zero();
  for (const Cone& p : parts) axis += Vec3(p.axis[0], p.axis[1], p.axis[2]);
  if (axis.norm() < 1e-3) return kAny;
  axis.normalize();
  double c = 1.0;
  for (const Cone& p : parts) {
    if (p.cos_half < -1.0F) return kAny;
    const double off = axis.dot(Vec3(p.axis[0], p.axis[1], p.axis[2]));
    c = std::min(c, cos_sum(std::clamp(off, -1.0, 1.0), p.cos_half) - 1e-6);
  }
  return {{float(axis[0]), float(axis[1]), float(axis[2])}, c <= -1.0 ? kAnyDirection : float(c)};
}

// The normals around the corners of each facet. By way of the vertices, so that fans of many facets cost no
// more.
std::vector<FacetWall::Cone> FacetWall::facet_cones() const {
  std::vector<std::uint8_t> open(surface_.points.size(), 0);
  for (const Edge& e : topology_.edges)
    if (!e.regular) open[static_cast<std::size_t>(e.a)] = open[static_cast<std::size_t>(e.b)] = 1;
  std::vector<Cone> vertex(surface_.points.size()), facet(surface_.triangles.size());
  for_each_chunk(vertex.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<Cone> parts;
    for (std::size_t v = begin; v < end; ++v) {
      parts.clear();
      for (const Index corner : topology_.star_of(static_cast<Index>(v))) {
        const Vec3& n = topology_.normals[static_cast<std::size_t>(corner / 4)];
        parts.push_back({{float(n[0]), float(n[1]), float(n[2])}, 1.0F});
      }
      vertex[v] = merge(parts);
      if (open[v]) vertex[v].cos_half = kAnyDirection;
    }
  });
  for_each_index(facet.size(), [&](std::size_t t) {
    std::array<Cone, 3> parts;
    for (std::size_t k = 0; k < 3; ++k) parts[k] = vertex[static_cast<std::size_t>(surface_.triangles[t][k])];
    facet[t] = merge(parts);
    if (facet[t].cos_half >= -1.0F)  // a little wider, for single precision
      facet[t].cos_half = static_cast<float>(cos_sum(facet[t].cos_half, 0.9999));
  });
  return facet;
}

FacetWall::Part FacetWall::make_part(const Cone& normals, const Vec3& lo, const Vec3& hi) {
  Part part;
  const Vec3 center = 0.5 * (lo + hi);
  for (int a = 0; a < 3; ++a) part.center[a] = static_cast<float>(center[a]);
  constexpr double kSlack = 1e-6;  // single precision of the centre
  part.radius =
      static_cast<float>(0.5 * (hi - lo).norm() * (1.0 + kSlack) + kSlack * center.cwiseAbs().maxCoeff());
  part.normals = normals;
  const double cosine = normals.cos_half;
  part.sin_half = static_cast<float>(std::sqrt(std::max(0.0, 1.0 - cosine * cosine)));
  return part;
}

void FacetWall::build_parts() {
  const std::vector<Cone> facet = facet_cones();
  const BoxTree& tree = bvh_.tree();
  slots_.resize(tree.ids.size());
  for_each_index(slots_.size(), [&](std::size_t k) {
    const std::size_t t = static_cast<std::size_t>(tree.ids[k]);
    Box<3> box;
    for (const Index v : surface_.triangles[t])
      box.extend(surface_.points[static_cast<std::size_t>(v)] - bvh_.origin());
    slots_[k] = make_part(facet[t], box.lo, box.hi);
  });
  parts_.resize(tree.nodes.size());
  std::vector<Cone> below;
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children follow their parent: seen first
    const BoxNode& node = tree.nodes[i];
    for (std::size_t c = 0; c < 2; ++c) {
      const std::int32_t child = node.child[c];
      below.clear();
      if (child < 0) {
        for (int k = leaf_begin(child); k < leaf_begin(child) + leaf_count(child); ++k)
          below.push_back(slots_[static_cast<std::size_t>(k)].normals);
      } else {
        for (const Part& part : parts_[static_cast<std::size_t>(child)]) below.push_back(part.normals);
      }
      const Vec3 lo(node.lo[0][c], node.lo[1][c], node.lo[2][c]),
          hi(node.hi[0][c], node.hi[1][c], node.hi[2][c]);
      parts_[i][c] = make_part(merge(below), lo, hi);
    }
  }
}

// Can a normal of `part` (turned around, for its back) point from its place to x? Asks whether the ball, seen
// from x, meets the cone.
bool FacetWall::may_face(const Part& part, const Vec3& local, bool front, bool back) {
  if (part.normals.cos_half < -1.0F) return true;
  const Vec3 from(local[0] - part.center[0], local[1] - part.center[1], local[2] - part.center[2]);
  const double d2 = from.squaredNorm(), radius = part.radius;
  if (d2 <= radius * radius) return true;
  const double height =
      from[0] * part.normals.axis[0] + from[1] * part.normals.axis[1] + from[2] * part.normals.axis[2];
  const double across = std::sqrt(std::max(0.0, d2 - height * height));
  constexpr double kSlack = 1e-5;  // single precision of the cone
  const double beside = across * part.normals.cos_half - kSlack * (across + std::abs(height)) - radius;
  const double along = height * part.sin_half;
  return (front && beside <= along) || (back && beside <= -along);
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

bool FacetWall::is_local_minimum(const Vec3& x, const TriangleHit& hit, double sign) const {
  if (descends(hit)) return false;
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
  // Facets around a corner or edge share its minimum: the first one on the wall speaks for all.
  const auto first_of = [&](std::span<const Index> corners) {
    for (const Index c : corners)
      if (sign_.on_wall(c / 4)) return c / 4 == hit.triangle;
    return false;
  };
  if (hit.feature >= kCorner0) {
    const Index v = surface_.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)];
    if (!first_of(topology_.star_of(v))) return false;
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
    if (!first_of(half)) return false;
    for (const Index h : half)
      if (closer(h / 4)) return false;
    if (goes_on(id)) return false;
  }
  // The wall must face x, so that the space in front of it is of the kind x is in: its other side is not
  // seen.
  constexpr double kInFront = 1e-3;
  TriangleHit front = hit;
  front.offset *= kInFront;
  front.d2 *= kInFront * kInFront;
  return sign_.two_sided(hit.triangle) ||
         sign_.sign(surface_, topology_, hit.point + front.offset, front) == sign;
}

void FacetWall::collect(const Vec3& x, double sign, double reach, const Vec3& main,
                        std::vector<Candidate>& out) const {
  const BoxTree& tree = bvh_.tree();
  if (tree.empty()) return;
  const Vec3 local = x - bvh_.origin();
  const bool front = sign > 0.0 || !sign_.oriented(), back = sign < 0.0 || !sign_.oriented();
  std::int32_t stack[kTreeStack];
  int depth = 0;
  stack[depth++] = tree.root;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      for (int i = leaf_begin(code); i < leaf_begin(code) + leaf_count(code); ++i) {
        if (!may_face(slots_[static_cast<std::size_t>(i)], local, front, back)) continue;
        const TriangleHit hit = bvh_.on_slot(i, x);
        if (hit.d2 > reach * reach) continue;
        const double d = std::sqrt(hit.d2);
        const Vec3 to = d > tiny_ ? Vec3(-hit.offset / d)
                                  : Vec3(-sign * topology_.normals[static_cast<std::size_t>(hit.triangle)]);
        if (to.dot(main) > kSeparation || !is_local_minimum(x, hit, sign)) continue;
        out.push_back({hit.d2, hit, to});
      }
      continue;
    }
    const BoxNode& node = tree.nodes[static_cast<std::size_t>(code)];
    double d2[2];
    child_distances(node, local.data(), d2);
    for (int c = 0; c < 2; ++c) {
      if (d2[c] > reach * reach) continue;
      if (!may_face(parts_[static_cast<std::size_t>(code)][static_cast<std::size_t>(c)], local, front, back))
        continue;
      stack[depth++] = node.child[c];
    }
  }
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
    if (!apart) continue;
    kept[static_cast<std::size_t>(count)] = c.direction;
    out[static_cast<std::size_t>(count++)] = describe(c.hit, sign);
  }
  return count;
}

}  // namespace lamina::detail
