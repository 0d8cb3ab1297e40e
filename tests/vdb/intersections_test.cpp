// The brute force here shares no arithmetic with the code: positions along the common line, and areas of
// clipped polygons, in fractions where facets are made to degenerate and in long doubles elsewhere.
#include "vdb/detail/intersections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

Surface facets(const std::vector<Vec3>& points, const std::vector<std::array<Index, 3>>& triangles) {
  Surface s;
  s.points = points;
  s.triangles = triangles;
  finish(s);
  return s;
}

std::int64_t pairs(const Surface& s) { return find_intersections(s).pairs; }

/// The lowest-terms fraction of two 64-bit integers.
struct Fraction {
  std::int64_t n = 0, d = 1;
  Fraction() = default;
  Fraction(double x) : n(static_cast<std::int64_t>(x)) {}  // NOLINT(google-explicit-constructor)
  Fraction(std::int64_t num, std::int64_t den) : n(num), d(den) {
    if (d < 0) n = -n, d = -d;
    const std::int64_t g = std::gcd(n, d);
    n /= g;
    d /= g;
  }
  friend Fraction operator+(const Fraction& a, const Fraction& b) {
    return {a.n * b.d + b.n * a.d, a.d * b.d};
  }
  friend Fraction operator-(const Fraction& a, const Fraction& b) {
    return {a.n * b.d - b.n * a.d, a.d * b.d};
  }
  friend Fraction operator*(const Fraction& a, const Fraction& b) { return {a.n * b.n, a.d * b.d}; }
  friend Fraction operator/(const Fraction& a, const Fraction& b) { return {a.n * b.d, a.d * b.n}; }
  friend bool operator<(const Fraction& a, const Fraction& b) { return a.n * b.d < b.n * a.d; }
  friend bool operator==(const Fraction& a, const Fraction& b) { return a.n == b.n && a.d == b.d; }
};

template <class T>
using Point = std::array<T, 3>;
template <class T>
using Corners = std::vector<Point<T>>;

