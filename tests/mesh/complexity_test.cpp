#include "mesh/complexity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

// Constant size h: 1 / h^D, whatever the cells are.
TEST(Complexity, OfOneSizeIsExact) {
  EXPECT_NEAR(
      (estimate_complexity<2>(lattice<2>(3, 0.1), [](const Vec2&) { return Metric<2>::isotropic(0.1); })),
      100.0, 1e-9);
  EXPECT_NEAR(
      (estimate_complexity<3>(lattice<3>(3, 0.1), [](const Vec3&) { return Metric<3>::isotropic(0.1); })),
      1000.0, 1e-9);
}

// h_z = h + g |z - 1/2|, 1 elsewhere: the integral is (2 / g) ln(1 + g / (2 h)).
TEST(Complexity, OfAThinLayer) {
  const double h = 1e-3, g = 0.2;
  const auto metric = [&](const Vec3& x) {
    return Metric<3>::from_frame(Mat3::Identity(), {1.0, 1.0, h + g * std::abs(x[2] - 0.5)});
  };
  const double exact = 2.0 / g * std::log(1.0 + g / (2.0 * h));
  EXPECT_NEAR(estimate_complexity<3>(lattice<3>(3), metric) / exact, 1.0, 0.02);
}

}  // namespace
}  // namespace lamina
