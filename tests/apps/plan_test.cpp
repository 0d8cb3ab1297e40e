#include "apps/pipeline/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/parallel.h"

namespace lamina {
namespace {

/// The exact sphere of radius R at the origin.
class Sphere : public WallField {
 public:
  explicit Sphere(double radius) : radius_(radius) {}
  [[nodiscard]] WallPoint at(const Vec3& x) const override {
    WallPoint p;
    p.phi = phi(x);
    p.N = x.norm() > 0.0 ? Vec3(x.normalized()) : Vec3::UnitX();
    p.closest = radius_ * p.N;
    p.T1 = p.N.unitOrthogonal();
    p.T2 = p.N.cross(p.T1);
    p.k1 = p.k2 = 1.0 / radius_;
    return p;
  }
  [[nodiscard]] double phi(const Vec3& x) const override { return x.norm() - radius_; }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  [[nodiscard]] Box<3> bounds() const override { return {Vec3::Constant(-radius_), Vec3::Constant(radius_)}; }

 private:
  double radius_;
};

BoundaryLayer layer(double h_min, int layers) {
  BoundaryLayer b;
  b.h_min = h_min;
  b.layers = layers;
  b.delta = b.top();
  return b;
}

SizeOptions sizes() {
  SizeOptions s;
  s.h2 = 0.1;
  s.h1 = 0.3;
  s.domain = {Vec3(-2, -2, -2), Vec3(2, 2, 2)};
  s.box2 = {Vec3(-1, -1, -1), Vec3(1, 1, 1)};
  return s;
}

/// The integral of sqrt(det M) between the radii a and b, by the rotational symmetry of the layers.
double radial_integral(const WallMetric& metric, double a, double b) {
  constexpr int kSteps = 200000;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double r = a + (i + 0.5) / kSteps * (b - a);
    sum += 4.0 * M_PI * r * r * metric.at(Vec3(r, 0, 0)).sqrt_det();
  }
  return sum * (b - a) / kSteps;
}

TEST(Plan, CountsOfTheLayersOfASphereMatchTheRadialIntegral) {
  const Sphere sphere(0.5);
  for (const double h_min : {1e-2, 1e-3, 1e-5}) {
    const WallMetric metric(sphere, layer(h_min, 10), sizes());
    const Prediction p = predict(metric);
    const double exact = kCellsPerComplexity * radial_integral(metric, 0.5, 0.5 + metric.layer().top());
    EXPECT_NEAR(p.region_cells[1] / exact, 1.0, 0.05) << h_min;
    EXPECT_LT(p.evaluations, 1000000);
  }
}

TEST(Plan, RegionsAddUp) {
  const Sphere sphere(0.5);
  const WallMetric metric(sphere, layer(1e-3, 10), sizes());
  const Prediction p = predict(metric);
  EXPECT_NEAR(p.region_cells[0] + p.region_cells[1] + p.region_cells[2] + p.region_cells[3], p.cells,
              1e-9 * p.cells);
  EXPECT_NEAR(p.points / p.cells, kPointsPerComplexity / kCellsPerComplexity, 1e-12);
  for (const double n : p.region_cells) EXPECT_GT(n, 0.0);
}

// The ground's layers hold h_min over a whole plane: only a column through them finds their count.
TEST(Plan, CountsTheLayersOfADomainFace) {
  const Sphere sphere(0.5);
  SizeOptions with = sizes();
  with.h1 = with.h2;
  with.walls[4] = true;
  const WallMetric metric(sphere, layer(1e-3, 10), with);
  const double above = predict(metric).cells - predict(WallMetric(sphere, layer(1e-3, 10),
                                                                  [&] {
                                                                    SizeOptions s = with;
                                                                    s.walls.fill(false);
                                                                    return s;
                                                                  }()))
                                                   .cells;
  // Over 4 x 4: cells of h2 x h2 x hn in the layers instead of h2^3, and in the growth above them.
  double layers = 0.0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double z = 2.0 * (i + 0.5) / kSteps;
    layers += (metric.at(Vec3(1.9, 1.9, -2.0 + z)).sqrt_det() - 1e3) * 2.0 / kSteps;
  }
  EXPECT_NEAR(above / (kCellsPerComplexity * 16.0 * layers), 1.0, 0.1);
}

TEST(Plan, CostlySpotsAreSortedAndTellTheCause) {
  const Sphere sphere(0.5);
  const Prediction p = predict(WallMetric(sphere, layer(1e-3, 10), sizes()));
  ASSERT_EQ(p.spots.size(), 5U);
  double sum = 0.0;
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(p.spots[i].cause, Cause::kCurvature);
    EXPECT_NEAR(p.spots[i].place.norm(), 0.5, 0.1);
    EXPECT_LE(p.spots[i].cells, p.spots[i == 0 ? 0 : i - 1].cells);
    sum += p.spots[i].cells;
  }
  EXPECT_LT(sum, p.cells);
  EXPECT_GT(sum, 0.01 * p.cells);
}

TEST(Plan, SameBitsForEveryThreadCount) {
  const Sphere sphere(0.5);
  const WallMetric metric(sphere, layer(1e-3, 10), sizes());
  std::vector<double> cells;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    cells.push_back(predict(metric).cells);
  }
  for (const double c : cells) EXPECT_EQ(c, cells.front());
}

TEST(Plan, TableListsEveryLayer) {
  ResolvedCase r;
  r.layer = layer(1e-3, 4);
  r.sizes = sizes();
  const auto json = nlohmann::json::parse(plan_json(r, Prediction()));
  ASSERT_EQ(json["layers"].size(), 4U);
  EXPECT_DOUBLE_EQ(json["layers"][0]["height"], 1e-3);
  EXPECT_DOUBLE_EQ(json["layers"][1]["size"], 1.2e-3);
  EXPECT_DOUBLE_EQ(json["layers"][3]["height"], r.layer.top());
  EXPECT_NE(plan_text(r, Prediction()).find("4 layers"), std::string::npos);
}

}  // namespace
}  // namespace lamina
