#include "core/predicates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lamina {
namespace {

TEST(Predicates, HandValues) {
  EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1.0);
  EXPECT_EQ(orient2d({0, 0}, {0, 1}, {1, 0}), -1.0);
  EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1.0);
  EXPECT_EQ(orient3d({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 2}), -2.0);
}

// Points on a line through the origin whose coordinates are exact multiples are exactly collinear; one ulp
// off is not.
TEST(Predicates, SignIsExactNextToALine) {
  const double ulp = std::ldexp(1.0, -52);
  for (int i = 1; i < 60; ++i) {
    const double s = i / 64.0;
    const Vec2 a(0.5, 0.5);
    const Vec2 b(12.0, 12.0);
    const Vec2 c(0.5 + s, 0.5 + s);
    EXPECT_EQ(orient2d(a, b, c), 0.0);
    EXPECT_GT(orient2d(a, b, Vec2(c[0], c[1] * (1.0 + ulp))), 0.0) << i;
    EXPECT_LT(orient2d(a, b, Vec2(c[0] * (1.0 + ulp), c[1])), 0.0) << i;
  }
}

TEST(Predicates, SignIsExactNextToAPlane) {
  const Vec3 a(0.5, 0.5, 0.5);
  const Vec3 b(12.0, 12.0, 0.25);
  const Vec3 c(24.0, 0.125, 24.0);
  // (2 b + c - 2 a) has only short binary fractions: it lies in the plane of a, b and c exactly.
  const Vec3 d = 2.0 * b + c - 2.0 * a;
  EXPECT_EQ(orient3d(a, b, c, d), 0.0);
  const Vec3 n = (b - a).cross(c - a);
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 up = d;
    up[axis] = std::nextafter(d[axis], 1e9);
    EXPECT_EQ(orient3d(a, b, c, up) > 0.0, n[axis] > 0.0) << axis;
    Vec3 down = d;
    down[axis] = std::nextafter(d[axis], -1e9);
    EXPECT_EQ(orient3d(a, b, c, down) > 0.0, n[axis] < 0.0) << axis;
  }
}

// Swapping two points flips the sign, also for points so flat that rounding decides a naive determinant.
TEST(Predicates, SymmetryOnNearlyFlatTetrahedra) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  int degenerate_for_doubles = 0;
  for (int k = 0; k < 2000; ++k) {
    std::array<Vec3, 4> x;
    for (Vec3& p : x) {
      p = Vec3(u(rng), u(rng), 0.0);
      p[2] = 0.3 * p[0] - 0.7 * p[1] + 1e-17 * u(rng);
    }
    const double s = orient3d(x[0], x[1], x[2], x[3]);
    EXPECT_EQ(s > 0.0, orient3d(x[1], x[0], x[2], x[3]) < 0.0);
    EXPECT_EQ(s > 0.0, orient3d(x[2], x[3], x[0], x[1]) > 0.0);
    EXPECT_EQ(s > 0.0, orient3d(x[1], x[2], x[0], x[3]) > 0.0);
    degenerate_for_doubles += std::abs(s) < 1e-16;
  }
  EXPECT_GT(degenerate_for_doubles, 100) << "the points are meant to need the exact stage";
}

TEST(Predicates, OrientDispatchesOnDimension) {
  EXPECT_GT(orient<2>({Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}), 0.0);
  EXPECT_GT(orient<3>({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}), 0.0);
}

}  // namespace
}  // namespace lamina
