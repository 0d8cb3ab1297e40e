// Per facet the shape tensor that best turns the normal of one corner into the next (least squares over three
// edges), rotated to the tangent plane of each corner and averaged over the group, weighted by area.
#include "vdb/detail/curvature.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr double kBroad = 4.0;      // width ratio across a bent edge that makes a facet broad
constexpr double kBent = 1e-3;      // radians; below, an edge counts as flat
constexpr double kOnePlane = 1e-6;  // radians; between facets of a flat face
constexpr double kSliver = 1e-6;    // altitude over longest edge of facets that have no say
constexpr double kBroadAgree =
    0.985;  // cosine; broad facets of one group that disagree more are not flat faces

const Vec3& point(const Surface& s, Index v) { return s.points[static_cast<std::size_t>(v)]; }

Vec3 corner_edge(const Surface& s, Index facet, int from, int to) {
  const std::array<Index, 3>& t = s.triangles[static_cast<std::size_t>(facet)];
  return point(s, t[static_cast<std::size_t>(to % 3)]) - point(s, t[static_cast<std::size_t>(from % 3)]);
}

double longest_edge(const Surface& s, Index facet) {
  return std::max({corner_edge(s, facet, 0, 1).norm(), corner_edge(s, facet, 1, 2).norm(),
                   corner_edge(s, facet, 2, 0).norm()});
}

bool is_sliver(const Surface& s, const Topology& topo, Index facet) {
  const double l = longest_edge(s, facet);
  return !(2.0 * topo.areas[static_cast<std::size_t>(facet)] > kSliver * l * l);
}

double altitude(const Surface& s, const Topology& topo, Index facet, Index edge) {
  const Edge& e = topo.edges[static_cast<std::size_t>(edge)];
  const double length = (point(s, e.b) - point(s, e.a)).norm();
  return length > 0.0 ? 2.0 * topo.areas[static_cast<std::size_t>(facet)] / length : 0.0;
}

Index neighbour(const Topology& topo, Index facet, const Edge& e) {
  const std::span<const Index> half = topo.half_edges_of(e);
  return half[0] / 4 == facet ? half[1] / 4 : half[0] / 4;
}

// Is the facet many times wider than a neighbour it meets at an angle in this vertex?
bool is_broad(const Surface& s, const Topology& topo, Index facet, int corner) {
  for (const int k : {corner, (corner + 2) % 3}) {
    const Index id = topo.facet_edges[static_cast<std::size_t>(facet)][static_cast<std::size_t>(k)];
    const Edge& e = topo.edges[static_cast<std::size_t>(id)];
    if (e.kind != EdgeKind::kSmooth || !e.regular || std::abs(e.angle) < kBent) continue;
    const double other = altitude(s, topo, neighbour(topo, facet, e), id);
    if (altitude(s, topo, facet, id) > kBroad * other) return true;
  }
  return false;
}

// Rotation that takes unit vector a to unit vector b; the identity when they are opposite.
Mat3 rotation(const Vec3& a, const Vec3& b) {
  const Vec3 v = a.cross(b);
  const double c = a.dot(b);
  if (c < -0.999) return Mat3::Identity();
  Mat3 k;
  k << 0.0, -v[2], v[1], v[2], 0.0, -v[0], -v[1], v[0], 0.0;
  return Mat3::Identity() + k + k * k / (1.0 + c);
}

// Calls visit(edge, j) for the corners j, out of a sorted list around a vertex, whose facets meet that of
// corner i in a smooth edge there.
template <class Visit>
void visit_across(const Topology& topo, std::span<const Index> corners, std::size_t i, Visit&& visit) {
  const Index facet = corners[i] / 4, corner = corners[i] % 4;
  for (const Index k : {corner, (corner + 2) % 3}) {
    const Edge& e = topo.edges[static_cast<std::size_t>(
        topo.facet_edges[static_cast<std::size_t>(facet)][static_cast<std::size_t>(k)])];
    if (e.kind != EdgeKind::kSmooth || !e.regular) continue;
    const Index other = neighbour(topo, facet, e);
    const auto at = std::lower_bound(corners.begin(), corners.end(), 4 * other);
    if (at != corners.end() && *at / 4 == other) visit(e, static_cast<std::size_t>(at - corners.begin()));
  }
}

