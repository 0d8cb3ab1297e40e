// How fast the wall metric changes from place to place, over real level sets: what no mesh could follow is a
// defect of the metric. (It stands here because core knows no bodies.)
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "core/wall_metric.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/level_set.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

using namespace testing_surfaces;

struct Growth {
  double p99, worst;          // factor per unit of metric length, of the size along the segment
  double any_p99, any_worst;  // of the size in the direction where it is largest
};

using Keep = bool(const Vec3& foot);
constexpr Keep* kAnywhere = [](const Vec3&) { return true; };

struct Field {
  Surface surface;
  LevelSet wall;
  WallMetric metric;
  Field(const Surface& s, double h_min)
      : surface(s), wall(LevelSet::from_surface(s, {})), metric(wall, layer(h_min), sizes()) {}
  static BoundaryLayer layer(double h_min) {
    Flow flow;
    flow.h_min = h_min;
    flow.layers = 20;
    return resolve(flow, 1.0);
  }
  [[nodiscard]] SizeOptions sizes() const {
    const double extent = wall.bounds().size().maxCoeff();
    SizeOptions o;
    o.h2 = 0.1 * extent;
    o.h1 = 0.5 * extent;
    o.domain = wall.bounds().padded(2.0 * extent);
    o.box2 = wall.bounds().padded(0.3 * extent);
    o.profile = Profile::kContinuous;  // the steps of the layers are wanted
    return o;
  }
};

enum class Segments { kOutside, kThroughTheWall };

// Factor by which a size grows from one metric to another, in the direction where it does most.
double largest_ratio(const Metric<3>& from, const Metric<3>& to) {
  const Vec3 sizes = Eigen::JacobiSVD<Mat3>(to.factor() * from.factor().inverse()).singularValues();
  return std::max(sizes[0], 1.0 / sizes[2]);
}

