// The rims of the set are closed by caps: cones from each connected rim to an apex. The winding number of the
// closed set is the signed count of facets that a ray crosses, found by exact predicates; that of the caps,
// few triangles, is a sum of solid angles; the difference is the winding number of the set. Why not solid
// angles of all: slivers as long as the body are near to everything, and a sum over clusters degrades to one
// over all of them.
//
// The solid angle of a triangle is the flux of the field r / |r|^3 through it; far clusters use the Taylor
// expansion of that field about the area centre: dipole . G + moment : grad G. A cluster is far when its
// distance exceeds kBeta times its radius.
#include "vdb/detail/winding.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/predicates.h"

namespace lamina::detail {
namespace {

constexpr double kBeta = 2.3;

// Sum of signed solid angles of triangles seen from the origin [vanOosterom1983]. Half angles are arguments
// of complex numbers; small ones are summed by multiplication, which saves most of the arc tangents.
class AngleSum {
 public:
  /// `up` over `down` is the tangent of half a solid angle.
  void add(double up, double down) {
    if (!(std::abs(up) < down)) {  // a half angle above 45 degrees
      sum_ += std::atan2(up, down);
      return;
    }
    const double t = up / down;
    const double re = re_ - im_ * t;
    im_ += re_ * t;
    re_ = re;
    if (std::abs(im_) > re_ || re_ > 1e100) flush();
  }
  double total() {
    flush();
    return 2.0 * sum_;
  }

