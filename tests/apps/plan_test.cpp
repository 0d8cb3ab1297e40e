#include "apps/pipeline/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/parallel.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/shapes.h"
#include "vdb/surface_io.h"

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
    const double exact = radial_integral(metric, 0.5, 0.5 + metric.layer().top());
    EXPECT_NEAR(p.region_complexity[1] / exact, 1.0, 0.05) << h_min;
    EXPECT_LT(p.evaluations, 1000000);
  }
}

TEST(Plan, RegionsAddUp) {
  const Sphere sphere(0.5);
  const WallMetric metric(sphere, layer(1e-3, 10), sizes());
  const Prediction p = predict(metric);
  EXPECT_NEAR(p.region_cells[0] + p.region_cells[1] + p.region_cells[2] + p.region_cells[3], p.cells,
              1e-9 * p.cells);
  EXPECT_NEAR(p.points / p.cells, 1.0 / kCellsPerPoint, 1e-12);
  for (const double n : p.region_cells) EXPECT_GT(n, 0.0);
}

// The ground's layers hold h_min over a whole plane: only a column through them finds their count.
TEST(Plan, CountsTheLayersOfADomainFace) {
  const Sphere sphere(0.5);
  SizeOptions with = sizes();
  with.h1 = with.h2;
  with.walls[4] = true;
  const WallMetric metric(sphere, layer(1e-3, 10), with);
  const double above = predict(metric).complexity - predict(WallMetric(sphere, layer(1e-3, 10),
                                                                       [&] {
                                                                         SizeOptions s = with;
                                                                         s.walls.fill(false);
                                                                         return s;
                                                                       }()))
                                                        .complexity;
  // Over 4 x 4: cells of h2 x h2 x hn in the layers instead of h2^3, and in the growth above them.
  double layers = 0.0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double z = 2.0 * (i + 0.5) / kSteps;
    layers += (metric.at(Vec3(1.9, 1.9, -2.0 + z)).sqrt_det() - 1e3) * 2.0 / kSteps;
  }
  EXPECT_NEAR(above / (16.0 * layers), 1.0, 0.1);
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

Body body_of(const std::string& shape) {
  Surface surface = make_shape(shape, {});
  clean(surface, shape);
  return {.level_set = LevelSet::from_surface(std::move(surface), {})};
}

// At the settings of [Billon2016] the rounded front costs most, where its sharp edges follow an arc.
TEST(Plan, TheAhmedBodysFrontCornersCostMost) {
  const Body body = body_of("ahmed");
  SizeOptions s = sizes();
  s.h1 = 0.5;
  s.domain = {Vec3(-2, -1, 0), Vec3(8, 1, 1.5)};
  s.box2 = {Vec3(-0.3, -0.5, 0), Vec3(1.35, 0.5, 0.65)};
  const Prediction p = predict(WallMetric(body.level_set, layer(3.07e-5, 27), s), nullptr, kFineLeaves);
  double share = 0.0;
  for (const Spot& spot : p.spots) {
    EXPECT_LT(spot.place[0], 0.15);
    EXPECT_GT(std::abs(spot.place[1]), 0.1);
    EXPECT_EQ(spot.cause, Cause::kCurvedEdge);
    share += spot.cells / p.cells;
  }
  EXPECT_GT(share, 0.35);
}

TEST(Plan, SharpEdgesAndCornersAreTold) {
  const Body body = body_of("cube");
  const Prediction p = predict(WallMetric(body.level_set, layer(1e-4, 20), sizes()), nullptr, kFineLeaves);
  for (const Spot& spot : p.spots) {
    EXPECT_TRUE(spot.cause == Cause::kCorner || spot.cause == Cause::kSharpEdge) << cause_text(spot.cause);
    EXPECT_NEAR(spot.place.cwiseAbs().maxCoeff(), 0.25, 0.05);
  }
}

