// Walls whose distance to a lattice's interpolation of them is known.
#include "mesh/wall_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
std::vector<double> distances(const Mesh<D>& mesh, const FunctionRef<WallProbe<D>(const Vec<D>&)>& probe) {
  std::vector<double> phi;
  for (const Vec<D>& x : mesh.points) phi.push_back(probe(x).phi);
  return phi;
}

template <int D>
WallProbe<D> ball(const Vec<D>& x, double radius) {
  const Vec<D> y = x - Vec<D>::Constant(0.5);
  const Vec<D> n = y.norm() > 0.0 ? Vec<D>(y.normalized()) : Vec<D>(Vec<D>::UnitX());
  return {y.norm() - radius, Vec<D>::Constant(0.5) + radius * n, n};
}

template <class T>
class WallFitOf : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(WallFitOf, Dimensions);

// Linear interpolation is exact for a plane.
TYPED_TEST(WallFitOf, APlaneIsMet) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(8, 0.1);
  const Vec<D> n = Vec<D>::Ones().normalized();
  const auto probe = [&](const Vec<D>& x) {
    const double s = n.dot(x - Vec<D>::Constant(0.47));
    return WallProbe<D>{s, x - s * n, n};
  };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(0.125); };
  std::vector<Vec<D>> points;
  for (int i = 0; i < 50; ++i) {
    Vec<D> x;
    for (int k = 0; k < D; ++k)
      x[k] = 0.5 + 0.3 * noise(static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(k));
    points.push_back(probe(x).closest);
  }
  points.push_back(Vec<D>::Constant(0.47) + 10.0 * (Vec<D>::Unit(0) - Vec<D>::Unit(1)));
  const WallFit fit = fit_wall<D>(mesh, distances<D>(mesh, probe), points, {probe, metric});
  EXPECT_LT(fit.to_wall.distance, 1e-14);
  EXPECT_LT(fit.to_mesh.distance, 1e-14);
  EXPECT_GT(fit.mesh_points, 20);
  EXPECT_EQ(fit.wall_points, 50);
  EXPECT_EQ(fit.outside, 1);
  EXPECT_EQ(fit.straddling, 0);
}

// Interpolation of a convex function lies above it by at most (longest edge)^2 / 8 times its curvature 1/r.
TYPED_TEST(WallFitOf, ABallIsCutShort) {
  constexpr int D = TypeParam::value;
  constexpr int n = 40;  // normals turn by less than WallFit::kKink in a cell
  constexpr double radius = 0.31;
  const Mesh<D> mesh = lattice<D>(n);
  const auto probe = [&](const Vec<D>& x) { return ball<D>(x, radius); };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(1.0 / n); };
  std::vector<Vec<D>> points;
  for (const Vec<D>& x : mesh.points) points.push_back(probe(x).closest);
  const WallFit fit = fit_wall<D>(mesh, distances<D>(mesh, probe), points, {probe, metric});
  const double bound = D / (8.0 * n * n) / (radius - std::sqrt(D) / n);
  EXPECT_GT(fit.to_wall.distance, 0.1 * bound);
  EXPECT_LT(fit.to_wall.distance, bound);
  EXPECT_GT(fit.to_mesh.distance, 0.1 * bound);
  EXPECT_LT(fit.to_mesh.distance, bound);
  EXPECT_EQ(fit.outside, 0);
  EXPECT_EQ(fit.straddling, 0);
  EXPECT_NEAR(ball<D>(fit.to_mesh.at.template head<D>(), radius).phi, 0.0, 1e-14);
}

// Two planes that meet at less than a sharp angle: cells across are not smooth, all others are met.
TYPED_TEST(WallFitOf, CreasesDoNotCount) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(9);
  const auto probe = [&](const Vec<D>& x) {
    const double side = x[0] < 0.5 ? -1.0 : 1.0;
    const Vec<D> n = (Vec<D>::Unit(D - 1) + 0.3 * side * Vec<D>::Unit(0)).normalized();
    const double s = n.dot(x - Vec<D>::Constant(0.5));
    return WallProbe<D>{s, x - s * n, n};
  };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(0.1); };
  const WallFit fit = fit_wall<D>(mesh, distances<D>(mesh, probe), {}, {probe, metric});
  EXPECT_GT(fit.mesh_points, 0);
  EXPECT_LT(fit.to_wall.distance, 1e-14);
  EXPECT_GT(fit.anywhere.distance, 1e-3);
  EXPECT_NEAR(fit.anywhere.at[0], 0.5, 0.06);
}

