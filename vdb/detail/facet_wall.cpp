// At a point the tree gives the closest feature. On a sharp edge or corner that opens towards x the frame is
// that of the ray from it; anywhere else it is interpolated from the corners of the facet, which makes it
// constant along each wall-normal ray and continuous between them.
#include "vdb/detail/facet_wall.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr double kTiny = 1e-11;  // of the bounding box's diagonal

}  // namespace

FacetWall::FacetWall(Surface surface, double feature_angle, bool sheets)
    : surface_(std::move(surface)),
      bounds_(surface_.bounds()),
      tiny_(kTiny * bounds_.diagonal()),
      topology_(make_topology(surface_, feature_angle)),
      sign_(surface_, topology_, sheets),
      bvh_(surface_.points, surface_.triangles, sign_.wall()),
      features_(surface_, topology_, sign_),
      curvature_(estimate_curvature(surface_, topology_)),
      cones_(bvh_.tree(), make_pieces()) {}

double FacetWall::phi(const Vec3& x) const {
  const TriangleHit hit = bvh_.closest(x);
  return sign_.sign(surface_, topology_, x, hit) * std::sqrt(hit.d2);
}

TriangleHit FacetWall::closest_within(const Vec3& x, double limit) const {
  const TriangleHit hit = bvh_.closest(x, limit * limit * (1.0 + 1e-9));
  return hit.triangle == kNone ? bvh_.closest(x) : hit;
}

double FacetWall::phi_within(const Vec3& x, double limit) const {
  const TriangleHit hit = closest_within(x, limit);
  return sign_.sign(surface_, topology_, x, hit) * std::sqrt(hit.d2);
}

double FacetWall::distance(const Vec3& x, double eps) const {
  return std::sqrt(bvh_.closest(x, std::numeric_limits<double>::infinity(), eps).d2);
}

WallPoint FacetWall::at(const Vec3& x) const {
  const TriangleHit hit = bvh_.closest(x);
  return describe(hit, sign_.sign(surface_, topology_, x, hit));
}

WallPoint FacetWall::at_known(const Vec3& x, double phi) const {
  constexpr double kSingle = 1e-6;
  return describe(closest_within(x, std::abs(phi) * (1.0 + kSingle)), std::signbit(phi) ? -1.0 : 1.0);
}

// Mean normal of the facets around the closest feature: the direction of a ray of no length.
Vec3 FacetWall::feature_normal(const TriangleHit& hit) const {
  const std::size_t t = static_cast<std::size_t>(hit.triangle);
  Vec3 n = topology_.normals[t];
  if (hit.feature >= kCorner0) {
    n = pseudonormal(surface_, topology_,
                     surface_.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)]);
  } else if (hit.feature >= kEdge0) {
    const std::size_t k = static_cast<std::size_t>(hit.feature - kEdge0);
    const Edge& e = topology_.edges[static_cast<std::size_t>(topology_.facet_edges[t][k])];
    const Vec3 along = surface_.points[static_cast<std::size_t>(surface_.triangles[t][(k + 1) % 3])] -
                       surface_.points[static_cast<std::size_t>(surface_.triangles[t][k])];
    if (e.count == 1) return along.cross(n).normalized();  // a rim: away from the sheet, in its plane
    n.setZero();
    for (const Index h : topology_.half_edges_of(e)) n += topology_.normals[static_cast<std::size_t>(h / 4)];
  }
  if (n.norm() < 1e-6) n = topology_.normals[t];
  return n.isZero() ? Vec3(Vec3::UnitZ()) : n.normalized();
}

