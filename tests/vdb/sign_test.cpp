#include "vdb/detail/sign.h"

#include <gtest/gtest.h>

#include "tests/vdb/test_surfaces.h"
#include "vdb/detail/facet_wall.h"
#include "vdb/shapes.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

constexpr double kAngle = 40.0 * std::numbers::pi / 180.0;

TEST(Sign, ThinPlate) {
  const double t = 1e-3;
  const FacetWall wall(box({0, 0, 0}, {1, 1, t}), kAngle);
  EXPECT_EQ(wall.sign_rule().name(), "pseudonormal");
  Dice dice(1);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 x = dice.point({-0.01, -0.01, -2 * t}, {1.01, 1.01, 3 * t});
    const bool inside = x[0] > 0 && x[0] < 1 && x[1] > 0 && x[1] < 1 && x[2] > 0 && x[2] < t;
    EXPECT_EQ(wall.phi(x) < 0.0, inside) << x.transpose();
  }
}

TEST(Sign, OverlappingBoxesAreTheirUnion) {
  const FacetWall wall(joined(box(Vec3::Zero(), Vec3::Ones()), box({0.5, 0.25, 0.25}, {1.5, 0.75, 0.75})),
                       kAngle);
  EXPECT_EQ(wall.sign_rule().name(), "winding number");
  Dice dice(2);
  const auto within = [](const Vec3& x, const Vec3& lo, const Vec3& hi) {
    return (x.array() > lo.array()).all() && (x.array() < hi.array()).all();
  };
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = dice.point(Vec3::Constant(-0.2), Vec3(1.7, 1.2, 1.2));
    const bool inside =
        within(x, Vec3::Zero(), Vec3::Ones()) || within(x, {0.5, 0.25, 0.25}, {1.5, 0.75, 0.75});
    EXPECT_EQ(wall.phi(x) < 0.0, inside) << x.transpose();
  }
  // The end of the second box inside the first is no wall: its facets x = 0.5 are left out.
  EXPECT_EQ(wall.sign_rule().wall().size(), 22U);
  EXPECT_NEAR(wall.phi({0.5, 0.5, 0.5}), -0.5, 0.26);
  EXPECT_LT(wall.phi({0.5, 0.5, 0.5}), -0.2);
}

TEST(Sign, TouchingBoxesShareNoWall) {
  const FacetWall wall(joined(box(Vec3::Zero(), Vec3::Ones()), box({1, 0, 0}, {2, 1, 1})), kAngle);
  Dice dice(3);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 x = dice.point(Vec3::Constant(-0.2), Vec3(2.2, 1.2, 1.2));
    const bool inside = (x.array() > 0.0).all() && x[0] < 2.0 && x[1] < 1.0 && x[2] < 1.0;
    EXPECT_EQ(wall.phi(x) < 0.0, inside) << x.transpose();
  }
}

TEST(Sign, HoleDoesNotLoseTheInside) {
  const FacetWall wall(sphere(1.0, 16, Vec3::Zero(), [](const Vec3& c) { return c[2] < 0.97; }), kAngle);
  EXPECT_EQ(wall.sign_rule().name(), "winding number");
  Dice dice(4);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = 1.3 * dice.uniform(0.0, 1.0) * dice.direction();
    if (x[2] > 0.75 && x.head<2>().norm() < 0.5) continue;  // in the opening either answer will do
    const double r = x.norm();
    if (std::abs(r - 1.0) < 0.02) continue;  // between facet and sphere
    EXPECT_EQ(wall.phi(x) < 0.0, r < 1.0) << x.transpose();
  }
}

TEST(Sign, SheetsAreTwoSided) {
  const FacetWall wall(box({0, 0, -1}, {1, 1, 0}, 32), kAngle);  // the face z = 0 alone
  EXPECT_TRUE(wall.sign_rule().two_sided(0));
  ASSERT_EQ(wall.sign_rule().warnings().size(), 2U);
  EXPECT_NE(wall.sign_rule().warnings()[1].find("nowhere negative"), std::string::npos);
  for (const double z : {0.3, 1e-6, -1e-6, -0.3}) {
    const WallPoint w = wall.at({0.4, 0.4, z});
    EXPECT_DOUBLE_EQ(w.phi, std::abs(z));
    EXPECT_EQ(w.N, Vec3(0, 0, z > 0 ? 1 : -1));
  }
  const WallPoint rim = wall.at({1.3, 0.4, 0.4});
  EXPECT_EQ(rim.feature, WallFeature::kEdge);
  EXPECT_NEAR(rim.edge_angle, std::numbers::pi, 1e-12);
  EXPECT_LT((rim.N - Vec3(0.6, 0, 0.8)).norm(), 1e-12);
}

TEST(Sign, OpenShellsAreSheetsWhereAsked) {
  const Surface bowl = sphere(1.0, 16, Vec3::Zero(), [](const Vec3& c) { return c[2] < 0.97; });
  EXPECT_LT(FacetWall(bowl, kAngle).phi({0.0, 0.0, 0.2}), 0.0);
  const FacetWall sheet(bowl, kAngle, true);
  for (const double x : {0.2, 0.9, 1.1}) {
    const WallPoint w = sheet.at({x, 0.0, 0.0});
    EXPECT_NEAR(w.phi, std::abs(x - 1.0), 0.01);
    EXPECT_GT(w.N[0] * (x - 1.0), 0.0);  // away from the wall on either side
  }
  const FacetWall closed(sphere(1.0, 8), kAngle, true);
  EXPECT_LT(closed.phi({0.0, 0.0, 0.2}), 0.0);
  ASSERT_EQ(closed.sign_rule().warnings().size(), 1U);
  EXPECT_NE(closed.sign_rule().warnings()[0].find("--sheet"), std::string::npos);
}

TEST(Sign, FinOnABodyKeepsTheBodySolid) {
  const Surface body = box(Vec3::Zero(), Vec3::Ones());
  Surface fin;
  fin.points = {{0.5, 0.2, 0.9}, {0.5, 0.8, 0.9}, {0.5, 0.8, 2.0}, {0.5, 0.2, 2.0}};
  fin.triangles = {{0, 1, 2}, {0, 2, 3}};
  const FacetWall wall(joined(body, fin), kAngle);
  EXPECT_LT(wall.phi({0.5, 0.5, 0.5}), 0.0);
  EXPECT_LT(wall.phi({0.49, 0.5, 0.95}), 0.0);
  EXPECT_GT(wall.phi({0.49, 0.5, 1.5}), 0.0);
  EXPECT_GT(wall.phi({0.51, 0.5, 1.5}), 0.0);
  EXPECT_NEAR(wall.phi({0.51, 0.5, 1.5}), 0.01, 1e-15);
}

TEST(Sign, CrossingFacets) {
  EXPECT_EQ(crossing_facets(box(Vec3::Zero(), Vec3::Ones())), std::vector<std::uint8_t>(12, 0));
  Surface two;
  two.points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.3, 0.3, -1}, {0.3, 0.3, 1}, {0.4, 0.5, 2}};
  two.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(crossing_facets(two), std::vector<std::uint8_t>(2, 1));
}

// Rounding takes facets of a finely meshed plane face that only touch for crossing ones.
TEST(Sign, FacetsThatTouchDoNotCross) {
  Surface ahmed = make_shape("ahmed", {.facet = 0.006});
  clean(ahmed, "ahmed");
  const std::vector<std::uint8_t> crossing = crossing_facets(ahmed);
  EXPECT_EQ(std::count(crossing.begin(), crossing.end(), 1), 0);
}

}  // namespace
}  // namespace lamina::detail
