#include "vdb/detail/winding.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using namespace testing_surfaces;

Winding winding_of(const Surface& s) {
  std::vector<Index> ids(s.triangles.size());
  std::iota(ids.begin(), ids.end(), 0);
  return {s.points, s.triangles, ids};
}

TEST(Winding, ClosedShellsAreExact) {
  const Surface cube = box(Vec3::Zero(), Vec3::Ones());
  const Winding w = winding_of(cube);
  EXPECT_EQ(w.at({0.5, 0.5, 0.5}), 1.0);
  EXPECT_EQ(w.at({0.5, 0.5, 1.5}), 0.0);
  EXPECT_EQ(w.at({-0.5, 0.5, 0.5}), 0.0);  // a ray through edges of the two x faces' diagonals
  EXPECT_EQ(w.at({-0.5, 0.25, 0.25}), 0.0);
  EXPECT_EQ(w.at({0.5, 0.25, 0.25}), 1.0);
  EXPECT_EQ(w.at({-1.0, 0.0, 0.0}), 0.0);  // along an edge
  EXPECT_EQ(w.at({-1.0, 1.0, 1.0}), 0.0);  // along another
}

TEST(Winding, RaysThroughVerticesOfASphere) {
  const Surface s = sphere(1.0, 8);
  const Winding w = winding_of(s);
  for (const Vec3& p : s.points) {
    EXPECT_EQ(w.at({0.0, 0.97 * p[1], 0.97 * p[2]}), 1.0);
    EXPECT_EQ(w.at({-2.0, p[1], p[2]}), 0.0);
    EXPECT_EQ(w.at(0.9 * p), 1.0);
    EXPECT_EQ(w.at(1.01 * p), 0.0);
  }
}

TEST(Winding, HandValuesOfOpenSets) {
  // From the centre each face of a cube is seen under 4 pi / 6.
  EXPECT_NEAR(winding_of(box(Vec3::Zero(), Vec3::Ones(), 63 - 32)).at({0.5, 0.5, 0.5}), 5.0 / 6.0, 1e-14);
  EXPECT_NEAR(winding_of(box(Vec3::Zero(), Vec3::Ones(), 32)).at({0.5, 0.5, 0.5}), 1.0 / 6.0, 1e-14);
  const Winding plate = winding_of(box(Vec3::Zero(), Vec3::Ones(), 32));  // z = 1, facing up
  EXPECT_NEAR(plate.at({0.5, 0.5, 1.0 - 1e-9}), 0.5, 1e-8);
  EXPECT_NEAR(plate.at({0.5, 0.5, 1.0 + 1e-9}), -0.5, 1e-8);
}

// The part of a sphere around x that t covers, negative when seen from behind [vanOosterom1983].
double share_of_sphere(const Corners& t, const Vec3& x) {
  const Vec3 a = t[0] - x, b = t[1] - x, c = t[2] - x;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) /
         (2.0 * std::numbers::pi);
}

TEST(Winding, RoughExpansionsKeepTheirBound) {
  Dice dice(3);
  const Vec3 lo = Vec3::Zero(), hi = Vec3::Ones();
  for (const double size : {0.02, 0.1}) {
    std::vector<Corners> soup;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 a = dice.point(lo, hi), d = Vec3::Constant(size);
      soup.push_back({a, dice.point(a - d, a + d), dice.point(a - d, a + d)});
    }
    const DipoleTree tree(soup);
    int differing = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3 x = dice.point(lo, hi);
      double sum = 0.0;
      for (const Corners& t : soup) sum += share_of_sphere(t, x);
      EXPECT_NEAR(tree.at(x), sum, 0.02);
      EXPECT_NEAR(tree.roughly_at(x), sum, DipoleTree::kRoughError);
      differing += std::abs(tree.roughly_at(x) - sum) > 1e-6;
    }
    EXPECT_GT(differing, 250);  // it is an expansion
  }
}

TEST(Winding, OverlapsNestingAndInversionAddUp) {
  const Surface a = box(Vec3::Zero(), Vec3::Ones()), b = box(Vec3::Constant(0.5), Vec3::Constant(1.5));
  const Winding w = winding_of(joined(a, b));
  EXPECT_EQ(w.at(Vec3::Constant(0.25)), 1.0);
  EXPECT_EQ(w.at(Vec3::Constant(0.75)), 2.0);
  EXPECT_EQ(w.at(Vec3::Constant(1.25)), 1.0);
  Surface inverted = a;
  for (auto& t : inverted.triangles) std::swap(t[1], t[2]);
  EXPECT_EQ(winding_of(inverted).at(Vec3::Constant(0.5)), -1.0);
}

TEST(Winding, AgreesWithPlainSolidAngles) {
  // A sphere with a hole, a long thin tube without caps, and a fan of three facets on one edge.
  Surface fan = box(Vec3::Zero(), Vec3::Ones(), 1 + 4);
  fan.triangles.push_back({0, 4, 7});
  finish(fan);
  Surface tube = cylinder(0.05, -1.0, 1.0, 60);
  std::erase_if(tube.triangles, [](const auto& t) { return t[2] >= 120; });
  finish(tube);
  Dice dice(5);
  for (const Surface& s :
       {sphere(1.0, 12, Vec3::Zero(), [](const Vec3& c) { return c[2] < 0.8; }), tube, fan}) {
    const Winding w = winding_of(s);
    const Box<3> box = s.bounds().padded(0.2);
    for (int i = 0; i < 300; ++i) {
      const Vec3 x = dice.point(box.lo, box.hi);
      double sum = 0.0;
      for (const auto& t : s.triangles)
        sum += share_of_sphere(
            {s.points[static_cast<std::size_t>(t[0])], s.points[static_cast<std::size_t>(t[1])],
             s.points[static_cast<std::size_t>(t[2])]},
            x);
      EXPECT_NEAR(w.at(x), sum, 0.02);
      if (std::abs(std::abs(sum) - 0.5) > 0.02) {
        EXPECT_EQ(w.encloses(x), std::abs(sum) > 0.5);
      }
    }
  }
}

TEST(Winding, EmptySet) {
  const Surface s = box(Vec3::Zero(), Vec3::Ones());
  EXPECT_EQ(Winding(s.points, s.triangles, {}).at(Vec3::Zero()), 0.0);
  EXPECT_EQ(Winding().at(Vec3::Zero()), 0.0);
}

}  // namespace
}  // namespace lamina::detail
