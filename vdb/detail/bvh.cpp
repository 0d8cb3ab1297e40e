// Closest point of a triangle: the Voronoi regions of its corners, edges and interior are told apart by the
// six dot products of [Ericson2005, section 5.1.5], here from x - a and the stored Gram matrix only. The
// residual x - q is formed directly from x - a, so that tiny distances keep their relative accuracy. Slivers,
// where the regions are decided by rounding, take the best of that answer (clamped into the triangle) and the
// three edges.
//
// Long triangles are entered into the tree by several boxes, halved along their longest axis, when their box
// is mostly empty: the exact test is always against the whole triangle.
#include "vdb/detail/bvh.h"

#include <cmath>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr double kSliver = 1e-5;     // altitude over longest edge below which the regions are not trusted
constexpr int kMaxSplits = 4;        // a triangle gets at most 2^4 boxes
constexpr double kSplitSize = 0.02;  // boxes shorter than this share of the whole are not split

double dot(const double* p, const double* q) { return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]; }

struct Answer {
  double d2, v, w;
  std::uint8_t feature;
};

double residual2(const double* ap, const double* ab, const double* ac, double v, double w) {
  double s = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double r = ap[k] - v * ab[k] - w * ac[k];
    s += r * r;
  }
  return s;
}

// The region of the triangle that is closest, and the position (v, w) in it.
inline Answer locate(const double* ap, const double* ab, const double* ac) {
  const double g00 = dot(ab, ab), g01 = dot(ab, ac), g11 = dot(ac, ac);
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  const double d3 = d1 - g00, d4 = d2 - g01, d5 = d1 - g01, d6 = d2 - g11;
  const auto at = [&](double v, double w, int feature) {
    return Answer{residual2(ap, ab, ac, v, w), v, w, static_cast<std::uint8_t>(feature)};
  };
  if (d1 <= 0.0 && d2 <= 0.0) return at(0.0, 0.0, kCorner0);
  if (d3 >= 0.0 && d4 <= d3) return at(1.0, 0.0, kCorner0 + 1);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return at(d1 / g00, 0.0, kEdge0);
  if (d6 >= 0.0 && d5 <= d6) return at(0.0, 1.0, kCorner0 + 2);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return at(0.0, d2 / g11, kEdge0 + 2);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(1.0 - w, w, kEdge0 + 1);
  }
  const double s = va + vb + vc;
  return at(vb / s, vc / s, kInterior);
}

// As locate, for triangles whose regions are lost in rounding or which are points or segments.
Answer locate_sliver(const double* ap, const double* ab, const double* ac) {
  Answer best = locate(ap, ab, ac);
  const bool inside = best.v >= 0.0 && best.w >= 0.0 && best.v + best.w <= 1.0;  // false for NaN
  if (!inside) best.d2 = std::numeric_limits<double>::infinity();
  const double corner[3][2] = {{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}};
  for (int k = 0; k < 3; ++k) {
    const double* from = corner[k];
    const double* to = corner[(k + 1) % 3];
    double e[3], p[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = ap[i] - from[0] * ab[i] - from[1] * ac[i];
      e[i] = (to[0] - from[0]) * ab[i] + (to[1] - from[1]) * ac[i];
    }
    const double length2 = dot(e, e);
    const double t = length2 > 0.0 ? std::clamp(dot(e, p) / length2, 0.0, 1.0) : 0.0;
    const double v = from[0] + t * (to[0] - from[0]), w = from[1] + t * (to[1] - from[1]);
    const double d2 = residual2(ap, ab, ac, v, w);
    if (d2 < best.d2) {
      const int feature = t <= 0.0 ? kCorner0 + k : t >= 1.0 ? kCorner0 + (k + 1) % 3 : kEdge0 + k;
      best = {d2, v, w, static_cast<std::uint8_t>(feature)};
    }
  }
  return best;
}

bool is_sliver(const double* ab, const double* ac) {
  const Vec3 u(ab[0], ab[1], ab[2]), v(ac[0], ac[1], ac[2]);
  const double longest2 = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
  return !(u.cross(v).norm() > kSliver * longest2);
}

TriangleHit make_hit(const Answer& a, const double* ap, const double* ab, const double* ac, const Vec3& x,
                     Index id) {
  TriangleHit hit;
  hit.d2 = a.d2;
  hit.triangle = id;
  hit.feature = a.feature;
  for (int k = 0; k < 3; ++k) hit.offset[k] = ap[k] - a.v * ab[k] - a.w * ac[k];
  hit.point = x - hit.offset;
  hit.bary = {1.0 - a.v - a.w, a.v, a.w};
  return hit;
}