 private:
  void flush() {
    sum_ += std::atan2(im_, re_);
    re_ = 1.0;
    im_ = 0.0;
  }
  double sum_ = 0.0, re_ = 1.0, im_ = 0.0;
};

// Two corners, one of each of two triangles, seen from x.
struct CornerPair {
  CornerPair(const Vec3& s, const Vec3& t, const Vec3& x)
      : r{Eigen::Array2d(s[0], t[0]) - x[0], Eigen::Array2d(s[1], t[1]) - x[1],
          Eigen::Array2d(s[2], t[2]) - x[2]},
        length(dot(*this).sqrt()) {}
  [[nodiscard]] Eigen::Array2d dot(const CornerPair& q) const {
    return r[0] * q.r[0] + r[1] * q.r[1] + r[2] * q.r[2];
  }
  std::array<Eigen::Array2d, 3> r;
  Eigen::Array2d length;
};

// The solid angles of the first `count` of two triangles, computed side by side.
void add_pair(const Corners& s, const Corners& t, int count, const Vec3& x, AngleSum& sum) {
  const CornerPair a(s[0], t[0], x), b(s[1], t[1], x), c(s[2], t[2], x);
  const Eigen::Array2d up = a.r[0] * (b.r[1] * c.r[2] - b.r[2] * c.r[1]) +
                            a.r[1] * (b.r[2] * c.r[0] - b.r[0] * c.r[2]) +
                            a.r[2] * (b.r[0] * c.r[1] - b.r[1] * c.r[0]);
  const Eigen::Array2d down =
      a.length * b.length * c.length + a.dot(b) * c.length + b.dot(c) * a.length + c.dot(a) * b.length;
  for (int i = 0; i < count; ++i) sum.add(up[i], down[i]);
}

// Sign of the turn p, q, x in the y-z plane, x being moved by (e, e^2) for a vanishing e > 0; 0 if p and q
// coincide there.
int turn(const Vec3& p, const Vec3& q, const Vec3& x) {
  const double s = orient2d(p.tail<2>(), q.tail<2>(), x.tail<2>());
  if (s != 0.0) return s > 0.0 ? 1 : -1;
  if (p[2] != q[2]) return q[2] < p[2] ? 1 : -1;
  if (p[1] != q[1]) return q[1] > p[1] ? 1 : -1;
  return 0;
}

// +1 or -1 when the ray from x along +X leaves or enters through t.
int crossing(const Corners& t, const Vec3& x) {
  const int s = turn(t[0], t[1], x);
  if (s == 0 || turn(t[1], t[2], x) != s || turn(t[2], t[0], x) != s) return 0;
  return orient3d(t[0], t[1], t[2], x) * s < 0.0 ? s : 0;
}

// A directed edge that the set lacks to be closed.
struct Rim {
  Index from, to;
};

std::vector<Rim> find_rims(std::span<const std::array<Index, 3>> triangles, std::span<const Index> subset) {
  struct Half {
    Index a, b;
    int way;
  };
  std::vector<Half> half;
  half.reserve(3 * subset.size());
  for (const Index t : subset) {
    const std::array<Index, 3>& v = triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k) {
      const Index p = v[k], q = v[(k + 1) % 3];
      half.push_back({std::min(p, q), std::max(p, q), p < q ? 1 : -1});
    }
  }
  std::sort(half.begin(), half.end(),
            [](const Half& g, const Half& h) { return g.a != h.a ? g.a < h.a : g.b < h.b; });
  std::vector<Rim> rims;
  for (std::size_t i = 0; i < half.size();) {
    std::size_t j = i;
    int net = 0;
    for (; j < half.size() && half[j].a == half[i].a && half[j].b == half[i].b; ++j) net += half[j].way;
    for (; net > 0; --net) rims.push_back({half[i].b, half[i].a});
    for (; net < 0; ++net) rims.push_back({half[i].a, half[i].b});
    i = j;
  }
  return rims;
}

// One cone per connected set of rims. The apex stands off the rim's plane, so that no point of a flat opening
// lies on a cap by design.
std::vector<Corners> make_caps(std::span<const Vec3> points, const std::vector<Rim>& rims) {
  std::vector<Index> parent(points.size(), kNone);
  const auto root = [&](Index v) {
    while (parent[static_cast<std::size_t>(v)] != v) v = parent[static_cast<std::size_t>(v)];
    return v;
  };
  for (const Rim& r : rims) {
    for (const Index v : {r.from, r.to})
      if (parent[static_cast<std::size_t>(v)] == kNone) parent[static_cast<std::size_t>(v)] = v;
    const Index a = root(r.from), b = root(r.to);
    parent[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    parent[static_cast<std::size_t>(r.from)] = parent[static_cast<std::size_t>(r.to)] = std::min(a, b);
  }
  std::vector<Box<3>> box(points.size());
  for (const Rim& r : rims)
    for (const Index v : {r.from, r.to})
      box[static_cast<std::size_t>(root(v))].extend(points[static_cast<std::size_t>(v)]);
  std::vector<Corners> caps;
  caps.reserve(rims.size());
  for (const Rim& r : rims) {
    const Box<3>& b = box[static_cast<std::size_t>(root(r.from))];
    const Vec3 apex = b.center() + 0.0137 * b.diagonal() * Vec3(0.36, 0.48, 0.8);
    caps.push_back({points[static_cast<std::size_t>(r.from)], points[static_cast<std::size_t>(r.to)], apex});
  }
  return caps;
}

}  // namespace

Winding::Winding(std::span<const Vec3> points, std::span<const std::array<Index, 3>> triangles,
                 std::span<const Index> subset) {
  std::vector<Corners> caps = make_caps(points, find_rims(triangles, subset)), all;
  all.reserve(subset.size() + caps.size());
  for (const Index t : subset) {
    Corners c;
    for (std::size_t k = 0; k < 3; ++k)
      c[k] = points[static_cast<std::size_t>(triangles[static_cast<std::size_t>(t)][k])];
    all.push_back(c);
  }
  all.insert(all.end(), caps.begin(), caps.end());
  Box<3> bounds;
  for (const Corners& c : all)
    for (const Vec3& x : c) bounds.extend(x);
  if (!all.empty()) bounds.size().minCoeff(&first_);
  for (Corners& c : all)
    for (Vec3& x : c) x = turned(x);
  std::vector<BoxRef> refs;
  refs.reserve(all.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    refs.push_back(BoxRef::around(all[i].data(), 3, static_cast<Index>(i)));
  tree_ = build_box_tree(std::move(refs));
  closed_.reserve(all.size());
  for (const Index id : tree_.ids) closed_.push_back(all[static_cast<std::size_t>(id)]);
  caps_ = DipoleTree(std::move(caps));
}

int Winding::crossings(const Vec3& x) const {
  if (tree_.empty()) return 0;
  std::int32_t stack[kTreeStack];
  int depth = 0, count = 0;
  stack[depth++] = tree_.root;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      for (int i = leaf_begin(code); i < leaf_begin(code) + leaf_count(code); ++i)
        count += crossing(closed_[static_cast<std::size_t>(i)], x);
      continue;
    }
    const BoxNode& n = tree_.nodes[static_cast<std::size_t>(code)];
    for (int c = 0; c < 2; ++c) {
      if (n.hi[0][c] >= x[0] && n.lo[1][c] <= x[1] && n.hi[1][c] >= x[1] && n.lo[2][c] <= x[2] &&
          n.hi[2][c] >= x[2])
        stack[depth++] = n.child[c];
    }
  }
  return count;
}

bool Winding::encloses(const Vec3& x) const {
  const int count = crossings(turned(x));
  const double rough = std::abs(count - caps_.roughly_at(x)) - 0.5;
  if (std::abs(rough) > DipoleTree::kRoughError) return rough > 0.0;
  return std::abs(count - caps_.at(x)) > 0.5;
}

DipoleTree::DipoleTree(std::vector<Corners> triangles) {
  std::vector<BoxRef> refs;
  refs.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    refs.push_back(BoxRef::around(triangles[i].data(), 3, static_cast<Index>(i)));
  tree_ = build_box_tree(std::move(refs));
  triangles_.reserve(tree_.ids.size());
  for (const Index id : tree_.ids) triangles_.push_back(triangles[static_cast<std::size_t>(id)]);
  clusters_.resize(tree_.nodes.size());
  std::vector<Index> leaves;
  if (!tree_.empty()) summarize(tree_.root, leaves);
}

