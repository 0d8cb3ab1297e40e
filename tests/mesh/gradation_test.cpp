// The law itself on isotropic sizes, where it is a line, and its properties on metrics of aspect ratios to
// 1e5 whose directions turn.
#include "mesh/gradation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
std::vector<Metric<D>> sizes_at(const Mesh<D>& mesh, auto&& size) {
  std::vector<Metric<D>> metric;
  for (const Vec<D>& x : mesh.points) metric.push_back(Metric<D>::isotropic(size(x)));
  return metric;
}

/// Sizes and directions without any order, aspect ratios to 1e5.
template <int D>
std::vector<Metric<D>> rough(const Mesh<D>& mesh) {
  std::vector<Metric<D>> metric;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Vec<D> sizes, n;
    for (int k = 0; k < D; ++k) {
      sizes[k] = std::pow(10.0, 2.5 * noise(i, static_cast<std::uint64_t>(k)) - 2.5);
      n[k] = noise(i, static_cast<std::uint64_t>(k) + 7);
    }
    const Mat<D> axes = Mat<D>::Identity() - 2.0 / n.squaredNorm() * n * n.transpose();  // a reflection
    metric.push_back(Metric<D>::from_frame(axes, sizes));
  }
  return metric;
}

/// The wall is the sphere (circle) of radius 1 around the origin.
constexpr double kGrowth = 1.2;

/// A patch of `n` layers over `n` chords each way along the wall, all about one unit long in the metric of
/// `layers`.
template <int D>
Mesh<D> patch(int n, double h_min) {
  Mesh<D> mesh = lattice<D>(n);
  const double chord = std::sqrt(h_min);
  for (Vec<D>& x : mesh.points) {
    const double height = h_min * (std::pow(kGrowth, n * x[0]) - 1.0) / (kGrowth - 1.0);
    Vec<D> direction = chord * n * x;
    direction[0] = 1.0;
    x = (1.0 + height) * direction.normalized();
  }
  return mesh;
}

/// Thin layers on the wall; along it a chord is off the wall by an eighth of a layer.
template <int D>
std::vector<Metric<D>> layers(const Mesh<D>& mesh, double h_min) {
  std::vector<Metric<D>> metric;
  for (const Vec<D>& x : mesh.points) {
    const Vec<D> n = x.normalized();
    const double hn = h_min + (kGrowth - 1.0) * std::abs(x.norm() - 1.0);
    Vec<D> sizes = Vec<D>::Constant(std::max(hn, std::sqrt(hn)));
    sizes[0] = hn;
    Mat<D> axes;
    axes.row(0) = n.transpose();
    if constexpr (D == 2) {
      axes.row(1) = Vec2(-n[1], n[0]).transpose();
    } else {
      axes.row(1) = n.unitOrthogonal().transpose();
      axes.row(2) = n.cross(Vec3(axes.row(1))).transpose();
    }
    metric.push_back(Metric<D>::from_frame(axes, sizes));
  }
  return metric;
}

template <int D>
bool same(const std::vector<Metric<D>>& a, const std::vector<Metric<D>>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), sizeof(Metric<D>) * a.size()) == 0;
}

template <class T>
class Gradation : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(Gradation, Dimensions);

// One small size among large ones. Along an axis the sizes are those of the chain of its vertices, each
// h + |e| ln b from the one before; off it no path is shorter than |x - x0| or longer than the sum of the
// axes.
TYPED_TEST(Gradation, OnePointSpreads) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(8);
  const double h = 0.01, bound = 1.5, rate = std::log(bound);
  auto metric = sizes_at<D>(mesh, [&](const Vec<D>& x) { return x.isZero() ? h : 10.0; });
  gradate<D>(mesh, metric, bound);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vec<D>& x = mesh.points[i];
    const double size = metric[i].size_along(Vec<D>::Unit(D - 1));
    EXPECT_GE(size, (h + rate * x.norm()) * (1.0 - 1e-9));
    EXPECT_LE(size, (h + rate * x.template lpNorm<1>()) * 1.02);
    EXPECT_NEAR(metric[i].size_along(Vec<D>::Unit(0)), size, 1e-9 * size) << "isotropic stays isotropic";
  }
}

TYPED_TEST(Gradation, BoundHoldsAlongEveryEdge) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(D == 2 ? 24 : 8, 0.1);
  for (const double bound : {1.2, 2.0}) {
    const std::vector<Metric<D>> before = rough<D>(mesh);
    ASSERT_GT(gradation_excess<D>(mesh, before, bound), 10.0);
    std::vector<Metric<D>> metric = before;
    gradate<D>(mesh, metric, bound);
    EXPECT_LE(gradation_excess<D>(mesh, metric, bound), 1.0 + 2e-3) << bound;
    for (std::size_t i = 0; i < metric.size(); ++i) {
      for (std::uint64_t k = 0; k < 20; ++k) {
        Vec<D> d;
        for (int j = 0; j < D; ++j) d[j] = noise(i + 1000 * k, static_cast<std::uint64_t>(j));
        d.normalize();
        EXPECT_LE(metric[i].size_along(d), before[i].size_along(d) * (1.0 + 1e-9)) << "no size grows";
      }
    }
    const std::vector<Metric<D>> once = metric;
    EXPECT_EQ(gradate<D>(mesh, metric, bound), 1);
    EXPECT_TRUE(same<D>(once, metric)) << "a second time changes nothing";
  }
}

TYPED_TEST(Gradation, SmoothMetricsAreLeftAlone) {
  constexpr int D = TypeParam::value;
  for (const double h_min : {1e-4, 1e-6, 1e-9}) {  // aspect ratios 100 to 3e4
    const Mesh<D> mesh = patch<D>(10, h_min);
    const std::vector<Metric<D>> before = layers<D>(mesh, h_min);
    std::vector<Metric<D>> metric = before;
    gradate<D>(mesh, metric, 1.5);
    EXPECT_TRUE(same<D>(before, metric)) << h_min << ": " << gradation_excess<D>(mesh, before, 1.5);
  }
}

TYPED_TEST(Gradation, SameBitsForEveryThreadCount) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(D == 2 ? 40 : 12, 0.1);
  const auto run = [&](int threads) {
    const ThreadLimit limit(threads);
    std::vector<Metric<D>> metric = rough<D>(mesh);
    gradate<D>(mesh, metric, 1.5);
    return metric;
  };
  const auto expected = run(1);
  for (const int threads : {2, 3, 8}) EXPECT_TRUE(same<D>(expected, run(threads))) << threads;
}

TYPED_TEST(Gradation, RefusesWhatItCannotUse) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(2);
  std::vector<Metric<D>> metric(mesh.points.size());
  EXPECT_THROW(gradate<D>(mesh, metric, 1.0), Error);
  metric.pop_back();
  EXPECT_THROW(gradate<D>(mesh, metric, 1.5), Error);
}

}  // namespace
}  // namespace lamina
