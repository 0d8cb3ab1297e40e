// Pairs are found by walking a tree of boxes against itself: each inner node contributes the pairs between
// its two children, each leaf those within. Nodes are independent of each other, so they are the items of the
// parallel loop; counts add up and the first pair is the smallest one, whatever the order.
//
// Two facets in different planes meet the common line of the planes in one interval each [Guigue2003]; they
// meet when the intervals overlap by more than a point, unless each interval is an edge of its facet. In one
// plane, facets overlap unless an edge of one has the other on its far side. Shared corners are known to lie
// in both planes: asking for them would send every pair of neighbours into exact arithmetic. Most neighbours
// are told apart before that, by a plane through the shared corner found in floating point with a margin.
#include "vdb/detail/intersections.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/box_tree.h"
#include "core/parallel.h"
#include "core/predicates.h"

namespace lamina::detail {
namespace {

/// Relative rounding of the differences and products in the floating-point filters is below 20 units of
/// 1.1e-16.
constexpr double kMargin = 1e-14;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Facet {
  std::array<Index, 3> v;
  std::array<Vec3, 3> p;
};

Facet facet(const Surface& s, Index t) {
  const std::array<Index, 3>& v = s.triangles[at(t)];
  return {v, {s.points[at(v[0])], s.points[at(v[1])], s.points[at(v[2])]}};
}

int sign(double x) { return (x > 0.0) - (x < 0.0); }

/// Corners that two facets share, as pairs of local numbers.
struct Shared {
  int count = 0;
  std::array<std::size_t, 3> a{}, b{};
};

Shared shared_corners(const Facet& a, const Facet& b) {
  Shared out;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      if (a.v[i] != b.v[j]) continue;
      out.a[static_cast<std::size_t>(out.count)] = i;
      out.b[static_cast<std::size_t>(out.count++)] = j;
    }
  }
  return out;
}

/// True when facets without a common corner clearly lie on different sides of a plane normal to the line
/// between their centroids.
bool clearly_apart(const Facet& a, const Facet& b) {
  const Vec3& origin = a.p[0];
  const Vec3 w = (a.p[0] - b.p[0]) + (a.p[1] - b.p[1]) + (a.p[2] - b.p[2]);
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, reach = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 x = a.p[k] - origin, y = b.p[k] - origin;
    reach = std::max({reach, x.cwiseAbs().maxCoeff(), y.cwiseAbs().maxCoeff()});
    lowest = std::min(lowest, w.dot(x));
    highest = std::max(highest, w.dot(y));
  }
  return lowest - highest > kMargin * reach * w.lpNorm<1>();
}

/// True when a plane through the common corner clearly separates the facets. Its normal w must have a
/// positive product with the edges of `a` from there and with the negative edges of `b`; starting from their
/// sum, the edge that is worst off is added (the perceptron rule), which settles sectors of a flat fan in few
/// steps.
bool clearly_apart_at_corner(const Facet& a, const Facet& b, const Shared& shared) {
  constexpr int kTrials = 6;
  const std::size_t i = shared.a[0], j = shared.b[0];
  const Vec3& origin = a.p[i];
  const std::array<Vec3, 4> edges{
      (a.p[(i + 1) % 3] - origin).normalized(), (a.p[(i + 2) % 3] - origin).normalized(),
      (origin - b.p[(j + 1) % 3]).normalized(), (origin - b.p[(j + 2) % 3]).normalized()};
  Vec3 w = edges[0] + edges[1] + edges[2] + edges[3];
  for (int trial = 0; trial < kTrials; ++trial) {
    std::array<double, 4> product{};
    for (std::size_t k = 0; k < 4; ++k) product[k] = w.dot(edges[k]);
    const auto worst = std::min_element(product.begin(), product.end());
    if (*worst > kMargin * w.lpNorm<1>()) return true;
    w += edges[static_cast<std::size_t>(worst - product.begin())];
  }
  return false;
}

/// True when facets with a common edge clearly stand on different sides of it, as all but folds do.
bool clearly_unfolded(const Facet& a, const Facet& b, const Shared& shared) {
  const Vec3& origin = a.p[shared.a[0]];
  const Vec3 edge = a.p[shared.a[1]] - origin;
  const Vec3 x = a.p[3 - shared.a[0] - shared.a[1]] - origin;
  const Vec3 y = b.p[3 - shared.b[0] - shared.b[1]] - origin;
  const double margin = kMargin * edge.squaredNorm() * x.norm() * y.norm();
  return edge.cross(x).dot(edge.cross(y)) < -margin;
}

