#include "vdb/detail/surface_topology.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace lamina::detail {
namespace {

constexpr double kLargest = 1e100;
constexpr double kDegenerateArea = 1e-12;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

bool usable(const Vec3& p) { return p.cwiseAbs().maxCoeff() <= kLargest && !p.hasNaN(); }

std::uint64_t hash(const Vec3& p) {
  std::uint64_t h = 0;
  for (int i = 0; i < 3; ++i) {
    h ^= std::bit_cast<std::uint64_t>(p[i]);
    h *= 0x9E3779B97F4A7C15u;
    h ^= h >> 29;
  }
  return h;
}

/// Open-addressing set of points, identified by their number in a growing list.
class PointSet {
 public:
  explicit PointSet(std::vector<Vec3>& points) : points_(points), slots_(1024, kNone) {}

  Index insert(const Vec3& raw) {
    const Vec3 p = raw.array() + 0.0;  // turns -0.0 into 0.0
    std::size_t slot = hash(p) & (slots_.size() - 1);
    for (; slots_[slot] != kNone; slot = (slot + 1) & (slots_.size() - 1))
      if (points_[at(slots_[slot])] == p) return slots_[slot];
    const auto index = static_cast<Index>(points_.size());
    slots_[slot] = index;
    points_.push_back(p);
    if (2 * points_.size() > slots_.size()) grow();
    return index;
  }

 private:
  void grow() {
    slots_.assign(4 * slots_.size(), kNone);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      std::size_t slot = hash(points_[i]) & (slots_.size() - 1);
      while (slots_[slot] != kNone) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = static_cast<Index>(i);
    }
  }

  std::vector<Vec3>& points_;
  std::vector<Index> slots_;
};

/// Keeps the triangles for which keep(t) holds, in order; returns how many went.
template <class Keep>
std::int64_t filter(Surface& surface, Keep&& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (!keep(t)) continue;
    surface.triangles[kept] = surface.triangles[t];
    surface.tags[kept] = surface.tags[t];
    ++kept;
  }
  const auto dropped = static_cast<std::int64_t>(surface.triangles.size() - kept);
  surface.triangles.resize(kept);
  surface.tags.resize(kept);
  return dropped;
}

/// Triangle corners in ascending order, and whether that keeps the orientation.
struct SortedCorners {
  std::array<Index, 3> v;
  bool even;
};
SortedCorners sorted(std::array<Index, 3> v) {
  bool even = true;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (v[i] > v[j]) {
      std::swap(v[i], v[j]);
      even = !even;
    }
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return {v, even};
}

