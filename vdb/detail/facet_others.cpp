// Other walls in reach. A point q of the wall is a local minimum of the distance from x when it is the
// closest point of its facet and no neighbour of the feature it lies on comes closer. Subtrees are skipped by
// distance, when they lie in the 30 degree cone around the nearest wall, and - what makes it cheap along a
// plain wall - when no normal below them points towards x: at a local minimum x lies in the hull of the
// normals around q. Facets at rims and where more than two meet allow every direction.
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "vdb/detail/facet_wall.h"

namespace lamina::detail {
namespace {

constexpr double kSeparation = 0.86602540378443865;  // cos 30 degrees
constexpr float kAnyDirection = -2.0F;

// Sine and cosine of the half angle under which a box is seen, and the unit direction of its centre; false
// when x is inside its bounding sphere.
struct View {
  Vec3 direction;
  double sin_half, cos_half;
};

bool view_of(const BoxNode& n, int c, const Vec3& x, View& view) {
  Vec3 center, half;
  for (int a = 0; a < 3; ++a) {
    center[a] = 0.5 * (double(n.lo[a][c]) + double(n.hi[a][c]));
    half[a] = 0.5 * (double(n.hi[a][c]) - double(n.lo[a][c]));
  }
  const Vec3 to = center - x;
  const double d2 = to.squaredNorm(), r2 = half.squaredNorm();
  if (d2 <= r2) return false;
  view.direction = to / std::sqrt(d2);
  view.sin_half = std::sqrt(r2 / d2);
  view.cos_half = std::sqrt(1.0 - r2 / d2);
  return true;
}

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

void FacetWall::build_cones() {
  const std::vector<Cone> facet = facet_cones();
  const BoxTree& tree = bvh_.tree();
  cones_.resize(tree.nodes.size());
  std::vector<Cone> parts;
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children follow their parent: seen first
    for (std::size_t c = 0; c < 2; ++c) {
      const std::int32_t child = tree.nodes[i].child[c];
      parts.clear();
      if (child < 0) {
        for (int k = leaf_begin(child); k < leaf_begin(child) + leaf_count(child); ++k)
          parts.push_back(facet[static_cast<std::size_t>(tree.ids[static_cast<std::size_t>(k)])]);
      } else {
        parts.assign(cones_[static_cast<std::size_t>(child)].begin(),
                     cones_[static_cast<std::size_t>(child)].end());
      }
      cones_[i][c] = merge(parts);
    }
  }
}

bool FacetWall::is_local_minimum(const Vec3& x, const TriangleHit& hit, double sign) const {
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
  Vec3 n = topology_.normals[t];
  if (hit.feature >= kCorner0) {
    const Index v = surface_.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)];
    if (!first_of(topology_.star_of(v))) return false;
    for (const Index c : topology_.star_of(v)) {
      const std::array<Index, 3>& edges = topology_.facet_edges[static_cast<std::size_t>(c / 4)];
      if (closer(c / 4) || goes_on(edges[static_cast<std::size_t>(c % 4)]) ||
          goes_on(edges[static_cast<std::size_t>((c % 4 + 2) % 3)]))
        return false;
    }
    n = pseudonormal(surface_, topology_, v);
  } else if (hit.feature >= kEdge0) {
    const Index id = topology_.facet_edges[t][static_cast<std::size_t>(hit.feature - kEdge0)];
    const std::span<const Index> half =
        topology_.half_edges_of(topology_.edges[static_cast<std::size_t>(id)]);
    if (!first_of(half)) return false;
    n.setZero();
    for (const Index h : half) {
      if (closer(h / 4)) return false;
      n += topology_.normals[static_cast<std::size_t>(h / 4)];
    }
    if (goes_on(id)) return false;
  }
  // The wall must face x: its other side is not seen from here.
  return sign_.two_sided(hit.triangle) || sign * hit.offset.dot(n) >= 0.0;
}

void FacetWall::collect(const Vec3& x, double sign, double reach, const Vec3& main,
                        std::vector<Candidate>& out) const {
  const BoxTree& tree = bvh_.tree();
  if (tree.empty()) return;
  const Vec3 local = x - bvh_.origin();
  std::int32_t stack[kTreeStack];
  int depth = 0;
  stack[depth++] = tree.root;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      for (int i = leaf_begin(code); i < leaf_begin(code) + leaf_count(code); ++i) {
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
      View view;
      if (view_of(node, c, local, view)) {
        // Wholly inside the cone of the nearest wall?
        const double to_main = std::clamp(view.direction.dot(main), -1.0, 1.0);
        if (cos_sum(to_main, view.cos_half) > kSeparation) continue;
        const Cone& cone = cones_[static_cast<std::size_t>(code)][static_cast<std::size_t>(c)];
        if (cone.cos_half >= -1.0F) {
          const double facing = -view.direction.dot(Vec3(cone.axis[0], cone.axis[1], cone.axis[2]));
          const double widest = cos_sum(cone.cos_half, view.cos_half);
          const bool front = sign > 0.0 || sign_.any_sheet(), back = sign < 0.0 || sign_.any_sheet();
          if (!(front && facing >= widest) && !(back && -facing >= widest)) continue;
        }
      }
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
