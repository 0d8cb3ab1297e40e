#include "mesh/score.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/io.h"
#include "mesh/solution.h"
#include "tests/mesh/lattice.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

/// A metric with all directions and sizes between 0.05 and 1 that varies from point to point.
template <int D>
std::vector<Metric<D>> wild_metric(const Mesh<D>& mesh) {
  std::vector<Metric<D>> metric;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Mat<D> A = Mat<D>::Zero();
    for (int r = 0; r < D; ++r) {
      A(r, r) = std::pow(10.0, 0.6 + 0.6 * noise(i, static_cast<std::uint64_t>(r)));
      for (int c = r + 1; c < D; ++c) A(r, c) = 2.0 * noise(i, static_cast<std::uint64_t>(10 + r * D + c));
    }
    metric.push_back(Metric<D>::from_factor(A));
  }
  return metric;
}

TEST(Score, RegularTetrahedronByHand) {
  Mesh<3> mesh;
  mesh.points = {{1, 1, 1}, {-1, 1, -1}, {1, -1, -1}, {-1, -1, 1}};
  mesh.cells = {{0, 1, 2, 3}};
  const double edge = 2.0 * std::sqrt(2.0), volume = 8.0 / 3.0;
  const Score s = score(mesh, std::vector<Metric<3>>(4, Metric<3>::isotropic(edge / 1.2)));
  EXPECT_EQ(s.points, 4);
  EXPECT_EQ(s.cells, 1);
  EXPECT_EQ(s.edges, 6);
  EXPECT_NEAR(s.length_min, 1.2, 1e-14);
  EXPECT_NEAR(s.length_max, 1.2, 1e-14);
  EXPECT_NEAR(s.length_mean, 1.2, 1e-14);
  EXPECT_EQ(s.unit_share, 1.0);
  EXPECT_EQ(s.short_share, 0.0);
  EXPECT_EQ(s.long_share, 0.0);
  EXPECT_NEAR(s.quality_min, 1.0, 1e-14);
  EXPECT_NEAR(s.quality_mean, 1.0, 1e-14);
  EXPECT_NEAR(s.aspect_max, std::sqrt(1.5), 1e-14);  // edge a, height a sqrt(2/3)
  EXPECT_NEAR(s.complexity, volume * std::pow(1.2 / edge, 3), 1e-14);
  EXPECT_EQ(std::accumulate(s.length_histogram.begin(), s.length_histogram.end(), std::int64_t{0}), 6);
  ASSERT_EQ(s.worst.size(), 1u);
  EXPECT_EQ(s.worst[0].center, Vec3(0, 0, 0));
}

TEST(Score, RightTriangleByHand) {
  Mesh<2> mesh;
  mesh.points = {{0, 0}, {3, 0}, {0, 4}};
  mesh.cells = {{0, 1, 2}};
  const Score s = score(mesh, std::vector<Metric<2>>(3));
  EXPECT_EQ(s.edges, 3);
  EXPECT_DOUBLE_EQ(s.length_min, 3.0);
  EXPECT_DOUBLE_EQ(s.length_max, 5.0);
  EXPECT_EQ(s.long_share, 1.0);
  EXPECT_EQ(s.length_histogram[13], 1);  // [2, 4): the edge of 3
  EXPECT_EQ(s.length_histogram[14], 2);  // from 4 on
  EXPECT_NEAR(s.aspect_max, 5.0 / 2.4, 1e-14);
  EXPECT_DOUBLE_EQ(s.aspect_p99, s.aspect_max);
  EXPECT_NEAR(s.quality_mean, 4.0 * std::sqrt(3.0) * 6.0 / 50.0, 1e-14);
  EXPECT_DOUBLE_EQ(s.complexity, 6.0);
}

TEST(Score, CountsEdgesOnce) {
  const int n = 5;
  const Mesh<3> mesh = lattice<3>(n);
  const Score s = score(mesh, std::vector<Metric<3>>(mesh.points.size(), Metric<3>::isotropic(1.0 / n)));
  const int m = n + 1;
  // Axis edges, face diagonals, body diagonals of the Kuhn mesh; Euler's count agrees: V - E + F - C = 1.
  EXPECT_EQ(s.edges, 3 * n * m * m + 3 * n * n * m + n * n * n);
  EXPECT_EQ(s.points, m * m * m);
  EXPECT_NEAR(s.length_max, std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(s.length_min, 1.0, 1e-12);
  EXPECT_NEAR(s.complexity, n * n * n, 1e-9);
  EXPECT_EQ(s.worst.size(), 20u);
}

TEST(Score, WorstCellsInOrder) {
  const Mesh<2> mesh = lattice<2>(40, 0.2);
  const auto metric = wild_metric(mesh);
  const Score s = score(mesh, metric);
  std::vector<std::pair<double, Index>> all;
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    std::array<Vec2, 3> x;
    std::array<const Metric<2>*, 3> m;
    for (int k = 0; k < 3; ++k) {
      x[k] = mesh.points[mesh.cells[i][k]];
      m[k] = &metric[mesh.cells[i][k]];
    }
    all.emplace_back(cell_quality<2>(x, m), static_cast<Index>(i));
  }
  std::sort(all.begin(), all.end());
  ASSERT_EQ(s.worst.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(s.worst[i].cell, all[i].second);
    EXPECT_EQ(s.worst[i].quality, all[i].first);
  }
  EXPECT_EQ(s.quality_min, all[0].first);
  EXPECT_EQ(std::accumulate(s.quality_histogram.begin(), s.quality_histogram.end(), std::int64_t{0}), 3200);
}

