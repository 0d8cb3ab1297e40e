#include "vdb/detail/segment_minima.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using testing_surfaces::Dice;

struct Curves {
  std::vector<Vec3> points;
  std::vector<std::array<Index, 2>> ends;

  void add_line(const std::vector<Vec3>& p, bool closed) {
    const auto first = static_cast<Index>(points.size()), n = static_cast<Index>(p.size());
    points.insert(points.end(), p.begin(), p.end());
    for (Index i = 0; i + (closed ? 0 : 1) < n; ++i) ends.push_back({first + i, first + (i + 1) % n});
  }
  [[nodiscard]] SegmentMinima minima() const { return {points, ends}; }
};

std::vector<double> distances(const SegmentMinima& minima, const Vec3& x, double reach) {
  std::vector<double> out;
  minima.visit(x, reach, [&](const SegmentHit& hit) { out.push_back(std::sqrt(hit.d2)); });
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<Vec3> circle(double radius, int n) {
  std::vector<Vec3> p;
  for (int i = 0; i < n; ++i) {
    const double a = 2.0 * std::numbers::pi * i / n;
    p.emplace_back(radius * std::cos(a), radius * std::sin(a), 0.0);
  }
  return p;
}

TEST(SegmentMinima, SidesOfASquareCutIntoManySegments) {
  Curves square;
  std::vector<Vec3> p;
  constexpr int kPieces = 100;
  for (const auto& [from, to] :
       {std::pair{Vec3(0, 0, 0), Vec3(1, 0, 0)}, std::pair{Vec3(1, 0, 0), Vec3(1, 1, 0)},
        std::pair{Vec3(1, 1, 0), Vec3(0, 1, 0)}, std::pair{Vec3(0, 1, 0), Vec3(0, 0, 0)}})
    for (int i = 0; i < kPieces; ++i) p.push_back(from + (to - from) * i / kPieces);
  square.add_line(p, true);
  const SegmentMinima minima = square.minima();
  for (const Vec3& x : {Vec3(0.3, 0.2, 0.0), Vec3(0.3333, 0.20001, 0.0), Vec3(0.255, 0.2, 0.0)}) {
    const std::vector<double> d = distances(minima, x, 2.0);
    ASSERT_EQ(d.size(), 4U) << x.transpose();  // at a vertex between two segments as well: each counts once
    EXPECT_NEAR(d[0], x[1], 1e-14);
    EXPECT_NEAR(d[1], x[0], 1e-14);
    EXPECT_NEAR(d[2], 1.0 - x[0], 1e-14);
    EXPECT_NEAR(d[3], 1.0 - x[1], 1e-14);
  }
  EXPECT_EQ(distances(minima, {0.3, 0.2, 0.0}, 0.25).size(), 1U);
  EXPECT_EQ(distances(minima, {1.5, 1.5, 0.0}, 2.0).size(), 1U);  // the corner, which turns away
}

TEST(SegmentMinima, CurvesEndsAndPoints) {
  Curves curves;
  curves.add_line(circle(1.0, 90), true);
  curves.add_line({{1.5, 0, 0}, {2.5, 0, 0}}, false);
  curves.points.emplace_back(0.9, 0.5, 0.0);
  const auto point = static_cast<Index>(curves.points.size() - 1);
  curves.ends.push_back({point, point});
  const double a = std::numbers::pi / 90.0;  // below the middle of a chord
  const Vec3 x(0.95 * std::cos(a), 0.95 * std::sin(a), 0.0);
  const std::vector<double> d = distances(curves.minima(), x, 1.5);
  ASSERT_EQ(d.size(), 3U);
  EXPECT_NEAR(d[0], std::cos(a) - 0.95, 1e-14);
  EXPECT_NEAR(d[1], (Vec3(0.9, 0.5, 0.0) - x).norm(), 1e-14);
  EXPECT_NEAR(d[2], (Vec3(1.5, 0.0, 0.0) - x).norm(), 1e-14);
}

// Against a look at every segment: a minimum lies inside of one, or at a vertex nearest to x on both sides.
TEST(SegmentMinima, NoneIsPassedOver) {
  Dice dice(7);
  Curves curves;
  for (int c = 0; c < 12; ++c) {
    std::vector<Vec3> p{dice.point({0, 0, 0}, {1, 1, 1})};
    Vec3 way = dice.direction();
    for (int i = 0; i < 60; ++i) {
      way = (way + 0.3 * dice.direction()).normalized();
      p.push_back(p.back() + 0.03 * way);
    }
    curves.add_line(p, c % 2 == 0);
  }
  const SegmentMinima minima = curves.minima();
  const auto position = [&](std::size_t i, const Vec3& x) {
    const Vec3 &a = curves.points[static_cast<std::size_t>(curves.ends[i][0])],
               &b = curves.points[static_cast<std::size_t>(curves.ends[i][1])];
    return std::clamp((x - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  };
  int found = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 x = dice.point({-0.2, -0.2, -0.2}, {1.2, 1.2, 1.2});
    constexpr double kReach = 0.5;
    std::size_t wanted = 0;
    for (std::size_t i = 0; i < curves.ends.size(); ++i) {
      const double t = position(i, x);
      const Vec3 &a = curves.points[static_cast<std::size_t>(curves.ends[i][0])],
                 &b = curves.points[static_cast<std::size_t>(curves.ends[i][1])];
      if ((x - a - t * (b - a)).norm() > kReach) continue;
      bool least = true, told = false;  // told: by the segment before
      for (std::size_t j = 0; j < curves.ends.size(); ++j) {
        if (t == 1.0 && curves.ends[j][0] == curves.ends[i][1]) least = position(j, x) == 0.0;
        if (t == 0.0 && curves.ends[j][1] == curves.ends[i][0]) told = true;
      }
      wanted += least && !told ? 1 : 0;
    }
    std::set<Index> got;
    minima.visit(x, kReach, [&](const SegmentHit& hit) { got.insert(hit.segment); });
    EXPECT_EQ(got.size(), wanted) << trial;
    found += static_cast<int>(got.size());
  }
  EXPECT_GT(found, 10000);
}

TEST(SegmentMinima, NoSegments) {
  EXPECT_TRUE(distances(SegmentMinima(), Vec3::Zero(), 1.0).empty());
  EXPECT_TRUE(distances(Curves().minima(), Vec3::Zero(), 1.0).empty());
}

}  // namespace
}  // namespace lamina::detail
