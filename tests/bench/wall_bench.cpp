// What the optimizer asks of the wall and of the metric, at points where it asks: seven of ten in the layers.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>

#include "core/hilbert.h"
#include "core/wall_metric.h"
#include "vdb/level_set.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

struct Scene {
  LevelSet wall;
  WallMetric metric;
  std::vector<Vec3> points;

  explicit Scene(Surface surface, std::size_t count = 10000, bool sorted = false)
      : wall(LevelSet::from_surface(std::move(surface), {})), metric(wall, layer(), sizes(wall.bounds())) {
    std::mt19937 engine(1);
    const auto uniform = [&] { return static_cast<double>(engine()) / 4294967296.0; };
    const Box<3> box = wall.bounds().padded(0.1);
    while (points.size() < count) {
      const Vec3 x = box.lo + Vec3(uniform(), uniform(), uniform()).cwiseProduct(box.size());
      const WallPoint at = wall.at(x);
      const double height = 0.03 * std::pow(uniform(), 3.0);
      points.push_back(points.size() % 10 < 7 ? Vec3(at.closest + height * at.N) : x);
    }
    if (!sorted) return;
    std::sort(points.begin(), points.end(),
              [&](const Vec3& a, const Vec3& b) { return hilbert_key<3>(a, box) < hilbert_key<3>(b, box); });
  }

  static BoundaryLayer layer() {
    Flow flow;
    flow.h_min = 1e-3;
    return resolve(flow, 1.0);
  }
  static SizeOptions sizes(const Box<3>& body) {
    SizeOptions s;
    s.h2 = 0.1;
    s.h1 = 0.5;
    s.box2 = body.padded(0.3);
    s.domain = body.padded(2.0);
    return s;
  }
};

Surface shape(const char* name, double facet = 0.0) {
  Surface surface = make_shape(name, {.facet = facet});
  clean(surface, name);
  return surface;
}

const Scene& ahmed() {
  static const Scene scene(shape("ahmed"));
  return scene;
}

// 97 k facets; points along a Hilbert curve, as the mesher asks.
const Scene& fine_ahmed() {
  static const Scene scene(shape("ahmed", 0.006), 100000, true);
  return scene;
}

template <class Query>
void run(benchmark::State& state, Query&& query, const Scene& scene = ahmed()) {
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(query(scene, scene.points[i]));
    i = i + 1 < scene.points.size() ? i + 1 : 0;
  }
}

void wall_phi(benchmark::State& state) {
  run(state, [](const Scene& s, const Vec3& x) { return s.wall.phi(x); });
}
BENCHMARK(wall_phi);

void wall_at(benchmark::State& state) {
  run(state, [](const Scene& s, const Vec3& x) { return s.wall.at(x); });
}
BENCHMARK(wall_at);

// With the search for the closest wall that comes before it.
void wall_at_and_others(benchmark::State& state) {
  run(state, [](const Scene& s, const Vec3& x) {
    std::array<WallPoint, 4> others;
    const WallPoint at = s.wall.at(x);
    return s.wall.others(x, at, std::abs(at.phi) + 0.1, others);
  });
}
BENCHMARK(wall_at_and_others);

void metric_at(benchmark::State& state) {
  run(state, [](const Scene& s, const Vec3& x) { return s.metric.at(x); });
}
BENCHMARK(metric_at);

void wall_at_fine(benchmark::State& state) {
  run(
      state, [](const Scene& s, const Vec3& x) { return s.wall.at(x); }, fine_ahmed());
}
BENCHMARK(wall_at_fine);

void metric_at_fine(benchmark::State& state) {
  run(
      state, [](const Scene& s, const Vec3& x) { return s.metric.at(x); }, fine_ahmed());
}
BENCHMARK(metric_at_fine);

}  // namespace
}  // namespace lamina
