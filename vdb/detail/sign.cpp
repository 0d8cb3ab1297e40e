// A facet's closest region can rely on its pseudonormal when its shell is closed, crosses nothing and has
// fluid on its outer side: then the segment from x to its closest point meets no other wall. Facets of closed
// shells that lie wholly inside another shell are no wall at all and are left out. An open shell is a sheet -
// two sided, never an inside - when the winding number next to its facets is near half-integers (a flat plate
// sees -1/2 and 1/2), and a body with holes when it is near integers. Sheets do not take part in the winding
// number.
#include "vdb/detail/sign.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/words.h"
#include "vdb/detail/intersections.h"

namespace lamina::detail {
namespace {

constexpr double kSheetShare = 0.3;  // mean distance of the winding number from integers that makes a sheet
constexpr const char* kNoSheet = "--sheet: no shell is open, so it changes nothing";
constexpr double kNearbyShare = 0.25;  // of the distance to the nearest rim
constexpr double kClear = 0.25;        // a winding number this close to an integer is that integer

const Vec3& point(const Surface& s, Index v) { return s.points[static_cast<std::size_t>(v)]; }

Vec3 centroid(const Surface& s, std::size_t t) {
  const std::array<Index, 3>& v = s.triangles[t];
  return (point(s, v[0]) + point(s, v[1]) + point(s, v[2])) / 3.0;
}

double volume6(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a);
}

// True when the open segment p q passes through the interior of triangle t.
bool pierces(const Vec3& p, const Vec3& q, const Vec3* t) {
  const double sp = volume6(t[0], t[1], t[2], p), sq = volume6(t[0], t[1], t[2], q);
  if (!((sp > 0.0 && sq < 0.0) || (sp < 0.0 && sq > 0.0))) return false;
  const double a = volume6(p, q, t[0], t[1]), b = volume6(p, q, t[1], t[2]), c = volume6(p, q, t[2], t[0]);
  return (a > 0.0 && b > 0.0 && c > 0.0) || (a < 0.0 && b < 0.0 && c < 0.0);
}

// What rounding takes for a crossing of facets that touch is refuted exactly.
bool cross(const Surface& s, std::size_t i, std::size_t j) {
  Vec3 a[3], b[3];
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t m = 0; m < 3; ++m)
      if (s.triangles[i][k] == s.triangles[j][m]) return false;
    a[k] = point(s, s.triangles[i][k]);
    b[k] = point(s, s.triangles[j][k]);
  }
  for (std::size_t k = 0; k < 3; ++k)
    if (pierces(a[k], a[(k + 1) % 3], b) || pierces(b[k], b[(k + 1) % 3], a))
      return facets_meet(s, static_cast<Index>(i), static_cast<Index>(j));
  return false;
}

bool overlap(const BoxRef& r, const BoxNode& n, int c) {
  for (int a = 0; a < 3; ++a)
    if (r.lo[a] > n.hi[a][c] || r.hi[a] < n.lo[a][c]) return false;
  return true;
}

// Points that all facets below a child of a node have in common; they make a fan that a facet at such a point
// need not be tested against.
std::vector<std::array<std::array<Index, 3>, 2>> shared_points(const Surface& s, const BoxTree& tree) {
  using Points = std::array<Index, 3>;
  const auto both = [](const Points& a, const Points& b) {
    Points out = a;
    for (Index& v : out)
      if (std::find(b.begin(), b.end(), v) == b.end()) v = kNone;
    return out;
  };
  std::vector<std::array<Points, 2>> shared(tree.nodes.size());
  for (std::size_t n = tree.nodes.size(); n-- > 0;) {  // children follow their parent
    for (std::size_t c = 0; c < 2; ++c) {
      const std::int32_t child = tree.nodes[n].child[c];
      if (child >= 0) {
        shared[n][c] =
            both(shared[static_cast<std::size_t>(child)][0], shared[static_cast<std::size_t>(child)][1]);
        continue;
      }
      const auto facet = [&](int i) {
        return s.triangles[static_cast<std::size_t>(tree.ids[static_cast<std::size_t>(i)])];
      };
      shared[n][c] = facet(leaf_begin(child));
      for (int i = 1; i < leaf_count(child); ++i)
        shared[n][c] = both(shared[n][c], facet(leaf_begin(child) + i));
    }
  }
  return shared;
}

