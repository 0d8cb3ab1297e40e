// Parabolas, which the fit must give back exactly; a stretched mesh; and the metric by its own laws.
#include "mesh/hessian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/score.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
Mat<D> some_symmetric() {
  Mat<D> h;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j <= i; ++j) h(i, j) = h(j, i) = i == j ? 2.0 - 3.0 * i : 0.5 + i;
  return h;
}

template <int D, class F>
std::vector<double> sampled(const Mesh<D>& mesh, F&& f) {
  std::vector<double> values;
  for (const Vec<D>& x : mesh.points) values.push_back(f(x));
  return values;
}

/// Largest difference from `wanted` in the space where the mesh is a lattice of cubes of size 1.
template <int D>
void expect_parabola(const Vec<D>& stretch) {
  Mesh<D> mesh = lattice<D>(6, 0.15);
  for (Vec<D>& x : mesh.points) x = x.cwiseProduct(stretch);
  const Mat<D> unit = some_symmetric<D>();
  const Mat<D> h =
      stretch.cwiseInverse().asDiagonal() * unit * stretch.cwiseInverse().asDiagonal();  // values of order 1
  const std::vector<Sym<D>> found = recover_hessian<D>(
      mesh, sampled<D>(mesh, [&](const Vec<D>& x) { return 3.0 + x[0] / stretch[0] + 0.5 * x.dot(h * x); }));
  for (std::size_t v = 0; v < found.size(); ++v) {
    const Mat<D> back = stretch.asDiagonal() * to_matrix<D>(found[v]) * stretch.asDiagonal();
    ASSERT_LT((back - unit).norm(), 1e-9) << "vertex " << v;
  }
}

TEST(Hessian, ParabolasAreGivenBackOnTheBoundaryToo) {
  expect_parabola<2>({1.0, 1.0});
  expect_parabola<3>({1.0, 1.0, 1.0});
  expect_parabola<2>({1.0, 1e-4});
  expect_parabola<3>({1.0, 1e-4, 0.1});
}

TEST(Hessian, OfAWaveConverges) {
  const auto error = [](int n) {
    const Mesh<2> mesh = lattice<2>(n, 0.1);
    const auto found = recover_hessian<2>(
        mesh, sampled<2>(mesh, [](const Vec2& x) { return std::sin(3.0 * x[0] + 2.0 * x[1]); }));
    double worst = 0.0;
    for (std::size_t v = 0; v < found.size(); ++v) {
      const Vec2& x = mesh.points[v];
      Mat<2> h;
      h << 9.0, 6.0, 6.0, 4.0;
      worst =
          std::max(worst, (to_matrix<2>(found[v]) + std::sin(3.0 * x[0] + 2.0 * x[1]) * h).norm() / h.norm());
    }
    return worst;
  };
  const double coarse = error(16);
  EXPECT_LT(coarse, 0.5);
  EXPECT_LT(error(32), 0.6 * coarse);  // of first order on shaken meshes
}

TEST(Hessian, MeshesTooSmallToTell) {
  Mesh<2> one;
  one.points = {{0, 0}, {1, 0}, {0, 1}, {5, 5}};
  one.cells = {{0, 1, 2}};
  const auto found = recover_hessian<2>(one, {0.0, 1.0, 1.0, 7.0});
  for (const Sym<2>& h : found)
    for (const double x : h) EXPECT_TRUE(std::isfinite(x));
  EXPECT_EQ(to_matrix<2>(found[3]).norm(), 0.0);
}

TEST(Hessian, BadValuesAreNamed) {
  const Mesh<2> mesh = lattice<2>(2);
  EXPECT_THROW(recover_hessian<2>(mesh, {1.0}), Error);
  std::vector<double> values(mesh.points.size(), 0.0);
  values[4] = NAN;
  try {
    recover_hessian<2>(mesh, values);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("point 4"), std::string::npos) << e.what();
  }
  const std::vector<Sym<2>> none(mesh.points.size(), Sym<2>{});
  EXPECT_THROW(lp_metric<2>(mesh, none, 2.0, 100.0), Error);
  const std::vector<Sym<2>> some(mesh.points.size(), Sym<2>{1.0, 0.0, 1.0});
  EXPECT_THROW(lp_metric<2>(mesh, some, 0.5, 100.0), Error);
  EXPECT_THROW(lp_metric<2>(mesh, some, 2.0, 0.0), Error);
  EXPECT_THROW(lp_metric<2>(mesh, {}, 2.0, 100.0), Error);
}

TEST(Hessian, SameBitsForEveryThreadCount) {
  const Mesh<3> mesh = lattice<3>(12, 0.1);
  const auto values = sampled<3>(mesh, [](const Vec3& x) { return std::tanh(9.0 * (x[0] + x[1] - x[2])); });
  std::vector<Sym<3>> first;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const auto found = recover_hessian<3>(mesh, values);
    if (first.empty())
      first = found;
    else
      EXPECT_EQ(std::memcmp(first.data(), found.data(), sizeof(first[0]) * first.size()), 0);
  }
}

/// |H| of eigenvalues a, b everywhere: M is proportional to it, and the complexity is what was asked for.
TEST(LpMetric, ConstantHessian) {
  const Mesh<2> mesh = lattice<2>(4);
  const std::vector<Sym<2>> hessian(mesh.points.size(), Sym<2>{100.0, 0.0, -4.0});
  const auto metric = lp_metric<2>(mesh, hessian, 2.0, 50.0);
  EXPECT_NEAR(score<2>(mesh, metric).complexity, 50.0, 1e-9);
  const auto sizes = metric[0].principal().sizes;
  EXPECT_NEAR(sizes[1] / sizes[0], 5.0, 1e-12);  // sqrt(100 / 4)
}

/// Density goes as det(|H|)^(p / (2p + D)) [Loseille2011]: 16 times the Hessian on one half.
TEST(LpMetric, DensityFollowsThePower) {
  for (const double p : {1.0, 2.0, 8.0}) {
    const Mesh<3> mesh = lattice<3>(4);
    std::vector<Sym<3>> hessian(mesh.points.size(), Sym<3>{1, 0, 2, 0, 0, 3});
    for (double& h : hessian[0]) h *= 16.0;
    const auto metric = lp_metric<3>(mesh, hessian, p, 1000.0);
    const double expected = std::pow(16.0 * 16.0 * 16.0, p / (2.0 * p + 3.0));
    EXPECT_NEAR(metric[0].sqrt_det() / metric[1].sqrt_det(), expected, 1e-9 * expected);
  }
}

}  // namespace
}  // namespace lamina
