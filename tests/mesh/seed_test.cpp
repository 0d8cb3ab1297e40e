#include "mesh/seed.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace lamina