// Is the closest point on a sharp edge or corner that is convex seen from the side of x?
bool FacetWall::on_sharp(const TriangleHit& hit, double sign, EdgePoint& edge, bool& corner) const {
  if (hit.feature == kInterior) return false;
  const std::size_t t = static_cast<std::size_t>(hit.triangle);
  const EdgeKind wanted = sign > 0.0 ? EdgeKind::kConvex : EdgeKind::kConcave;
  const bool sheet = sign_.two_sided(hit.triangle);
  const auto counts = [&](const Edge& e) {
    return e.kind == wanted || (sheet && e.regular && e.kind != EdgeKind::kSmooth);
  };
  corner = false;
  if (hit.feature < kCorner0) {
    const std::size_t k = static_cast<std::size_t>(hit.feature - kEdge0);
    const Index id = topology_.facet_edges[t][k];
    const Edge& e = topology_.edges[static_cast<std::size_t>(id)];
    if (!counts(e)) return false;
    const double along = hit.bary[(k + 1) % 3];
    edge = features_.on_edge(surface_, topology_, id, surface_.triangles[t][k] == e.a ? along : 1.0 - along);
    return true;
  }
  const Index v = surface_.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)];
  const std::size_t i = static_cast<std::size_t>(v);
  corner = (sign > 0.0 || sheet) ? topology_.convex[i].corner : topology_.concave[i].corner;
  if (corner) return true;
  for (const Index c : topology_.star_of(v)) {
    for (const Index k : {c % 4, (c % 4 + 2) % 3}) {
      const Index id = topology_.facet_edges[static_cast<std::size_t>(c / 4)][static_cast<std::size_t>(k)];
      const Edge& e = topology_.edges[static_cast<std::size_t>(id)];
      if (!counts(e)) continue;
      edge = features_.on_edge(surface_, topology_, id, e.a == v ? 0.0 : 1.0);
      return true;
    }
  }
  return false;
}

bool FacetWall::fill_ray(const TriangleHit& hit, double sign, WallPoint& wall) const {
  EdgePoint edge;
  bool corner = false;
  if (!on_sharp(hit, sign, edge, corner)) return false;
  const double d = std::sqrt(hit.d2);
  wall.N = d > tiny_ ? Vec3(hit.offset.normalized() * sign) : feature_normal(hit);
  wall.k1 = std::numeric_limits<double>::infinity();
  wall.reliability = 0.0;
  if (corner) {
    wall.feature = WallFeature::kCorner;
    wall.k2 = wall.k1;
    wall.T1 = wall.N.unitOrthogonal();
    wall.T2 = wall.N.cross(wall.T1);
    return true;
  }
  wall.feature = WallFeature::kEdge;
  Vec3 along = edge.tangent - wall.N * wall.N.dot(edge.tangent);
  if (along.norm() < 1e-6) along = wall.N.unitOrthogonal();
  wall.T2 = along.normalized();
  wall.T1 = wall.T2.cross(wall.N);
  wall.k2 = -edge.curvature.dot(wall.N);
  return true;
}

WallPoint FacetWall::describe(const TriangleHit& hit, double sign) const {
  WallPoint wall;
  wall.phi = sign * std::sqrt(hit.d2);
  wall.closest = hit.point;
  if (!fill_ray(hit, sign, wall)) {
    const Vec3& n = topology_.normals[static_cast<std::size_t>(hit.triangle)];
    const Frame f = interpolate_frame(curvature_, hit.triangle, hit.bary, n);
    const double side = sign_.two_sided(hit.triangle) && hit.offset.dot(f.N) < 0.0 ? -1.0 : 1.0;
    wall.N = side * f.N;
    wall.T1 = f.T1;
    wall.T2 = side * f.T2;
    wall.k1 = side * f.k1;
    wall.k2 = side * f.k2;
    wall.reliability = f.reliability;
    wall.facet = hit.triangle;
    wall.bary = hit.bary;
  }
  features_.describe(surface_, hit.triangle, wall);
  bends_.describe(surface_, hit.triangle, wall);
  if (wall.feature == WallFeature::kCorner) {
    wall.edge_distance = wall.corner_distance = 0.0;
    wall.edge_direction.setZero();
  } else if (wall.feature == WallFeature::kEdge) {
    wall.edge_distance = 0.0;
  }
  return wall;
}

std::array<double, 2> FacetWall::graded_curvatures(const WallPoint& wall, double root) const {
  if (wall.facet == kNone || graded_.empty()) return WallField::graded_curvatures(wall, root);
  return graded_.at(curvature_.corner_shapes[static_cast<std::size_t>(wall.facet)], wall.bary, root);
}

}  // namespace lamina::detail
