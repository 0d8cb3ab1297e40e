// How fast the wall metric changes from place to place, over real level sets: what no mesh could follow is a
// defect of the metric. (It stands here because core knows no bodies.)
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "core/wall_metric.h"
#include "tests/vdb/test_surfaces.h"
#include "vdb/level_set.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

using namespace testing_surfaces;

struct Growth {
  double p99, worst;  // factor per unit of metric length, along segments
};

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

// Segments of half a unit of length from points at all heights over the wall.
Growth measure(const Field& f, int count, Segments wanted = Segments::kOutside) {
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
  std::vector<double> growth;
  while (static_cast<int>(growth.size()) < count) {
    const auto t = static_cast<std::size_t>(
        std::lower_bound(area.begin(), area.end(), uniform(engine) * area.back()) - area.begin());
    const double a = std::sqrt(uniform(engine)), b = uniform(engine);
    const Vec3 foot = (1 - a) * corner(t, 0) + a * (1 - b) * corner(t, 1) + a * b * corner(t, 2);
    const Vec3 p = foot + h_min * std::pow(0.3 * extent / h_min, uniform(engine)) * any();
    const Metric<3> at_p = f.metric.at(p);
    const Vec3 q = p + 0.5 * (at_p.factor().inverse() * any());
    const bool p_inside = f.wall.phi(p) < 0.0, q_inside = f.wall.phi(q) < 0.0;
    if (wanted == Segments::kOutside ? p_inside || q_inside : p_inside == q_inside) continue;
    const Metric<3> at_q = f.metric.at(q);
    const Vec3 along = (q - p).normalized();
    const double ratio = std::abs(std::log(at_p.size_along(along) / at_q.size_along(along)));
    growth.push_back(std::exp(ratio / edge_length(p, at_p, q, at_q)));
  }
  std::sort(growth.begin(), growth.end());
  return {growth[growth.size() * 99 / 100], growth.back()};
}

Surface two_blocks(double gap) {
  return joined(box({-0.5, -0.5, -0.3}, {0.5, 0.5, 0.0}), box({-0.5, -0.5, gap}, {0.5, 0.5, gap + 0.3}));
}

// The wanted growth is 2 per element along the wall; where bodies have corners a cell may see twice that.
TEST(WallGradation, SizesNeverJump) {
  constexpr int kSegments = 20000;
  // The flat tip of the aerofoil ends between two edges that converge: which is nearer decides there.
  const std::map<std::string, double> worst = {{"cube", 6.0},      {"step", 6.0},  {"plate", 6.0},
                                               {"naca0012", 20.0}, {"ahmed", 8.0}, {"sphere", 3.0},
                                               {"cylinder", 4.0}};
  for (const auto& [name, most] : worst) {
    const Growth g = measure(Field(make_shape(name, {}), 1e-4), kSegments);
    EXPECT_LT(g.p99, 2.3) << name;
    EXPECT_LT(g.worst, most) << name;
  }
}

// Cells of both sides share the vertices on the wall.
TEST(WallGradation, SizesGoOnThroughTheWall) {
  for (const char* name : {"cube", "step", "ahmed", "cylinder"}) {
    const Growth g = measure(Field(make_shape(name, {}), 1e-4), 8000, Segments::kThroughTheWall);
    EXPECT_LT(g.p99, 2.5) << name;
    EXPECT_LT(g.worst, 8.0) << name;
  }
}

TEST(WallGradation, GapsAreFilledFromBothWalls) {
  const double delta = Field::layer(1e-4).top();
  for (const double gap : {3.0 * delta, delta, 0.2 * delta}) {
    const Field f(two_blocks(gap), 1e-4);
    const Growth g = measure(f, 10000);
    EXPECT_LT(g.p99, 2.3) << gap;
    EXPECT_LT(g.worst, 6.0) << gap;
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