/// Items 0..n-1 in buckets of equal bucket(i): a counting sort that keeps the order within a bucket.
struct Buckets {
  template <class BucketOf>
  Buckets(std::size_t n, std::size_t buckets, BucketOf&& bucket_of) : first(buckets + 1, 0), items(n) {
    for (std::size_t i = 0; i < n; ++i) ++first[bucket_of(i) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::int64_t> fill(first.begin(), first.end() - 1);
    for (std::size_t i = 0; i < n; ++i)
      items[static_cast<std::size_t>(fill[bucket_of(i)]++)] = static_cast<Index>(i);
  }
  std::vector<std::int64_t> first;
  std::vector<Index> items;
};

/// Calls group(begin, end) for runs of equal key in each bucket, items ordered by (key, index).
template <class KeyOf, class Group>
void for_each_group(Buckets& buckets, KeyOf&& key_of, Group&& group) {
  const auto less = [&](Index a, Index b) {
    const auto ka = key_of(a), kb = key_of(b);
    return ka != kb ? ka < kb : a < b;
  };
  for (std::size_t b = 0; b + 1 < buckets.first.size(); ++b) {
    Index* const begin = buckets.items.data() + buckets.first[b];
    Index* const end = buckets.items.data() + buckets.first[b + 1];
    std::sort(begin, end, less);
    for (Index* run = begin; run != end;) {
      Index* stop = run + 1;
      while (stop != end && key_of(*stop) == key_of(*run)) ++stop;
      group(run, stop);
      run = stop;
    }
  }
}

/// Union-find whose roots are the smallest members.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  Index root(Index i) {
    while (parent_[at(i)] != i) i = parent_[at(i)] = parent_[at(parent_[at(i)])];
    return i;
  }
  void join(Index a, Index b) {
    a = root(a);
    b = root(b);
    if (a != b) parent_[at(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<Index> parent_;
};

}  // namespace

Welded weld(Surface& surface) {
  Welded out;
  std::vector<char> good(surface.points.size());
  for (std::size_t i = 0; i < good.size(); ++i) good[i] = usable(surface.points[i]) ? 1 : 0;
  out.dropped = filter(surface, [&](std::size_t t) {
    const auto& v = surface.triangles[t];
    return good[at(v[0])] != 0 && good[at(v[1])] != 0 && good[at(v[2])] != 0;
  });
  std::vector<Vec3> points;
  points.reserve(std::min(surface.points.size(), surface.triangles.size()));
  PointSet set(points);
  std::vector<Index> number(surface.points.size(), kNone);
  for (auto& triangle : surface.triangles)
    for (Index& v : triangle) {
      Index& known = number[at(v)];
      if (known == kNone) {
        const Vec3& p = surface.points[at(v)];
        known = set.insert(p);
        for (const double x : p) out.negative_zeros += x == 0.0 && std::signbit(x);
        ++out.merged;
      }
      v = known;
    }
  out.merged -= static_cast<std::int64_t>(points.size());
  surface.points = std::move(points);
  return out;
}

namespace {

bool has_repeated_corner(const std::array<Index, 3>& v) {
  return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

bool has_no_area(const Surface& surface, std::size_t t) {
  const auto& v = surface.triangles[t];
  const Vec3 a = surface.points[at(v[1])] - surface.points[at(v[0])];
  const Vec3 b = surface.points[at(v[2])] - surface.points[at(v[0])];
  const double longest2 = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  return !(0.5 * a.cross(b).norm() >= kDegenerateArea * longest2);
}

/// Half-edge opposite the corner that lies between the two others.
Index longest_half_edge(const Surface& surface, Index t) {
  Index best = 3 * t;
  double best2 = -1.0;
  for (Index h = 3 * t; h < 3 * t + 3; ++h) {
    const auto& v = surface.triangles[at(t)];
    const double length2 =
        (surface.points[at(v[at((h + 1) % 3)])] - surface.points[at(v[at(h % 3)])]).squaredNorm();
    if (length2 > best2) {
      best2 = length2;
      best = h;
    }
  }
  return best;
}

/// One sweep of cut_at_slivers over the triangles as they are.
std::int64_t cut_once(Surface& surface, const std::vector<Index>& slivers) {
  const EdgeTable edges(surface);
  std::vector<char> changed(surface.triangles.size(), 0);
  std::int64_t count = 0;
  for (const Index t : slivers) {
    const Index h = longest_half_edge(surface, t), other = edges.opposite[at(h)];
    if (other < 0) continue;
    const Index u = triangle_of(other);
    if (changed[at(t)] != 0 || changed[at(u)] != 0) continue;
    // Two slivers are cut along their common longest edge only: the edges get shorter, so this ends.
    if (has_no_area(surface, at(u)) && longest_half_edge(surface, u) != other) continue;
    const auto& v = surface.triangles[at(u)];
    const Index p = v[at(other % 3)], q = v[at((other + 1) % 3)], apex = v[at((other + 2) % 3)];
    const Index middle = surface.triangles[at(t)][at((h + 2) % 3)];
    if (middle == apex) continue;
    surface.triangles[at(t)] = {p, middle, apex};
    surface.triangles[at(u)] = {middle, q, apex};
    surface.tags[at(t)] = surface.tags[at(u)];
    changed[at(t)] = changed[at(u)] = 1;
    ++count;
  }
  return count;
}

}  // namespace

std::int64_t cut_at_slivers(Surface& surface) {
  // Slivers stacked on one edge are undone from outside in, one a sweep; more than a few are not worth the
  // time.
  constexpr int kSweeps = 16;
  std::int64_t total = 0;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    std::vector<Index> slivers;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
      if (!has_repeated_corner(surface.triangles[t]) && has_no_area(surface, t))
        slivers.push_back(static_cast<Index>(t));
    const std::int64_t count = slivers.empty() ? 0 : cut_once(surface, slivers);
    if (count == 0) break;
    total += count;
  }
  return total;
}

std::int64_t drop_degenerate(Surface& surface) {
  return filter(surface, [&](std::size_t t) {
    return !has_repeated_corner(surface.triangles[t]) && !has_no_area(surface, t);
  });
}

namespace {

/// Marks one triangle of each coincident group to stay and the others to go; `wall` lists those that stay
/// although an opposite copy goes.
std::vector<char> mark_duplicates(const Surface& surface, std::vector<Index>& wall) {
  const std::size_t n = surface.triangles.size();
  std::vector<char> keep(n, 1);
  std::vector<SortedCorners> corners(n);
  for (std::size_t t = 0; t < n; ++t) corners[t] = sorted(surface.triangles[t]);
  Buckets buckets(n, surface.points.size(), [&](std::size_t t) { return at(corners[t].v[0]); });
  for_each_group(
      buckets,
      [&](Index t) {
        const auto& v = corners[at(t)].v;
        return static_cast<std::uint64_t>(v[1]) << 32 | static_cast<std::uint64_t>(v[2]);
      },
      [&](const Index* begin, const Index* end) {
        bool opposite = false;
        for (const Index* t = begin + 1; t < end; ++t) {
          keep[at(*t)] = 0;
          opposite = opposite || corners[at(*t)].even != corners[at(*begin)].even;
        }
        if (opposite) wall.push_back(*begin);
      });
  return keep;
}

}  // namespace

Duplicates drop_duplicates(Surface& surface) {
  std::vector<Index> wall;
  std::vector<char> keep = mark_duplicates(surface, wall);
  if (wall.empty()) return {filter(surface, [&](std::size_t t) { return keep[t] != 0; }), 0};
  std::vector<char> is_wall(surface.triangles.size(), 0);
  for (const Index t : wall) is_wall[at(t)] = 1;
  std::vector<char> kept_wall;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] != 0) ++kept, kept_wall.push_back(is_wall[t]);
  const std::int64_t copies = filter(surface, [&](std::size_t t) { return keep[t] != 0; });

  // Edge-connected patches of wall triangles. A patch is an inner wall when it has a border and the other
  // triangles close up without it: an even number of them, not zero, at every border edge.
  const EdgeTable edges(surface);
  DisjointSets patches(kept);
  std::vector<char> bordered(kept, 0), needed(kept, 0);
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t e = 0; e < edges.size(); ++e) {
      Index some_wall = kNone;
      std::int64_t others = 0;
      for (std::int64_t i = edges.first[e]; i < edges.first[e + 1]; ++i) {
        const Index t = triangle_of(edges.half_edges[static_cast<std::size_t>(i)]);
        if (kept_wall[at(t)] == 0) {
          ++others;
        } else {
          if (some_wall != kNone && pass == 0) patches.join(some_wall, t);
          some_wall = t;
        }
      }
      if (pass == 0 || some_wall == kNone) continue;
      const bool border = others > 0 || edges.count(e) == 1;
      if (border) bordered[at(patches.root(some_wall))] = 1;
      if (others % 2 != 0 || (border && others == 0)) needed[at(patches.root(some_wall))] = 1;
    }
  const std::int64_t walls = filter(surface, [&](std::size_t t) {
    if (kept_wall[t] == 0) return true;
    const Index patch = patches.root(static_cast<Index>(t));
    return bordered[at(patch)] == 0 || needed[at(patch)] != 0;
  });
  return {copies, walls};
}

