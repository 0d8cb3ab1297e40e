// Orientation of a triangle surface.
//
// A patch is a set of triangles connected across manifold edges; within it the orientation of one triangle
// fixes all others (breadth-first). Of the two ways to orient a patch the one is taken that keeps most of its
// area as the file has it; the sign of the volume it encloses is then "the sign in the file". A patch whose
// oriented boundary cancels is closed, also where it touches others along non-manifold edges.
//
// A closed patch is turned outward unless it is a cavity: it lies inside a closed patch and their signs in
// the file differ. Then it is oriented against its container, the smallest one around it. So a hollow ball
// stays hollow even if the file holds it inside out, while an inverted solid, or a solid within a solid,
// becomes outward. An open patch with a clearly negative volume (most of a closed surface, seen from inside)
// is treated alike; a flat or strongly curled sheet, whose volume says nothing, keeps the majority of the
// file.
//
// "Inside" is the parity of crossings of a ray along +x. The side of an edge on which the ray passes is
// computed from its end points in a fixed order, so that the two triangles of an edge always agree and no ray
// slips between them.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "vdb/detail/surface_topology.h"

namespace lamina::detail {
namespace {

/// |volume| / area^1.5 from which the volume of an open patch says where its inside is; a ball has 0.094, a
/// wing of thickness ratio 0.02 and aspect ratio 10 has 0.0015.
constexpr double kClearVolume = 0.001;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

struct Patch {
  std::vector<Index> triangles;
  Box<3> box;
  double area = 0.0;
  double kept_area = 0.0;  ///< area whose orientation agrees with the file, minus the rest
  double volume = 0.0;     ///< signed, in the orientation of the file's majority
  bool closed = true;
  int sign = 1;  ///< sign in the file; 0: says nothing
  int new_sign = 1;
};

class Orienter {
 public:
  Orienter(Surface& surface, const EdgeTable& edges)
      : surface_(surface),
        edges_(edges),
        patch_(surface.triangles.size(), kNone),
        flip_(surface.triangles.size()) {}

  Turned run();