// Clips the polygon by x[axis] <= at (side < 0) or >= at.
int clip(const Vec3* in, int n, int axis, double at, int side, Vec3* out) {
  int m = 0;
  for (int i = 0; i < n; ++i) {
    const Vec3 &p = in[i], &q = in[(i + 1) % n];
    const double sp = (p[axis] - at) * side, sq = (q[axis] - at) * side;
    if (sp >= 0.0) out[m++] = p;
    if ((sp > 0.0 && sq < 0.0) || (sp < 0.0 && sq > 0.0)) {
      Vec3 cut = p + (q - p) * (sp / (sp - sq));
      cut[axis] = at;
      out[m++] = cut;
    }
  }
  return m;
}

struct Splitter {
  double smallest;  // boxes shorter than this stay whole
  double pad;       // covers the rounding of the clipped corners
  std::vector<BoxRef>* refs;

  void add(const Vec3* polygon, int n, Index id, int level) const {
    Box<3> box;
    for (int i = 0; i < n; ++i) box.extend(polygon[i]);
    int axis = 0;
    const Vec3 size = box.size();
    const double longest = size.maxCoeff(&axis);
    double area = 0.0;
    for (int i = 1; i + 1 < n; ++i)
      area += 0.5 * (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]).norm();
    const double box_area = size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
    if (level < kMaxSplits && longest > smallest && area < 0.25 * box_area) {
      Vec3 part[2][12];
      const double at = box.center()[axis];
      const int left = clip(polygon, n, axis, at, -1, part[0]),
                right = clip(polygon, n, axis, at, 1, part[1]);
      if (left >= 3 && right >= 3) {
        add(part[0], left, id, level + 1);
        add(part[1], right, id, level + 1);
        return;
      }
    }
    const Vec3 corners[2] = {box.lo.array() - (level > 0 ? pad : 0.0),
                             box.hi.array() + (level > 0 ? pad : 0.0)};
    refs->push_back(BoxRef::around(corners, 2, id));
  }
};

}  // namespace

Vec3 coarse_center(const Box<3>& box) {
  if (box.empty()) return Vec3::Zero();
  const double g = std::exp2(std::ceil(std::log2(std::max(box.diagonal(), 1e-300))));
  return (box.center() / g).array().round() * g;
}

TriangleHit closest_on_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
  const Vec3 ab = b - a, ac = c - a, ap = x - a;
  const bool sliver = is_sliver(ab.data(), ac.data());
  const Answer answer =
      sliver ? locate_sliver(ap.data(), ab.data(), ac.data()) : locate(ap.data(), ab.data(), ac.data());
  return make_hit(answer, ap.data(), ab.data(), ac.data(), x, 0);
}

void TriangleBvh::gather_refs(std::span<const Vec3> points, std::span<const std::array<Index, 3>> triangles,
                              std::span<const Index> subset, std::vector<BoxRef>& refs) const {
  Box<3> box;
  for (const Index t : subset)
    for (const Index v : triangles[static_cast<std::size_t>(t)])
      box.extend(points[static_cast<std::size_t>(v)] - origin_);
  const double diagonal = subset.empty() ? 0.0 : box.diagonal();
  const Splitter splitter{kSplitSize * diagonal, 1e-14 * diagonal, &refs};
  refs.reserve(subset.size());
  for (const Index t : subset) {
    Vec3 p[3];
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = points[static_cast<std::size_t>(triangles[static_cast<std::size_t>(t)][k])] - origin_;
    splitter.add(p, 3, t, 0);
  }
}

TriangleBvh::TriangleBvh(std::span<const Vec3> points, std::span<const std::array<Index, 3>> triangles,
                         std::span<const Index> subset) {
  Box<3> box;
  for (const Index t : subset)
    for (const Index v : triangles[static_cast<std::size_t>(t)])
      box.extend(points[static_cast<std::size_t>(v)]);
  origin_ = coarse_center(box);
  std::vector<BoxRef> refs;
  gather_refs(points, triangles, subset, refs);
  tree_ = build_box_tree(std::move(refs));
  wide_ = WideTree(tree_);
  slots_.resize(tree_.ids.size());
  sliver_.resize(tree_.ids.size());
  for_each_index(slots_.size(), [&](std::size_t i) {
    const std::array<Index, 3>& t = triangles[static_cast<std::size_t>(tree_.ids[i])];
    const Vec3 a = points[static_cast<std::size_t>(t[0])] - origin_;
    const Vec3 ab = points[static_cast<std::size_t>(t[1])] - points[static_cast<std::size_t>(t[0])];
    const Vec3 ac = points[static_cast<std::size_t>(t[2])] - points[static_cast<std::size_t>(t[0])];
    for (int k = 0; k < 3; ++k) {
      slots_[i].a[k] = a[k];
      slots_[i].ab[k] = ab[k];
      slots_[i].ac[k] = ac[k];
    }
    sliver_[i] = is_sliver(ab.data(), ac.data());
  });
}