// A ball that reaches through a ground with layers of its own: where they meet, and nowhere else.
TEST(Plan, AnotherWallIsTold) {
  const Sphere sphere(0.5);
  SizeOptions s = sizes();
  s.domain.lo[2] = s.box2.lo[2] = -0.2;
  s.walls[4] = true;
  const Prediction p = predict(WallMetric(sphere, layer(1e-3, 20), s), nullptr, kFineLeaves);
  int told = 0;
  for (const Spot& spot : p.spots)
    if (spot.cause == Cause::kOtherWall) {
      ++told;
      EXPECT_NEAR(spot.place[2], -0.2, 0.08);
    }
  EXPECT_GT(told, 0);
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

/// Cells of a mesh of a shape, and how many were expected.
std::pair<double, double> made_and_expected(const std::string& shape) {
  const auto folder = std::filesystem::temp_directory_path() / ("lamina_plan_" + shape);
  std::filesystem::create_directories(folder);
  ShapeOptions options;
  options.facet = 0.1;
  write_stl(folder / "body.stl", make_shape(shape, options));
  Case c;
  c.body = folder / "body.stl";
  c.flow.h_min = 0.03;
  c.flow.layers = 4;
  c.h2 = 0.25;
  c.h1 = 0.5;
  c.domain = Box<3>{Vec3::Constant(-1.2), Vec3::Constant(1.4)};
  const Report report = run_case(c, nullptr);
  std::filesystem::remove_all(folder);
  return {static_cast<double>(report.cells()), report.expected_cells};
}

// Of a curved body the mesh is denser than its complexity says, of a sharp one hardly.
TEST(Plan, ForetellsRealMeshes) {
  for (const char* shape : {"sphere", "cube"}) {
    const auto [made, expected] = made_and_expected(shape);
    EXPECT_GT(made, 5000.0) << shape;
    EXPECT_NEAR(expected / made, 1.0, 0.15) << shape << ": " << expected << " expected, " << made << " made";
  }
}

/// The integral of sqrt(det M) over the domain by a point in each of n^3 cells.
double plain_integral(const WallMetric& metric, int n) {
  const Box<3>& box = metric.sizes().domain;
  testing_surfaces::Dice dice(3);
  double sum = 0.0;
  for (int i = 0; i < n * n * n; ++i) {
    const Vec3 cell(i % n, i / n % n, i / n / n);
    const Vec3 at = (cell + dice.point(Vec3::Zero(), Vec3::Ones())) / n;
    sum += metric.at(box.lo + at.cwiseProduct(box.size())).sqrt_det();
  }
  return sum * box.volume() / (n * n * n);
}

double predicted_over_plain(const Surface& surface) {
  const LevelSet wall = LevelSet::from_surface(surface, {});
  SizeOptions s = sizes();
  s.box2 = s.domain = {Vec3::Constant(-0.4), Vec3::Constant(0.4)};
  s.h1 = s.h2;
  const WallMetric metric(wall, layer(4e-3, 8), s);
  return predict(metric, nullptr, kFineLeaves).complexity / plain_integral(metric, 90);
}

TEST(Plan, IsUnbiasedWhereEdgesOfBothKindsMeet) {
  Surface star = testing_surfaces::sphere(0.3, 2);
  testing_surfaces::Dice dice(5);
  for (Vec3& p : star.points) p *= dice.uniform(0.5, 1.0);
  EXPECT_NEAR(predicted_over_plain(star), 1.0, 0.05);
}

/// The z axis as an edge that does not count as one standing out: a rim seen from inside the body, the
/// meeting of more than two facets.
class Wire : public WallField {
 public:
  [[nodiscard]] WallPoint at(const Vec3& x) const override {
    WallPoint p;
    p.phi = phi(x);
    p.closest = {0.0, 0.0, x[2]};
    p.N = p.phi > 0.0 ? Vec3((x - p.closest) / p.phi) : Vec3::UnitX();
    p.T1 = Vec3::UnitZ().cross(p.N);
    p.T2 = Vec3::UnitZ();
    p.edge_distance = 0.0;
    p.edge_direction = Vec3::UnitZ();
    p.edge_angle = 1.0;
    return p;
  }
  [[nodiscard]] double phi(const Vec3& x) const override { return std::hypot(x[0], x[1]); }
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  [[nodiscard]] Box<3> bounds() const override { return {Vec3(-0.01, -0.01, -2), Vec3(0.01, 0.01, 2)}; }
};

TEST(Plan, RaysFanOutFromEdgesThatDoNotStandOut) {
  const Wire wire;
  SizeOptions options = sizes();
  options.box2 = options.domain;
  const WallMetric metric(wire, layer(1e-4, 10), options);
  const double top = metric.layer().top();
  double exact = 0.0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double r = (i + 0.5) / kSteps * top;
    exact += 4.0 * 2.0 * M_PI * r * metric.at(Vec3(r, 0, 0)).sqrt_det() * top / kSteps;
  }
  EXPECT_NEAR(predict(metric).region_complexity[1] / exact, 1.0, 0.15);
}

// Where the leaves lie against the body changes nothing: no sample beside a corner weighs too much.
TEST(Plan, DoesNotDependOnTheDomain) {
  ShapeOptions options;
  Surface surface = make_shape("step", options);
  clean(surface, "step");
  LevelSetOptions voxels;
  voxels.voxel = 0.02;
  const Body body{.level_set = LevelSet::from_surface(std::move(surface), voxels)};
  const auto inside_and_layers = [&](double shift) {
    SizeOptions s = sizes();
    const Vec3 center = body.level_set.bounds().center();
    s.box2 = {center - Vec3::Constant(1.0), center + Vec3::Constant(1.0)};
    s.domain = {center - Vec3::Constant(2.0 + shift), center + Vec3::Constant(2.0 + 0.3 * shift)};
    const Prediction p = predict(WallMetric(body.level_set, layer(2e-4, 10), s), nullptr, kFineLeaves);
    return p.region_cells[0] + p.region_cells[1];
  };
  // Each draws other samples, with a standard deviation of some 4 %.
  std::vector<double> cells;
  for (const double shift : {0.0, 0.17, 0.29, 0.5}) cells.push_back(inside_and_layers(shift));
  const double mean = std::accumulate(cells.begin(), cells.end(), 0.0) / static_cast<double>(cells.size());
  for (const double c : cells) EXPECT_NEAR(c / mean, 1.0, 0.08);
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