void number_points(Surface& surface) {
  std::vector<Index> number(surface.points.size(), kNone);
  std::vector<Vec3> points;
  points.reserve(surface.points.size());
  for (auto& triangle : surface.triangles)
    for (Index& v : triangle) {
      Index& known = number[at(v)];
      if (known == kNone) {
        known = static_cast<Index>(points.size());
        points.push_back(surface.points[at(v)]);
      }
      v = known;
    }
  surface.points = std::move(points);
}

EdgeTable::EdgeTable(const Surface& surface) : first{0} {
  const std::size_t n = 3 * surface.triangles.size();
  const auto ends = [&](std::size_t h) {
    const auto& v = surface.triangles[h / 3];
    const Index a = v[h % 3], b = v[(h + 1) % 3];
    return std::pair{std::min(a, b), std::max(a, b)};
  };
  Buckets buckets(n, surface.points.size(), [&](std::size_t h) { return at(ends(h).first); });
  opposite.assign(n, kOpen);
  first.reserve(n / 2 + 2);
  for_each_group(
      buckets, [&](Index h) { return ends(at(h)).second; },
      [&](const Index* begin, const Index* end) {
        first.push_back(end - buckets.items.data());
        if (end - begin == 2) {
          opposite[at(begin[0])] = begin[1];
          opposite[at(begin[1])] = begin[0];
        } else if (end - begin > 2) {
          for (const Index* h = begin; h < end; ++h) opposite[at(*h)] = kNonManifold;
        }
      });
  half_edges = std::move(buckets.items);
}

Index find_shells(const Surface& surface, const EdgeTable& edges, std::vector<Index>& shell) {
  DisjointSets sets(surface.triangles.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (std::int64_t i = edges.first[e] + 1; i < edges.first[e + 1]; ++i)
      sets.join(triangle_of(edges.half_edges[static_cast<std::size_t>(i - 1)]),
                triangle_of(edges.half_edges[static_cast<std::size_t>(i)]));
  shell.assign(surface.triangles.size(), kNone);
  Index count = 0;
  for (std::size_t t = 0; t < shell.size(); ++t) {
    const Index root = sets.root(static_cast<Index>(t));
    if (shell[at(root)] == kNone) shell[at(root)] = count++;  // the root is the first of its set
    shell[t] = shell[at(root)];
  }
  return count;
}

}  // namespace lamina::detail