TriangleHit TriangleBvh::on_slot(int slot, const Vec3& x) const {
  const Slot& s = slots_[static_cast<std::size_t>(slot)];
  const Vec3 local = x - origin_;
  const double ap[3] = {local[0] - s.a[0], local[1] - s.a[1], local[2] - s.a[2]};
  const Answer a =
      sliver_[static_cast<std::size_t>(slot)] ? locate_sliver(ap, s.ab, s.ac) : locate(ap, s.ab, s.ac);
  return make_hit(a, ap, s.ab, s.ac, x, tree_.ids[static_cast<std::size_t>(slot)]);
}

TriangleHit TriangleBvh::closest(const Vec3& x, double max_d2, double eps) const {
  const Vec3 local = x - origin_;
  const auto id_of = [&](int slot) { return tree_.ids[static_cast<std::size_t>(slot)]; };
  const auto answer_at = [&](std::size_t slot) {
    const Slot& s = slots_[slot];
    const double ap[3] = {local[0] - s.a[0], local[1] - s.a[1], local[2] - s.a[2]};
    return sliver_[slot] ? locate_sliver(ap, s.ab, s.ac) : locate(ap, s.ab, s.ac);
  };
  // Where the last search of this thread ended is near: no farther triangle need be looked at. All that are
  // equally near are looked at, as their boxes seem nearer still, so that the answer does not depend on where
  // the search began, nor on its order.
  thread_local std::size_t last = 0;
  double best = max_d2;
  if (eps == 0.0 && last < slots_.size()) {
    constexpr double kAbove = 1.0 + 1e-12;
    const double start = answer_at(last).d2 * kAbove + std::numeric_limits<double>::min();
    best = std::min(best, start);
  }
  Answer answer{best, 0.0, 0.0, kInterior};
  int found = -1;
  wide_.visit_nearest(local.data(), best, (1.0 + eps) * (1.0 + eps), [&](int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Answer a = answer_at(static_cast<std::size_t>(i));
      const bool nearer = a.d2 < best;
      if (!nearer && !(found >= 0 && a.d2 == best && id_of(i) > id_of(found))) continue;
      best = a.d2;
      answer = a;
      found = i;
    }
  });
  if (found < 0) return {};
  last = static_cast<std::size_t>(found);
  const Slot& s = slots_[static_cast<std::size_t>(found)];
  const double ap[3] = {local[0] - s.a[0], local[1] - s.a[1], local[2] - s.a[2]};
  return make_hit(answer, ap, s.ab, s.ac, x, id_of(found));
}

double TriangleBvh::bytes() const {
  return wide_.bytes() +
         static_cast<double>(tree_.nodes.size() * sizeof(BoxNode) + tree_.ids.size() * sizeof(Index) +
                             slots_.size() * sizeof(Slot) + sliver_.size());
}

SegmentBvh::SegmentBvh(std::span<const std::array<Vec3, 2>> segments)
    : segments_(segments.begin(), segments.end()) {
  std::vector<BoxRef> refs;
  refs.reserve(segments_.size());
  for (std::size_t i = 0; i < segments_.size(); ++i)
    refs.push_back(BoxRef::around(segments_[i].data(), 2, static_cast<Index>(i)));
  BoxTree tree = build_box_tree(std::move(refs));
  tree_ = WideTree(tree);
  ids_ = std::move(tree.ids);
}

SegmentHit SegmentBvh::on_segment(Index segment, const Vec3& x) const {
  const std::array<Vec3, 2>& s = segments_[static_cast<std::size_t>(segment)];
  const Vec3 e = s[1] - s[0], p = x - s[0];
  const double length2 = e.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp(e.dot(p) / length2, 0.0, 1.0) : 0.0;
  return {(p - t * e).squaredNorm(), segment, t};
}

SegmentHit SegmentBvh::closest(const Vec3& x, double max_d2, Index skip) const {
  SegmentHit hit;
  double best = max_d2;
  tree_.visit_nearest(x.data(), best, 1.0, [&](int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Index id = ids_[static_cast<std::size_t>(i)];
      if (id == skip) continue;
      const SegmentHit h = on_segment(id, x);
      if (h.d2 < best) {
        best = h.d2;
        hit = h;
      }
    }
  });
  return hit;
}

}  // namespace lamina::detail
