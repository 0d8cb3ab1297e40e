// Half edges are sorted by their end points, which groups them into edges in an order that depends on the
// surface alone. Sharp vertices: three or more sharp edges of one kind, or two that turn by more than
// kCornerTurn, make a corner; so does the tip of a cone, where no edge is sharp but the facets stand off
// their mean normal.
#include "vdb/detail/topology.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "core/parallel.h"
#include "vdb/detail/bvh.h"
#include "vdb/detail/creases.h"

namespace lamina::detail {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kCornerTurn = 40.0 * kPi / 180.0;
constexpr double kSeamGap = 2e-6;             // of the diagonal: rims this close belong together
constexpr double kApex = 35.0 * kPi / 180.0;  // facets of a smooth, coarse sphere stay below this

const Vec3& point(const Surface& s, Index v) { return s.points[static_cast<std::size_t>(v)]; }

void facet_geometry(const Surface& s, Topology& out) {
  const std::size_t n = s.triangles.size();
  out.normals.resize(n);
  out.areas.resize(n);
  for_each_index(n, [&](std::size_t t) {
    const std::array<Index, 3>& v = s.triangles[t];
    const Vec3 c = (point(s, v[1]) - point(s, v[0])).cross(point(s, v[2]) - point(s, v[0]));
    const double length = c.norm();
    out.areas[t] = 0.5 * length;
    out.normals[t] = length > 0.0 ? Vec3(c / length) : Vec3(Vec3::Zero());
  });
}

void build_edges(const Surface& s, Topology& out) {
  const std::size_t n = s.triangles.size();
  std::vector<std::uint64_t> keys(3 * n);
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = s.triangles[t][k], b = s.triangles[t][(k + 1) % 3];
      keys[3 * t + k] =
          static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<std::uint64_t>(std::max(a, b));
    }
  }
  const std::vector<std::int32_t> order = sorted_order(keys);
  out.half_edges.resize(3 * n);
  out.facet_edges.resize(n);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t h = static_cast<std::size_t>(order[i]);
    if (i == 0 || keys[h] != keys[static_cast<std::size_t>(order[i - 1])]) {
      Edge e;
      e.a = static_cast<Index>(keys[h] >> 32);
      e.b = static_cast<Index>(keys[h] & 0xffffffffU);
      e.begin = static_cast<Index>(i);
      out.edges.push_back(e);
    }
    ++out.edges.back().count;
    out.half_edges[i] = static_cast<Index>(4 * (h / 3) + h % 3);
    out.facet_edges[h / 3][h % 3] = static_cast<Index>(out.edges.size() - 1);
  }
}

void build_stars(const Surface& s, Topology& out) {
  out.star_begin.assign(s.points.size() + 1, 0);
  for (const auto& t : s.triangles)
    for (const Index v : t) ++out.star_begin[static_cast<std::size_t>(v) + 1];
  std::partial_sum(out.star_begin.begin(), out.star_begin.end(), out.star_begin.begin());
  out.star.resize(3 * s.triangles.size());
  std::vector<Index> next(out.star_begin.begin(), out.star_begin.end() - 1);
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      out.star[static_cast<std::size_t>(next[static_cast<std::size_t>(s.triangles[t][k])]++)] =
          static_cast<Index>(4 * t + k);
}

// True when the half edge runs from the edge's a to its b.
bool forward(const Surface& s, const Edge& e, Index half) {
  return s.triangles[static_cast<std::size_t>(half / 4)][static_cast<std::size_t>(half % 4)] == e.a;
}

// Exterior angle of an edge of many facets: the widest gap around it, less a half turn.
double widest_gap_angle(const Surface& s, const Topology& topo, const Edge& e) {
  const Vec3 axis = (point(s, e.b) - point(s, e.a)).normalized();
  const Vec3 u = axis.unitOrthogonal(), w = axis.cross(u);
  std::vector<double> turn;
  for (const Index h : topo.half_edges_of(e)) {
    const std::array<Index, 3>& t = s.triangles[static_cast<std::size_t>(h / 4)];
    const Vec3 side = point(s, t[static_cast<std::size_t>((h % 4 + 2) % 3)]) - point(s, e.a);
    turn.push_back(std::atan2(side.dot(w), side.dot(u)));
  }
  std::sort(turn.begin(), turn.end());
  double gap = turn.front() + 2.0 * kPi - turn.back();
  for (std::size_t i = 1; i < turn.size(); ++i) gap = std::max(gap, turn[i] - turn[i - 1]);
  return gap - kPi;
}