// Groups of corners around v that are joined through smooth edges, each sorted.
std::vector<std::vector<Index>> smooth_groups(const Topology& topo, std::span<const Index> star) {
  std::vector<std::vector<Index>> groups;
  std::vector<std::uint8_t> done(star.size(), 0);
  for (std::size_t seed = 0; seed < star.size(); ++seed) {
    if (done[seed]) continue;
    std::vector<std::size_t> group{seed};
    done[seed] = 1;
    for (std::size_t i = 0; i < group.size(); ++i) {
      visit_across(topo, star, group[i], [&](const Edge&, std::size_t j) {  // stars are in facet order
        if (std::exchange(done[j], std::uint8_t{1}) == 0) group.push_back(j);
      });
    }
    std::sort(group.begin(), group.end());
    groups.emplace_back();
    for (const std::size_t i : group) groups.back().push_back(star[i]);
  }
  return groups;
}

Vec3 max_normal(const Surface& s, const Topology& topo, const std::vector<Index>& corners) {
  Vec3 sum = Vec3::Zero(), plain = Vec3::Zero();
  for (const Index c : corners) {
    const Vec3 u = corner_edge(s, c / 4, c % 4, c % 4 + 1), w = corner_edge(s, c / 4, c % 4, c % 4 + 2);
    plain += topo.areas[static_cast<std::size_t>(c / 4)] * topo.normals[static_cast<std::size_t>(c / 4)];
    if (is_sliver(s, topo, c / 4)) continue;
    sum += u.cross(w) / (u.squaredNorm() * w.squaredNorm());
  }
  if (sum.norm() > 0.0) return sum.normalized();
  if (plain.norm() > 0.0) return plain.normalized();
  return Vec3::UnitZ();
}

constexpr int kRest = 0, kFirstBroad = 1, kUnsorted = -1;

struct GroupDraft {
  std::vector<Index> corners;  // sorted
  std::vector<int> part;       // of each corner: kRest, or a set of broad facets counted from kFirstBroad
  int parts = 1;
  Vec3 normal;
};

// The corners listed hand their part on to those of part `from` across edges bent by less than `angle`.
void spread(const Topology& topo, std::vector<std::size_t> stack, int from, double angle, GroupDraft& g) {
  while (!stack.empty()) {
    const std::size_t i = stack.back();
    stack.pop_back();
    visit_across(topo, g.corners, i, [&](const Edge& e, std::size_t j) {
      if (std::abs(e.angle) >= angle || g.part[j] != from) return;
      g.part[j] = g.part[i];
      stack.push_back(j);
    });
  }
}

// Puts the broad ones among the rest, and the facets coplanar with them, into part `broad`.
template <class Accept>
void mark_broad(const Surface& s, const Topology& topo, int broad, GroupDraft& g, Accept&& accept) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < g.corners.size(); ++i)
    if (g.part[i] == kRest && accept(g.corners[i] / 4) &&
        is_broad(s, topo, g.corners[i] / 4, g.corners[i] % 4))
      found.push_back(i);
  for (const std::size_t i : found) g.part[i] = broad;
  spread(topo, std::move(found), kRest, kBent, g);
}