TYPED_TEST(WallFitOf, SharpEdgesDoNotCount) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(10);
  const auto probe = [&](const Vec<D>& x) {
    WallProbe<D> p = ball<D>(x, 0.31);
    p.edge_distance = 0.05;  // less than any cell is long
    return p;
  };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(0.1); };
  const WallFit fit =
      fit_wall<D>(mesh, distances<D>(mesh, probe), {probe(Vec<D>::Zero()).closest}, {probe, metric});
  EXPECT_EQ(fit.mesh_points, 0);
  EXPECT_EQ(fit.wall_points, 0);
  EXPECT_EQ(fit.to_wall.distance, 0.0);
  EXPECT_GT(fit.anywhere.distance, 1e-3);
}

TYPED_TEST(WallFitOf, CellsLargerThanTheWallAsks) {
  constexpr int D = TypeParam::value;
  constexpr int n = 10;
  const Mesh<D> mesh = lattice<D>(n);
  const auto probe = [&](const Vec<D>& x) { return ball<D>(x, 0.31); };
  // Large cells are wrong on one side of the body only.
  const auto metric = [](const Vec<D>& x) { return Metric<D>::isotropic(x[0] > 0.5 ? 0.01 : 0.1); };
  const WallFit fit = fit_wall<D>(mesh, distances<D>(mesh, probe), {}, {probe, metric});
  EXPECT_GT(fit.straddling, 4);
  ASSERT_FALSE(fit.worst.empty());
  for (const WallFit::Straddler& s : fit.worst) {
    EXPECT_GT(s.at[0], 0.5);
    EXPECT_NEAR(s.length, std::sqrt(D) / n / 0.01, 1e-12);
  }
}

// A sheet thinner than a cell that no vertex sees: only points of the wall tell.
TYPED_TEST(WallFitOf, AWallBetweenTheVerticesIsFound) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(10);
  const auto probe = [&](const Vec<D>& x) {
    const double s = x[0] - 0.55, side = s < 0.0 ? -1.0 : 1.0;
    Vec<D> closest = x;
    closest[0] = 0.55 + 0.01 * side;
    return WallProbe<D>{std::abs(s) - 0.01, closest, Vec<D>::Unit(0)};
  };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(0.005); };
  const std::vector<Vec<D>> points = {probe(Vec<D>::Constant(0.531)).closest,
                                      probe(Vec<D>::Constant(0.532)).closest};
  const WallFit fit = fit_wall<D>(mesh, distances<D>(mesh, probe), points, {probe, metric});
  EXPECT_EQ(fit.mesh_points, 0);
  EXPECT_EQ(fit.straddling, 1);
  EXPECT_NEAR(fit.to_mesh.distance, 0.04, 1e-14);  // the vertices' distance
}

TYPED_TEST(WallFitOf, SameBitsForEveryThreadCount) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(D == 2 ? 100 : 20, 0.1);
  const auto probe = [&](const Vec<D>& x) { return ball<D>(x, 0.31); };
  const auto metric = [](const Vec<D>&) { return Metric<D>::isotropic(0.001); };
  std::vector<Vec<D>> points;
  for (const Vec<D>& x : mesh.points) points.push_back(probe(x).closest);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    return fit_wall<D>(mesh, distances<D>(mesh, probe), points, {probe, metric});
  };
  const WallFit expected = run(1);
  EXPECT_GT(expected.straddling, 20);
  for (const int threads : {2, 3, 8}) {
    const WallFit fit = run(threads);
    EXPECT_EQ(fit.to_wall.distance, expected.to_wall.distance);
    EXPECT_EQ(fit.to_mesh.at, expected.to_mesh.at);
    EXPECT_EQ(fit.straddling, expected.straddling);
    ASSERT_EQ(fit.worst.size(), expected.worst.size());
    for (std::size_t i = 0; i < fit.worst.size(); ++i) EXPECT_EQ(fit.worst[i].cell, expected.worst[i].cell);
  }
}

}  // namespace
}  // namespace lamina
