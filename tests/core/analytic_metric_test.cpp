// Sizes along known directions, worked out by hand from the definitions, at points where they are short.
#include "core/analytic_metric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"

namespace lamina {
namespace {

const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

double size3(const char* spec, const Vec3& x, const Vec3& direction) {
  return make_analytic_metric<3>(spec)->at(x).size_along(direction.normalized());
}

TEST(AnalyticMetric, TiltedPlane) {
  const Vec3 n = Vec3(0.3, 0.2, 1.0) / std::sqrt(1.13);
  const Vec3 center(0.5, 0.5, 0.5), t = n.cross(kX).normalized();
  EXPECT_NEAR(size3("tilted-plane", center, n), 1e-4, 1e-15);
  EXPECT_NEAR(size3("tilted-plane", center, t), 0.1, 1e-12);
  EXPECT_NEAR(size3("tilted-plane:hmin=1e-3", center - 0.1 * n, n), 0.021, 1e-12);
  EXPECT_NEAR(size3("tilted-plane:hmin=1e-3,ht=0.01", center + 0.1 * n, n), 0.01, 1e-12);
}

TEST(AnalyticMetric, Sphere) {
  // On the wall: sqrt(2 x 0.3 x 0.002 + 0.002^2) = sqrt(0.001204). At r = 0.4: hn = 0.002 + 0.2 x 0.1 =
  // 0.022, sqrt(2 x 0.4 x 0.002 + 4e-6) = sqrt(0.001604) = 0.04005.
  EXPECT_NEAR(size3("sphere", Vec3(0.8, 0.5, 0.5), kX), 0.002, 1e-12);
  EXPECT_NEAR(size3("sphere", Vec3(0.8, 0.5, 0.5), kY), std::sqrt(0.001204), 1e-10);
  EXPECT_NEAR(size3("sphere", Vec3(0.5, 0.5, 0.1), kZ), 0.022, 1e-12);
  EXPECT_NEAR(size3("sphere", Vec3(0.5, 0.5, 0.1), kX), std::sqrt(0.001604), 1e-10);
  // At the centre the normal size is 0.002 + 0.06, more than the chord of the smallest radius.
  EXPECT_NEAR(size3("sphere", Vec3(0.5, 0.5, 0.5), kY), 0.062, 1e-12);
}

TEST(AnalyticMetric, CubeFacesEdgesAndCorners) {
  const char* spec = "cube:hmin=1e-3";
  // Inside near the face x+, and outside over it.
  EXPECT_NEAR(size3(spec, Vec3(0.70, 0.5, 0.5), kX), 0.001 + 0.2 * 0.05, 1e-12);
  EXPECT_NEAR(size3(spec, Vec3(0.85, 0.6, 0.5), kX), 0.001 + 0.2 * 0.10, 1e-12);
  EXPECT_NEAR(size3(spec, Vec3(0.85, 0.6, 0.5), kY), 0.1, 1e-12);
  // Off the edge x+ y+ by (0.03, 0.04): distance 0.05, along the edge H2, across it a chord of radius 0.05.
  const Vec3 edge(0.78, 0.79, 0.5), n(0.6, 0.8, 0.0);
  const double hn = 0.001 + 0.2 * 0.05, chord = std::sqrt(2.0 * 0.05 * 0.001 + 1e-6);
  ASSERT_LT(chord, hn);  // so that the normal size rules
  EXPECT_NEAR(size3(spec, edge, n), hn, 1e-12);
  EXPECT_NEAR(size3(spec, edge, kZ), 0.1, 1e-12);
  EXPECT_NEAR(size3(spec, edge, Vec3(0.8, -0.6, 0.0)), hn, 1e-12);
  // Nearer to the edge the chord rules: at 0.01, sqrt(2 x 0.01 x 0.001 + 1e-6) = sqrt(2.1e-5) = 0.00458 >
  // 0.003.
  EXPECT_NEAR(size3(spec, Vec3(0.756, 0.758, 0.5), Vec3(0.8, -0.6, 0.0)), std::sqrt(2.1e-5), 1e-9);
  // Off a corner: isotropic across the ray.
  const Vec3 corner = Vec3::Constant(0.75) + 0.01 * Vec3(1, 2, 2) / 3.0;
  EXPECT_NEAR(size3(spec, corner, Vec3(1, 2, 2)), 0.003, 1e-12);
  EXPECT_NEAR(size3(spec, corner, Vec3(0, 1, -1)), std::sqrt(2.1e-5), 1e-9);
}

TEST(AnalyticMetric, BenchmarksOfTheWorkingGroup) {
  EXPECT_NEAR(size3("cube-linear", Vec3(0.2, 0.3, 0.5), kZ), 0.001, 1e-15);
  EXPECT_NEAR(size3("cube-linear:h0=0.01", Vec3(0.2, 0.3, 0.75), kZ), 0.055, 1e-12);
  EXPECT_NEAR(size3("cube-linear", Vec3(0.2, 0.3, 0.5), kX), 0.1, 1e-12);
  // r = 0.5 along (0.6, 0.8): thin along the radius; 0.025 around the axis in polar-2 only.
  const Vec3 on(0.3, 0.4, 0.9), radial(0.6, 0.8, 0.0), around(-0.8, 0.6, 0.0);
  EXPECT_NEAR(size3("polar-1", on, radial), 0.001, 1e-14);
  EXPECT_NEAR(size3("polar-1", on, around), 0.1, 1e-12);
  EXPECT_NEAR(size3("polar-2", on, around), 0.025, 1e-12);
  EXPECT_NEAR(size3("polar-2", on, kZ), 0.1, 1e-12);
  EXPECT_NEAR(size3("polar-2:scale=2", on, kZ), 0.05, 1e-12);
  // r = 0.55: d = 0.5, h_t = (0.1 + 0.025) / 2, h_r = 0.001 + 2 x 0.099 x 0.05.
  EXPECT_NEAR(size3("polar-2", Vec3(0.55, 0.0, 0.0), kY), 0.0625, 1e-12);
  EXPECT_NEAR(size3("polar-2", Vec3(0.55, 0.0, 0.0), kX), 0.0109, 1e-12);
}

// A layer between the levels s_{k-1} and s_k has thickness 1: the integral of 1/h over it.
TEST(AnalyticMetric, LayersAreOneUnitThick) {
  const auto metric = make_analytic_metric<3>("plane-bl:hmin=1e-3");
  double from = 0.0;
  for (int k = 1; k <= 10; ++k) {
    const double to = 1e-3 * (std::pow(1.2, k) - 1.0) / 0.2;
    constexpr int kSteps = 200;
    double thickness = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      const double z = from + (to - from) * (i + 0.5) / kSteps;
      thickness += (to - from) / kSteps / metric->at(Vec3(0.1, 0.2, 0.5 - z)).size_along(kZ);
    }
    EXPECT_NEAR(thickness, 1.0, 1e-5) << k;
    from = to;
  }
  EXPECT_NEAR(metric->at(Vec3(0.1, 0.2, 1.0)).size_along(kZ), 0.05, 1e-12);
  EXPECT_NEAR(metric->smallest(), 1e-3 * std::log(1.2) / 0.2, 1e-15);
}

TEST(AnalyticMetric, CircleInItsBox) {
  const auto metric = make_analytic_metric<2>("circle-bl");
  const Vec2 x = Vec2::UnitX(), y = Vec2::UnitY();
  const double h_min = 1.11e-4;  // the paper's, three digits
  const Vec2 wall(2.3, 1.375);
  EXPECT_NEAR(metric->at(wall).size_along(x) / (h_min * std::log(1.2) / 0.2), 1.0, 5e-3);
  EXPECT_NEAR(metric->at(wall).size_along(y) / std::sqrt(0.6 * h_min), 1.0, 5e-3);
  // Just inside the border of Box2 (0.3 from the wall) nearly H2, at the corners of the domain H1.
  EXPECT_NEAR(metric->at(Vec2(2.6, 1.375)).size_along(x), 0.05, 1e-6);
  EXPECT_NEAR(metric->at(Vec2(8.5, 0.0)).size_along(y), 0.5, 1e-9);
  EXPECT_NEAR(metric->at(Vec2(8.5, 2.75)).size_along(x), 0.5, 1e-9);
  // The centre lies deep below the three mirrored layers: H2.
  EXPECT_NEAR(metric->at(Vec2(2.0, 1.375)).size_along(x), 0.05, 1e-12);
}

TEST(AnalyticMetric, MildSphereInside) {
  // Three mirrored layers of 1e-3 x (1 + 1.2 + 1.44) = 3.64e-3; at 4.64e-3 below the wall 1e-3 beyond them.
  const double mirrored = 3.64e-3, start = 1e-3 * std::log(1.2) / 0.2;
  const double expected = start + std::log(1.2) * mirrored + std::log(1.5) * 1e-3;
  EXPECT_NEAR(size3("sphere-bl-mild", Vec3(1.3 - 4.64e-3, 0.75, 0.75), kX), expected, 1e-9);
  EXPECT_NEAR(size3("sphere-bl-mild", Vec3(1.3, 0.75, 0.75), kY), std::sqrt(0.6e-3 + 1e-6), 1e-9);
}

TEST(AnalyticMetric, SmallestIsABound) {
  for (const AnalyticName& name : analytic_names()) {
    if (name.dimension == 2) continue;
    const auto metric = make_analytic_metric<3>(name.name);
    double least = 1e300;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 u(std::fmod(0.8191725133961645 * i, 1.0), std::fmod(0.6710436067037893 * i, 1.0),
                   std::fmod(0.5497004779019703 * i, 1.0));
      const Vec3 x = metric->domain().lo + u.cwiseProduct(metric->domain().size());
      least = std::min(least, metric->frame(x).sizes.minCoeff());
    }
    EXPECT_GE(least, metric->smallest() * (1.0 - 1e-12)) << name.name;
  }
}

TEST(AnalyticMetric, NamesAndKeysAreChecked) {
  const auto message = [](const char* spec) -> std::string {
    try {
      make_analytic_metric<3>(spec);
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::kUsage) << spec;
      return e.what();
    }
    return "accepted";
  };
  EXPECT_NE(message("kube").find("known are iso, tilted-plane"), std::string::npos);
  EXPECT_NE(message("cube:H=1").find("its keys are half, hmin, H2, growth"), std::string::npos);
  for (const char* bad :
       {"cube:hmin", "cube:hmin=", "cube:hmin=1e-3x", "cube:hmin=nan", "cube:hmin=0", "cube:hmin=-1",
        "cube:,", "cube:hmin=1,hmin=1", "plane-bl:alpha=1", "circle-bl", ""})
    EXPECT_NE(message(bad), "accepted") << bad;
  EXPECT_EQ(message("cube:"), "accepted");
  EXPECT_EQ(analytic_dimension("circle-bl:R=0.2"), 2);
  for (const AnalyticName& name : analytic_names())
    EXPECT_NE(analytic_list().find(name.name), std::string::npos);
}

}  // namespace
}  // namespace lamina
