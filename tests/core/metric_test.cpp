#include "core/metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lamina {
namespace {

Mat3 rotation(double a, double b) {
  return (Eigen::AngleAxisd(a, Vec3(1, 2, 3).normalized()) * Eigen::AngleAxisd(b, Vec3::UnitY()))
      .toRotationMatrix();
}

TEST(Metric, IsotropicByHand) {
  const auto m = Metric<3>::isotropic(0.5);
  EXPECT_DOUBLE_EQ(m.length(Vec3(3, 0, 4)), 10.0);
  EXPECT_DOUBLE_EQ(m.sqrt_det(), 8.0);
  EXPECT_EQ(m.tensor(), (Sym<3>{4, 0, 4, 0, 0, 4}));
}

TEST(Metric, TensorEntriesFollowXxXyYyXzYzZz) {
  const Sym<3> t = {4, 1, 5, 0.5, -1, 6};
  const auto m = Metric<3>::from_tensor(t);
  ASSERT_TRUE(m);
  const Sym<3> back = m->tensor();
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(back[i], t[i], 1e-14);
  EXPECT_NEAR(std::pow(m->length(Vec3::UnitY()), 2), 5.0, 1e-14);
  EXPECT_NEAR(std::pow(m->length(Vec3(1, 0, 1)), 2), 4 + 6 + 2 * 0.5, 1e-13);
}

TEST(Metric, RefusesTensorsThatAreNotPositive) {
  EXPECT_FALSE(Metric<3>::from_tensor({1, 2, 1, 0, 0, 1}));
  EXPECT_FALSE(Metric<2>::from_tensor({1, 0, 0}));
  EXPECT_FALSE(Metric<2>::from_tensor({std::nan(""), 0, 1}));
}

// Sizes along the axes come back to full relative accuracy at aspect ratios where an eigen-decomposition
// fails.
TEST(Metric, FrameSizesAtHighAspectRatio) {
  for (const double hn : {1e-2, 1e-4, 1e-6}) {
    const Mat3 R = rotation(0.7, 1.1);
    const Vec3 h(hn, 0.3, 0.1);
    const auto m = Metric<3>::from_frame(R, h);
    for (int i = 0; i < 3; ++i) {
      const Vec3 d = R.row(i).transpose();
      EXPECT_NEAR(m.size_along(d) / h[i], 1.0, 1e-15 / hn * 10) << hn;
    }
    EXPECT_NEAR(m.sqrt_det() * h.prod(), 1.0, 1e-12);
    const auto p = m.principal();
    EXPECT_NEAR(p.sizes[0] / hn, 1.0, 1e-12);
    EXPECT_NEAR(p.sizes[1] / 0.1, 1.0, 1e-9);
    EXPECT_NEAR(p.sizes[2] / 0.3, 1.0, 1e-9);
    EXPECT_NEAR(std::abs(p.axes.row(0).dot(R.row(0))), 1.0, 1e-12);
  }
}

TEST(Metric, LogarithmByHandAndBack) {
  const auto m = Metric<2>::from_frame(Mat<2>::Identity(), Vec2(1.0, std::exp(-3.0)));
  const Sym<2> l = m.log();
  EXPECT_NEAR(l[0], 0.0, 1e-14);
  EXPECT_NEAR(l[1], 0.0, 1e-14);
  EXPECT_NEAR(l[2], 6.0, 1e-14);
  const Vec3 h(1e-6, 0.3, 0.1);
  const auto back = Metric<3>::from_log(Metric<3>::from_frame(rotation(0.7, 1.1), h).log()).principal();
  EXPECT_NEAR(back.sizes[0] / 1e-6, 1.0, 1e-9);
  EXPECT_NEAR(back.sizes[1] / 0.1, 1.0, 1e-9);
  EXPECT_NEAR(back.sizes[2] / 0.3, 1.0, 1e-9);
}

TEST(Metric, IntersectionByHand) {
  const auto a = Metric<2>::from_frame(Mat<2>::Identity(), Vec2(1.0, 0.1));
  const auto b = Metric<2>::from_frame(Mat<2>::Identity(), Vec2(0.2, 0.5));
  const auto m = intersect(a, b);
  EXPECT_NEAR(m.size_along(Vec2::UnitX()), 0.2, 1e-14);
  EXPECT_NEAR(m.size_along(Vec2::UnitY()), 0.1, 1e-14);
}

TEST(Metric, IntersectionIsBelowBothAndSymmetric) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int k = 0; k < 300; ++k) {
    const auto size = [&] { return std::pow(10.0, -4.0 * u(rng)); };
    const auto a = Metric<3>::from_frame(rotation(6 * u(rng), 6 * u(rng)), Vec3(size(), size(), size()));
    const auto b = Metric<3>::from_frame(rotation(6 * u(rng), 6 * u(rng)), Vec3(size(), size(), size()));
    const auto m = intersect(a, b);
    const auto n = intersect(b, a);
    for (int i = 0; i < 20; ++i) {
      const Vec3 d = Vec3(u(rng) - 0.5, u(rng) - 0.5, u(rng) - 0.5).normalized();
      const double h = m.size_along(d);
      EXPECT_LE(h, std::min(a.size_along(d), b.size_along(d)) * (1 + 1e-7));
      EXPECT_NEAR(n.size_along(d) / h, 1.0, 1e-7);
    }
  }
}