template <class T>
Point<T> minus(const Point<T>& a, const Point<T>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class T>
Point<T> cross(const Point<T>& a, const Point<T>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class T>
T dot(const Point<T>& a, const Point<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class T>
Point<T> normal(const Corners<T>& t) {
  return cross(minus(t[1], t[0]), minus(t[2], t[0]));
}

/// Keeps the part of a polygon where the height, a linear function, is not negative.
template <class T, class Height>
Corners<T> kept(const Corners<T>& polygon, Height height) {
  Corners<T> out;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point<T>&x = polygon[k], &y = polygon[(k + 1) % polygon.size()];
    const T hx = height(x), hy = height(y);
    if (!(hx < T(0))) out.push_back(x);
    if ((hx < T(0) && T(0) < hy) || (hy < T(0) && T(0) < hx)) {
      Point<T> z;
      for (std::size_t i = 0; i < 3; ++i) z[i] = x[i] + hx / (hx - hy) * (y[i] - x[i]);
      out.push_back(z);
    }
  }
  return out;
}

template <class T>
bool brute_overlap(const Corners<T>& a, const Corners<T>& b) {
  Corners<T> polygon = a;
  const Point<T> n = normal(b);
  for (std::size_t k = 0; k < 3 && !polygon.empty(); ++k) {
    const Point<T> inward = cross(n, minus(b[(k + 1) % 3], b[k]));
    polygon = kept<T>(polygon, [&](const Point<T>& x) { return dot(inward, minus(x, b[k])); });
  }
  T area(0);
  for (std::size_t k = 2; k < polygon.size(); ++k)
    area = area + dot(n, cross(minus(polygon[k - 1], polygon[0]), minus(polygon[k], polygon[0])));
  return !(area == T(0));
}

/// What a triangle has of a plane: positions along `line` of its end points, and whether that is an edge.
template <class T>
struct Stretch {
  std::vector<T> ends;
  bool edge = false;

  Stretch(const Corners<T>& t, const Corners<T>& plane, const Point<T>& line) {
    const Point<T> n = normal(plane);
    std::array<T, 3> h;
    for (std::size_t k = 0; k < 3; ++k) h[k] = dot(n, minus(t[k], plane[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t m = (k + 1) % 3;
      if (h[k] == T(0)) ends.push_back(dot(line, t[k]));
      if ((h[k] < T(0) && T(0) < h[m]) || (h[m] < T(0) && T(0) < h[k]))
        ends.push_back(dot(line, t[k]) + h[k] / (h[k] - h[m]) * dot(line, minus(t[m], t[k])));
    }
    edge = std::count(h.begin(), h.end(), T(0)) == 2;
    std::sort(ends.begin(), ends.end());
  }
};

template <class T>
bool brute_meet(const Corners<T>& a, const Corners<T>& b) {
  const Point<T> line = cross(normal(a), normal(b));
  if (line == Point<T>{T(0), T(0), T(0)})
    return dot(normal(a), minus(b[0], a[0])) == T(0) && brute_overlap(a, b);
  const Stretch<T> sa(a, b, line), sb(b, a, line);
  if (sa.ends.size() < 2 || sb.ends.size() < 2 || (sa.edge && sb.edge)) return false;
  return std::max(sa.ends.front(), sb.ends.front()) < std::min(sa.ends.back(), sb.ends.back());
}

template <class T>
Corners<T> corners(const Surface& s, std::size_t t) {
  Corners<T> out;
  for (const Index v : s.triangles[t]) {
    const Vec3& p = s.points[static_cast<std::size_t>(v)];
    out.push_back({T(p[0]), T(p[1]), T(p[2])});
  }
  return out;
}

template <class T>
Intersections brute_force(const Surface& s) {
  Intersections out;
  for (std::size_t i = 0; i < s.triangles.size(); ++i) {
    for (std::size_t j = i + 1; j < s.triangles.size(); ++j) {
      if (!brute_meet(corners<T>(s, i), corners<T>(s, j))) continue;
      if (out.pairs++ == 0) out.first = {static_cast<Index>(i), static_cast<Index>(j)};
    }
  }
  return out;
}

TEST(Intersections, CleanBodiesHaveNone) {
  EXPECT_EQ(pairs(box({0, 0, 0}, {1, 2, 3})), 0);
  EXPECT_EQ(pairs(sphere(0.5, 20)), 0);
  EXPECT_EQ(pairs(torus(1.0, 0.3, 40, 20)), 0);
  EXPECT_EQ(pairs(step()), 0);
  EXPECT_EQ(pairs(cylinder(0.5, 0.0, 2.0, 300)), 0);  // caps are fans of slivers
  EXPECT_EQ(pairs(Surface{}), 0);
  EXPECT_TRUE(find_intersections(sphere(0.5, 20)).complete);
}

// A bar through the middle of a box, along x. Of the box the faces x = 0 and x = 4 are crossed, whose
// diagonals run corner to corner, y = z or y = 4 - z, through the bar's section [1, 3]^2 from corner to
// corner. Each of the two facets of a face lies on one side of its diagonal and so meets two of the bar's
// four sides: in each side the stretch of the face's plane goes across both of its facets, or ends at the
// corner they share.
TEST(Intersections, BarThroughABoxByHand) {
  const Surface s = joined(box({0, 0, 0}, {4, 4, 4}), box({-1, 1, 1}, {5, 3, 3}));
  const Intersections found = find_intersections(s);
  EXPECT_EQ(found.pairs, 2 * 2 * 2 * 2);  // faces, facets of a face, sides, facets of a side
  EXPECT_TRUE(found.complete);
  EXPECT_EQ(brute_force<Fraction>(s).pairs, found.pairs);
  EXPECT_TRUE(found.place[0] == 0.0 || found.place[0] == 4.0) << found.place.transpose();
  EXPECT_EQ(std::max(std::abs(found.place[1] - 2.0), std::abs(found.place[2] - 2.0)), 1.0);
}

TEST(Intersections, TwoFacetsByHand) {
  // A facet in z = 0 and one in y = 0.25 through its inside.
  const std::vector<Vec3> p{{0, 0, 0},        {1, 0, 0},         {0, 1, 0},
                            {0.25, 0.25, -1}, {0.5, 0.25, -1},   {0.375, 0.25, 1},
                            {0.25, 0.25, 0},  {0.375, 0.25, -1}, {0.375, 0.25, 0}};
  const auto with = [&](Index a, Index b, Index c) { return facets(p, {{0, 1, 2}, {a, b, c}}); };
  const Intersections found = find_intersections(with(3, 4, 5));
  EXPECT_EQ(found.pairs, 1);
  EXPECT_EQ(found.first, (std::array<Index, 2>{0, 1}));
  EXPECT_NEAR((found.place - Vec3(0.375, 0.25, 0)).norm(), 0.0, 1e-15);
  EXPECT_EQ(pairs(with(5, 4, 3)), 1) << "either orientation";
  EXPECT_EQ(pairs(with(3, 4, 8)), 0) << "a corner in the inside touches";
  EXPECT_EQ(pairs(with(6, 8, 5)), 1) << "an edge laid into the inside";
}

TEST(Intersections, HangingNodesTouch) {
  // The edge (0, 1) is cut at (0.5, 0, 0) on the other side, flat and at an angle.
  for (const double z : {0.0, 1.0}) {
    const Surface s = facets({{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0.5, 1, 0}, {0.5, -1, z}},
                             {{0, 1, 3}, {0, 4, 2}, {2, 4, 1}});
    EXPECT_EQ(pairs(s), 0) << z;
  }
}

TEST(Intersections, CornersAndEdgesTouch) {
  EXPECT_EQ(pairs(joined(box({0, 0, 0}, {1, 1, 1}), box({1, 1, 1}, {2, 2, 2}))), 0) << "corner, not welded";
  EXPECT_EQ(pairs(joined(box({0, 0, 0}, {1, 1, 1}), box({1, 1, 0}, {2, 2, 1}))), 0) << "edge, not welded";
  EXPECT_EQ(pairs(facets({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 1}, {0, -1, 1}}, {{0, 1, 2}, {0, 3, 4}})),
            0)
      << "corner, welded";
}

TEST(Intersections, SharedCorner) {
  const auto second = [](const Vec3& a, const Vec3& b) {
    return facets({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, a, b}, {{0, 1, 2}, {0, 3, 4}});
  };
  EXPECT_EQ(pairs(second({1, 1, 1}, {1, 1, -1})), 1) << "the opposite edge pierces the inside";
  EXPECT_EQ(pairs(second({4, 4, 1}, {4, 4, -1})), 1) << "... passes beyond, the edge of the other pierces it";
  EXPECT_EQ(pairs(second({1, 1, 0}, {1, 1, 5})), 1) << "an edge laid into the inside";
  EXPECT_EQ(pairs(second({-1, -1, 1}, {-1, -1, -1})), 0) << "behind the corner";
  EXPECT_EQ(pairs(second({3, 0, 1}, {3, 0, -1})), 1) << "the edge of the other laid into it";
  EXPECT_EQ(pairs(second({3, 0, 0}, {3, 0, 5})), 0) << "edges along each other";
  EXPECT_EQ(pairs(second({1, 3, 0}, {3, 1, 0})), 1) << "in one plane, one over the other";
  EXPECT_EQ(pairs(second({0, 3, 0}, {-3, 0, 0})), 0) << "in one plane, side by side";
}

TEST(Intersections, Folds) {
  const auto apex = [](const Vec3& d) {
    return pairs(facets({{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, d}, {{0, 1, 2}, {1, 0, 3}}));
  };
  EXPECT_EQ(apex({0.5, 0.5, 0}), 1) << "folded back";
  EXPECT_EQ(apex({3, 0.5, 0}), 1) << "folded back, leaning over";
  EXPECT_EQ(apex({0.5, 0.5, 1e-300}), 0) << "folded nearly back";
  EXPECT_EQ(apex({0.5, -0.5, 0}), 0) << "flat";
  EXPECT_EQ(apex({0.5, 0, 1}), 0);
}

TEST(Intersections, FacetsInOnePlane) {
  const auto over = [](const Vec3& shift) {
    const Surface one = facets({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}});
    Surface other = one;
    for (Vec3& x : other.points) x += shift;
    return find_intersections(joined(one, other));
  };
  EXPECT_EQ(over({0, 0, 0}).pairs, 1) << "one over the other";
  EXPECT_EQ(over({0.5, 0.5, 0}).pairs, 1);
  EXPECT_NEAR((over({0.5, 0.5, 0}).place - Vec3(5. / 6, 5. / 6, 0)).norm(), 0.0, 1e-15);
  EXPECT_EQ(over({1, 1, 0}).pairs, 0) << "corner on the edge";
  EXPECT_EQ(over({2, 0, 0}).pairs, 0) << "corner to corner";
  EXPECT_EQ(over({0.5, 0.5, 1e-300}).pairs, 0) << "parallel";
}

TEST(Intersections, StackedBoxesOverlapWithTheirFaces) {
  // The face z = 1 of the lower and the smaller face of the upper box: 2 x 2 facets; the smaller one's
  // diagonal lies along the larger one's, so two of the pairs only touch. The four sides of the upper box
  // stand with their edge, on one facet each, inside one facet of the lower face: 4 more.
  const Surface s = joined(box({0, 0, 0}, {4, 4, 1}), box({1, 1, 1}, {3, 3, 2}));
  const Intersections found = find_intersections(s);
  EXPECT_EQ(found.pairs, 2 + 4);
  EXPECT_EQ(brute_force<Fraction>(s).pairs, found.pairs);
  EXPECT_EQ(found.place[2], 1.0);
}

/// Facets over a lattice of points: nearly every degenerate position occurs, shared corners as well.
Surface lattice_soup(Dice& dice, int count, int width) {
  Surface s;
  for (int i = 0; i < width * width * width; ++i)
    s.points.emplace_back(i % width, i / width % width, i / (width * width));
  while (static_cast<int>(s.triangles.size()) < count) {
    std::array<Index, 3> t{};
    for (Index& v : t) v = static_cast<Index>(dice.engine() % s.points.size());
    const auto p = [&](std::size_t k) { return s.points[static_cast<std::size_t>(t[k])]; };
    if (!(p(1) - p(0)).cross(p(2) - p(0)).isZero()) s.triangles.push_back(t);
  }
  finish(s);
  return s;
}

TEST(Intersections, LatticeSoupsAgainstFractions) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Dice dice(seed);
    const Surface s = lattice_soup(dice, 60, 3 + static_cast<int>(seed % 3));
    const Intersections found = find_intersections(s), expected = brute_force<Fraction>(s);
    EXPECT_EQ(found.pairs, expected.pairs) << "seed " << seed;
    EXPECT_EQ(found.first, expected.first) << "seed " << seed;
    EXPECT_GT(expected.pairs, 100);
  }
}

/// Facets of the given size at random places of the unit cube.
Surface soup(Dice& dice, int count, double size) {
  Surface s;
  for (Index i = 0; i < count; ++i) {
    const Vec3 x = dice.point(Vec3::Zero(), Vec3::Ones());
    for (int k = 0; k < 3; ++k)
      s.points.push_back(x + size * dice.point(Vec3::Constant(-1.0), Vec3::Constant(1.0)));
    s.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  finish(s);
  return s;
}

TEST(Intersections, SoupsAgainstLongDoubles) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Dice dice(seed);
    const Surface s = soup(dice, 300, seed % 2 == 0 ? 0.1 : 0.5);
    const Intersections found = find_intersections(s), expected = brute_force<long double>(s);
    EXPECT_EQ(found.pairs, expected.pairs) << "seed " << seed;
    EXPECT_EQ(found.first, expected.first) << "seed " << seed;
  }
}

