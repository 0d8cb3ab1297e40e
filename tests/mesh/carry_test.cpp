// Linear fields are carried without error, ranges are kept, metrics stay metrics.
#include "mesh/carry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/metric.h"
#include "core/parallel.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
std::vector<Vec<D>> scattered(std::size_t n) {
  std::vector<Vec<D>> points(n);
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < D; ++k) points[i][k] = 0.5 + 0.5 * noise(i, static_cast<std::uint64_t>(k));
  return points;
}

template <int D>
void linear_fields() {
  const Mesh<D> mesh = lattice<D>(5, 0.12);
  const auto u = [](const Vec<D>& x) { return 2.0 + 3.0 * x[0] - x[D - 1]; };
  MeshField scalar{"u", 1, {}}, vector{"w", D, {}};
  for (const Vec<D>& x : mesh.points) {
    scalar.values.push_back(u(x));
    for (int k = 0; k < D; ++k) vector.values.push_back(x[k] - 0.25);
  }
  const auto points = scattered<D>(400);
  const auto carried = carry_fields<D>(CellFinder<D>(mesh), {scalar, vector}, points);
  ASSERT_EQ(carried.size(), 2u);
  EXPECT_EQ(carried[1].name, "w");
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(carried[0].values[i], u(points[i]), 1e-13);
    for (int k = 0; k < D; ++k)
      EXPECT_NEAR(carried[1].values[i * D + static_cast<std::size_t>(k)], points[i][k] - 0.25, 1e-13);
  }
}

TEST(CarryFields, LinearOnesWithoutError) {
  linear_fields<2>();
  linear_fields<3>();
}

TEST(CarryFields, RangeIsKeptAndPointsKeepTheirBits) {
  const Mesh<3> mesh = lattice<3>(4, 0.1);
  MeshField field{"u", 1, {}};
  for (std::size_t i = 0; i < mesh.points.size(); ++i) field.values.push_back(noise(i, 3) > 0 ? 0.1 : 0.7);
  const CellFinder<3> from(mesh);
  EXPECT_EQ(carry_fields<3>(from, {field}, mesh.points)[0].values, field.values);
  auto points = scattered<3>(2000);
  for (Vec3& x : points) x = Vec3::Constant(0.5) + 1.2 * (x - Vec3::Constant(0.5));  // some beyond the mesh
  const FieldRange range = range_of(carry_fields<3>(from, {field}, points)[0]);
  EXPECT_GE(range.least, 0.1);
  EXPECT_LE(range.most, 0.7);
}

/// Halfway between sizes h and 4 h along x lies 2 h; a tensor that is no metric anywhere is a plain mean.
TEST(CarryFields, TensorsAreLogEuclideanOnlyWhenTheyAreMetrics) {
  Mesh<2> mesh;
  mesh.points = {{0, 0}, {1, 0}, {0, 1}};
  mesh.cells = {{0, 1, 2}};
  const CellFinder<2> from(mesh);
  MeshField tensor{"t", 3, {1.0, 0.0, 1.0, 1.0 / 16.0, 0.0, 1.0, 1.0, 0.0, 1.0}};
  EXPECT_NEAR(carry_fields<2>(from, {tensor}, {{0.5, 0.0}})[0].values[0], 0.25, 1e-14);
  tensor.values[8] = -1.0;
  EXPECT_NEAR(carry_fields<2>(from, {tensor}, {{0.5, 0.0}})[0].values[0], 0.5 * (1.0 + 1.0 / 16.0), 1e-14);
}

TEST(CarryFields, SameBitsForEveryThreadCount) {
  const Mesh<3> mesh = lattice<3>(8, 0.1);
  MeshField field{"u", 1, {}};
  for (std::size_t i = 0; i < mesh.points.size(); ++i) field.values.push_back(noise(i, 1));
  const auto points = scattered<3>(5000);
  std::vector<double> first;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const auto values = carry_fields<3>(CellFinder<3>(mesh), {field}, points)[0].values;
    if (first.empty()) first = values;
    EXPECT_EQ(first, values);
  }
}

}  // namespace
}  // namespace lamina