std::vector<std::uint8_t> open_shells(const Topology& topo) {
  std::vector<std::uint8_t> open(static_cast<std::size_t>(topo.shells), 0);
  for (std::size_t t = 0; t < topo.shell.size(); ++t)
    for (const Index e : topo.facet_edges[t])
      if (!topo.edges[static_cast<std::size_t>(e)].regular) open[static_cast<std::size_t>(topo.shell[t])] = 1;
  return open;
}

// Winding number just outside the centroid of a facet.
double outer_winding(const Surface& s, const Topology& topo, const Winding& tree, std::size_t t,
                     double scale) {
  const double step = std::min(1e-3 * std::sqrt(topo.areas[t]), 1e-6 * scale);
  return tree.at(centroid(s, t) + step * topo.normals[t]);
}

}  // namespace

std::vector<std::uint8_t> crossing_facets(const Surface& s) {
  std::vector<BoxRef> refs;
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const std::array<Index, 3>& v = s.triangles[t];
    const Vec3 p[3] = {point(s, v[0]), point(s, v[1]), point(s, v[2])};
    refs.push_back(BoxRef::around(p, 3, static_cast<Index>(t)));
  }
  const BoxTree tree = build_box_tree(refs);
  const std::vector<std::array<std::array<Index, 3>, 2>> shared = shared_points(s, tree);
  const auto touches = [&](std::size_t t, const std::array<Index, 3>& points) {
    return std::any_of(points.begin(), points.end(), [&](Index v) {
      return v != kNone && std::find(s.triangles[t].begin(), s.triangles[t].end(), v) != s.triangles[t].end();
    });
  };
  std::vector<std::uint8_t> out(s.triangles.size(), 0);
  const auto search = [&](std::size_t t) {
    std::int32_t stack[kTreeStack];
    int depth = 0;
    stack[depth++] = tree.root;
    while (depth > 0 && !out[t]) {
      const std::int32_t code = stack[--depth];
      if (code < 0) {
        for (int i = leaf_begin(code); i < leaf_begin(code) + leaf_count(code); ++i) {
          const std::size_t other = static_cast<std::size_t>(tree.ids[static_cast<std::size_t>(i)]);
          if (other != t && cross(s, t, other)) out[t] = 1;
        }
        continue;
      }
      const std::size_t node = static_cast<std::size_t>(code);
      for (std::size_t c = 0; c < 2; ++c)
        if (overlap(refs[t], tree.nodes[node], static_cast<int>(c)) && !touches(t, shared[node][c]))
          stack[depth++] = tree.nodes[node].child[c];
    }
  };
  for_each_index(out.size(), search, 256);
  return out;
}

Vec3 pseudonormal(const Surface& surface, const Topology& topology, Index v) {
  Vec3 sum = Vec3::Zero();
  for (const Index c : topology.star_of(v))
    sum += corner_angle(surface, c / 4, c % 4) * topology.normals[static_cast<std::size_t>(c / 4)];
  return sum;
}

std::vector<std::uint8_t> SignRule::find_sheets(const Surface& s, const Topology& topo,
                                                const std::vector<std::uint8_t>& open) const {
  std::vector<std::uint8_t> sheet(open.size(), 0);
  if (std::find(open.begin(), open.end(), 1) == open.end()) return sheet;
  std::vector<Index> all(s.triangles.size());
  for (std::size_t t = 0; t < all.size(); ++t) all[t] = static_cast<Index>(t);
  const Winding tree(s.points, s.triangles, all);
  const double scale = s.bounds().diagonal();
  std::vector<double> off(s.triangles.size(), 0.0);
  for_each_index(
      off.size(),
      [&](std::size_t t) {
        if (!open[static_cast<std::size_t>(topo.shell[t])]) return;
        const double w = outer_winding(s, topo, tree, t, scale);
        off[t] = std::abs(w - std::round(w));
      },
      256);
  std::vector<double> area(open.size(), 0.0), sum(open.size(), 0.0);
  for (std::size_t t = 0; t < off.size(); ++t) {
    area[static_cast<std::size_t>(topo.shell[t])] += topo.areas[t];
    sum[static_cast<std::size_t>(topo.shell[t])] += topo.areas[t] * off[t];
  }
  for (std::size_t i = 0; i < open.size(); ++i) sheet[i] = open[i] && sum[i] > kSheetShare * area[i];
  return sheet;
}