// Facets of flat faces: those with a vertex around which all lies in one plane, and what goes on in their
// plane. (Two coplanar facets alone may be a strip of a cylinder.)
std::vector<std::uint8_t> flat_facets(const Surface& s, const Topology& topo) {
  std::vector<std::uint8_t> flat(s.triangles.size(), 0);
  for (std::size_t v = 0; v < s.points.size(); ++v) {
    const std::span<const Index> star = topo.star_of(static_cast<Index>(v));
    const auto in_plane = [&](Index corner) {
      const Vec3& n = topo.normals[static_cast<std::size_t>(corner / 4)];
      return (n - topo.normals[static_cast<std::size_t>(star[0] / 4)]).norm() < kOnePlane;
    };
    if (star.empty() || !std::all_of(star.begin(), star.end(), in_plane)) continue;
    for (const Index corner : star) flat[static_cast<std::size_t>(corner / 4)] = 1;
  }
  std::vector<Index> stack;
  for (std::size_t t = 0; t < flat.size(); ++t)
    if (flat[t]) stack.push_back(static_cast<Index>(t));
  while (!stack.empty()) {
    const Index facet = stack.back();
    stack.pop_back();
    for (const Index id : topo.facet_edges[static_cast<std::size_t>(facet)]) {
      const Edge& e = topo.edges[static_cast<std::size_t>(id)];
      if (!e.regular || std::abs(e.angle) >= kOnePlane) continue;
      const Index other = neighbour(topo, facet, e);
      if (std::exchange(flat[static_cast<std::size_t>(other)], std::uint8_t{1}) == 0) stack.push_back(other);
    }
  }
  return flat;
}

// Mean normal of the broad facets; zero when they disagree, or when there are none.
Vec3 broad_normal(const Surface& s, const Topology& topo, const GroupDraft& g) {
  Vec3 sum = Vec3::Zero();
  double weight = 0.0;
  for (std::size_t i = 0; i < g.corners.size(); ++i) {
    const Index c = g.corners[i];
    if (g.part[i] == kRest) continue;
    const double angle = corner_angle(s, c / 4, c % 4);
    sum += angle * topo.normals[static_cast<std::size_t>(c / 4)];
    weight += angle;
  }
  return weight > 0.0 && sum.norm() > kBroadAgree * weight ? Vec3(sum.normalized()) : Vec3(Vec3::Zero());
}

// Each connected set of broad facets gets a curvature of its own: where two fillets and a ball patch meet in
// the corner of a flat face, each fillet bends another way, and none like their mean.
void number_broad(const Topology& topo, GroupDraft& g) {
  for (std::size_t i = 0; i < g.corners.size(); ++i) {
    if (g.part[i] != kUnsorted) continue;
    g.part[i] = g.parts++;
    spread(topo, {i}, kUnsorted, std::numeric_limits<double>::infinity(), g);
  }
}

GroupDraft draft_group(const Surface& s, const Topology& topo, const std::vector<std::uint8_t>& flat_facet,
                       std::vector<Index> corners) {
  GroupDraft g;
  g.corners = std::move(corners);
  g.part.assign(g.corners.size(), kRest);
  std::vector<std::size_t> flat;
  for (std::size_t i = 0; i < g.corners.size(); ++i)
    if (flat_facet[static_cast<std::size_t>(g.corners[i] / 4)]) flat.push_back(i);
  if (flat.empty()) {
    mark_broad(s, topo, kUnsorted, g, [](Index) { return true; });
  } else if (flat.size() < g.corners.size()) {
    for (const std::size_t i : flat) g.part[i] = kFirstBroad;
    spread(topo, flat, kRest, kBent, g);
    g.parts = kFirstBroad + 1;
  }
  g.normal = broad_normal(s, topo, g);
  if (g.normal.isZero()) {
    std::fill(g.part.begin(), g.part.end(), kRest);
    g.parts = 1;
    g.normal = max_normal(s, topo, g.corners);
    return g;
  }
  if (!flat.empty())
    mark_broad(s, topo, kUnsorted, g, [&](Index facet) {
      return topo.normals[static_cast<std::size_t>(facet)].dot(g.normal) > kBroadAgree;
    });
  number_broad(topo, g);
  return g;
}

