// Sweeps over all vertices at once: each looks at those of its neighbours that changed in the sweep before
// and intersects its metric with what spreads from them, in ascending order of their numbers. New metrics
// take effect when all vertices are done, so the order of the work is of no account.
#include "mesh/gradation.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/topology/neighbours.h"

namespace lamina {
namespace {

constexpr double kSlack = 1e-3;   // of a size: below it nothing is done, so that sweeps come to an end
constexpr double kMixed = 0.125;  // t of the law
constexpr std::size_t kGrain = 256;

/// A metric in its principal directions: what spreading needs, once per vertex and change.
template <int D>
using Principal = typename Metric<D>::Principal;

/// Rows: principal directions over the sizes that spread along e. The spread metric is its A^T A.
template <int D>
Mat<D> spread(const Principal<D>& p, const Vec<D>& e, double log_bound) {
  const double length = e.norm();
  const double metric_length = (p.axes * e).cwiseQuotient(p.sizes).norm();
  const double shape_kept = std::pow(1.0 + metric_length * log_bound, 1.0 - kMixed);
  Mat<D> a = p.axes;
  for (int i = 0; i < D; ++i)
    a.row(i) /= p.sizes[i] * std::pow(1.0 + length / p.sizes[i] * log_bound, kMixed) * shape_kept;
  return a;
}

/// Largest factor by which a size of `m` exceeds that of the metric A^T A in the same direction.
template <int D>
double excess(const Metric<D>& m, const Mat<D>& a) {
  // Columns of A U^-1 by back substitution: U is triangular and may be badly scaled, but never wrongly
  // solved.
  const Mat<D> b = m.factor().template triangularView<Eigen::Upper>().template solve<Eigen::OnTheRight>(a);
  if (b.squaredNorm() <= 1.0) return b.norm();  // a bound, and enough to know that nothing is exceeded
  Eigen::SelfAdjointEigenSolver<Mat<D>> solver;
  solver.computeDirect(b.transpose() * b, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[D - 1]));
}

template <int D>
void check(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric, double bound) {
  if (!(bound > 1.0) || !std::isfinite(bound))
    throw Error(ErrorCode::kParameter,
                fmt::format("a gradation of {:g} is out of range: must be > 1", bound));
  if (metric.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{} metrics for {} points: one for each point is needed",
                                                   metric.size(), mesh.points.size()));
}

}  // namespace

template <int D>
int gradate(const Mesh<D>& mesh, std::vector<Metric<D>>& metric, double bound) {
  constexpr int kMostSweeps = 10000;
  check(mesh, metric, bound);
  const double log_bound = std::log(bound);
  const std::size_t n = metric.size();
  const Neighbours around = neighbours(mesh);
  std::vector<Principal<D>> principal(n);
  for_each_index(
      n, [&](std::size_t v) { principal[v] = metric[v].principal(); }, kGrain);
  std::vector<char> changed(n, 1), changing(n);
  std::vector<Metric<D>> next = metric;
  for (int sweep = 1; sweep <= kMostSweeps; ++sweep) {
    for_each_index(
        n,
        [&](std::size_t v) {
          changing[v] = 0;
          for (const Index w : around.of(v)) {
            if (!changed[static_cast<std::size_t>(w)]) continue;
            const Vec<D> e = mesh.points[v] - mesh.points[static_cast<std::size_t>(w)];
            const Mat<D> a = spread<D>(principal[static_cast<std::size_t>(w)], e, log_bound);
            if (excess<D>(next[v], a) <= 1.0 + kSlack) continue;
            next[v] = intersect(next[v], Metric<D>::from_factor(a));
            changing[v] = 1;
          }
        },
        kGrain);
    for_each_index(
        n,
        [&](std::size_t v) {
          changed[v] = changing[v];
          if (!changed[v]) return;
          metric[v] = next[v];
          principal[v] = metric[v].principal();
        },
        kGrain);
    if (std::find(changed.begin(), changed.end(), 1) == changed.end()) return sweep;
  }
  throw Error(ErrorCode::kInternal,
              fmt::format("the gradation of {:g} did not settle within {} sweeps", bound, kMostSweeps));
}

template <int D>
double gradation_excess(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric, double bound) {
  check(mesh, metric, bound);
  const double log_bound = std::log(bound);
  return reduce(
      mesh.cells.size(), 0.0,
      [&](std::size_t begin, std::size_t end) {
        double worst = 0.0;
        for (std::size_t c = begin; c < end; ++c) {
          for (const auto& [i, j] : kCellEdges<D>) {
            for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
              const auto p = static_cast<std::size_t>(mesh.cells[c][from]);
              const auto q = static_cast<std::size_t>(mesh.cells[c][to]);
              const Vec<D> e = mesh.points[q] - mesh.points[p];
              worst = std::max(worst, excess<D>(metric[q], spread<D>(metric[p].principal(), e, log_bound)));
            }
          }
        }
        return worst;
      },
      [](double a, double b) { return std::max(a, b); });
}

template int gradate(const Mesh<2>&, std::vector<Metric<2>>&, double);
template int gradate(const Mesh<3>&, std::vector<Metric<3>>&, double);
template double gradation_excess(const Mesh<2>&, const std::vector<Metric<2>>&, double);
template double gradation_excess(const Mesh<3>&, const std::vector<Metric<3>>&, double);

}  // namespace lamina
