#include "vdb/detail/bvh.h"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "core/parallel.h"
#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

std::vector<Index> all_of(const Surface& s) {
  std::vector<Index> ids(s.triangles.size());
  std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

TriangleBvh tree_of(const Surface& s) { return {s.points, s.triangles, all_of(s)}; }

// Independent of the code under test: minimum over a fine search of the three segments and the plane.
double plain_distance2(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
  const auto segment = [&](const Vec3& p, const Vec3& q) {
    const double l = (q - p).squaredNorm();
    const double t = l > 0.0 ? std::clamp((x - p).dot(q - p) / l, 0.0, 1.0) : 0.0;
    return (x - p - t * (q - p)).squaredNorm();
  };
  double best = std::min({segment(a, b), segment(b, c), segment(c, a)});
  const Vec3 n = (b - a).cross(c - a);
  if (n.norm() > 0.0) {
    const Vec3 q = x - n * n.dot(x - a) / n.squaredNorm();
    const bool inside = n.dot((b - a).cross(q - a)) >= 0.0 && n.dot((c - b).cross(q - b)) >= 0.0 &&
                        n.dot((a - c).cross(q - c)) >= 0.0;
    if (inside) best = std::min(best, (x - q).squaredNorm());
  }
  return best;
}

TEST(Bvh, FeaturesOfOneTriangle) {
  const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  struct Case {
    Vec3 x, q;
    int feature;
  };
  const Case cases[] = {
      {{0.5, 0.5, 3.0}, {0.5, 0.5, 0.0}, kInterior},  {{1.0, -2.0, 1.0}, {1.0, 0.0, 0.0}, kEdge0},
      {{2.0, 2.0, 1.0}, {1.0, 1.0, 0.0}, kEdge0 + 1}, {{-1.0, 1.0, 0.0}, {0.0, 1.0, 0.0}, kEdge0 + 2},
      {{-1.0, -1.0, 2.0}, {0, 0, 0}, kCorner0},       {{5.0, -1.0, 0.0}, {2, 0, 0}, kCorner0 + 1},
      {{-1.0, 4.0, -1.0}, {0, 2, 0}, kCorner0 + 2}};
  for (const Case& t : cases) {
    const TriangleHit hit = closest_on_triangle(a, b, c, t.x);
    EXPECT_EQ(hit.feature, t.feature) << t.x.transpose();
    EXPECT_LT((hit.point - t.q).norm(), 1e-15);
    EXPECT_DOUBLE_EQ(hit.d2, (t.x - t.q).squaredNorm());
    const Vec3 again = hit.bary[0] * a + hit.bary[1] * b + hit.bary[2] * c;
    EXPECT_LT((again - t.q).norm(), 1e-15);
  }
}

TEST(Bvh, SliversAndDegenerateTriangles) {
  Dice dice(1);
  for (const double thin : {1e-4, 1e-7, 1e-12, 0.0}) {
    const Vec3 a(0, 0, 0), b(1, 0, 0), c(0.4, thin, 0);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x = dice.point({-0.5, -0.01, -0.01}, {1.5, 0.01, 0.01});
      const double d2 = closest_on_triangle(a, b, c, x).d2;
      EXPECT_NEAR(std::sqrt(d2), std::sqrt(plain_distance2(a, b, c, x)), 1e-15) << thin;
    }
  }
  EXPECT_DOUBLE_EQ(closest_on_triangle({1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 4}).d2, 9.0);
}

