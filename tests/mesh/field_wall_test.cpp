// A circle and a sphere, whose curvature is known, a plane, and fields that have no wall.
#include "mesh/field_wall.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

constexpr double kRadius = 0.3;

template <int D>
FieldWall<D> ball(int n) {
  const Mesh<D> mesh = lattice<D>(n, 0.1);
  std::vector<double> distance;
  for (const Vec<D>& x : mesh.points) distance.push_back((x - Vec<D>::Constant(0.5)).norm() - kRadius);
  return FieldWall<D>(mesh, std::make_shared<const CellFinder<D>>(mesh), distance);
}

template <int D>
void check_ball(int n, double tolerance) {
  const FieldWall<D> wall = ball<D>(n);
  for (std::size_t i = 0; i < 200; ++i) {
    Vec3 way = Vec3::Zero();
    for (int k = 0; k < D; ++k) way[k] = noise(i, static_cast<std::uint64_t>(k));
    way.normalize();
    Vec3 center = Vec3::Zero();
    center.head<D>().setConstant(0.5);
    const double height = 0.1 * noise(i, 9);
    const Vec3 x = center + (kRadius + height) * way;
    const WallPoint w = wall.at(x);
    EXPECT_EQ(w.phi, wall.phi(x));
    EXPECT_NEAR(w.phi, height, 0.02 * tolerance);
    EXPECT_LT((w.closest - center - kRadius * way).norm(), 0.1 * tolerance);
    EXPECT_LT((w.N - way).norm(), tolerance);
    EXPECT_NEAR(w.N.dot(w.T1), 0.0, 1e-12);
    EXPECT_NEAR(w.N.cross(w.T1).dot(w.T2), 1.0, 1e-12);
    EXPECT_NEAR(w.k1 * kRadius, 1.0, 3.0 * tolerance);
    EXPECT_NEAR(w.k2 * kRadius, D == 2 ? 0.0 : 1.0, 3.0 * tolerance);
  }
  EXPECT_NEAR(wall.bounds().size()[0], 2.0 * kRadius, 0.01);
}

TEST(FieldWall, Balls) {
  check_ball<2>(40, 0.02);
  check_ball<3>(24, 0.05);
}

// Of edges of 1/n to sqrt 2/n, at a curvature of 1/kRadius.
TEST(FieldWall, CoarsenessTellsHowFarTheMeshTurns) {
  const double turn = ball<2>(40).coarseness();
  EXPECT_GT(turn, 0.8 / 40 / kRadius);
  EXPECT_LT(turn, 1.7 / 40 / kRadius);
  EXPECT_NEAR(ball<2>(20).coarseness() / turn, 2.0, 0.4);
  EXPECT_GT(ball<2>(3).coarseness(), 1.0);
}

/// A wall on the border of the mesh, as in body-fitted meshes: linear distances are told without error.
TEST(FieldWall, PlaneOnTheBorder) {
  const Mesh<3> mesh = lattice<3>(5, 0.1);
  std::vector<double> distance;
  for (const Vec3& x : mesh.points) distance.push_back(x[2]);
  const FieldWall<3> wall(mesh, std::make_shared<const CellFinder<3>>(mesh), distance);
  const WallPoint w = wall.at({0.3, 0.6, 0.45});
  EXPECT_NEAR(w.phi, 0.45, 1e-13);
  EXPECT_LT((w.closest - Vec3(0.3, 0.6, 0.0)).norm(), 1e-12);
  EXPECT_LT((w.N - Vec3::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(w.k1, 0.0, 1e-9);
  EXPECT_NEAR(wall.bounds().size()[2], 0.0, 1e-12);
}

TEST(FieldWall, WithoutAWall) {
  const Mesh<2> mesh = lattice<2>(3);
  const auto places = std::make_shared<const CellFinder<2>>(mesh);
  EXPECT_THROW(FieldWall<2>(mesh, places, std::vector<double>(mesh.points.size(), 1.0)), Error);
  EXPECT_THROW(FieldWall<2>(mesh, places, {1.0}), Error);
}

}  // namespace
}  // namespace lamina
