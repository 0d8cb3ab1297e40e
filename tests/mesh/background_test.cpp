#include "mesh/background.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "mesh/io.h"
#include "mesh/solution.h"
#include "tests/mesh/lattice.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

// Logarithms that are linear in space are interpolated without error.
template <int D>
Metric<D> field(const Vec<D>& x) {
  Sym<D> log{};
  for (std::size_t i = 0; i < log.size(); ++i)
    log[i] = 3.0 + 0.7 * static_cast<double>(i) * x[0] - 1.3 * x[1] + 0.2 * x[D - 1] * (i == 1 ? 4.0 : 1.0);
  return Metric<D>::from_log(log);
}

template <int D>
std::vector<Metric<D>> metric_of(const Mesh<D>& mesh) {
  std::vector<Metric<D>> out;
  for (const Vec<D>& x : mesh.points) out.push_back(field<D>(x));
  return out;
}

template <int D>
void expect_same(const Metric<D>& a, const Metric<D>& b, double tolerance) {
  const Sym<D> la = a.log(), lb = b.log();
  for (std::size_t i = 0; i < la.size(); ++i) EXPECT_NEAR(la[i], lb[i], tolerance);
}

template <int D>
void check_dimension() {
  const Mesh<D> mesh = lattice<D>(6, 0.1);
  const BackgroundMetric<D> background(mesh, metric_of<D>(mesh));
  for (int i = 0; i < 500; ++i) {
    Vec<D> x;
    for (int k = 0; k < D; ++k)
      x[k] = 0.5 + 0.5 * noise(static_cast<std::size_t>(i), static_cast<unsigned>(k));
    expect_same<D>(background.at(x), field<D>(x), 1e-10);
  }
  for (std::size_t i = 0; i < mesh.points.size(); i += 7)
    expect_same<D>(background.at(mesh.points[i]), field<D>(mesh.points[i]), 1e-10);
  // Beyond the mesh: as at the nearest point of the unit cube.
  Vec<D> out = Vec<D>::Constant(0.5), foot = out;
  out[0] = 1.7;
  foot[0] = 1.0;
  expect_same<D>(background.at(out), field<D>(foot), 1e-10);
  EXPECT_GT(background.smallest(), 0.0);
}

TEST(BackgroundMetric, InterpolatesLogarithms) {
  check_dimension<2>();
  check_dimension<3>();
}

TEST(BackgroundMetric, ReadsAFieldOrAFileBeside) {
  const Scratch scratch;
  Mesh<3> mesh = lattice<3>(4, 0.1);
  const std::vector<Metric<3>> metric = metric_of<3>(mesh);
  const Vec3 x(0.3, 0.4, 0.6);
  write_mesh<3>(scratch / "a.meshb", mesh);
  EXPECT_THROW((void)BackgroundMetric<3>::read(scratch / "a.meshb"), Error);  // no metric yet
  write_metric<3>(scratch / "a.solb", metric);
  expect_same<3>(BackgroundMetric<3>::read(scratch / "a.meshb").at(x), field<3>(x), 1e-9);
  MeshField tensors{"metric", 6, {}};
  for (const Metric<3>& m : metric) {
    const Sym<3> t = m.tensor();
    tensors.values.insert(tensors.values.end(), t.begin(), t.end());
  }
  mesh.point_fields = {tensors};
  write_mesh<3>(scratch / "b.vtu", mesh);
  expect_same<3>(BackgroundMetric<3>::read(scratch / "b.vtu").at(x), field<3>(x), 1e-9);
  EXPECT_THROW((void)BackgroundMetric<2>::read(scratch / "b.vtu"), Error);
  write_metric<3>(scratch / "a.solb", {metric[0]});
  try {
    (void)BackgroundMetric<3>::read(scratch / "a.meshb");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kParameter);
  }
}

}  // namespace
}  // namespace lamina
