#include "mesh/validate.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
Box<D> unit_box() {
  return {Vec<D>::Zero(), Vec<D>::Ones()};
}

template <int D>
void expect_lattice_valid() {
  for (const int n : {1, 2, 7}) {
    const Mesh<D> mesh = lattice<D>(n, 0.1);
    const Validation v = validate<D>(mesh, unit_box<D>());
    EXPECT_TRUE(v.ok()) << v.summary();
    EXPECT_EQ(v.summary(), "valid");
    EXPECT_EQ(v.boundary_facets, D == 2 ? 4 * n : 12 * n * n);
    EXPECT_EQ(v.inward_facets, 0);
    EXPECT_EQ(v.unused_points, 0);
    EXPECT_NEAR(v.volume, 1.0, 1e-14);
    EXPECT_LT(v.volume_error, 1e-14);
    EXPECT_LT(v.boundary_area_error, 1e-14);
  }
}

TEST(Validate, LatticesAreValid) {
  expect_lattice_valid<2>();
  expect_lattice_valid<3>();
}

TEST(Validate, OneTetrahedronByHand) {
  Mesh<3> mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {5, 5, 5}};
  mesh.cells = {{0, 1, 2, 3}};
  const Validation v = validate(mesh);
  EXPECT_TRUE(v.ok());
  EXPECT_EQ(v.boundary_facets, 4);
  EXPECT_EQ(v.unused_points, 1);
  EXPECT_DOUBLE_EQ(v.volume, 1.0 / 6.0);
  const Validation boxed = validate<3>(mesh, unit_box<3>());
  EXPECT_EQ(boxed.off_box_facets, 1);
  EXPECT_FALSE(boxed.ok());
}

TEST(Validate, FlippedAndFlatCellsAreCounted) {
  Mesh<3> mesh = lattice<3>(2);
  std::swap(mesh.cells[5][0], mesh.cells[5][1]);
  const Validation v = validate<3>(mesh, unit_box<3>());
  EXPECT_EQ(v.nonpositive_cells, 1);
  EXPECT_GT(v.misoriented_facets, 0);
  EXPECT_NE(v.summary().find("1 cells not positive"), std::string::npos);
  Mesh<2> flat;
  flat.points = {{0.1, 0.1}, {0.2, 0.2}, {0.3, 0.3}};  // collinear; one ulp decides below
  flat.cells = {{0, 1, 2}};
  EXPECT_EQ(validate(flat).nonpositive_cells, 1);
  flat.points[2][1] = std::nextafter(0.3, 1.0);
  EXPECT_EQ(validate(flat).nonpositive_cells, 0);
  flat.points[2][1] = std::nextafter(0.3, 0.0);
  EXPECT_EQ(validate(flat).nonpositive_cells, 1);
}

TEST(Validate, NotANumberIsNotPositive) {
  Mesh<2> mesh = lattice<2>(2);
  mesh.points[4][0] = std::numeric_limits<double>::quiet_NaN();
  const Validation v = validate<2>(mesh, unit_box<2>());
  EXPECT_EQ(v.nonpositive_cells, 6);
  EXPECT_FALSE(v.ok());
}

TEST(Validate, BadIndicesAreCountedAndPassedOver) {
  Mesh<3> mesh = lattice<3>(2);
  mesh.cells[0][2] = 1000;
  mesh.cells[1][3] = -1;
  mesh.cells[2][1] = mesh.cells[2][0];
  mesh.facets[0][0] = mesh.facets[0][1];
  const Validation v = validate<3>(mesh, unit_box<3>());
  EXPECT_EQ(v.bad_indices, 4);
  EXPECT_EQ(v.nonpositive_cells, 0);
  EXPECT_GT(v.volume_error, 0.01);
  EXPECT_FALSE(v.ok());
}

TEST(Validate, DuplicateCellSharesItsFacetsThrice) {
  Mesh<3> mesh = lattice<3>(3);
  mesh.cells.push_back(mesh.cells[40]);
  const Validation v = validate<3>(mesh, unit_box<3>());
  EXPECT_GT(v.overshared_facets, 0);
  EXPECT_FALSE(v.ok());
}