void SignRule::classify(const Surface& s, const Topology& topo, const std::vector<std::uint8_t>& crossing,
                        bool sheets_asked) {
  const std::vector<std::uint8_t> open = open_shells(topo);
  const std::vector<std::uint8_t> sheet = sheets_asked ? open : find_sheets(s, topo, open);
  std::vector<Index> solid;
  for (std::size_t t = 0; t < mode_.size(); ++t) {
    if (sheet[static_cast<std::size_t>(topo.shell[t])]) continue;
    solid.push_back(static_cast<Index>(t));
    for (const Index v : s.triangles[t]) solid_box_.extend(point(s, v));
  }
  const std::int64_t sheets = std::count(sheet.begin(), sheet.end(), 1);
  const std::int64_t holes = std::count(open.begin(), open.end(), 1) - sheets;
  const bool crossed = std::find(crossing.begin(), crossing.end(), 1) != crossing.end();
  if (topo.shells == 1 && !open[0] && !crossed) {  // one clean shell: pseudonormals all over
    if (sheets_asked) warnings_.push_back(kNoSheet);
    return;
  }
  solid_ = Winding(s.points, s.triangles, solid);
  const double scale = s.bounds().diagonal();
  for_each_index(
      mode_.size(),
      [&](std::size_t t) {
        const std::size_t shell = static_cast<std::size_t>(topo.shell[t]);
        const double w = outer_winding(s, topo, solid_, t, scale);
        const double inner = sheet[shell] ? w : w + 1.0;
        const auto clearly = [](double value, double lo) { return std::abs(value) > lo; };
        if (!crossing[t] && clearly(w, 1.0 - kClear) && clearly(inner, 1.0 - kClear)) {
          mode_[t] = kSubmerged;
        } else if (crossing[t] || clearly(w, kClear)) {
          mode_[t] = kWinding;
        } else if (sheet[shell]) {
          mode_[t] = kSheet;
        } else {
          mode_[t] = open[shell] ? kNearby : kPseudonormal;
        }
      },
      256);
  oriented_ = std::none_of(mode_.begin(), mode_.end(),
                           [](std::uint8_t mode) { return mode == kSheet || mode == kWinding; });
  find_nearby(s, topo);
  const std::int64_t submerged = std::count(mode_.begin(), mode_.end(), kSubmerged);
  if (std::any_of(mode_.begin(), mode_.end(), [](std::uint8_t mode) {
        return mode == kNearby || mode == kWinding || mode == kSubmerged;
      }))
    name_ = "winding number";
  if (holes > 0)
    warnings_.push_back(fmt::format("{} of {} {} holes: inside is where the winding number exceeds 1/2",
                                    holes, counted(topo.shells, "shell"), holes == 1 ? "has" : "have"));
  if (sheets > 0)
    warnings_.push_back(counted(sheets, "open shell is taken as a two-sided sheet",
                                "open shells are taken as two-sided sheets"));
  if (sheets == topo.shells)
    warnings_.push_back(
        "nothing but sheets: the distance is nowhere negative, and other programs see no wall in it");
  if (sheets_asked && sheets == 0) warnings_.push_back(kNoSheet);
  if (crossed) {
    warnings_.push_back(
        fmt::format("{} others: their union is meshed, {} inside it left out",
                    counted(std::count(crossing.begin(), crossing.end(), 1), "facet crosses", "facets cross"),
                    counted(submerged, "facet")));
  } else if (submerged > 0) {
    warnings_.push_back(counted(submerged, "facet lies inside the body and is left out",
                                "facets lie inside the body and are left out"));
  }
}

// Next to a facet of a shell with holes the winding number is known to be near 0 and 1. But for the jump at
// facets it is a smooth function that varies on the scale of the distance to the rims: within a share of that
// the pseudonormal gives the same answer.
void SignRule::find_nearby(const Surface& s, const Topology& topo) {
  std::vector<std::array<Vec3, 2>> rims;
  for (const Edge& e : topo.edges) {
    if (e.regular) continue;
    bool solid = false;
    for (const Index h : topo.half_edges_of(e)) solid |= mode_[static_cast<std::size_t>(h / 4)] != kSheet;
    if (solid) rims.push_back({point(s, e.a), point(s, e.b)});
  }
  const SegmentBvh tree(rims);
  nearby_.assign(mode_.size(), 0.0);
  for_each_index(mode_.size(), [&](std::size_t t) {
    if (mode_[t] == kNearby) nearby_[t] = kNearbyShare * kNearbyShare * tree.closest(centroid(s, t)).d2;
  });
}