// Least squares over the three edges, in a frame whose unknowns are scaled by the facet's extents.
Mat3 facet_tensor(const Surface& s, const Topology& topo, const Curvature& out, Index facet) {
  if (is_sliver(s, topo, facet)) return Mat3::Zero();
  const std::size_t f = static_cast<std::size_t>(facet);
  const Vec3 n = topo.normals[f];
  int first = 0;
  for (int k = 1; k < 3; ++k)
    if (corner_edge(s, facet, k, k + 1).norm() > corner_edge(s, facet, first, first + 1).norm()) first = k;
  const Vec3 u = corner_edge(s, facet, first, first + 1).normalized(), v = n.cross(u);
  Eigen::Matrix<double, 6, 3> A;
  Eigen::Matrix<double, 6, 1> b;
  for (int k = 0; k < 3; ++k) {
    const Vec3 e = corner_edge(s, facet, k, k + 1);
    const Vec3 dn =
        out.shapes[static_cast<std::size_t>(out.corner_shapes[f][static_cast<std::size_t>((k + 1) % 3)])]
            .normal -
        out.shapes[static_cast<std::size_t>(out.corner_shapes[f][static_cast<std::size_t>(k)])].normal;
    A.row(2 * k) << e.dot(u), e.dot(v), 0.0;
    A.row(2 * k + 1) << 0.0, e.dot(u), e.dot(v);
    b[2 * k] = dn.dot(u);
    b[2 * k + 1] = dn.dot(v);
  }
  const Vec3 x = A.colPivHouseholderQr().solve(b);
  if (!x.allFinite()) return Mat3::Zero();
  return x[0] * u * u.transpose() + x[1] * (u * v.transpose() + v * u.transpose()) + x[2] * v * v.transpose();
}

// Mean width of the group's facets across their bent edges; min() of both sides keeps flat faces beside a
// fillet out.
double facet_width(const Surface& s, const Topology& topo, const std::vector<Index>& corners) {
  double sum = 0.0, weight = 0.0;
  for (const Index c : corners) {
    for (const Index id : topo.facet_edges[static_cast<std::size_t>(c / 4)]) {
      const Edge& e = topo.edges[static_cast<std::size_t>(id)];
      if (e.kind != EdgeKind::kSmooth || !e.regular || std::abs(e.angle) < kBent) continue;
      const double w = std::abs(e.angle) * (point(s, e.b) - point(s, e.a)).norm();
      sum += w * std::min(altitude(s, topo, c / 4, id), altitude(s, topo, neighbour(topo, c / 4, e), id));
      weight += w;
    }
  }
  return weight > 0.0 ? sum / weight : 0.0;
}

void average_tensors(const std::vector<GroupDraft>& drafts, const Topology& topo,
                     const std::vector<Mat3>& facet, Curvature& out) {
  for_each_index(drafts.size(), [&](std::size_t g) {
    const GroupDraft& draft = drafts[g];
    const Mat3 p = Mat3::Identity() - draft.normal * draft.normal.transpose();
    for (int part = 0; part < draft.parts; ++part) {
      Mat3 sum = Mat3::Zero();
      double weight = 0.0;
      for (std::size_t i = 0; i < draft.corners.size(); ++i) {
        const std::size_t t = static_cast<std::size_t>(draft.corners[i] / 4);
        if (draft.part[i] != part) continue;
        const Mat3 r = rotation(topo.normals[t], draft.normal);
        sum += topo.areas[t] * (r * facet[t] * r.transpose());
        weight += topo.areas[t];
      }
      if (weight > 0.0)
        out.shapes[static_cast<std::size_t>(out.groups[g].shape + part)].shape =
            to_sym<3>(p * (sum / weight) * p);
    }
  });
}

}  // namespace