/// On which sides of the plane of `a` the corners of `b` lie.
std::array<int, 3> sides(const Facet& a, const Facet& b) {
  std::array<int, 3> out{};
  for (std::size_t k = 0; k < 3; ++k) {
    const bool common = std::find(a.v.begin(), a.v.end(), b.v[k]) != a.v.end();
    out[k] = common ? 0 : sign(orient3d(a.p[0], a.p[1], a.p[2], b.p[k]));
  }
  return out;
}

bool one_sided(const std::array<int, 3>& s) { return s[0] != 0 && s[0] == s[1] && s[1] == s[2]; }

bool all_zero(const std::array<int, 3>& s) { return s[0] == 0 && s[1] == 0 && s[2] == 0; }

/// An edge of the facet lies in the plane and nothing beyond.
bool grazes(const std::array<int, 3>& s) { return std::count(s.begin(), s.end(), 0) == 2; }

/// The corner that the plane parts from the two others, some of which may lie in the plane; 3 when the facet
/// has no more than a point in common with the plane.
std::size_t lone_corner(const std::array<int, 3>& s) {
  for (const int side : {1, -1})
    if (std::count(s.begin(), s.end(), side) == 1)
      return static_cast<std::size_t>(std::find(s.begin(), s.end(), side) - s.begin());
  return 3;
}

/// Facets in different planes. With the corners a, b, c and d, e, f counter-clockwise, a and d alone on the
/// positive side of the other plane, a b and a c leave the common line at i and j, d e and d f at k and l;
/// i j and l k have the same direction, and orient3d(a, b, d, e) < 0 says that i comes before k.
bool cross(Facet a, Facet b, const std::array<int, 3>& side_a, const std::array<int, 3>& side_b) {
  const std::size_t la = lone_corner(side_a), lb = lone_corner(side_b);
  if (la == 3 || lb == 3 || (grazes(side_a) && grazes(side_b))) return false;
  std::rotate(a.p.begin(), a.p.begin() + static_cast<std::ptrdiff_t>(la), a.p.end());
  std::rotate(b.p.begin(), b.p.begin() + static_cast<std::ptrdiff_t>(lb), b.p.end());
  if (side_a[la] < 0) std::swap(b.p[1], b.p[2]);
  if (side_b[lb] < 0) std::swap(a.p[1], a.p[2]);
  return orient3d(a.p[0], a.p[1], b.p[0], b.p[1]) < 0.0 && orient3d(a.p[0], a.p[2], b.p[0], b.p[2]) > 0.0;
}

using Flat = std::array<Vec2, 3>;

/// True when an edge of `a`, which turns like `turn`, has all of `b` on its far side or on its line.
bool edge_separates(const Flat& a, int turn, const Flat& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto beyond = [&](const Vec2& q) { return turn * sign(orient2d(a[k], a[(k + 1) % 3], q)) <= 0; };
    if (std::all_of(b.begin(), b.end(), beyond)) return true;
  }
  return false;
}

/// Facets in one plane, seen along the axis nearest to its normal.
bool overlap(const Facet& a, const Facet& b) {
  const Vec3 normal = (a.p[1] - a.p[0]).cross(a.p[2] - a.p[0]);
  Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const auto flat = [&](const Facet& f) {
    Flat out;
    for (std::size_t k = 0; k < 3; ++k) out[k] = {f.p[k][(axis + 1) % 3], f.p[k][(axis + 2) % 3]};
    return out;
  };
  const Flat fa = flat(a), fb = flat(b);
  return !edge_separates(fa, sign(orient2d(fa[0], fa[1], fa[2])), fb) &&
         !edge_separates(fb, sign(orient2d(fb[0], fb[1], fb[2])), fa);
}

bool meet(const Facet& a, const Facet& b) {
  const Shared shared = shared_corners(a, b);
  if (shared.count == 0 && clearly_apart(a, b)) return false;
  if (shared.count == 1 && clearly_apart_at_corner(a, b, shared)) return false;
  if (shared.count == 2 && clearly_unfolded(a, b, shared)) return false;
  const std::array<int, 3> side_b = sides(a, b);
  if (one_sided(side_b)) return false;
  if (all_zero(side_b)) return overlap(a, b);
  const std::array<int, 3> side_a = sides(b, a);
  return !one_sided(side_a) && cross(a, b, side_a, side_b);
}

/// The ends of the stretch that facet `f` has in the plane of `other`.
std::vector<Vec3> ends_in_plane(const Facet& f, const Facet& other) {
  std::array<double, 3> height{};
  const std::array<int, 3> side = sides(other, f);
  for (std::size_t k = 0; k < 3; ++k)
    height[k] = side[k] == 0 ? 0.0 : orient3d(other.p[0], other.p[1], other.p[2], f.p[k]);
  std::vector<Vec3> ends;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t n = (k + 1) % 3;
    if (side[k] == 0) ends.push_back(f.p[k]);
    if (side[k] * side[n] < 0)
      ends.push_back(f.p[k] + height[k] / (height[k] - height[n]) * (f.p[n] - f.p[k]));
  }
  return ends;
}