TEST(Score, FlippedAndFlatCells) {
  Mesh<2> mesh = lattice<2>(1);
  std::swap(mesh.cells[0][0], mesh.cells[0][1]);
  Score s = score(mesh, std::vector<Metric<2>>(4));
  EXPECT_LT(s.quality_min, 0.0);
  EXPECT_EQ(s.quality_histogram[0], 1);
  EXPECT_NEAR(s.complexity, 1.0, 1e-15);
  mesh.points = {{0, 0}, {1, 0}, {2, 0}, {3, 0}};
  s = score(mesh, std::vector<Metric<2>>(4));
  EXPECT_TRUE(std::isinf(s.aspect_max));
}

TEST(Score, EmptyAndMismatched) {
  EXPECT_EQ(score(Mesh<3>{}, {}).cells, 0);
  EXPECT_THROW(score(lattice<2>(1), std::vector<Metric<2>>(3)), Error);
}

TEST(Score, SameBitsForEveryThreadCount) {
  const Mesh<3> mesh = lattice<3>(25, 0.1);
  const auto metric = wild_metric(mesh);
  Score first;
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    const Score s = score(mesh, metric);
    if (threads == 1) first = s;
    EXPECT_EQ(s.complexity, first.complexity);
    EXPECT_EQ(s.length_mean, first.length_mean);
    EXPECT_EQ(s.quality_mean, first.quality_mean);
    EXPECT_EQ(s.aspect_p99, first.aspect_p99);
    EXPECT_EQ(s.length_histogram, first.length_histogram);
    for (std::size_t i = 0; i < first.worst.size(); ++i) EXPECT_EQ(s.worst[i].cell, first.worst[i].cell);
  }
}

constexpr const char* kCompare = R"(
import sys
sys.path.insert(0, sys.argv[1])
import meshscore
import numpy as np
def log_mean(la, lb):  # its own falls back to the arithmetic mean at differences of 1e-3, an error of 1e-8
    d = np.abs(la - lb)
    with np.errstate(divide='ignore', invalid='ignore'):
        l = (la - lb) / np.log(la / lb)
    return np.where(d > 1e-7, l, 0.5 * (la + lb))
meshscore.edge_len = log_mean
r = meshscore.score('m.meshb', None, 'm.solb')
for k in ('nverts', 'nelems', 'nedges', 'complexity', 'edge_in_pct', 'edge_min', 'edge_max', 'edge_mean', 'edge_lt_0.5_pct',
          'edge_gt_2_pct', 'q_min', 'q_mean', 'aspect_max', 'aspect_p99'):
    print(repr(float(r[k])))
)";

template <int D>
void compare_with_independent_scorer() {
  const std::filesystem::path tools = std::filesystem::path(LAMINA_DATA) / ".." / "tools";
  const Scratch folder;
  if (!std::filesystem::exists(tools / "meshscore.py") || !python_has(folder, "numpy"))
    GTEST_SKIP() << "meshscore.py or python3 with numpy is missing: NOT TESTED";
  const Mesh<D> mesh = lattice<D>(D == 2 ? 30 : 9, 0.12);
  const auto metric = wild_metric(mesh);
  write_mesh(folder / "m.meshb", mesh);
  write_metric(folder / "m.solb", metric);
  ASSERT_EQ(run_python(folder, kCompare, std::filesystem::absolute(tools).string()), 0)
      << read_text(folder / "log.txt");
  std::istringstream log(read_text(folder / "log.txt"));
  const Score s = score(mesh, metric);
  const std::array<double, 14> ours = {static_cast<double>(s.points),
                                       static_cast<double>(s.cells),
                                       static_cast<double>(s.edges),
                                       s.complexity,
                                       100 * s.unit_share,
                                       s.length_min,
                                       s.length_max,
                                       s.length_mean,
                                       100 * s.short_share,
                                       100 * s.long_share,
                                       s.quality_min,
                                       s.quality_mean,
                                       s.aspect_max,
                                       s.aspect_p99};
  for (std::size_t i = 0; i < ours.size(); ++i) {
    double theirs = 0.0;
    ASSERT_TRUE(log >> theirs) << "value " << i;
    EXPECT_NEAR(ours[i], theirs, 1e-9 * std::max(1.0, std::abs(theirs))) << "value " << i;
  }
}

TEST(Score, AgreesWithIndependentScorer2D) { compare_with_independent_scorer<2>(); }

TEST(Score, AgreesWithIndependentScorer3D) { compare_with_independent_scorer<3>(); }

}  // namespace
}  // namespace lamina