// A vertex or edge needs the winding number as soon as one of its facets does, or when facets of different
// nature meet there.
void SignRule::spread_modes(const Surface& s, const Topology& topo) {
  const auto joined = [](std::uint8_t a, std::uint8_t b) {
    if (a == b) return a;
    return std::max(a, b) <= kNearby ? std::uint8_t{kNearby} : std::uint8_t{kWinding};
  };
  edge_winding_.assign(topo.edges.size(), 0);
  for (std::size_t i = 0; i < topo.edges.size(); ++i) {
    std::uint8_t m = mode_[static_cast<std::size_t>(topo.half_edges_of(topo.edges[i])[0] / 4)];
    for (const Index h : topo.half_edges_of(topo.edges[i]))
      m = joined(m, mode_[static_cast<std::size_t>(h / 4)]);
    edge_winding_[i] = m == kWinding || (m == kNearby && !topo.edges[i].regular);
  }
  vertex_mode_.assign(s.points.size(), kPseudonormal);
  vertex_normal_.assign(s.points.size(), Vec3::Zero());
  for_each_index(s.points.size(), [&](std::size_t v) {
    const std::span<const Index> star = topo.star_of(static_cast<Index>(v));
    if (star.empty()) return;
    std::uint8_t m = mode_[static_cast<std::size_t>(star[0] / 4)];
    for (const Index c : star) m = joined(m, mode_[static_cast<std::size_t>(c / 4)]);
    vertex_mode_[v] = m;
    vertex_normal_[v] = pseudonormal(s, topo, static_cast<Index>(v));
  });
}

SignRule::SignRule(const Surface& surface, const Topology& topology, bool sheets)
    : mode_(surface.triangles.size(), kPseudonormal) {
  classify(surface, topology, crossing_facets(surface), sheets);
  spread_modes(surface, topology);
  for (std::size_t t = 0; t < mode_.size(); ++t)
    if (mode_[t] != kSubmerged) wall_.push_back(static_cast<Index>(t));
}

double SignRule::winding_sign(const Vec3& x) const {
  if (!solid_box_.contains(x)) return 1.0;
  return solid_.encloses(x) ? -1.0 : 1.0;
}

SignRule::Closest SignRule::closest_feature(const Surface& s, const Topology& topo,
                                            const TriangleHit& hit) const {
  const std::size_t t = static_cast<std::size_t>(hit.triangle);
  if (hit.feature >= kCorner0) {
    const std::size_t v =
        static_cast<std::size_t>(s.triangles[t][static_cast<std::size_t>(hit.feature - kCorner0)]);
    return {vertex_mode_[v], vertex_mode_[v] == kWinding, vertex_normal_[v]};
  }
  if (hit.feature < kEdge0) return {mode_[t], false, topo.normals[t]};
  const std::size_t e =
      static_cast<std::size_t>(topo.facet_edges[t][static_cast<std::size_t>(hit.feature - kEdge0)]);
  Vec3 n = Vec3::Zero();
  for (const Index h : topo.half_edges_of(topo.edges[e])) n += topo.normals[static_cast<std::size_t>(h / 4)];
  return {edge_winding_[e] ? std::uint8_t{kWinding} : mode_[t], !topo.edges[e].regular, n};
}

double SignRule::side(const Surface& s, const Topology& topo, const TriangleHit& hit) const {
  const Closest c = closest_feature(s, topo, hit);
  if (c.mode == kSheet || c.rim) return 0.0;
  return hit.offset.dot(c.normal) < 0.0 ? -1.0 : 1.0;
}

double SignRule::sign(const Surface& s, const Topology& topo, const Vec3& x, const TriangleHit& hit) const {
  const std::size_t t = static_cast<std::size_t>(hit.triangle);
  Closest c = closest_feature(s, topo, hit);
  if (c.mode == kSheet) return 1.0;
  if (c.mode == kNearby && mode_[t] == kNearby && (x - centroid(s, t)).squaredNorm() < nearby_[t])
    c.mode = kPseudonormal;
  if (c.mode == kPseudonormal) return hit.offset.dot(c.normal) < 0.0 ? -1.0 : 1.0;
  return winding_sign(x);
}

}  // namespace lamina::detail
