#include "vdb/detail/outline_wall.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/error.h"
#include "tests/vdb/message_of.h"
#include "vdb/profiles.h"

namespace lamina::detail {
namespace {

constexpr double kFeature = 40.0 / 180.0 * std::numbers::pi;

OutlineWall wall_of(Outline outline) {
  clean(outline, "test");
  std::vector<Path> paths = make_paths(outline, kFeature);
  require_apart(paths, "test");
  return OutlineWall(std::move(paths));
}

Outline ellipse(double a, double b, int n, bool smooth) {
  OutlineCurve curve{.points = {}, .closed = true, .smooth = smooth};
  for (int i = 0; i < n; ++i) {
    const double t = 2.0 * std::numbers::pi * (i + 0.3) / n;
    curve.points.emplace_back(a * std::cos(t), b * std::sin(t));
  }
  return {{curve}};
}

std::vector<Vec3> random_points(int n, double radius) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(-radius, radius);
  std::vector<Vec3> x;
  for (int i = 0; i < n; ++i) x.emplace_back(at(random), at(random), at(random));
  return x;
}

TEST(OutlineWall, SplineOfACircleIsOneToFourthOrder) {
  double before = 0.0;
  for (const int n : {32, 64}) {
    const OutlineWall wall = wall_of(ellipse(1.0, 1.0, n, true));
    double distance = 0.0, curvature = 0.0, normal = 0.0;
    for (const Vec3& x : random_points(2000, 2.0)) {
      const double r = x.head<2>().norm();
      if (r < 0.1) continue;
      const WallPoint w = wall.at(x);
      distance = std::max(distance, std::abs(w.phi - (r - 1.0)));
      curvature = std::max(curvature, std::abs(w.k1 - 1.0));
      normal = std::max(normal, (w.N.head<2>() - x.head<2>() / r).norm());
      EXPECT_EQ(w.feature, WallFeature::kFace);
      EXPECT_EQ(w.phi, wall.phi(x));
      EXPECT_EQ(w.closest[2], x[2]);
    }
    const double step = 2.0 * std::numbers::pi / n;
    EXPECT_LT(distance, std::pow(step, 4) / 300.0);
    EXPECT_LT(curvature, step * step / 5.0);
    EXPECT_LT(normal, std::pow(step, 3) / 10.0);
    if (before > 0.0) {
      EXPECT_GT(before / distance, 12.0);
    }
    before = distance;
  }
}

TEST(OutlineWall, CurvatureOfAnEllipse) {
  const double a = 2.0, b = 1.0;
  const OutlineWall wall = wall_of(ellipse(a, b, 200, true));
  for (const double t : {0.0, 0.4, 1.0, 1.57, 2.5, 4.0}) {
    const Vec3 foot(a * std::cos(t), b * std::sin(t), 0.0);
    const Vec3 out = Vec3(b * std::cos(t), a * std::sin(t), 0.0).normalized();
    const double exact = a * b / std::pow(std::pow(a * std::sin(t), 2) + std::pow(b * std::cos(t), 2), 1.5);
    const WallPoint w = wall.at(foot + 0.1 * out);
    EXPECT_NEAR(w.phi, 0.1, 1e-6);
    EXPECT_NEAR(w.k1, exact, 2e-3 * exact);
    EXPECT_LT((w.N - out).norm(), 1e-4);
    EXPECT_NEAR(w.N.cross(w.T1).dot(w.T2), 1.0, 1e-12);
  }
}

TEST(OutlineWall, DistanceIsThatOfBruteForce) {
  for (const auto& [name, help] : profile_list()) {
    Outline outline = make_profile(name);
    clean(outline, name);
    const std::vector<Path> paths = make_paths(outline, kFeature);
    const OutlineWall wall(paths);
    const Box<3> box = wall.bounds().padded(0.3);
    std::mt19937 random(3);
    for (int i = 0; i < 200; ++i) {
      std::uniform_real_distribution<double> at(0.0, 1.0);
      const Vec3 x = box.lo + Vec3(at(random), at(random), 0.0).cwiseProduct(box.size());
      double least = 1e300, step = 0.0;
      for (const Path& path : paths)
        for (const Arc& arc : path.arcs)
          for (int k = 0; k <= 200; ++k) {
            least = std::min(least, (arc.at(k / 200.0) - x.head<2>()).norm());
            step = std::max(step, arc.slope(k / 200.0).norm() / 200.0);
          }
      EXPECT_LE(std::abs(wall.phi(x)), least + 1e-14) << name;
      EXPECT_GE(std::abs(wall.phi(x)), least - 0.51 * step) << name;
    }
  }
}

// y(x) of the formula, its normal and curvature by derivatives of it, checked where the spline has points and
// between them.
TEST(OutlineWall, Naca0012FollowsItsFormula) {
  const OutlineWall wall = wall_of(make_profile("naca0012"));
  for (const double x : {0.003, 0.02, 0.1, 0.3, 0.55, 0.9}) {
    const double s = std::sqrt(x);
    const double y = 0.6 * (0.2969 * s + x * (-0.126 + x * (-0.3516 + x * (0.2843 - x * 0.1036))));
    const double d1 = 0.6 * (0.14845 / s - 0.126 + x * (-0.7032 + x * (0.8529 - x * 0.4144)));
    const double d2 = 0.6 * (-0.074225 / (s * x) - 0.7032 + x * (1.7058 - x * 1.2432));
    const WallPoint w = wall.at({x, y, 0.0});
    EXPECT_NEAR(w.phi, 0.0, 3e-8) << x;
    EXPECT_NEAR(w.k1, -d2 / std::pow(1.0 + d1 * d1, 1.5), 5e-3 * std::abs(d2)) << x;
    EXPECT_LT((w.N - Vec3(-d1, 1.0, 0.0).normalized()).norm(), 2e-4) << x;
  }
  const WallPoint tip = wall.at({1.01, 1e-4, 0.0});
  EXPECT_EQ(tip.feature, WallFeature::kEdge);
  EXPECT_TRUE(std::isinf(tip.k1));
  EXPECT_NEAR(tip.phi, std::hypot(0.01, 1e-4), 1e-15);
  EXPECT_NEAR(wall.at({0.0, 0.0, 0.0}).k1, 1.0 / (1.1019 * 0.0144), 0.05 / 0.0159);
}

TEST(OutlineWall, CornersOfASquare) {
  const OutlineWall wall = wall_of(make_profile("square"));
  EXPECT_EQ(wall.corners(), 4);
  const WallPoint face = wall.at({2.0, 1.7, 0.5});
  EXPECT_EQ(face.feature, WallFeature::kFace);
  EXPECT_NEAR(face.phi, 0.025, 1e-15);
  EXPECT_EQ(face.k1, 0.0);
  EXPECT_NEAR(face.edge_distance, 0.3, 1e-15);
  EXPECT_NEAR(face.edge_angle, 0.5 * std::numbers::pi, 1e-12);
  const WallPoint corner = wall.at({2.4, 1.775, 0.0});
  EXPECT_EQ(corner.feature, WallFeature::kEdge);
  EXPECT_EQ(corner.edge_distance, 0.0);
  EXPECT_LT((corner.N - Vec3(1.0, 1.0, 0.0).normalized()).norm(), 1e-12);
  EXPECT_NEAR(wall.phi({2.29, 1.66, 0.0}), -0.01, 1e-14);
}

TEST(OutlineWall, SheetsHaveTwoSidesAndTips) {
  const OutlineWall wall = wall_of(make_profile("plate"));
  for (const double side : {-1.0, 1.0}) {
    const WallPoint w = wall.at({2.0, 1.375 + 0.1 * side, 0.0});
    EXPECT_NEAR(w.phi, 0.1, 1e-15);
    EXPECT_NEAR(w.N[1], side, 1e-15);
  }
  const WallPoint tip = wall.at({0.3, 1.375, 0.0});
  EXPECT_EQ(tip.feature, WallFeature::kEdge);
  EXPECT_NEAR(tip.phi, 0.2, 1e-15);
  EXPECT_EQ(tip.edge_angle, std::numbers::pi);
}

TEST(OutlineWall, OthersAreTheOppositeWalls) {
  Outline two;  // a gap of 0.2 between unit squares
  for (const double x : {0.0, 1.2})
    two.curves.push_back({.points = {{x, 0}, {x + 1, 0}, {x + 1, 1}, {x, 1}}});
  const OutlineWall wall = wall_of(two);
  const Vec3 x(1.08, 0.5, 0.0);
  const WallPoint nearest = wall.at(x);
  std::array<WallPoint, 4> found;
  ASSERT_EQ(wall.others(x, nearest, 0.3, found), 1);
  EXPECT_NEAR(nearest.phi, 0.08, 1e-14);
  EXPECT_NEAR(found[0].phi, 0.12, 1e-14);
  EXPECT_NEAR(found[0].N[0], -1.0, 1e-14);
  EXPECT_EQ(wall.others(x, nearest, 0.1, found), 0);
  const Vec3 in(0.5, 0.4, 0.0);  // from inside all four sides are seen
  EXPECT_EQ(wall.others(in, wall.at(in), 2.0, found), 3);
}

TEST(OutlineWall, ChordsOfARoundWallHaveItsCurvature) {
  const OutlineWall wall = wall_of(ellipse(1.0, 1.0, 100, false));
  EXPECT_EQ(wall.corners(), 0);
  for (const double t : {0.1, 0.2, 1.0, 3.0}) {
    const Vec3 out(std::cos(t), std::sin(t), 0.0);
    const WallPoint w = wall.at(1.02 * out);  // farther away the rays of chords leave those of the circle
    EXPECT_NEAR(w.k1, 1.0, 1e-3);
    EXPECT_LT((w.N - out).norm(), 1e-3);
    EXPECT_NEAR(w.phi, 0.02, 5e-4);
  }
}

TEST(OutlineWall, CurvesMustNotTouch) {
  Outline crossing{{{.points = {{0, 0}, {1, 1}, {1, 0}, {0, 2}}}}};
  EXPECT_NE(
      message_of(ErrorCode::kSurfaceInvalid, [&] { require_apart(make_paths(crossing, kFeature), "f"); })
          .find("crosses itself"),
      std::string::npos);
  Outline touching{
      {{.points = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}}, {.points = {{1, 0}, {2, 0}, {2, 1}, {1, 1}}}}};
  EXPECT_NE(
      message_of(ErrorCode::kSurfaceInvalid, [&] { require_apart(make_paths(touching, kFeature), "f"); })
          .find("meets curve"),
      std::string::npos);
}

}  // namespace
}  // namespace lamina::detail
