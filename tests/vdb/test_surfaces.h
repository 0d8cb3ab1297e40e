// Small surfaces with known answers, made here so that tests of the wall do not rest on the readers or
// shapes.
#pragma once

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include "vdb/surface.h"

namespace lamina::testing_surfaces {

inline void finish(Surface& s) {
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"wall"};
}

/// Axis-aligned box, outward; `faces` selects of x-, x+, y-, y+, z-, z+ (bit i).
inline Surface box(const Vec3& lo, const Vec3& hi, unsigned faces = 63) {
  Surface s;
  for (int c = 0; c < 8; ++c)
    s.points.emplace_back(c & 1 ? hi[0] : lo[0], c & 2 ? hi[1] : lo[1], c & 4 ? hi[2] : lo[2]);
  const std::array<std::array<Index, 4>, 6> quad{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (std::size_t f = 0; f < 6; ++f) {
    if (!(faces >> f & 1)) continue;
    s.triangles.push_back({quad[f][0], quad[f][1], quad[f][2]});
    s.triangles.push_back({quad[f][0], quad[f][2], quad[f][3]});
  }
  finish(s);
  return s;
}

inline Surface joined(const Surface& a, const Surface& b) {
  Surface s = a;
  const Index shift = static_cast<Index>(a.points.size());
  s.points.insert(s.points.end(), b.points.begin(), b.points.end());
  for (const auto& t : b.triangles) s.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  finish(s);
  return s;
}

/// A closed surface over a torus-shaped grid of n x m vertices, rows shifted by half a cell against each
/// other.
inline Surface torus(double R, double r, int n, int m) {
  Surface s;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double u = 2.0 * std::numbers::pi * i / n, v = 2.0 * std::numbers::pi * (j + 0.5 * (i % 2)) / m;
      s.points.emplace_back((R + r * std::cos(v)) * std::cos(u), (R + r * std::cos(v)) * std::sin(u),
                            r * std::sin(v));
    }
  }
  const auto id = [&](int i, int j) { return static_cast<Index>((i % n) * m + j % m); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const Index a = id(i, j), b = id(i + 1, j), c = id(i + 1, j + 1), d = id(i, j + 1);
      if (i % 2 == 0) {
        s.triangles.push_back({a, b, d});
        s.triangles.push_back({b, c, d});
      } else {
        s.triangles.push_back({a, b, c});
        s.triangles.push_back({a, c, d});
      }
    }
  }
  finish(s);
  return s;
}

/// Octahedron, each facet cut into n^2, on the sphere of radius r about `center`; `keep` drops facets by
/// centroid.
inline Surface sphere(
    double r, int n, const Vec3& center = Vec3::Zero(),
    const std::function<bool(const Vec3&)>& keep = [](const Vec3&) { return true; }) {
  Surface s;
  std::map<std::array<int, 3>, Index> known;
  for (int o = 0; o < 8; ++o) {
    const int sx = o & 1 ? -1 : 1, sy = o & 2 ? -1 : 1, sz = o & 4 ? -1 : 1;
    const auto id = [&](int i, int j) {
      const std::array<int, 3> key{sx * i, sy * j, sz * (n - i - j)};
      const auto [entry, fresh] = known.try_emplace(key, static_cast<Index>(s.points.size()));
      if (fresh) s.points.push_back(center + r * Vec3(key[0], key[1], key[2]).normalized());
      return entry->second;
    };
    const auto add = [&](Index a, Index b, Index c) {
      const auto p = [&](Index v) -> const Vec3& { return s.points[static_cast<std::size_t>(v)]; };
      if (!keep((p(a) + p(b) + p(c)) / 3.0 - center)) return;
      if (sx * sy * sz > 0) {
        s.triangles.push_back({a, b, c});
      } else {
        s.triangles.push_back({a, c, b});
      }
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n - i; ++j) {
        add(id(i, j), id(i + 1, j), id(i, j + 1));
        if (i + j < n - 1) add(id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
      }
    }
  }
  finish(s);
  return s;
}

/// Closed cylinder about z of n strips, caps as fans.
inline Surface cylinder(double r, double lo, double hi, int n) {
  Surface s;
  for (int i = 0; i < n; ++i)
    for (const double z : {lo, hi})
      s.points.emplace_back(r * std::cos(2.0 * std::numbers::pi * i / n),
                            r * std::sin(2.0 * std::numbers::pi * i / n), z);
  s.points.emplace_back(0.0, 0.0, lo);
  s.points.emplace_back(0.0, 0.0, hi);
  for (Index i = 0; i < n; ++i) {
    const Index a = 2 * i, b = 2 * ((i + 1) % n);
    s.triangles.push_back({a, b, b + 1});
    s.triangles.push_back({a, b + 1, a + 1});
    s.triangles.push_back({b, a, 2 * n});
    s.triangles.push_back({a + 1, b + 1, 2 * n + 1});
  }
  finish(s);
  return s;
}

/// Prism along y in [0, width] over a polygon in the x-z plane, counter-clockwise seen from -y, given with a
/// fan of triangles that fills it.
inline Surface prism(const std::vector<Vec2>& polygon, const std::vector<std::array<Index, 3>>& fill,
                     double width) {
  Surface s;
  const Index n = static_cast<Index>(polygon.size());
  for (const double y : {0.0, width})
    for (const Vec2& p : polygon) s.points.emplace_back(p[0], y, p[1]);
  for (const auto& t : fill) {
    s.triangles.push_back({t[0], t[1], t[2]});
    s.triangles.push_back({t[0] + n, t[2] + n, t[1] + n});
  }
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    s.triangles.push_back({j, i, i + n});
    s.triangles.push_back({j, i + n, j + n});
  }
  finish(s);
  return s;
}

/// L-shaped step: floor z = 0 for x > 0 up to 2, wall x = 0 up to z = 1 and a roof; the concave edge is the y
/// axis.
inline Surface step() {
  const std::vector<Vec2> p{{-1.0, -1.0}, {2.0, -1.0}, {2.0, 0.0}, {0.0, 0.0}, {0.0, 1.0}, {-1.0, 1.0}};
  return prism(p, {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 1.0);
}

struct Dice {
  std::mt19937_64 engine;
  explicit Dice(std::uint64_t seed) : engine(seed) {}
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(engine() >> 11) * 0x1.0p-53;
  }
  Vec3 point(const Vec3& lo, const Vec3& hi) {
    const double x = uniform(lo[0], hi[0]), y = uniform(lo[1], hi[1]), z = uniform(lo[2], hi[2]);
    return {x, y, z};
  }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = point(Vec3::Constant(-1.0), Vec3::Constant(1.0));
      if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
  }
};

}  // namespace lamina::testing_surfaces