/// The middle of what crossing facets have in common: of four ends on one line, the two inner ones.
Vec3 middle_of_crossing(const Facet& a, const Facet& b) {
  std::vector<Vec3> ends = ends_in_plane(a, b);
  for (const Vec3& x : ends_in_plane(b, a)) ends.push_back(x);
  const Vec3 along = ends[1] - ends[0];
  std::sort(ends.begin(), ends.end(),
            [&](const Vec3& x, const Vec3& y) { return along.dot(x) < along.dot(y); });
  return 0.5 * (ends[1] + ends[2]);
}

/// The part of a polygon on the inner side of a line through p, empty when nothing is.
std::vector<Vec3> clipped(const std::vector<Vec3>& polygon, const Vec3& p, const Vec3& inward) {
  std::vector<Vec3> out;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 &x = polygon[k], &y = polygon[(k + 1) % polygon.size()];
    const double hx = inward.dot(x - p), hy = inward.dot(y - p);
    if (hx >= 0.0) out.push_back(x);
    if (hx * hy < 0.0) out.push_back(x + hx / (hx - hy) * (y - x));
  }
  return out;
}

/// The middle of what facets in one plane have in common.
Vec3 middle_of_overlap(const Facet& a, const Facet& b) {
  std::vector<Vec3> polygon(a.p.begin(), a.p.end());
  const Vec3 normal = (b.p[1] - b.p[0]).cross(b.p[2] - b.p[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<Vec3> part = clipped(polygon, b.p[k], normal.cross(b.p[(k + 1) % 3] - b.p[k]));
    if (!part.empty()) polygon = std::move(part);  // empty by rounding only
  }
  Vec3 sum = Vec3::Zero();
  for (const Vec3& x : polygon) sum += x;
  return sum / static_cast<double>(polygon.size());
}

struct FloatBox {
  std::array<float, 3> lo, hi;
};

bool touch(const FloatBox& a, const FloatBox& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.lo[k] > b.hi[k] || b.lo[k] > a.hi[k]) return false;
  return true;
}

/// A subtree and its box.
struct Branch {
  std::int32_t code;
  FloatBox box;
};

Branch child(const BoxNode& node, std::size_t c) {
  return {node.child[c],
          {{node.lo[0][c], node.lo[1][c], node.lo[2][c]}, {node.hi[0][c], node.hi[1][c], node.hi[2][c]}}};
}

float width(const Branch& b) {
  return std::max({b.box.hi[0] - b.box.lo[0], b.box.hi[1] - b.box.lo[1], b.box.hi[2] - b.box.lo[2]});
}

constexpr std::uint64_t kNoPair = std::numeric_limits<std::uint64_t>::max();

/// Comparing two facets takes as long as comparing this many pairs of boxes.
constexpr std::int64_t kStepsOfFacets = 20;

/// What one item of the search found; `steps` counts comparisons of boxes.
struct Found {
  std::int64_t pairs = 0, steps = 0;
  std::uint64_t first = kNoPair;  ///< the smaller facet number in the upper half
  bool complete = true;

  void add(const Found& f) {
    pairs += f.pairs;
    steps += f.steps;
    first = std::min(first, f.first);
    complete = complete && f.complete;
  }
};

/// The search is ended when it took more than this many steps: bodies with an area in common every few facets
/// take below 200 steps a facet, and a small soup shall be counted to its end.
double most_steps(std::size_t facets) { return 5e8 + 1000.0 * static_cast<double>(facets); }

/// Nodes are searched in blocks of chunks, so that where to end does not depend on the number of threads. A
/// chunk may take its part of all steps: a block goes beyond the limit by no more than the limit again.
constexpr std::size_t kChunk = 1024, kChunksOfBlock = 8;

class PairSearch {
 public:
  explicit PairSearch(const Surface& surface);
  [[nodiscard]] Found run() const;

 private:
  [[nodiscard]] Found search(std::size_t begin, std::size_t end) const;
  void within(std::int32_t leaf, Found& found) const;
  void between(const Branch& a, const Branch& b, Found& found) const;
  void between_leaves(std::int32_t a, std::int32_t b, Found& found) const;
  void compare(int slot_a, int slot_b, Found& found) const;

  const Surface& surface_;
  BoxTree tree_;
  std::vector<FloatBox> boxes_;  ///< in leaf order
  std::int64_t most_steps_, most_steps_of_chunk_;
};