Curvature estimate_curvature(const Surface& surface, const Topology& topology) {
  Curvature out;
  out.corner_shapes.resize(surface.triangles.size());
  const std::vector<std::uint8_t> flat = flat_facets(surface, topology);
  std::vector<GroupDraft> drafts;
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    for (std::vector<Index>& corners : smooth_groups(topology, topology.star_of(static_cast<Index>(v)))) {
      GroupDraft g = draft_group(surface, topology, flat, std::move(corners));
      CornerGroup group;
      group.vertex = static_cast<Index>(v);
      group.facet_width = facet_width(surface, topology, g.corners);
      group.shape = static_cast<Index>(out.shapes.size());
      group.parts = g.parts;
      out.shapes.resize(out.shapes.size() + static_cast<std::size_t>(g.parts), {g.normal, {}});
      for (std::size_t i = 0; i < g.corners.size(); ++i)
        out.corner_shapes[static_cast<std::size_t>(g.corners[i] / 4)]
                         [static_cast<std::size_t>(g.corners[i] % 4)] = group.shape + g.part[i];
      out.groups.push_back(group);
      drafts.push_back(std::move(g));
    }
  }
  std::vector<Mat3> facet(surface.triangles.size());
  for_each_index(facet.size(), [&](std::size_t t) {
    facet[t] = facet_tensor(surface, topology, out, static_cast<Index>(t));
  });
  average_tensors(drafts, topology, facet, out);
  return out;
}

double reliability(double turn, double scatter) {
  constexpr double kHalfTurn = 0.5, kHalfScatter = 0.1;  // where it falls to a half
  const double t = turn / kHalfTurn, s = scatter / kHalfScatter;
  return 1.0 / (1.0 + t * t + s * s);
}

Frame principal_frame(const Vec3& n, const Sym<3>& shape) {
  Frame f;
  f.N = n;
  Vec3 u = std::abs(n[0]) > 0.6 ? Vec3(-n[1], n[0], 0.0) : Vec3(0.0, -n[2], n[1]);
  u.normalize();
  const Vec3 v = n.cross(u);
  const Mat3 m = to_matrix<3>(shape);
  const double a = u.dot(m * u), b = u.dot(m * v), c = v.dot(m * v);
  const double mean = 0.5 * (a + c), diff = 0.5 * (a - c), r = std::sqrt(diff * diff + b * b);
  if (!std::isfinite(r) || !std::isfinite(mean)) {
    f.T1 = u;
    f.T2 = v;
    return f;
  }
  const double half = 0.5 * std::atan2(b, diff);  // direction of the algebraically larger one
  const Vec3 larger = std::cos(half) * u + std::sin(half) * v, smaller = n.cross(larger);
  if (mean >= 0.0) {
    f.k1 = mean + r;
    f.k2 = mean - r;
    f.T1 = larger;
    f.T2 = smaller;
  } else {
    f.k1 = mean - r;
    f.k2 = mean + r;
    f.T1 = smaller;
    f.T2 = -larger;
  }
  return f;
}

Frame interpolate_frame(const Curvature& curvature, Index facet, const std::array<double, 3>& bary,
                        const Vec3& fallback) {
  const std::array<Index, 3>& ids = curvature.corner_shapes[static_cast<std::size_t>(facet)];
  Vec3 n = Vec3::Zero();
  Sym<3> shape{};
  double reliability = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const VertexShape& v = curvature.shapes[static_cast<std::size_t>(ids[k])];
    n += bary[k] * v.normal;
    reliability += bary[k] * v.reliability;
    for (std::size_t i = 0; i < 6; ++i) shape[i] += bary[k] * v.shape[i];
  }
  const double length = n.norm();
  if (length > 0.1) {
    n /= length;
  } else {
    n = fallback.isZero() ? Vec3(Vec3::UnitZ()) : fallback;
  }
  Frame f = principal_frame(n, shape);
  f.reliability = reliability;
  return f;
}

}  // namespace lamina::detail