void measure_edge(const Surface& s, const Topology& topo, Edge& e) {
  const std::span<const Index> half = topo.half_edges_of(e);
  if (half.size() == 1) {
    e.angle = kPi;
    return;
  }
  if (half.size() == 2) {
    const bool first = forward(s, e, half[0]);
    if (first != forward(s, e, half[1])) {
      const Vec3& n1 = topo.normals[static_cast<std::size_t>(half[0] / 4)];
      const Vec3& n2 = topo.normals[static_cast<std::size_t>(half[1] / 4)];
      const Vec3 axis = (point(s, e.b) - point(s, e.a)).normalized() * (first ? 1.0 : -1.0);
      e.regular = true;
      e.angle = std::atan2(n1.cross(n2).dot(axis), n1.dot(n2));
      if (n1.isZero() || n2.isZero()) e.angle = 0.0;
      return;
    }
  }
  e.angle = widest_gap_angle(s, topo, e);
}

// Rims that coincide with another rim but share no points with it, as between unwelded patches: the angle is
// that between the two facets, as if they were joined.
void join_seams(const Surface& s, Topology& topo) {
  std::vector<std::array<Vec3, 2>> rims;
  std::vector<std::size_t> ids;
  for (std::size_t i = 0; i < topo.edges.size(); ++i) {
    if (topo.edges[i].count != 1) continue;
    rims.push_back({point(s, topo.edges[i].a), point(s, topo.edges[i].b)});
    ids.push_back(i);
  }
  const SegmentBvh tree(rims);
  const double gap = kSeamGap * s.bounds().diagonal();
  const auto facet_of = [&](std::size_t rim) {
    return topo.half_edges[static_cast<std::size_t>(topo.edges[ids[rim]].begin)];
  };
  for_each_index(rims.size(), [&](std::size_t r) {
    Index other = kNone;
    for (const double t : {0.25, 0.75, 0.5}) {
      const Vec3 x = (1.0 - t) * rims[r][0] + t * rims[r][1];
      other = tree.closest(x, gap * gap, static_cast<Index>(r)).segment;
      if (other == kNone) return;
    }
    const Index h = facet_of(static_cast<std::size_t>(other));
    const Vec3& n1 = topo.normals[static_cast<std::size_t>(facet_of(r) / 4)];
    const Vec3& n2 = topo.normals[static_cast<std::size_t>(h / 4)];
    const Vec3& beyond =
        point(s, s.triangles[static_cast<std::size_t>(h / 4)][static_cast<std::size_t>((h % 4 + 2) % 3)]);
    const double angle = std::atan2(n1.cross(n2).norm(), n1.dot(n2));
    Edge& e = topo.edges[ids[r]];
    e.angle = n1.dot(beyond - rims[r][0]) > 0.0 ? -angle : angle;
    e.partner = h / 4;
  });
}

// Sharp edges above `angle`, prolonged end to end through edges above half of it that go nearly straight on.
void classify_edges(const Surface& s, double angle, Topology& out) {
  const auto kind_of = [](const Edge& e) { return e.angle > 0.0 ? EdgeKind::kConvex : EdgeKind::kConcave; };
  std::vector<Index> front;
  for (std::size_t i = 0; i < out.edges.size(); ++i) {
    Edge& e = out.edges[i];
    const bool joined = e.regular || e.partner != kNone;
    if (!joined || std::abs(e.angle) > angle) {
      e.kind = joined || std::abs(e.angle) > angle ? kind_of(e) : EdgeKind::kConcave;
      if (e.regular) front.push_back(static_cast<Index>(i));
    }
  }
  while (!front.empty()) {
    const Edge e = out.edges[static_cast<std::size_t>(front.back())];
    front.pop_back();
    for (const Index v : {e.a, e.b}) {
      const Vec3 along = (point(s, v) - point(s, v == e.a ? e.b : e.a)).normalized();
      for (const Index c : out.star_of(v)) {
        for (const Index k : {c % 4, (c % 4 + 2) % 3}) {
          const Index id = out.facet_edges[static_cast<std::size_t>(c / 4)][static_cast<std::size_t>(k)];
          Edge& next = out.edges[static_cast<std::size_t>(id)];
          if (next.kind != EdgeKind::kSmooth || !next.regular || std::abs(next.angle) < 0.5 * angle) continue;
          if (kind_of(next) != e.kind) continue;
          const Vec3 on = (point(s, next.a == v ? next.b : next.a) - point(s, v)).normalized();
          if (along.dot(on) < 0.9) continue;
          next.kind = e.kind;
          front.push_back(id);
        }
      }
    }
  }
}

void build_shells(Topology& out) {
  const std::size_t n = out.facet_edges.size();
  out.shell.assign(n, kNone);
  std::vector<Index> stack;
  for (std::size_t seed = 0; seed < n; ++seed) {
    if (out.shell[seed] != kNone) continue;
    out.shell[seed] = out.shells;
    stack.push_back(static_cast<Index>(seed));
    while (!stack.empty()) {
      const Index t = stack.back();
      stack.pop_back();
      for (const Index id : out.facet_edges[static_cast<std::size_t>(t)]) {
        const Edge& e = out.edges[static_cast<std::size_t>(id)];
        if (!e.regular) continue;
        for (const Index h : out.half_edges_of(e)) {
          if (out.shell[static_cast<std::size_t>(h / 4)] != kNone) continue;
          out.shell[static_cast<std::size_t>(h / 4)] = out.shells;
          stack.push_back(h / 4);
        }
      }
    }
    ++out.shells;
  }
}