/// Boxes are those of the points moved to the middle of the surface and scaled near 1, by a power of two:
/// single precision would not tell far or huge points apart.
PairSearch::PairSearch(const Surface& surface) : surface_(surface) {
  const Box<3> bounds = surface.bounds();
  const Vec3 center = bounds.center();
  const double scale = std::ldexp(1.0, -std::ilogb(std::max(bounds.size().maxCoeff(), 1e-290)));
  std::vector<BoxRef> refs(surface.triangles.size());
  for_each_index(refs.size(), [&](std::size_t t) {
    Facet f = facet(surface, static_cast<Index>(t));
    for (Vec3& p : f.p) p = scale * (p - center);
    refs[t] = BoxRef::around(f.p.data(), 3, static_cast<Index>(t));
  });
  tree_ = build_box_tree(refs);
  boxes_.resize(refs.size());
  for_each_index(boxes_.size(), [&](std::size_t i) {
    const BoxRef& r = refs[at(tree_.ids[i])];
    boxes_[i] = {{r.lo[0], r.lo[1], r.lo[2]}, {r.hi[0], r.hi[1], r.hi[2]}};
  });
  most_steps_ = static_cast<std::int64_t>(most_steps(refs.size()));
  most_steps_of_chunk_ = most_steps_ / static_cast<std::int64_t>(kChunksOfBlock);
}

void PairSearch::compare(int slot_a, int slot_b, Found& found) const {
  const std::size_t a = static_cast<std::size_t>(slot_a), b = static_cast<std::size_t>(slot_b);
  ++found.steps;
  if (!touch(boxes_[a], boxes_[b])) return;
  found.steps += kStepsOfFacets;
  const auto [i, j] = std::minmax(tree_.ids[a], tree_.ids[b]);
  if (!facets_meet(surface_, i, j)) return;
  ++found.pairs;
  found.first = std::min(found.first, static_cast<std::uint64_t>(i) << 32 | static_cast<std::uint64_t>(j));
}

void PairSearch::within(std::int32_t leaf, Found& found) const {
  const int begin = leaf_begin(leaf), end = begin + leaf_count(leaf);
  for (int i = begin; i < end; ++i)
    for (int j = i + 1; j < end; ++j) compare(i, j, found);
}

void PairSearch::between_leaves(std::int32_t a, std::int32_t b, Found& found) const {
  for (int i = leaf_begin(a); i < leaf_begin(a) + leaf_count(a); ++i)
    for (int j = leaf_begin(b); j < leaf_begin(b) + leaf_count(b); ++j) compare(i, j, found);
}

void PairSearch::between(const Branch& a, const Branch& b, Found& found) const {
  ++found.steps;
  if (!touch(a.box, b.box)) return;
  if (found.steps > most_steps_of_chunk_) {
    found.complete = false;
    return;
  }
  if (a.code < 0 && b.code < 0) {
    between_leaves(a.code, b.code, found);
    return;
  }
  const bool open_a = b.code < 0 || (a.code >= 0 && width(a) >= width(b));
  const BoxNode& node = tree_.nodes[at(open_a ? a.code : b.code)];
  for (std::size_t c = 0; c < 2; ++c)
    open_a ? between(child(node, c), b, found) : between(a, child(node, c), found);
}

Found PairSearch::search(std::size_t begin, std::size_t end) const {
  Found found;
  for (std::size_t n = begin; n < end; ++n) {
    const BoxNode& node = tree_.nodes[n];
    for (const std::int32_t code : node.child)
      if (code < 0) within(code, found);
    between(child(node, 0), child(node, 1), found);
  }
  return found;
}

Found PairSearch::run() const {
  constexpr std::size_t kBlock = kChunksOfBlock * kChunk;
  Found all;
  if (tree_.root < 0) within(tree_.root, all);
  for (std::size_t block = 0; block < tree_.nodes.size(); block += kBlock) {
    if (all.steps > most_steps_) {
      all.complete = false;
      break;
    }
    const std::size_t count = std::min(kBlock, tree_.nodes.size() - block);
    all = reduce(
        count, all, [&](std::size_t begin, std::size_t end) { return search(block + begin, block + end); },
        [](Found sum, const Found& part) {
          sum.add(part);
          return sum;
        },
        kChunk);
  }
  return all;
}

}  // namespace

bool facets_meet(const Surface& surface, Index i, Index j) {
  return meet(facet(surface, i), facet(surface, j));
}

Intersections find_intersections(const Surface& surface) {
  Intersections out;
  if (surface.triangles.empty()) return out;
  const Found found = PairSearch(surface).run();
  out.pairs = found.pairs;
  out.complete = found.complete;
  if (found.first == kNoPair) return out;
  out.first = {static_cast<Index>(found.first >> 32), static_cast<Index>(found.first & 0xffffffffU)};
  const Facet a = facet(surface, out.first[0]), b = facet(surface, out.first[1]);
  out.place = all_zero(sides(a, b)) ? middle_of_overlap(a, b) : middle_of_crossing(a, b);
  return out;
}

}  // namespace lamina::detail