// Appends the leaf positions below `code` to `leaves`; moments are summed over the facets themselves.
DipoleTree::Cluster DipoleTree::summarize(std::int32_t code, std::vector<Index>& leaves) {
  const std::size_t first = leaves.size();
  if (code < 0) {
    for (int i = 0; i < leaf_count(code); ++i) leaves.push_back(leaf_begin(code) + i);
  } else {
    for (std::size_t c = 0; c < 2; ++c) {
      const std::int32_t child = tree_.nodes[static_cast<std::size_t>(code)].child[c];
      clusters_[static_cast<std::size_t>(code)].set(static_cast<int>(c), summarize(child, leaves));
    }
  }
  Cluster out;
  double area = 0.0;
  for (std::size_t i = first; i < leaves.size(); ++i) {
    const Corners& t = triangles_[static_cast<std::size_t>(leaves[i])];
    const Vec3 n = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]);
    const double a = n.norm();
    area += a;
    out.center += a * (t[0] + t[1] + t[2]) / 3.0;
    out.dipole += n;
  }
  out.center = area > 0.0 ? Vec3(out.center / area) : triangles_[static_cast<std::size_t>(leaves[first])][0];
  for (std::size_t i = first; i < leaves.size(); ++i) {
    const Corners& t = triangles_[static_cast<std::size_t>(leaves[i])];
    const Vec3 n = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]);
    out.moment += ((t[0] + t[1] + t[2]) / 3.0 - out.center) * n.transpose();
    for (const Vec3& p : t) out.radius = std::max(out.radius, (p - out.center).norm());
  }
  return out;
}

void DipoleTree::Pair::set(int child, const Cluster& cluster) {
  for (std::size_t k = 0; k < 3; ++k) {
    const int i = static_cast<int>(k), j = (i + 1) % 3, l = (i + 2) % 3;
    center[k][child] = cluster.center[i];
    dipole[k][child] = cluster.dipole[i];
    moment[k][child] = cluster.moment(i, i);
    moment[3 + k][child] = cluster.moment(j, l) + cluster.moment(l, j);
  }
  trace[child] = cluster.moment.trace();
  const double reach = kBeta * cluster.radius;
  reach2[child] = reach * reach;
}

// 4 pi times the winding numbers of both clusters seen along r, whose squared length is d2.
Eigen::Array2d DipoleTree::Pair::flux(const Eigen::Array2d* r, const Eigen::Array2d& d2) const {
  const Eigen::Array2d along = r[0] * dipole[0] + r[1] * dipole[1] + r[2] * dipole[2];
  const Eigen::Array2d stretch = r[0] * (r[0] * moment[0] + r[1] * moment[5]) +
                                 r[1] * (r[1] * moment[1] + r[2] * moment[3]) +
                                 r[2] * (r[2] * moment[2] + r[0] * moment[4]);
  const Eigen::Array2d inverse = 1.0 / d2;
  return inverse / d2.sqrt() * (along + trace - 3.0 * stretch * inverse);
}

// Clusters count as far beyond sqrt(reach2) of their reach.
double DipoleTree::expand(const Vec3& x, double reach2) const {
  if (tree_.empty()) return 0.0;
  std::int32_t stack[kTreeStack];
  int depth = 0;
  stack[depth++] = tree_.root;
  double sum = 0.0;
  AngleSum near;
  while (depth > 0) {
    const std::int32_t code = stack[--depth];
    if (code < 0) {
      const Corners* t = &triangles_[static_cast<std::size_t>(leaf_begin(code))];
      for (int left = leaf_count(code); left > 0; left -= 2, t += 2)
        add_pair(t[0], t[left > 1 ? 1 : 0], std::min(left, 2), x, near);
      continue;
    }
    const Pair& pair = clusters_[static_cast<std::size_t>(code)];
    const Eigen::Array2d r[3] = {pair.center[0] - x[0], pair.center[1] - x[1], pair.center[2] - x[2]};
    const Eigen::Array2d d2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    const bool far[2] = {d2[0] > reach2 * pair.reach2[0], d2[1] > reach2 * pair.reach2[1]};
    if (far[0] || far[1]) {
      const Eigen::Array2d flux = pair.flux(r, d2);
      sum += (far[0] ? flux[0] : 0.0) + (far[1] ? flux[1] : 0.0);
    }
    for (int c = 0; c < 2; ++c)
      if (!far[c]) stack[depth++] = tree_.nodes[static_cast<std::size_t>(code)].child[c];
  }
  return (sum + near.total()) / (4.0 * std::numbers::pi);
}

}  // namespace lamina::detail