TEST(Validate, OverlapOnOneSideIsMisoriented) {
  Mesh<2> mesh;  // two positive triangles on the same side of the edge 0-1
  mesh.points = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  mesh.cells = {{0, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(validate(mesh).misoriented_facets, 1);
}

TEST(Validate, HangingVertexLeavesTheBox) {
  Mesh<2> mesh = lattice<2>(2);
  // Splits one of the two triangles at an inner edge and not the other: conformity is lost, volume is not.
  const auto cell = mesh.cells[0];
  Index a = cell[0], b = cell[2], c = cell[1];
  if (!(mesh.points[a][0] == 0.0 && mesh.points[b] == Vec2(0.5, 0.5))) {
    b = cell[1];
    c = cell[2];
  }
  ASSERT_EQ(mesh.points[b], Vec2(0.5, 0.5));
  const auto m = static_cast<Index>(mesh.points.size());
  mesh.points.push_back(0.5 * (mesh.points[a] + mesh.points[b]));
  if (c == cell[1]) {
    mesh.cells[0] = {a, c, m};
    mesh.cells.push_back({c, b, m});
  } else {
    mesh.cells[0] = {a, m, c};
    mesh.cells.push_back({m, b, c});
  }
  const Validation v = validate<2>(mesh, unit_box<2>());
  EXPECT_EQ(v.nonpositive_cells, 0);
  EXPECT_LT(v.volume_error, 1e-14);
  EXPECT_EQ(v.off_box_facets, 3);
  EXPECT_EQ(v.boundary_mismatch, 3);
  EXPECT_GT(v.boundary_area_error, 0.1);
  EXPECT_FALSE(v.ok());
}

TEST(Validate, BoundaryMustLieExactlyInTheBox) {
  Mesh<3> mesh = lattice<3>(2);
  Index on_face = kNone;
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    if (mesh.points[i] == Vec3(0.5, 0.5, 1.0)) on_face = static_cast<Index>(i);
  ASSERT_NE(on_face, kNone);
  mesh.points[on_face][2] = std::nextafter(1.0, 0.0);
  const Validation v = validate<3>(mesh, unit_box<3>());
  EXPECT_EQ(v.off_box_facets, 6);
  EXPECT_LT(v.volume_error, 1e-12);
  EXPECT_FALSE(v.ok());
}

TEST(Validate, FacetListIsCompared) {
  const Mesh<3> good = lattice<3>(2);
  Mesh<3> mesh = good;
  mesh.facets.clear();
  mesh.facet_tags.clear();
  EXPECT_TRUE(validate<3>(mesh, unit_box<3>()).ok());  // no list, nothing to compare
  mesh = good;
  mesh.facets.pop_back();
  mesh.facet_tags.pop_back();
  EXPECT_EQ(validate(mesh).boundary_mismatch, 1);
  mesh = good;
  mesh.facets.push_back(mesh.facets[3]);
  mesh.facet_tags.push_back(1);
  EXPECT_EQ(validate(mesh).boundary_mismatch, 1);
  mesh = good;
  mesh.facets.push_back({0, 13, 26});  // a facet of no cell
  mesh.facet_tags.push_back(1);
  EXPECT_EQ(validate(mesh).boundary_mismatch, 1);
  mesh = good;
  std::swap(mesh.facets[7][0], mesh.facets[7][2]);
  EXPECT_EQ(validate(mesh).boundary_mismatch, 0);
  EXPECT_EQ(validate(mesh).inward_facets, 1);
  EXPECT_TRUE(validate(mesh).ok());
}

TEST(Validate, TaggedInteriorFacetsAreAllowed) {
  Mesh<2> mesh = lattice<2>(1);  // the diagonal 0-3 is inside
  mesh.facets.push_back({0, 3});
  mesh.facet_tags.push_back(9);
  EXPECT_TRUE(validate(mesh).ok());
  mesh.facet_tags.back() = 0;
  EXPECT_EQ(validate(mesh).boundary_mismatch, 1);
}

TEST(Validate, EmptyMesh) {
  EXPECT_TRUE(validate(Mesh<3>{}).ok());
  EXPECT_FALSE(validate<3>(Mesh<3>{}, unit_box<3>()).ok());
}

TEST(Validate, SameBitsForEveryThreadCount) {
  const Mesh<3> mesh = lattice<3>(30, 0.1);
  Validation first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    const Validation v = validate<3>(mesh, unit_box<3>());
    if (threads == 1) first = v;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(v.volume), std::bit_cast<std::uint64_t>(first.volume));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(v.boundary_area_error),
              std::bit_cast<std::uint64_t>(first.boundary_area_error));
    EXPECT_EQ(v.boundary_facets, 12 * 30 * 30);
  }
}

}  // namespace
}  // namespace lamina
