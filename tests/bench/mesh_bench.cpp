// The inner loop of the optimizer, and the optimizer on a plane layer.
#include <benchmark/benchmark.h>

#include "core/parallel.h"
#include "mesh/adapt.h"
#include "mesh/seed.h"

namespace lamina {
namespace {

Metric<3> thin(double h) {
  Mat3 axes;
  axes.row(0) = Vec3(0.3, 0.2, 1.0).normalized();
  axes.row(1) = axes.row(0).cross(Vec3(1, 0, 0)).normalized();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return Metric<3>::from_frame(axes, Vec3(h, 0.1, 0.1));
}

void quality_of_a_cell(benchmark::State& state) {
  const Metric<3> m = thin(1e-4);
  const std::array<Vec3, 4> x{Vec3(0, 0, 0), Vec3(0.1, 0, 0), Vec3(0, 0.1, 0), Vec3(0.03, 0.03, 1e-4)};
  const std::array<const Vec3*, 4> p{&x[0], &x[1], &x[2], &x[3]};
  for (auto _ : state) benchmark::DoNotOptimize(mean_ratio<3>(p, m));
}
BENCHMARK(quality_of_a_cell);

void intersection_of_metrics(benchmark::State& state) {
  const Metric<3> a = thin(1e-4), b = Metric<3>::from_frame(Mat3::Identity(), Vec3(0.1, 1e-3, 0.05));
  for (auto _ : state) benchmark::DoNotOptimize(intersect(a, b));
}
BENCHMARK(intersection_of_metrics);

struct PlaneLayer : AdaptMetric<3> {
  [[nodiscard]] Metric<3> at(const Vec3& x, double size_floor) const override {
    const double h = std::min(0.1, 1e-3 + 0.2 * std::abs(x[2] - 0.5));
    return Metric<3>::from_frame(Mat3::Identity(), Vec3(0.1, 0.1, std::max(h, size_floor)));
  }
};

void adapt_plane_layer(benchmark::State& state) {
  const ThreadLimit limit(static_cast<int>(state.range(0)));
  Box<3> box;
  box.lo = Vec3::Zero();
  box.hi = Vec3::Ones();
  const Mesh<3> seed = make_seed<3>(box, 0.1, SeedKind::kLattice);
  AdaptOptions options;
  options.start_size = 0.1;
  options.end_size = 1e-3;
  std::size_t cells = 0;
  for (auto _ : state) {
    Mesh<3> mesh = seed;
    std::vector<Metric<3>> metric;
    adapt<3>(mesh, PlaneLayer(), metric, options);
    cells = mesh.cells.size();
  }
  state.counters["cells"] = static_cast<double>(cells);
}
BENCHMARK(adapt_plane_layer)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lamina
