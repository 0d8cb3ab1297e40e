#include "core/hilbert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace lamina {
namespace {

// Along the curve consecutive cells of a regular grid share a side: the defining property.
template <int D>
void expect_unit_steps(int n) {
  Box<D> box;
  box.lo = Vec<D>::Zero();
  box.hi = Vec<D>::Constant(n);
  std::vector<std::pair<std::uint64_t, Vec<D>>> cells;
  int total = 1;
  for (int i = 0; i < D; ++i) total *= n;
  for (int c = 0; c < total; ++c) {
    Vec<D> x;
    for (int i = 0, r = c; i < D; ++i, r /= n) x[i] = r % n + 0.5;
    cells.emplace_back(hilbert_key<D>(x, box), x);
  }
  std::sort(cells.begin(), cells.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t k = 1; k < cells.size(); ++k) {
    ASSERT_NE(cells[k].first, cells[k - 1].first);
    ASSERT_EQ((cells[k].second - cells[k - 1].second).template lpNorm<1>(), 1.0) << k;
  }
}

TEST(Hilbert, ConsecutiveCellsTouch2d) { expect_unit_steps<2>(32); }
TEST(Hilbert, ConsecutiveCellsTouch3d) { expect_unit_steps<3>(16); }

TEST(Hilbert, PointsOutsideAreClamped) {
  Box<3> box;
  box.lo = Vec3::Zero();
  box.hi = Vec3::Ones();
  EXPECT_EQ(hilbert_key<3>(Vec3(-5, -5, -5), box), hilbert_key<3>(Vec3(0, 0, 0), box));
  EXPECT_EQ(hilbert_key<3>(Vec3(9, 1, 1), box), hilbert_key<3>(Vec3(1, 1, 1), box));
}

}  // namespace
}  // namespace lamina
