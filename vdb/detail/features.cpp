#include "vdb/detail/features.h"

#include <algorithm>
#include <cmath>

namespace lamina::detail {
namespace {

const Vec3& point(const Surface& s, Index v) { return s.points[static_cast<std::size_t>(v)]; }

}  // namespace

Features::Features(const Surface& surface, const Topology& topology, const SignRule& sign) {
  gather(surface, topology, sign);
  measure_curves(surface, topology);
}

void Features::gather(const Surface& s, const Topology& topo, const SignRule& sign) {
  std::vector<std::uint8_t> on_wall(s.triangles.size(), 0);
  for (const Index t : sign.wall()) on_wall[static_cast<std::size_t>(t)] = 1;
  std::vector<std::array<Vec3, 2>> edges, corners;
  std::vector<std::uint8_t> vertex_on_wall(s.points.size(), 0);
  for (const Edge& e : topo.edges) {
    const std::span<const Index> half = topo.half_edges_of(e);
    if (std::none_of(half.begin(), half.end(),
                     [&](Index h) { return on_wall[static_cast<std::size_t>(h / 4)] != 0; }))
      continue;
    vertex_on_wall[static_cast<std::size_t>(e.a)] = vertex_on_wall[static_cast<std::size_t>(e.b)] = 1;
    if (e.kind == EdgeKind::kSmooth) continue;
    edges.push_back({point(s, e.a), point(s, e.b)});
    segments_.push_back({e.a, e.b, std::abs(e.angle)});
  }
  is_corner_.assign(s.points.size(), 0);
  for (std::size_t v = 0; v < s.points.size(); ++v) {
    is_corner_[v] = topo.convex[v].corner || topo.concave[v].corner;
    if (is_corner_[v] && vertex_on_wall[v]) corners.push_back({s.points[v], s.points[v]});
  }
  edges_ = SeededSegments(s, edges);
  std::vector<std::array<Index, 2>> ends;
  for (const Segment& e : segments_) ends.push_back({e.a, e.b});
  minima_ = SegmentMinima(s.points, ends);
  corners_ = SeededSegments(s, corners);
}

void Features::measure_curves(const Surface& s, const Topology& topo) {
  std::vector<std::array<Index, 2>> ends(s.points.size(), {kNone, kNone});
  for (const Edge& e : topo.edges) {
    if (e.kind == EdgeKind::kSmooth) continue;
    const bool convex = e.kind == EdgeKind::kConvex;
    for (const auto& [v, other] : {std::pair{e.a, e.b}, std::pair{e.b, e.a}}) {
      const std::size_t i = static_cast<std::size_t>(v);
      if (is_corner_[i] || (convex ? topo.convex : topo.concave)[i].edges != 2) continue;
      ends[i][ends[i][0] == kNone ? 0 : 1] = other;
    }
  }
  tangent_.assign(s.points.size(), Vec3::Zero());
  curvature_.assign(s.points.size(), Vec3::Zero());
  for (std::size_t v = 0; v < ends.size(); ++v) {
    if (ends[v][1] == kNone) continue;
    const Vec3 in = s.points[v] - point(s, ends[v][0]), out = point(s, ends[v][1]) - s.points[v];
    const double li = in.norm(), lo = out.norm();
    const Vec3 sum = in / li + out / lo;
    if (sum.norm() < 1e-6) continue;
    tangent_[v] = sum.normalized();
    curvature_[v] = 2.0 * (out / lo - in / li) / (li + lo);
  }
}

Vec3 Features::tangent_at(const Surface& s, Index a, Index b, double t) const {
  const Vec3 own = (point(s, b) - point(s, a)).normalized();
  const auto end = [&](Index v) -> Vec3 {
    const Vec3& tangent = tangent_[static_cast<std::size_t>(v)];
    if (tangent.isZero()) return own;
    return tangent.dot(own) < 0.0 ? Vec3(-tangent) : tangent;
  };
  return ((1.0 - t) * end(a) + t * end(b)).normalized();
}

// A corner has no curvature: the other end's holds up to it.
Vec3 Features::curvature_at(Index a, Index b, double t) const {
  const auto end = [&](Index v, Index other) -> const Vec3& {
    return curvature_[static_cast<std::size_t>(tangent_[static_cast<std::size_t>(v)].isZero() ? other : v)];
  };
  return (1.0 - t) * end(a, b) + t * end(b, a);
}

EdgePoint Features::on_edge(const Surface& s, const Topology& topo, Index edge, double t) const {
  const Edge& e = topo.edges[static_cast<std::size_t>(edge)];
  EdgePoint out;
  out.tangent = tangent_at(s, e.a, e.b, t);
  out.angle = std::abs(e.angle);
  out.curvature = curvature_at(e.a, e.b, t);
  return out;
}

double Features::sharp_distance(const Vec3& x, double limit) const {
  const SegmentHit hit = edges_.tree().closest(x, limit * limit);
  return hit.segment == kNone ? limit : std::sqrt(hit.d2);
}

double Features::widening_at(const Surface& s, const SegmentHit& hit, const Vec3& at,
                             double& curvature) const {
  const Segment& e = segments_[static_cast<std::size_t>(hit.segment)];
  const Vec3 bend = curvature_at(e.a, e.b, hit.t);
  curvature = bend.norm();
  const Vec3 nearest = (1.0 - hit.t) * point(s, e.a) + hit.t * point(s, e.b);
  return 1.0 - bend.dot(at - nearest);
}

int Features::beside(const Surface& s, const WallPoint& wall, double reach, std::span<WallEdge> out) const {
  std::size_t count = 0;
  minima_.visit(wall.closest, reach, [&](const SegmentHit& hit) {
    const Segment& e = segments_[static_cast<std::size_t>(hit.segment)];
    const Index end = hit.t <= 0.0 ? e.a : hit.t >= 1.0 ? e.b : kNone;
    if (end != kNone && is_corner_[static_cast<std::size_t>(end)]) return;
    WallEdge edge;
    const double distance = std::sqrt(hit.d2);
    edge.direction = tangent_at(s, e.a, e.b, hit.t);
    constexpr double kSame = 1e-9;
    if (distance <= wall.edge_distance * (1.0 + kSame) &&
        std::abs(edge.direction.dot(wall.edge_direction)) > 1.0 - kSame)
      return;
    const double widening = widening_at(s, hit, wall.closest, edge.curvature);
    if (!(widening > 0.0)) return;
    edge.curvature /= widening;
    edge.distance =
        wall.edge_distance + std::max(0.0, distance - wall.edge_distance) / std::min(1.0, widening);
    edge.angle = e.angle;
    keep_nearest(edge, out, count, reach);
  });
  return static_cast<int>(count);
}

void Features::describe(const Surface& s, Index facet, WallPoint& wall) const {
  if (!corners_.empty()) wall.corner_distance = std::sqrt(corners_.closest(s, facet, wall.closest).d2);
  if (!edges_.empty()) {
    const SegmentHit hit = edges_.closest(s, facet, wall.closest);
    const Segment& e = segments_[static_cast<std::size_t>(hit.segment)];
    wall.edge_distance = std::sqrt(hit.d2);
    wall.edge_angle = e.angle;
    const double widening = widening_at(s, hit, wall.closest, wall.edge_curvature);
    wall.edge_curvature /= std::max(widening, 1e-300);
    const Index end = hit.t <= 0.0 ? e.a : hit.t >= 1.0 ? e.b : kNone;
    if (end == kNone || !is_corner_[static_cast<std::size_t>(end)])
      wall.edge_direction = tangent_at(s, e.a, e.b, hit.t);
  }
  if (wall.corner_distance < wall.edge_distance) {
    wall.edge_distance = wall.corner_distance;
    wall.edge_direction.setZero();
    wall.edge_angle = wall.edge_curvature = 0.0;
  }
}

}  // namespace lamina::detail
