// Meshes of right columns on flat layers, where every number is known.
#include "mesh/layer_score.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

// Layers of thickness h on both sides of the plane x_last = 1/2, and size h along it.
template <int D>
class Even : public AdaptMetric<D> {
 public:
  explicit Even(double h, int levels = 1000) : h_(h), levels_(levels) {}
  Metric<D> at(const Vec<D>&, double) const override { return Metric<D>::isotropic(h_); }
  std::optional<Level<D>> level(const Vec<D>& x, double) const override {
    const double k = std::round((x[D - 1] - 0.5) / h_);
    if (std::abs(k) > levels_) return std::nullopt;
    Level<D> l;
    l.number = static_cast<int>(k);
    l.normal = Vec<D>::Unit(D - 1);
    l.way = (0.5 + k * h_ - x[D - 1]) * l.normal;
    l.metric = at(x, 0.0);
    return l;
  }
  std::optional<double> wall_distance(const Vec<D>& x) const override { return x[D - 1] - 0.5; }

 private:
  double h_;
  int levels_;
};

template <class T>
class LayerScoreOf : public testing::Test {};
template <int D>
struct Dim {
  static constexpr int value = D;
};
using Dimensions = testing::Types<Dim<2>, Dim<3>>;
TYPED_TEST_SUITE(LayerScoreOf, Dimensions);

template <int D>
LayerScore judged(const Mesh<D>& mesh, const AdaptMetric<D>& field, std::vector<double>* offsets = nullptr) {
  std::vector<Metric<D>> metric;
  for (const Vec<D>& x : mesh.points) metric.push_back(field.at(x, 0.0));
  return score_layers<D>(mesh, metric, field, wall_distances<D>(mesh, field), offsets);
}

TYPED_TEST(LayerScoreOf, SquareColumnsOnTheirLevels) {
  constexpr int D = TypeParam::value;
  constexpr int n = 8, side = n + 1;
  const LayerScore s = judged<D>(lattice<D>(n), Even<D>(1.0 / n));
  EXPECT_EQ(s.dimension, D);
  EXPECT_EQ(s.points, D == 2 ? side * side : side * side * side);
  EXPECT_EQ(s.on_level, s.points);
  EXPECT_EQ(s.on_wall, D == 2 ? side : side * side);
  EXPECT_NEAR(s.mean_offset, 0.0, 1e-13);
  // A wall of area 1 at size 1/n; the Kuhn lattice has squares of side 1/n where triangles would be ideal.
  EXPECT_NEAR(s.ideal_on_wall, D == 2 ? n : n * n * 2.0 / std::sqrt(3.0), 1e-9);
  // Aligned: along the axes, and in 3D the diagonals within a level.
  const int axes = D == 2 ? 2 * n * side : 3 * n * side * side;
  const int level_diagonals = D == 2 ? 0 : n * n * side;
  const int other_diagonals = D == 2 ? n * n : 2 * n * n * side + n * n * n;
  EXPECT_EQ(s.edges, axes + level_diagonals + other_diagonals);
  EXPECT_EQ(s.aligned, axes + level_diagonals);
}

TYPED_TEST(LayerScoreOf, OffsetsOfALatticeBetweenTheLevels) {
  constexpr int D = TypeParam::value;
  constexpr int n = 8;
  Mesh<D> mesh = lattice<D>(n);
  for (Vec<D>& x : mesh.points) x[D - 1] += 0.25 / n;
  std::vector<double> offsets;
  const LayerScore s = judged<D>(mesh, Even<D>(1.0 / n), &offsets);
  EXPECT_EQ(s.on_level, 0);
  EXPECT_EQ(s.on_wall, 0);
  EXPECT_NEAR(s.mean_offset, 0.25, 1e-12);
  for (const double o : offsets) EXPECT_NEAR(o, 0.25, 1e-12);
  // The wall runs through cells now, and is no larger for that.
  EXPECT_NEAR(s.ideal_on_wall, D == 2 ? n : n * n * 2.0 / std::sqrt(3.0), 1e-9);
}

TYPED_TEST(LayerScoreOf, LooksAtLayersOnly) {
  constexpr int D = TypeParam::value;
  constexpr int n = 8, side = n + 1;
  std::vector<double> offsets;
  const LayerScore s = judged<D>(lattice<D>(n), Even<D>(1.0 / n, 1), &offsets);
  EXPECT_EQ(s.points, 3 * (D == 2 ? side : side * side));
  EXPECT_EQ(std::count(offsets.begin(), offsets.end(), -1.0), static_cast<int>(offsets.size()) - s.points);
}

TYPED_TEST(LayerScoreOf, NoWallNoLayers) {
  constexpr int D = TypeParam::value;
  class Plain : public AdaptMetric<D> {
   public:
    Metric<D> at(const Vec<D>&, double) const override { return {}; }
  };
  EXPECT_TRUE(wall_distances<D>(lattice<D>(2), Plain()).empty());
}

TYPED_TEST(LayerScoreOf, SameBitsForEveryThreadCount) {
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = lattice<D>(D == 2 ? 120 : 24, 0.1);
  const Even<D> field(0.03);
  const LayerScore expected = judged<D>(mesh, field);
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    const LayerScore s = judged<D>(mesh, field);
    EXPECT_EQ(s.mean_offset, expected.mean_offset) << threads;
    EXPECT_EQ(s.ideal_on_wall, expected.ideal_on_wall) << threads;
    EXPECT_EQ(s.aligned, expected.aligned) << threads;
  }
}

class Ball : public AdaptMetric<3> {
 public:
  Metric<3> at(const Vec3& x, double) const override {
    const Vec3 n = x.normalized(), t = n.unitOrthogonal();
    Mat3 axes;
    axes << n.transpose(), t.transpose(), n.cross(t).transpose();
    return Metric<3>::from_frame(axes, {kLayer, kAlong, kAlong});
  }
  std::optional<Level<3>> level(const Vec3& x, double) const override {
    Level<3> l;
    l.number = static_cast<int>(std::round((x.norm() - 1.0) / kLayer));
    l.normal = x.normalized();
    l.way = (1.0 + l.number * kLayer - x.norm()) * l.normal;
    l.metric = at(x, 0.0);
    return l;
  }
  std::optional<double> wall_distance(const Vec3& x) const override { return x.norm() - 1.0; }
  static constexpr double kLayer = 1e-3, kAlong = 0.0447;  // sqrt(2 R layer)
};

// On a sphere of radius R the chord between vertices of a level dips into the layer below by as much as a
// layer is thick: that is no slant. Three vertices of a level, and one above the first.
TEST(LayerScore, ChordsOfACurvedLevelAreTangential) {
  const Ball field;
  Mesh<3> mesh;
  mesh.points = {Vec3(1, 0, 0), Vec3(1, Ball::kAlong, 0).normalized(), Vec3(1, 0, Ball::kAlong).normalized(),
                 Vec3(1.0 + Ball::kLayer, 0, 0)};
  mesh.cells = {{0, 1, 2, 3}};
  const LayerScore s = judged<3>(mesh, field);
  EXPECT_EQ(s.points, 4);
  EXPECT_EQ(s.on_level, 4);
  EXPECT_EQ(s.on_wall, 3);
  EXPECT_EQ(s.edges, 6);
  EXPECT_EQ(s.aligned, 4);  // three along the level and one along the normal
}

}  // namespace
}  // namespace lamina
