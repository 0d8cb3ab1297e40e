#include "vdb/detail/wide_tree.h"

#include <gtest/gtest.h>

#include "tests/vdb/test_surfaces.h"

namespace lamina::detail {
namespace {

using testing_surfaces::Dice;

struct Cloud {
  std::vector<Vec3> points;
  BoxTree tree;
  WideTree wide;

  Cloud(int n, double scale) {
    Dice dice(5);
    std::vector<BoxRef> refs;
    for (int i = 0; i < n; ++i) {
      points.push_back(scale * dice.point(-Vec3::Ones(), Vec3::Ones()));
      refs.push_back(BoxRef::around(&points.back(), 1, static_cast<Index>(i)));
    }
    tree = build_box_tree(std::move(refs));
    wide = WideTree(tree);
  }

  double nearest(const Vec3& x, double slack, int& looked_at) const {
    double best = std::numeric_limits<double>::infinity();
    wide.visit_nearest(x.data(), best, slack, [&](int begin, int count) {
      for (int i = begin; i < begin + count; ++i, ++looked_at)
        best = std::min(
            best,
            (points[static_cast<std::size_t>(tree.ids[static_cast<std::size_t>(i)])] - x).squaredNorm());
    });
    return best;
  }
  double brute(const Vec3& x) const {
    double best = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) best = std::min(best, (p - x).squaredNorm());
    return best;
  }
};

TEST(WideTree, FindsTheNearestAtEveryScale) {
  for (const int n : {1, 3, 5, 20, 3000})
    for (const double scale : {1e-25, 1e-6, 1.0, 1e12, 1e25}) {
      const Cloud cloud(n, scale);
      Dice dice(6);
      int looked_at = 0;
      for (int i = 0; i < 300; ++i) {
        const double far = i % 3 == 0 ? 1e3 : i % 3 == 1 ? 2.0 : 1.0;
        const Vec3 x = i % 10 == 0 ? cloud.points[static_cast<std::size_t>(i % n)]
                                   : Vec3(far * scale * dice.point(-Vec3::Ones(), Vec3::Ones()));
        EXPECT_EQ(cloud.nearest(x, 1.0, looked_at), cloud.brute(x));
      }
      if (scale == 1.0 && n == 3000) {
        EXPECT_LT(looked_at, 300 * 300);  // boxes are passed over
      }
    }
}

TEST(WideTree, SlackBoundsTheError) {
  const Cloud cloud(3000, 1.0);
  Dice dice(7);
  int looked_at = 0, exactly = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 x = dice.point(Vec3::Constant(-20.0), Vec3::Constant(20.0));
    EXPECT_LE(cloud.nearest(x, 1.1 * 1.1, looked_at), 1.1 * 1.1 * cloud.nearest(x, 1.0, exactly));
  }
  EXPECT_LT(looked_at, exactly);
}

TEST(WideTree, NothingAndFarthestPoint) {
  int looked_at = 0;
  EXPECT_EQ(Cloud(0, 1.0).nearest(Vec3::Zero(), 1.0, looked_at), std::numeric_limits<double>::infinity());
  EXPECT_EQ(looked_at, 0);
  const Cloud cloud(100, 1.0);
  const Vec3 x(1e100, -1e100, 1e100);
  EXPECT_EQ(cloud.nearest(x, 1.0, looked_at), cloud.brute(x));
}

}  // namespace
}  // namespace lamina::detail