// Segments of half a unit of length from points at all heights over the parts of the wall to keep.
Growth measure(const Field& f, int count, Segments wanted = Segments::kOutside, Keep* keep = kAnywhere) {
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> normal;
  const double extent = f.wall.bounds().size().maxCoeff(), h_min = f.metric.layer().h_min;
  const auto any = [&] { return Vec3(normal(engine), normal(engine), normal(engine)).normalized(); };
  std::vector<double> area;
  const auto corner = [&](std::size_t t, std::size_t k) -> const Vec3& {
    return f.surface.points[static_cast<std::size_t>(f.surface.triangles[t][k])];
  };
  for (std::size_t t = 0; t < f.surface.triangles.size(); ++t)
    area.push_back((area.empty() ? 0.0 : area.back()) +
                   (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm());
  std::vector<double> growth, any_growth;
  while (static_cast<int>(growth.size()) < count) {
    const auto t = static_cast<std::size_t>(
        std::lower_bound(area.begin(), area.end(), uniform(engine) * area.back()) - area.begin());
    const double a = std::sqrt(uniform(engine)), b = uniform(engine);
    const Vec3 foot = (1 - a) * corner(t, 0) + a * (1 - b) * corner(t, 1) + a * b * corner(t, 2);
    if (!keep(foot)) continue;
    const Vec3 p = foot + h_min * std::pow(0.3 * extent / h_min, uniform(engine)) * any();
    const Metric<3> at_p = f.metric.at(p);
    const Vec3 q = p + 0.5 * (at_p.factor().inverse() * any());
    const bool p_inside = f.wall.phi(p) < 0.0, q_inside = f.wall.phi(q) < 0.0;
    if (wanted == Segments::kOutside ? p_inside || q_inside : p_inside == q_inside) continue;
    const Metric<3> at_q = f.metric.at(q);
    const Vec3 along = (q - p).normalized();
    const double ratio = std::abs(std::log(at_p.size_along(along) / at_q.size_along(along)));
    const double length = edge_length(p, at_p, q, at_q);
    growth.push_back(std::exp(ratio / length));
    any_growth.push_back(std::pow(largest_ratio(at_p, at_q), 1.0 / length));
  }
  std::sort(growth.begin(), growth.end());
  std::sort(any_growth.begin(), any_growth.end());
  const std::size_t p99 = growth.size() * 99 / 100;
  return {growth[p99], growth.back(), any_growth[p99], any_growth.back()};
}

Surface two_blocks(double gap) {
  return joined(box({-0.5, -0.5, -0.3}, {0.5, 0.5, 0.0}), box({-0.5, -0.5, gap}, {0.5, 0.5, gap + 0.3}));
}

// A block with a concave fillet between sharp edges and a slanted top: what a fan disk is made of.
Surface fan_disk() {
  constexpr int kArc = 40;
  std::vector<Vec2> p{{0.0, 0.0}, {1.0, 0.0}};
  for (int i = 0; i <= kArc; ++i) {
    const double a = -0.5 * std::numbers::pi * (1.0 + static_cast<double>(i) / kArc);
    p.emplace_back(1.0 + 0.5 * std::cos(a), 0.8 + 0.5 * std::sin(a));
  }
  p.emplace_back(0.5, 1.0);
  p.emplace_back(0.0, 0.8);
  std::vector<std::array<Index, 3>> fill;
  for (Index i = 1; i + 1 < static_cast<Index>(p.size()); ++i) fill.push_back({0, i, i + 1});
  return prism(p, fill, 0.5);
}

// A channel that turns by 90 degrees along the y axis: a step and a block in it.
Surface channel(double gap) {
  const std::vector<Vec2> p{{-0.3, -0.3}, {1.0, -0.3}, {1.0, 0.0}, {0.0, 0.0}, {0.0, 1.0}, {-0.3, 1.0}};
  return joined(prism(p, {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 1.0),
                box({gap, 0.0, gap}, {1.0, 1.0, 1.0}));
}

// The wanted growth is 2 per element along the wall. A direction in general sees more where a curved wall
// turns the metric: the chord of [eq. 29] turns by as much as it is long, on a sphere a factor of 3.
TEST(WallGradation, SizesNeverJump) {
  constexpr int kSegments = 20000;
  struct Bounds {
    double worst, any_p99, any_worst;
  };
  const std::map<std::string, Bounds> bounds = {
      {"cube", {2.1, 2.05, 2.5}},     {"step", {2.5, 2.1, 6.0}},  {"plate", {2.1, 2.05, 2.5}},
      {"naca0012", {4.5, 2.75, 6.0}}, {"ahmed", {3.3, 2.5, 6.5}}, {"sphere", {2.3, 2.8, 3.2}},
      {"cylinder", {3.0, 2.6, 4.2}},
  };
  for (const auto& [name, most] : bounds) {
    const Growth g = measure(Field(make_shape(name, {}), 1e-4), kSegments);
    EXPECT_LT(g.p99, 2.05) << name;
    EXPECT_LT(g.worst, most.worst) << name;
    EXPECT_LT(g.any_p99, most.any_p99) << name;
    EXPECT_LT(g.any_worst, most.any_worst) << name;
  }
}

TEST(WallGradation, PartsPlatesAndTrailingEdgesDoNotJump) {
  constexpr int kSegments = 10000;
  const double delta = Field::layer(1e-4).top();
  const auto check = [](const char* name, const Growth& g, double worst, double any_p99, double any_worst) {
    EXPECT_LT(g.p99, 2.05) << name;
    EXPECT_LT(g.worst, worst) << name;
    EXPECT_LT(g.any_p99, any_p99) << name;
    EXPECT_LT(g.any_worst, any_worst) << name;
  };
  check("fan disk", measure(Field(fan_disk(), 1e-4), kSegments), 3.0, 2.5, 4.5);
  check("thin plate", measure(Field(box({0, 0, 0}, {1.0, 0.2, 0.2 * delta}), 1e-4), kSegments), 2.1, 2.05,
        2.5);
  const auto trailing_edge = [](const Vec3& foot) { return foot[0] > 0.97 && std::abs(foot[1]) < 0.099; };
  check("trailing edge",
        measure(Field(make_shape("naca0012", {}), 1e-4), kSegments, Segments::kOutside, trailing_edge), 2.6,
        2.2, 3.0);
}

// Curvatures that pass through zero: without a bound on their fall sizes grow by 87 on the ball, by 6 on the
// torus.
TEST(WallGradation, SizesFollowCurvaturesThroughZero) {
  constexpr int kSegments = 10000;
  const Growth torus = measure(Field(make_shape("torus", {}), 1e-4), kSegments);
  EXPECT_LT(torus.p99, 2.25);
  EXPECT_LT(torus.worst, 3.6);
  EXPECT_LT(torus.any_p99, 3.2);
  EXPECT_LT(torus.any_worst, 8.0);
  Surface ball = sphere(0.5, 80);
  for (Vec3& p : ball.points)
    p *= 1.0 + 0.1 * std::sin(10 * p[0]) * std::sin(10 * p[1] + 1) * std::sin(10 * p[2] + 2);
  const Growth waves = measure(Field(ball, 1e-4), kSegments);
  EXPECT_LT(waves.p99, 2.65);
  EXPECT_LT(waves.worst, 3.6);
  EXPECT_LT(waves.any_p99, 3.35);
  EXPECT_LT(waves.any_worst, 5.3);
}

TEST(WallGradation, ATurningChannelMeetsTheSizesOfBothItsWalls) {
  const double delta = Field::layer(1e-4).top();
  for (const double gap : {3.0 * delta, delta, 0.2 * delta}) {
    const Field f(channel(gap), 1e-4);
    const Growth g = measure(f, 10000, Segments::kOutside, [](const Vec3& foot) {
      return foot[0] > -1e-9 && foot[0] < 0.2 && foot[2] > -1e-9 && foot[2] < 0.2;
    });
    EXPECT_LT(g.p99, 2.0) << gap;
    EXPECT_LT(g.worst, 2.4) << gap;
    EXPECT_LT(g.any_p99, 2.05) << gap;
    EXPECT_LT(g.any_worst, 6.0) << gap;
    for (const double share : {0.02, 0.1, 0.3, 0.45}) {
      const double t = share * gap;
      const Vec3 x(t, 0.5, t);  // on the bisector of the concave corner
      const Metric<3> m = f.metric.at(x);
      const double wanted = f.metric.normal_size(x, t);
      EXPECT_LE(m.size_along(Vec3::UnitX()), 1.001 * wanted) << gap << " " << share;
      EXPECT_LE(m.size_along(Vec3::UnitZ()), 1.001 * wanted) << gap << " " << share;
      for (const double off : {-1e-9, 1e-9}) {
        const Metric<3> beside = f.metric.at(x + Vec3(off, 0.0, 0.0));
        EXPECT_LT(largest_ratio(m, beside), 1.001) << gap << " " << share;
      }
    }
  }
}

// Cells of both sides share the vertices on the wall. Inside, chords of a curved wall stray by less.
TEST(WallGradation, SizesGoOnThroughTheWall) {
  const std::map<std::string, double> worst = {
      {"cube", 2.1}, {"step", 2.1}, {"ahmed", 3.0}, {"cylinder", 3.0}};
  for (const auto& [name, most] : worst) {
    const Growth g = measure(Field(make_shape(name, {}), 1e-4), 8000, Segments::kThroughTheWall);
    EXPECT_LT(g.p99, 2.1) << name;
    EXPECT_LT(g.worst, most) << name;
  }
}

TEST(WallGradation, GapsAreFilledFromBothWalls) {
  const double delta = Field::layer(1e-4).top();
  for (const double gap : {3.0 * delta, delta, 0.2 * delta}) {
    const Field f(two_blocks(gap), 1e-4);
    const Growth g = measure(f, 10000);
    EXPECT_LT(g.p99, 2.0) << gap;
    EXPECT_LT(g.worst, 2.4) << gap;
    EXPECT_LE(f.metric.at({0.1, 0.1, 0.5 * gap}).size_along(Vec3::UnitZ()), 0.25 * gap) << gap;
    for (const double z : {0.5e-4, gap - 0.5e-4})
      EXPECT_NEAR(f.metric.at({0.1, 0.1, z}).size_along(Vec3::UnitZ()), 1e-4, 0.25e-4) << gap;
    const Metric<3> below = f.metric.at({0.1, 0.1, 0.5 * gap - 1e-9}),
                    above = f.metric.at({0.1, 0.1, 0.5 * gap + 1e-9});
    for (const Vec3& d : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0.6, 0, 0.8)})
      EXPECT_NEAR(below.size_along(d) / above.size_along(d), 1.0, 1e-4) << gap;
  }
}

}  // namespace
}  // namespace lamina