TEST(Bvh, EqualsTheMinimumOverAllTriangles) {
  Dice dice(2);
  Surface soup;  // triangles of very different size and shape, far from the origin
  for (Index t = 0; t < 600; ++t) {
    const Vec3 p = Vec3(1000, 0, -50) + dice.point(Vec3::Zero(), Vec3::Ones());
    const double size = std::pow(10.0, dice.uniform(-3.0, 0.0));
    soup.points.push_back(p);
    soup.points.push_back(p + size * dice.direction());
    soup.points.push_back(p + size * (t % 3 == 0 ? 1e-4 : 1.0) * dice.direction());
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  for (const Surface& s : {soup, cylinder(1.0, -1.0, 1.0, 400), torus(1.0, 0.3, 20, 12)}) {
    const TriangleBvh bvh = tree_of(s);
    const Box<3> box = s.bounds().padded(0.3);
    for (int i = 0; i < 400; ++i) {
      const Vec3 x = i == 0 ? s.points[0] : dice.point(box.lo, box.hi);
      double best = 1e300;
      for (const auto& t : s.triangles)
        best = std::min(best, plain_distance2(s.points[static_cast<std::size_t>(t[0])],
                                              s.points[static_cast<std::size_t>(t[1])],
                                              s.points[static_cast<std::size_t>(t[2])], x));
      const TriangleHit hit = bvh.closest(x);
      EXPECT_NEAR(std::sqrt(hit.d2), std::sqrt(best), 2e-13);
      EXPECT_LT((x - hit.point - hit.offset).norm(), 1e-12);
      if (i == 0) continue;
      EXPECT_EQ(bvh.closest(x, hit.d2 * (1.0 + 1e-9)).triangle, hit.triangle);  // a bound changes nothing
      EXPECT_EQ(bvh.closest(x, hit.d2 * (1.0 - 1e-9)).triangle, kNone);
      const double rough = bvh.closest(x, 1e300, 0.01).d2;
      EXPECT_GE(rough, hit.d2);
      EXPECT_LE(std::sqrt(rough), 1.01 * std::sqrt(hit.d2) + 1e-15);
    }
  }
}

// On vertices and edges many triangles are equally near: the one that is found must not depend on the search
// before.
TEST(Bvh, WhereTheLastSearchEndedChangesNothing) {
  const Surface s = torus(1.0, 0.3, 60, 30);
  const TriangleBvh bvh = tree_of(s);
  Dice dice(3);
  const auto same = [](const TriangleHit& a, const TriangleHit& b) {
    return a.d2 == b.d2 && a.triangle == b.triangle && a.feature == b.feature && a.point == b.point;
  };
  for (std::size_t i = 0; i < 2000; ++i) {
    const Vec3 x = i % 2 == 0 ? s.points[i % s.points.size()] : dice.point({-2, -2, -1}, {2, 2, 1});
    static_cast<void>(bvh.closest(dice.point({-2, -2, -1}, {2, 2, 1})));
    const TriangleHit from_afar = bvh.closest(x), again = bvh.closest(x);
    TriangleHit afresh;
    std::thread([&] { afresh = bvh.closest(x); }).join();
    EXPECT_TRUE(same(from_afar, again));
    EXPECT_TRUE(same(from_afar, afresh));
  }
}

TEST(Bvh, TinyDistancesKeepTheirRelativeAccuracy) {
  const Surface s = sphere(3.0, 20);
  const TriangleBvh bvh = tree_of(s);
  for (std::size_t t = 0; t < s.triangles.size(); t += 7) {
    const auto p = [&](std::size_t k) -> const Vec3& {
      return s.points[static_cast<std::size_t>(s.triangles[t][k])];
    };
    const Vec3 n = (p(1) - p(0)).cross(p(2) - p(0)).normalized();
    EXPECT_NEAR(std::sqrt(bvh.closest((p(0) + p(1) + p(2)) / 3.0 + 1e-6 * n).d2), 1e-6, 5e-15);
  }
}

TEST(Bvh, ThreadsDoNotChangeTheTree) {
  const Surface s = torus(1.0, 0.3, 200, 60);
  std::vector<BoxNode> first;
  for (const int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    const TriangleBvh bvh = tree_of(s);
    if (first.empty()) first = bvh.tree().nodes;
    ASSERT_EQ(first.size(), bvh.tree().nodes.size());
    EXPECT_EQ(std::memcmp(first.data(), bvh.tree().nodes.data(), first.size() * sizeof(BoxNode)), 0);
  }
}

TEST(Bvh, EmptyAndSingle) {
  const Surface s = box(Vec3::Zero(), Vec3::Ones());
  EXPECT_EQ(TriangleBvh(s.points, s.triangles, {}).closest(Vec3::Zero()).triangle, kNone);
  const std::vector<Index> one{3};
  EXPECT_EQ(TriangleBvh(s.points, s.triangles, one).closest(Vec3(5, 5, 5)).triangle, 3);
  EXPECT_EQ(SegmentBvh().closest(Vec3::Zero()).segment, kNone);
}

TEST(Bvh, SegmentsAndPoints) {
  const std::vector<std::array<Vec3, 2>> segments{{Vec3(0, 0, 0), Vec3(4, 0, 0)},
                                                  {Vec3(9, 9, 9), Vec3(9, 9, 9)}};
  const SegmentBvh bvh(segments);
  const SegmentHit hit = bvh.closest({1, 2, 0});
  EXPECT_EQ(hit.segment, 0);
  EXPECT_DOUBLE_EQ(hit.d2, 4.0);
  EXPECT_DOUBLE_EQ(hit.t, 0.25);
  EXPECT_EQ(bvh.closest({8, 8, 8}).segment, 1);
  EXPECT_EQ(bvh.closest({1, 2, 0}, 3.0).segment, kNone);
}

TEST(Bvh, CoarseCenterIsExactForShortNumbers) {
  Box<3> b;
  b.extend({1000.0, 0.0, 0.0});
  b.extend({1001.0, 1.0, 1.0});
  const Vec3 c = coarse_center(b);
  EXPECT_LT((c - b.center()).norm(), 2.0 * b.diagonal());
  EXPECT_EQ((Vec3(1000.125, 0.5, 0.25) - c) + c, Vec3(1000.125, 0.5, 0.25));
  EXPECT_EQ(coarse_center({}), Vec3::Zero());
}

}  // namespace
}  // namespace lamina::detail
