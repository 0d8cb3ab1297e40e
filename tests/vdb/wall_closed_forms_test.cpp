// The metric over triangulated bodies against that of the bodies themselves, everywhere in the layers.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/wall_metric.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/level_set.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

using namespace testing_surfaces;

/// What is known of a smooth wall at one of its points.
struct Truth {
  Vec3 foot, N, T1, T2;  // T1 of the larger curvature
  double k1, k2;
  /// Magnitude that sizes follow in the place of k2, by the root of WallField::graded_curvatures(); k2 where
  /// there is none.
  std::function<double(double)> graded = {};
};

// sqrt(2 R h + h^2) with the radius of the level through the point [eq. 29]; h2 where flat. `graded` stands
// for k where that falls too fast.
double chord(double k, double graded, double height, double h, double h2) {
  const double level = 1.0 / graded + std::max(0.0, k / graded * height);
  return graded == 0.0 ? h2 : std::min(h2, std::sqrt(2.0 * level * h + h * h));
}

void compare(const std::string& name, const std::vector<double>& facets,
             const std::function<Truth(Dice&)>& point_of_wall) {
  for (const double facet : facets) {
    const LevelSet wall = LevelSet::from_surface(make_shape(name, {.facet = facet}), {});
    Flow flow;
    flow.h_min = 2e-3;
    flow.layers = 12;
    SizeOptions sizes;
    sizes.h2 = 0.2;
    sizes.h1 = 0.5;
    sizes.domain = wall.bounds().padded(2.0);
    sizes.box2 = wall.bounds().padded(1.0);
    sizes.profile = Profile::kContinuous;  // a step would move with the facets' sag
    const WallMetric metric(wall, resolve(flow, 1.0), sizes);
    Dice dice(7);
    for (int i = 0; i < 2000; ++i) {
      const Truth t = point_of_wall(dice);
      const double height = dice.uniform(0.0, metric.layer().top());
      const Metric<3> m = metric.at(t.foot + height * t.N);
      const double hn = 2e-3 + 0.2 * height;
      const std::string where =
          name + " of facets " + std::to_string(facet) + " at " + std::to_string(height);
      // Sizes along the true directions: one that is off by a degree shows at these ratios.
      ASSERT_NEAR(m.size_along(t.N) / hn, 1.0, 0.01) << where;
      const double root = std::sqrt(2.0 * hn) / std::log(sizes.edge_growth);
      const double k2 = t.graded ? t.graded(root) : t.k2;
      ASSERT_NEAR(m.size_along(t.T1) / chord(t.k1, t.k1, height, hn, 0.2), 1.0, 0.01) << where;
      // The bound on the fall of curvature is kept for roots that double and interpolated between them.
      const double slack = t.graded && t.graded(2.0 * root) > 1.001 * t.k2 ? 0.02 : 0.01;
      ASSERT_NEAR(m.size_along(t.T2) / chord(t.k2, k2, height, hn, 0.2), 1.0, slack) << where;
    }
  }
}

TEST(WallClosedForms, Sphere) {
  compare("sphere", {0.016, 0.012, 0.008}, [](Dice& dice) {
    Truth t;
    do t.N = dice.point({-1, -1, -1}, {1, 1, 1});
    while (t.N.norm() > 1.0 || t.N.norm() < 0.1);
    t.N.normalize();
    t.foot = 0.5 * t.N;
    t.T1 = t.N.unitOrthogonal();
    t.T2 = t.N.cross(t.T1);
    t.k1 = t.k2 = 2.0;
    return t;
  });
}

TEST(WallClosedForms, Torus) {
  compare("torus", {0.012, 0.008, 0.006}, [](Dice& dice) {
    const double a = dice.uniform(0.0, 6.283),
                 b = dice.uniform(-1.3, 1.3);  // the outer half: convex both ways
    const Vec3 radial(std::cos(a), std::sin(a), 0.0), up = Vec3::UnitZ();
    Truth t;
    t.N = std::cos(b) * radial + std::sin(b) * up;
    t.foot = 0.35 * radial + 0.15 * t.N;
    t.T1 = -std::sin(b) * radial + std::cos(b) * up;
    t.T2 = t.N.cross(t.T1);
    t.k1 = 1.0 / 0.15;
    const auto across = [](double at) { return std::cos(at) / (0.35 + 0.15 * std::cos(at)); };
    t.k2 = across(b);
    t.graded = [=](double root) {
      double least = 1e9;
      for (double at = -3.14; at < 3.14; at += 1e-3)
        least = std::min(least, 1.0 / std::sqrt(std::abs(across(at))) + 0.15 * std::abs(b - at) / root);
      return 1.0 / (least * least);
    };
    return t;
  });
}

// Away from the rims, whose fans are another matter.
TEST(WallClosedForms, CylinderAndItsFlatEnds) {
  const auto side = [](Dice& dice) {
    const double a = dice.uniform(0.0, 6.283);
    Truth t;
    t.N = {std::cos(a), 0.0, std::sin(a)};
    t.foot = 0.3 * t.N;  // half way between the ends
    t.T1 = {-std::sin(a), 0.0, std::cos(a)};
    t.T2 = Vec3::UnitY();
    t.k1 = 1.0 / 0.3;
    t.k2 = 0.0;
    return t;
  };
  const LevelSet wall = LevelSet::from_surface(make_shape("cylinder", {}), {});
  EXPECT_NEAR(wall.at({0.0, 0.3, 0.0}).N[1], 1.0, 1e-12);
  EXPECT_EQ(wall.at({0.0, 0.3, 0.0}).k1, 0.0);
  for (const double facet : {0.02, 0.012, 0.008}) {
    const LevelSet body = LevelSet::from_surface(make_shape("cylinder", {.facet = facet}), {});
    Dice dice(3);
    for (int i = 0; i < 2000; ++i) {
      const Truth t = side(dice);
      const WallPoint w = body.at(t.foot + dice.uniform(0.0, 0.1) * t.N);
      ASSERT_NEAR(w.k1 / t.k1, 1.0, 0.01) << facet;
      ASSERT_NEAR(w.k2, 0.0, 0.01) << facet;
      ASSERT_NEAR(std::abs(w.T1.dot(t.T1)), 1.0, 1e-3) << facet;
      ASSERT_NEAR(w.N.dot(t.N), 1.0, 1e-4) << facet;
    }
  }
}

}  // namespace
}  // namespace lamina