 private:
  void grow_patch(Index seed);
  void measure(Patch& patch);
  void find_closed();
  void find_new_signs();
  std::vector<std::pair<Index, Index>> containments() const;
  [[nodiscard]] const Vec3& corner(Index t, int k) const {
    return surface_.points[at(surface_.triangles[at(t)][static_cast<std::size_t>(k)])];
  }
  [[nodiscard]] Vec3 area_vector(Index t) const {
    return 0.5 * (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  }
  /// +1 or -1: direction of a half-edge along its edge, after the flips.
  [[nodiscard]] int direction(Index h) const {
    const auto& v = surface_.triangles[at(triangle_of(h))];
    const bool ascending = v[at(h % 3)] < v[at((h + 1) % 3)];
    return ascending != (flip_[at(triangle_of(h))] != 0) ? 1 : -1;
  }

  Surface& surface_;
  const EdgeTable& edges_;
  std::vector<Index> patch_;  ///< per triangle
  std::vector<char> flip_;    ///< per triangle
  std::vector<Patch> patches_;
};

void Orienter::grow_patch(Index seed) {
  const auto number = static_cast<Index>(patches_.size());
  Patch& patch = patches_.emplace_back();
  patch.triangles.push_back(seed);
  patch_[at(seed)] = number;
  for (std::size_t next = 0; next < patch.triangles.size(); ++next) {
    const Index t = patch.triangles[next];
    for (Index h = 3 * t; h < 3 * t + 3; ++h) {
      const Index other = edges_.opposite[at(h)];
      if (other < 0 || patch_[at(triangle_of(other))] != kNone) continue;
      const Index u = triangle_of(other);
      patch_[at(u)] = number;
      flip_[at(u)] = 0;
      flip_[at(u)] = direction(h) == direction(other) ? 1 : 0;
      patch.triangles.push_back(u);
    }
  }
  for (const Index t : patch.triangles) {
    const double area = area_vector(t).norm();
    patch.area += area;
    patch.kept_area += flip_[at(t)] != 0 ? -area : area;
    for (int k = 0; k < 3; ++k) patch.box.extend(corner(t, k));
  }
  if (patch.kept_area < 0.0)
    for (const Index t : patch.triangles) flip_[at(t)] ^= 1;
}

/// Volume of the cone over the patch from its centre of area: the enclosed volume when it is closed, and a
/// measure that does not depend on the origin when it is open.
void Orienter::measure(Patch& patch) {
  Vec3 centre = Vec3::Zero();
  for (const Index t : patch.triangles)
    centre += area_vector(t).norm() / 3.0 *
              (corner(t, 0) - patch.box.lo + corner(t, 1) - patch.box.lo + corner(t, 2) - patch.box.lo);
  centre = patch.box.lo + centre / patch.area;
  for (const Index t : patch.triangles) {
    const double part = area_vector(t).dot(corner(t, 0) - centre) / 3.0;
    patch.volume += flip_[at(t)] != 0 ? -part : part;
  }
  const bool clear = patch.closed
                         ? patch.volume != 0.0
                         : std::abs(patch.volume) > kClearVolume * patch.area * std::sqrt(patch.area);
  patch.sign = !clear ? 0 : patch.volume > 0.0 ? 1 : -1;
}

/// A patch is closed when its half-edges cancel on every edge.
void Orienter::find_closed() {
  std::vector<std::pair<Index, int>> sums;  // patch, signed number of its half-edges on one edge
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    sums.clear();
    for (std::int64_t i = edges_.first[e]; i < edges_.first[e + 1]; ++i) {
      const Index h = edges_.half_edges[static_cast<std::size_t>(i)];
      const Index p = patch_[at(triangle_of(h))];
      if (!patches_[at(p)].closed) continue;
      if (sums.empty() || sums.back().first != p) sums.emplace_back(p, 0);
      sums.back().second += direction(h);
    }
    if (sums.size() > 1) {
      std::sort(sums.begin(), sums.end());
      for (std::size_t i = 1; i < sums.size(); ++i)
        if (sums[i].first == sums[i - 1].first) sums[i].second += std::exchange(sums[i - 1].second, 0);
    }
    for (const auto& [p, sum] : sums)
      if (sum != 0) patches_[at(p)].closed = false;
  }
}

/// A point on a patch, and the patch.
struct Probe {
  Vec3 x;
  Index patch;
};

/// True when, in the yz plane, x lies left of the line from the lower to the higher numbered of two points.
/// Being symmetric in its arguments it decides the same for both triangles of an edge.
bool left_of_edge(const Vec3& x, Index ia, const Vec3& a, Index ib, const Vec3& b) {
  const Vec3& p = ia < ib ? a : b;
  const Vec3& q = ia < ib ? b : a;
  return (q[1] - p[1]) * (x[2] - p[2]) - (q[2] - p[2]) * (x[1] - p[1]) >= 0.0;
}

/// True when the ray from x along +x crosses the triangle.
bool ray_crosses(const Surface& surface, Index t, const Vec3& x) {
  const auto& v = surface.triangles[at(t)];
  std::array<bool, 3> left{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Index ia = v[k], ib = v[(k + 1) % 3];
    left[k] = left_of_edge(x, ia, surface.points[at(ia)], ib, surface.points[at(ib)]) == (ia < ib);
  }
  if (left[0] != left[1] || left[1] != left[2]) return false;
  const Vec3& a = surface.points[at(v[0])];
  const Vec3 n = (surface.points[at(v[1])] - a).cross(surface.points[at(v[2])] - a);
  if (n[0] == 0.0) return false;
  return a[0] - (n[1] * (x[1] - a[1]) + n[2] * (x[2] - a[2])) / n[0] > x[0];
}

bool box_contains(const Box<3>& outer, const Box<3>& inner) {
  return outer.contains(inner.lo) && outer.contains(inner.hi);
}

/// Pairs (inner, outer): three points of the inner patch lie inside the closed outer one, as does its box.
std::vector<std::pair<Index, Index>> Orienter::containments() const {
  // Odd weights keep the probes off the symmetry planes, where rays meet vertices.
  constexpr std::array<double, 3> kWeights{0.41327, 0.32511, 0.26162};
  std::vector<Probe> probes;
  for (std::size_t p = 0; p < patches_.size(); ++p) {
    const auto& triangles = patches_[p].triangles;
    if (patches_[p].sign == 0) continue;
    for (const std::size_t i : {std::size_t{0}, triangles.size() / 2, triangles.size() - 1}) {
      Vec3 x = Vec3::Zero();
      for (int k = 0; k < 3; ++k) x += kWeights[static_cast<std::size_t>(k)] * corner(triangles[i], k);
      probes.push_back({x, static_cast<Index>(p)});
    }
  }
  std::stable_sort(probes.begin(), probes.end(),
                   [](const Probe& a, const Probe& b) { return a.x[1] < b.x[1]; });
  std::vector<std::array<Index, 3>> crossings;  // inner, outer, probe
  for (std::size_t t = 0; t < patch_.size(); ++t) {
    const Patch& outer = patches_[at(patch_[t])];
    if (!outer.closed || outer.sign == 0) continue;
    Box<3> box;
    for (int k = 0; k < 3; ++k) box.extend(corner(static_cast<Index>(t), k));
    auto probe = std::lower_bound(probes.begin(), probes.end(), box.lo[1],
                                  [](const Probe& a, double y) { return a.x[1] < y; });
    for (; probe != probes.end() && probe->x[1] <= box.hi[1]; ++probe) {
      if (probe->x[2] < box.lo[2] || probe->x[2] > box.hi[2] || probe->x[0] > box.hi[0]) continue;
      if (probe->patch == patch_[t] || !box_contains(outer.box, patches_[at(probe->patch)].box)) continue;
      if (ray_crosses(surface_, static_cast<Index>(t), probe->x))
        crossings.push_back({probe->patch, patch_[t], static_cast<Index>(probe - probes.begin())});
    }
  }
  std::sort(crossings.begin(), crossings.end());
  std::vector<std::pair<Index, Index>> result;
  for (std::size_t i = 0; i < crossings.size();) {
    const auto pair = std::pair{crossings[i][0], crossings[i][1]};
    int inside = 0;
    while (i < crossings.size() && std::pair{crossings[i][0], crossings[i][1]} == pair) {
      const Index probe = crossings[i][2];
      bool odd = false;
      for (; i < crossings.size() && crossings[i] == std::array{pair.first, pair.second, probe}; ++i)
        odd = !odd;
      inside += odd ? 1 : 0;
    }
    if (inside == 3) result.push_back(pair);
  }
  return result;
}

void Orienter::find_new_signs() {
  bool plus = false, minus = false;
  for (Patch& patch : patches_) {
    patch.new_sign = patch.sign == 0 ? 0 : 1;
    plus = plus || patch.sign > 0;
    minus = minus || patch.sign < 0;
  }
  if (!plus || !minus) return;  // no cavity without both signs
  std::vector<Index> container(patches_.size(), kNone);
  const auto size = [&](Index p) { return std::abs(patches_[at(p)].volume); };
  for (const auto& [inner, outer] : containments())
    if (size(outer) > size(inner) &&
        (container[at(inner)] == kNone || size(outer) < size(container[at(inner)])))
      container[at(inner)] = outer;
  std::vector<Index> order(patches_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return size(a) > size(b); });
  for (const Index p : order) {
    Patch& patch = patches_[at(p)];
    if (container[at(p)] == kNone) continue;
    const Patch& outer = patches_[at(container[at(p)])];
    if (patch.sign == -outer.sign) patch.new_sign = -outer.new_sign;
  }
}

Turned Orienter::run() {
  for (std::size_t t = 0; t < patch_.size(); ++t)
    if (patch_[t] == kNone) grow_patch(static_cast<Index>(t));
  find_closed();
  for (Patch& patch : patches_) measure(patch);
  find_new_signs();
  Turned out;
  for (const Patch& patch : patches_) {
    std::size_t turned = 0;
    for (const Index t : patch.triangles)
      if ((flip_[at(t)] != 0) != (patch.sign != patch.new_sign)) {
        std::swap(surface_.triangles[at(t)][1], surface_.triangles[at(t)][2]);
        ++turned;
      }
    out.triangles += static_cast<std::int64_t>(turned);
    if (turned == 0) continue;
    const bool whole = turned == patch.triangles.size();
    ++(whole ? out.whole : out.mixed);
    if (!whole) out.in_mixed += static_cast<std::int64_t>(turned);
  }
  return out;
}

}  // namespace

Turned orient(Surface& surface, const EdgeTable& edges) { return Orienter(surface, edges).run(); }

}  // namespace lamina::detail