// Directions of the sharp edges of one kind at v, pointing away from it.
std::vector<Vec3> sharp_directions(const Surface& s, const std::vector<std::vector<Index>>& at,
                                   const Topology& topo, std::size_t v, EdgeKind kind) {
  std::vector<Vec3> out;
  for (const Index id : at[v]) {
    const Edge& e = topo.edges[static_cast<std::size_t>(id)];
    if (e.kind != kind) continue;
    const Index other = static_cast<std::size_t>(e.a) == v ? e.b : e.a;
    out.push_back((point(s, other) - s.points[v]).normalized());
  }
  return out;
}

// > 0 when every facet at v stands off the mean normal by more than kApex on the convex side, < 0 concave.
int apex(const Surface& s, const Topology& topo, Index v) {
  Vec3 mean = Vec3::Zero();
  for (const Index c : topo.star_of(v))
    mean += corner_angle(s, c / 4, c % 4) * topo.normals[static_cast<std::size_t>(c / 4)];
  if (mean.norm() < 1e-12) return 0;
  mean.normalize();
  int sign = 0;
  for (const Index c : topo.star_of(v)) {
    const std::array<Index, 3>& t = s.triangles[static_cast<std::size_t>(c / 4)];
    if (topo.normals[static_cast<std::size_t>(c / 4)].dot(mean) > std::cos(kApex)) return 0;
    const Vec3 to = point(s, t[static_cast<std::size_t>((c % 4 + 1) % 3)]) +
                    point(s, t[static_cast<std::size_t>((c % 4 + 2) % 3)]) - 2.0 * point(s, v);
    const int side = to.dot(mean) < 0.0 ? 1 : -1;
    if (sign != 0 && side != sign) return 0;
    sign = side;
  }
  return sign;
}

VertexKind vertex_kind(const std::vector<Vec3>& sharp, bool apex_here) {
  VertexKind kind;
  kind.edges = static_cast<std::uint8_t>(std::min<std::size_t>(sharp.size(), 255));
  kind.corner = sharp.size() > 2 || (sharp.empty() && apex_here) ||
                (sharp.size() == 2 && -sharp[0].dot(sharp[1]) < std::cos(kCornerTurn));
  return kind;
}

void classify_vertices(const Surface& s, Topology& out) {
  std::vector<std::vector<Index>> at(s.points.size());
  for (std::size_t i = 0; i < out.edges.size(); ++i) {
    const Edge& e = out.edges[i];
    if (e.kind == EdgeKind::kSmooth) continue;
    at[static_cast<std::size_t>(e.a)].push_back(static_cast<Index>(i));
    at[static_cast<std::size_t>(e.b)].push_back(static_cast<Index>(i));
  }
  out.convex.resize(s.points.size());
  out.concave.resize(s.points.size());
  for_each_index(s.points.size(), [&](std::size_t v) {
    const int tip = apex(s, out, static_cast<Index>(v));
    out.convex[v] = vertex_kind(sharp_directions(s, at, out, v, EdgeKind::kConvex), tip > 0);
    out.concave[v] = vertex_kind(sharp_directions(s, at, out, v, EdgeKind::kConcave), tip < 0);
  });
  for (const Edge& e : out.edges) out.sharp_edges += e.kind == EdgeKind::kConvex;
  for (const VertexKind& k : out.convex) out.corners += k.corner;
}

}  // namespace

double corner_angle(const Surface& s, Index facet, int k) {
  const std::array<Index, 3>& t = s.triangles[static_cast<std::size_t>(facet)];
  const Vec3& p = point(s, t[static_cast<std::size_t>(k)]);
  const Vec3 u = point(s, t[static_cast<std::size_t>((k + 1) % 3)]) - p;
  const Vec3 w = point(s, t[static_cast<std::size_t>((k + 2) % 3)]) - p;
  return std::atan2(u.cross(w).norm(), u.dot(w));
}

Topology make_topology(const Surface& surface, double feature_angle) {
  Topology out;
  facet_geometry(surface, out);
  build_edges(surface, out);
  build_stars(surface, out);
  for_each_index(out.edges.size(), [&](std::size_t i) { measure_edge(surface, out, out.edges[i]); });
  join_seams(surface, out);
  classify_edges(surface, feature_angle, out);
  mark_creases(surface, out);
  build_shells(out);
  classify_vertices(surface, out);
  return out;
}

}  // namespace lamina::detail