TEST(Metric, IntersectionWithAWeakerMetricIsTheStronger) {
  const auto a = Metric<3>::from_frame(rotation(1, 2), Vec3(1e-4, 0.1, 0.1));
  EXPECT_EQ(intersect(a, Metric<3>::isotropic(1.0)).tensor(), a.tensor());
  EXPECT_EQ(intersect(Metric<3>::isotropic(1.0), a).tensor(), a.tensor());
}

TEST(Metric, LogEuclideanIsGeometricOnSharedAxes) {
  const Mat3 R = rotation(0.4, 0.9);
  const auto a = Metric<3>::from_frame(R, Vec3(1e-4, 0.1, 1.0));
  const auto b = Metric<3>::from_frame(R, Vec3(1e-2, 0.4, 1.0));
  const auto m = interpolate_log_euclidean(a, b, 0.5);
  EXPECT_NEAR(m.size_along(R.row(0).transpose()) / 1e-3, 1.0, 1e-9);
  EXPECT_NEAR(m.size_along(R.row(1).transpose()) / 0.2, 1.0, 1e-9);
  EXPECT_NEAR(interpolate_log_euclidean(a, b, 0.0).sqrt_det() / a.sqrt_det(), 1.0, 1e-9);
}

TEST(EdgeLength, IsTheLogarithmicMean) {
  EXPECT_DOUBLE_EQ(edge_length(2.0, 2.0), 2.0);
  EXPECT_NEAR(edge_length(1.0, std::exp(1.0)), std::exp(1.0) - 1.0, 1e-14);
  EXPECT_NEAR(edge_length(1.0, 1.0 + 1e-3 * 1.001), edge_length(1.0, 1.0 + 1e-3 * 0.999), 2e-6);
  EXPECT_EQ(edge_length(0.3, 0.7), edge_length(0.7, 0.3));
}

TEST(MeanRatio, OneForRegularSimplices) {
  const double s = std::sqrt(0.75);
  EXPECT_NEAR(mean_ratio<2>({Vec2(0, 0), Vec2(1, 0), Vec2(0.5, s)}, Metric<2>()), 1.0, 1e-15);
  const std::array<Vec3, 4> tet = {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)};
  const double q = mean_ratio<3>(tet, Metric<3>::isotropic(17.0));
  EXPECT_NEAR(std::abs(q), 1.0, 1e-14);
  EXPECT_NEAR(mean_ratio<3>({tet[1], tet[0], tet[2], tet[3]}, Metric<3>()), -q, 1e-14);
}

TEST(ShapeEnergy, IsMeanRatioToTheMinusHalfDimension) {
  const auto m = Metric<3>::from_frame(rotation(0.3, 1.1), Vec3(1e-3, 0.1, 0.4));
  const std::array<Vec3, 4> x = {Vec3(0, 0, 0), Vec3(0.1, 0.02, 0), Vec3(0.01, 0.3, 0.1),
                                 Vec3(0.05, 0.1, 0.2)};
  EXPECT_NEAR(shape_energy<3>({&x[0], &x[1], &x[2], &x[3]}, m) * std::pow(mean_ratio<3>(x, m), 1.5), 1.0,
              1e-12);
  EXPECT_EQ(shape_energy<3>({&x[1], &x[0], &x[2], &x[3]}, m), std::numeric_limits<double>::infinity());
  const std::array<Vec2, 3> y = {Vec2(0, 0), Vec2(1, 0.1), Vec2(0.2, 0.4)};
  const auto n = Metric<2>::isotropic(0.3);
  EXPECT_NEAR(shape_energy<2>({&y[0], &y[1], &y[2]}, n) * mean_ratio<2>(y, n), 1.0, 1e-13);
  EXPECT_EQ(shape_energy<2>({&y[0], &y[1], &y[1]}, n), std::numeric_limits<double>::infinity());
}

// The unit corner tetrahedron: V = 1/6, sum of squared edges 3 + 6 = 9: q = 12 (1/2)^(2/3) / 9.
TEST(MeanRatio, CornerTetrahedronByHand) {
  const std::array<Vec3, 4> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  EXPECT_NEAR(mean_ratio<3>(x, Metric<3>()), 12.0 * std::pow(0.5, 2.0 / 3.0) / 9.0, 1e-14);
}

TEST(MeanRatio, InvariantUnderTheMapOfItsMetric) {
  const Mat3 R = rotation(2.0, 0.3);
  const auto m = Metric<3>::from_frame(R, Vec3(1e-4, 0.2, 0.05));
  const Mat3 inverse = m.factor().inverse();
  std::array<Vec3, 4> x = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.3, 1, 0), Vec3(0.2, 0.1, 0.9)};
  const double q = mean_ratio<3>(x, Metric<3>());
  for (Vec3& p : x) p = inverse * p;
  EXPECT_NEAR(mean_ratio<3>(x, m), q, 1e-11);
}

TEST(CellQuality, UsesTheVertexOfLargestDeterminant) {
  const std::array<Vec2, 3> x = {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)};
  const auto fine = Metric<2>::from_frame(Mat<2>::Identity(), Vec2(0.1, 1.0));
  const auto coarse = Metric<2>::isotropic(1.0);
  EXPECT_EQ(cell_quality<2>(x, {&coarse, &fine, &coarse}), mean_ratio<2>(x, fine));
}

TEST(CubeRoot, MatchesTheLibrary) {
  for (double x = 1e-280; x < 1e280; x *= 7.31) EXPECT_NEAR(cube_root(x) / std::cbrt(x), 1.0, 1e-15);
  EXPECT_EQ(cube_root(0.0), 0.0);
  EXPECT_EQ(cube_root(-27.0), -cube_root(27.0));
}

}  // namespace
}  // namespace lamina
