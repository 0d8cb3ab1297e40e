#include "vdb/detail/bends.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/vdb/test_surfaces.h"
#include "vdb/level_set.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

using namespace testing_surfaces;

// A half cylinder of radius 0.5 and axis y on top of a slab: z = 0.5 + ... ends in flat sides x = -0.5, x =
// 0.5.
Surface arch(int segments) {
  std::vector<std::array<double, 2>> outline = {{-0.5, -1.0}, {0.5, -1.0}};
  for (int i = 0; i <= segments; ++i) {
    const double a = std::numbers::pi * i / segments;
    outline.push_back({0.5 * std::cos(a), 0.5 * std::sin(a)});
  }
  Surface s;
  const auto n = static_cast<Index>(outline.size());
  constexpr Index kRows = 8;  // along y
  for (Index row = 0; row <= kRows; ++row)
    for (const auto& [x, z] : outline) s.points.emplace_back(x, -1.0 + 2.0 * row / kRows, z);
  for (Index row = 0; row < kRows; ++row) {
    for (Index i = 0; i < n; ++i) {
      const Index a = row * n + i, b = row * n + (i + 1) % n, c = a + n, d = b + n;
      s.triangles.push_back({a, c, b});
      s.triangles.push_back({b, c, d});
    }
  }
  for (Index i = 1; i + 1 < n; ++i) {
    s.triangles.push_back({0, i, i + 1});
    s.triangles.push_back({kRows * n, kRows * n + i + 1, kRows * n + i});
  }
  s.tags.assign(s.triangles.size(), 0);
  s.tag_names = {"wall"};
  clean(s, "arch");
  return s;
}

TEST(Bends, StandWhereAFlatSideEndsInAnArch) {
  const LevelSet wall = LevelSet::from_surface(arch(48), {});
  for (const double depth : {0.05, 0.2, 0.4}) {
    const WallPoint side = wall.at({0.6, 0.1, -depth});  // on the flat side, below the arch
    EXPECT_EQ(side.k1, 0.0);
    EXPECT_NEAR(side.bend_distance, depth, 1e-3) << depth;
    EXPECT_NEAR(std::abs(side.bend_direction[2]), 1.0, 1e-3);
    EXPECT_NEAR(side.bend_k1, 2.0, 0.1);
    EXPECT_NEAR(side.bend_k2, 0.0, 0.02);
  }
  const WallPoint top = wall.at({0.0, 0.0, 0.7});
  EXPECT_NEAR(top.k1, 2.0, 0.02);
  EXPECT_GT(top.bend_distance, 0.4);  // the arch itself is as bent everywhere
}

TEST(Bends, SmoothAndFlatBodiesHaveNone) {
  for (const Surface& s : {sphere(0.5, 12), torus(1.0, 0.3, 80, 30), box({-1, -1, -1}, {1, 1, 1})}) {
    const WallPoint w = LevelSet::from_surface(s, {}).at({0.3, 0.4, 1.2});
    EXPECT_TRUE(std::isinf(w.bend_distance));
  }
}

}  // namespace
}  // namespace lamina
