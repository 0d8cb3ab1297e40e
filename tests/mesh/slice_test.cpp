#include "mesh/slice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

double signed_area(const std::vector<Vec2>& x) {
  double area = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec2 &p = x[i], &q = x[(i + 1) % x.size()];
    area += 0.5 * (p[0] * q[1] - q[0] * p[1]);
  }
  return area;
}

double total_area(const std::vector<SlicePolygon>& polygons) {
  double area = 0.0;
  for (const SlicePolygon& p : polygons) area += std::abs(signed_area(p.corners));
  return area;
}

std::vector<double> linear(const Mesh<3>& mesh) {
  std::vector<double> values;
  for (const Vec3& x : mesh.points) values.push_back(1.0 + 2.0 * x[0] - 3.0 * x[1] + 0.5 * x[2]);
  return values;
}

TEST(Slice, OneTetrahedronByHand) {
  Mesh<3> mesh;
  mesh.points = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}};
  mesh.cells = {{0, 1, 2, 3}};
  const auto triangle = slice(mesh, 2, 1.0, {0.0, 10.0, 20.0, 30.0});
  ASSERT_EQ(triangle.size(), 1u);
  ASSERT_EQ(triangle[0].corners.size(), 3u);
  EXPECT_DOUBLE_EQ(total_area(triangle), 0.5);
  for (std::size_t i = 0; i < 3; ++i) {  // phi = 5 x + 10 y + 15 z
    const Vec2& c = triangle[0].corners[i];
    EXPECT_DOUBLE_EQ(triangle[0].phi[i], 5 * c[0] + 10 * c[1] + 15);
  }
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 1}, {0, 0, 1}};
  const auto quad = slice(mesh, 2, 0.5, {});
  ASSERT_EQ(quad.size(), 1u);
  EXPECT_EQ(quad[0].corners.size(), 4u);
  EXPECT_TRUE(quad[0].phi.empty());
  EXPECT_DOUBLE_EQ(total_area(quad), 0.25);
}

TEST(Slice, PlaneCoordinatesOfEachAxis) {
  Mesh<3> mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}};
  mesh.cells = {{0, 1, 2, 3}};
  const std::array<Vec2, 3> extent = {Vec2(1, 2), Vec2(0.5, 2),
                                      Vec2(0.5, 1)};  // of the cut half way along the axis
  const std::array<double, 3> half = {0.5, 1.0, 2.0};
  for (int axis = 0; axis < 3; ++axis) {
    const auto cut = slice(mesh, axis, half[axis], {});
    ASSERT_EQ(cut.size(), 1u);
    Vec2 top = Vec2::Zero();
    for (const Vec2& c : cut[0].corners) top = top.cwiseMax(c);
    EXPECT_EQ(top, extent[axis]) << axis;
  }
}

TEST(Slice, CoversThePlaneOnceAtAnyOffset) {
  const Mesh<3> mesh = lattice<3>(4);
  const auto values = linear(mesh);
  for (int axis = 0; axis < 3; ++axis) {
    for (const double offset : {0.0, 0.1, 0.25, 0.5, 0.6, 0.75, 1.0}) {  // planes of the lattice among them
      const auto cut = slice(mesh, axis, offset, values);
      EXPECT_NEAR(total_area(cut), 1.0, 1e-13) << axis << " " << offset;
      Index last = -1;
      for (const SlicePolygon& p : cut) {
        EXPECT_GT(p.cell, last);
        last = p.cell;
        ASSERT_EQ(p.phi.size(), p.corners.size());
        for (std::size_t i = 0; i < p.phi.size(); ++i) {
          Vec3 x;
          x[axis] = offset;
          x[axis == 0 ? 1 : 0] = p.corners[i][0];
          x[axis == 2 ? 1 : 2] = p.corners[i][1];
          EXPECT_NEAR(p.phi[i], 1.0 + 2.0 * x[0] - 3.0 * x[1] + 0.5 * x[2], 1e-13);
        }
      }
    }
  }
}

TEST(Slice, PolygonsAreConvexAndNotDegenerate) {
  const Mesh<3> mesh = lattice<3>(5, 0.15);
  for (const double offset : {0.2, 0.37, 0.5}) {
    for (const SlicePolygon& p : slice(mesh, 1, offset, {})) {
      const std::size_t n = p.corners.size();
      ASSERT_TRUE(n == 3 || n == 4);
      const double sign = signed_area(p.corners);
      EXPECT_NE(sign, 0.0);
      for (std::size_t i = 0; i < n; ++i) {
        const Vec2 a = p.corners[(i + 1) % n] - p.corners[i],
                   b = p.corners[(i + 2) % n] - p.corners[(i + 1) % n];
        EXPECT_GE(sign * (a[0] * b[1] - a[1] * b[0]), -1e-15);
      }
    }
  }
}

TEST(Slice, MissesAndBadArguments) {
  const Mesh<3> mesh = lattice<3>(2);
  EXPECT_TRUE(slice(mesh, 0, 1.5, {}).empty());
  EXPECT_TRUE(slice(mesh, 0, -1e-9, {}).empty());
  EXPECT_TRUE(slice(Mesh<3>{}, 0, 0.0, {}).empty());
  EXPECT_THROW(slice(mesh, 3, 0.5, {}), Error);
  EXPECT_THROW(slice(mesh, 0, 0.5, {1.0}), Error);
}

TEST(Slice, CellsThatOnlyTouchAreLeftOut) {
  Mesh<3> mesh;
  mesh.points = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  mesh.cells = {{3, 1, 2, 0}};
  EXPECT_TRUE(slice(mesh, 2, 1.0, {}).empty());   // a vertex
  EXPECT_EQ(slice(mesh, 2, 0.0, {}).size(), 1u);  // a facet, with no cell below
  mesh.points = {{0, 0, 1}, {1, 0, 1}, {0, 1, 0}, {0, 0, 0}};
  EXPECT_TRUE(slice(mesh, 2, 1.0, {}).empty());  // an edge
}

TEST(Slice, SameForEveryThreadCount) {
  const Mesh<3> mesh = lattice<3>(20, 0.1);
  std::vector<SlicePolygon> first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    const auto cut = slice(mesh, 0, 0.33, linear(mesh));
    if (threads == 1) first = cut;
    ASSERT_EQ(cut.size(), first.size());
    for (std::size_t i = 0; i < cut.size(); ++i) {
      ASSERT_EQ(cut[i].cell, first[i].cell);
      ASSERT_EQ(cut[i].corners, first[i].corners);
      ASSERT_EQ(cut[i].phi, first[i].phi);
    }
  }
}

}  // namespace
}  // namespace lamina