TEST(Intersections, PlaceIsOnBothFacets) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    const Surface s = seed % 2 == 0 ? soup(dice, 50, 0.5) : lattice_soup(dice, 20, 4);
    const Intersections found = find_intersections(s);
    ASSERT_GT(found.pairs, 0);
    for (const Index t : found.first) {
      const auto& v = s.triangles[static_cast<std::size_t>(t)];
      const Vec3 a = s.points[static_cast<std::size_t>(v[0])], b = s.points[static_cast<std::size_t>(v[1])],
                 c = s.points[static_cast<std::size_t>(v[2])];
      const Vec3 n = (b - a).cross(c - a), x = found.place;
      EXPECT_NEAR(n.normalized().dot(x - a), 0.0, 1e-12) << "seed " << seed;
      EXPECT_GE(n.dot((b - a).cross(x - a)), -1e-12) << "seed " << seed;
      EXPECT_GE(n.dot((c - b).cross(x - b)), -1e-12) << "seed " << seed;
      EXPECT_GE(n.dot((a - c).cross(x - c)), -1e-12) << "seed " << seed;
    }
  }
}

TEST(Intersections, OrderOfArgumentsAndCornersDoesNotMatter) {
  Dice dice(7);
  const Surface s = lattice_soup(dice, 60, 4);
  Surface turned = s;
  for (auto& t : turned.triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
  Surface flipped = s;
  for (std::size_t t = 0; t < s.triangles.size(); t += 2)
    std::swap(flipped.triangles[t][0], flipped.triangles[t][1]);
  for (Index i = 0; i < 60; ++i) {
    for (Index j = 0; j < i; ++j) {
      const bool expected = facets_meet(s, i, j);
      EXPECT_EQ(facets_meet(s, j, i), expected);
      EXPECT_EQ(facets_meet(turned, i, j), expected);
      EXPECT_EQ(facets_meet(flipped, i, j), expected);
    }
  }
}

TEST(Intersections, FarHugeAndTinyCoordinates) {
  const Surface crossing = joined(box({0, 0, 0}, {4, 4, 4}), box({-1, 1, 1}, {5, 3, 3}));
  for (const double scale : {1e-30, 1e-9, 1e9, 1e80}) {
    Surface s = crossing;
    for (Vec3& x : s.points) x *= scale;
    EXPECT_EQ(pairs(s), 16) << scale;
  }
  Surface s = crossing;
  for (Vec3& x : s.points) x += Vec3(1e12, -1e12, 0.0);
  EXPECT_EQ(pairs(s), 16);
}

TEST(Intersections, SameAnswerForEveryNumberOfThreads) {
  Dice dice(3);
  const Surface many = joined(torus(1.0, 0.3, 400, 200), soup(dice, 20000, 0.02));
  std::vector<Intersections> answers;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    answers.push_back(find_intersections(many));
  }
  for (const Intersections& found : answers) {
    EXPECT_GT(found.pairs, 1000);
    EXPECT_TRUE(found.complete);
    EXPECT_EQ(found.pairs, answers[0].pairs);
    EXPECT_EQ(found.first, answers[0].first);
    EXPECT_EQ(found.place, answers[0].place);
  }
}

TEST(Intersections, SearchOfAHopelessSoupEnds) {
  Dice dice(5);
  const Surface s = soup(dice, 12000, 1.0);  // 7e7 pairs of boxes overlap
  std::vector<Intersections> answers;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    answers.push_back(find_intersections(s));
  }
  EXPECT_FALSE(answers[0].complete);
  EXPECT_GT(answers[0].pairs, 100000);
  EXPECT_EQ(answers[0].pairs, answers[1].pairs);
  EXPECT_EQ(answers[0].first, answers[1].first);
}

}  // namespace
}  // namespace lamina::detail
