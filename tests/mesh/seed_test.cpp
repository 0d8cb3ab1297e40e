#include "mesh/seed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "mesh/validate.h"

namespace lamina {
namespace {

template <int D>
Box<D> box(double x) {
  Box<D> b;
  b.lo = Vec<D>::Constant(-0.3);
  b.hi = Vec<D>::Constant(1.0);
  b.hi[0] = x;
  return b;
}

TEST(Seed, LatticeFillsTheBox) {
  const auto m = make_seed<3>(box<3>(2.0), 0.5, SeedKind::kLattice);
  EXPECT_EQ(m.cells.size(), 5U * 3U * 3U * 6U);  // 2.3 / 0.5 and 1.3 / 0.5 rounded, six cells each
  EXPECT_TRUE(validate<3>(m, box<3>(2.0)).ok()) << validate<3>(m, box<3>(2.0)).summary();
  const auto t = make_seed<2>(box<2>(2.0), 0.5, SeedKind::kLattice);
  EXPECT_EQ(t.cells.size(), 5U * 3U * 2U);
  EXPECT_TRUE(validate<2>(t, box<2>(2.0)).ok()) << validate<2>(t, box<2>(2.0)).summary();
}

TEST(Seed, TetgenFillsTheBox) {
  if (!have_tetgen()) GTEST_SKIP() << "SKIPPED ALOUD: built without TetGen";
  for (const double size : {5.0, 0.6, 0.2}) {
    const auto m = make_seed<3>(box<3>(7.7), size, SeedKind::kTetgen);
    const auto v = validate<3>(m, box<3>(7.7));
    EXPECT_TRUE(v.ok()) << size << ": " << v.summary();
  }
}

TEST(Seed, TagsNameTheSides) {
  const auto m = make_seed<3>(box<3>(2.0), 0.6, SeedKind::kLattice);
  EXPECT_EQ(m.facet_names.size(), 6U);
  EXPECT_EQ(m.facet_names.at(1), "xmin");
  EXPECT_EQ(m.facet_names.at(6), "zmax");
  for (std::size_t f = 0; f < m.facets.size(); ++f) {
    const int axis = (m.facet_tags[f] - 1) / 2;
    const double plane = m.facet_tags[f] % 2 == 1 ? box<3>(2.0).lo[axis] : box<3>(2.0).hi[axis];
    for (const Index v : m.facets[f]) EXPECT_EQ(m.points[v][axis], plane);
  }
}

TEST(Seed, CellsPerAxisAreBounded) {
  EXPECT_EQ(make_seed<3>(box<3>(1.0), 1e-9, SeedKind::kLattice, 4).cells.size(), 4U * 4U * 4U * 6U);
}

TEST(Seed, RefusesAnEmptyBox) {
  Box<3> b = box<3>(1.0);
  b.hi[1] = b.lo[1];
  EXPECT_THROW((void)make_seed<3>(b, 0.5, SeedKind::kLattice), Error);
}

DomainBorder polygon(std::vector<Vec2> points) {
  DomainBorder border;
  border.points = std::move(points);
  border.tags.assign(border.points.size(), 1);
  return border;
}

double area(const std::vector<Vec2>& x) {
  double twice = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec2 &a = x[i], &b = x[(i + 1) % x.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return 0.5 * twice;
}

// A star, a comb of thin teeth, points within straight sides: every point is used, and the area is filled.
TEST(Seed, TrianglesFillAnyPolygon) {
  std::vector<Vec2> star, comb = {{20.0, -1.0}, {20.0, 0.0}}, square;
  for (int k = 0; k < 14; ++k) {
    const double a = std::numbers::pi * k / 7.0, r = k % 2 == 0 ? 1.0 : 0.1;
    star.emplace_back(r * std::cos(a), r * std::sin(a));
  }
  for (int k = 19; k > 0; --k) {
    comb.emplace_back(k + 0.01, 5.0);
    comb.emplace_back(k, 0.0);
  }
  comb.emplace_back(0.0, -1.0);
  for (int k = 0; k < 10; ++k) square.emplace_back(k, 0.0);
  for (int k = 0; k < 10; ++k) square.emplace_back(10.0, k);
  for (int k = 10; k > 0; --k) square.emplace_back(k, 10.0);
  for (int k = 10; k > 0; --k) square.emplace_back(0.0, k);
  for (const auto& points : {star, comb, square}) {
    const Mesh<2> mesh = make_seed(polygon(points));
    const Validation v = validate<2>(mesh);
    EXPECT_TRUE(v.ok()) << v.summary();
    EXPECT_EQ(v.unused_points, 0);
    EXPECT_EQ(mesh.cells.size(), points.size() - 2);
    EXPECT_EQ(v.boundary_facets, static_cast<std::int64_t>(points.size()));
    EXPECT_NEAR(v.volume, area(points), 1e-12 * v.volume);
  }
}

TEST(Seed, RefusesBordersThatAreNone) {
  const auto refused = [](std::vector<Vec2> points) {
    try {
      (void)make_seed(polygon(std::move(points)));
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kDomain);
      return true;
    }
    return false;
  };
  EXPECT_TRUE(refused({{0.0, 0.0}, {1.0, 0.0}}));
  EXPECT_TRUE(refused({{0.0, 0.0}, {2.0, 2.0}, {2.0, 0.0}, {0.0, 1.0}}));              // crosses
  EXPECT_TRUE(refused({{0.0, 0.0}, {4.0, 0.0}, {4.0, 4.0}, {2.0, 0.0}, {0.0, 4.0}}));  // touches
  EXPECT_TRUE(refused({{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}}));                          // flat
}

TEST(Seed, TheCHasTheShapeItIsNamedAfter) {
  const double radius = 2.0, length = 3.0;
  for (const double height : {4.0, 2.0}) {
    const Mesh<2> mesh = make_seed(c_border(radius, length, height));
    const Validation v = validate<2>(mesh);
    EXPECT_TRUE(v.ok()) << v.summary();
    const double half = 0.5 * height, angle = std::asin(half / radius);
    const double disc = radius * radius * angle + half * radius * std::cos(angle);
    EXPECT_NEAR(v.volume, disc + length * height, 2e-4 * v.volume);
    EXPECT_EQ(mesh.facet_names.at(1), "inlet");
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
      for (const Index p : mesh.facets[f]) {
        const Vec2& x = mesh.points[p];
        switch (mesh.facet_tags[f]) {
          case 1:
            EXPECT_NEAR(x.norm(), radius, 1e-12);
            break;
          case 2:
            EXPECT_EQ(x[0], length);
            break;
          default:
            EXPECT_EQ(x[1], mesh.facet_tags[f] == 3 ? -half : half);
        }
      }
    }
  }
  EXPECT_THROW((void)c_border(1.0, 1.0, 2.1), Error);
  EXPECT_THROW((void)c_border(0.0, 1.0, 1.0), Error);
}

}  // namespace
}  // namespace lamina
