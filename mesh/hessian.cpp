// A patch is mapped to one whose vertices spread equally in all directions before the parabola is fitted, so
// that a layer of aspect ratio 1e4 is as well conditioned as a regular mesh. Rejected: two L2 projections of
// gradients, which are wrong by a factor of order one on the boundary, where layers are.
#include "mesh/hessian.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/score.h"
#include "mesh/topology/neighbours.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 256;

template <int D>
constexpr int kUnknowns = D + kSymSize<D>;  // gradient and Hessian; the value at the vertex is kept
/// Fewer neighbours take in theirs: those of a vertex on the boundary lie on one side.
template <int D>
constexpr std::size_t kFewest = D == 2 ? 6 : 12;
constexpr int kMostRings = 4;

/// Grows by one ring of neighbours, ascending; `patch` does not hold the vertex itself.
void grow(const Neighbours& around, Index center, std::vector<Index>& patch) {
  std::vector<Index> grown = patch;
  const auto take = [&](Index v) {
    for (const Index w : around.of(static_cast<std::size_t>(v)))
      if (w != center) grown.push_back(w);
  };
  if (patch.empty()) take(center);
  for (const Index v : patch) take(v);
  std::sort(grown.begin(), grown.end());
  grown.erase(std::unique(grown.begin(), grown.end()), grown.end());
  patch = std::move(grown);
}

/// Maps offsets of a patch to ones of unit covariance: the lower Cholesky factor of theirs. Empty when the
/// patch is flat.
template <int D>
std::optional<Mat<D>> spread_of(const std::vector<Vec<D>>& offsets) {
  constexpr double kFlat = 1e-28;  // of the longest spread squared: offsets cannot tell less from rounding
  Mat<D> covariance = Mat<D>::Zero();
  for (const Vec<D>& e : offsets) covariance += e * e.transpose();
  covariance /= static_cast<double>(offsets.size());
  const Eigen::LLT<Mat<D>> cholesky(covariance);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  const Mat<D> factor = cholesky.matrixL();
  if (factor.diagonal().array().square().minCoeff() <= kFlat * covariance.trace()) return std::nullopt;
  return factor;
}

template <int D>
struct Derivatives {
  Vec<D> gradient = Vec<D>::Zero();
  Sym<D> hessian{};
};

/// Least squares over the patch; `full` tells whether it determines all unknowns.
template <int D>
Derivatives<D> fit(const std::vector<Vec<D>>& offsets, const std::vector<double>& rises, const Mat<D>& spread,
                   bool& full) {
  constexpr double kSingular = 1e-6;
  using Row = Eigen::Matrix<double, 1, kUnknowns<D>>;
  Eigen::Matrix<double, Eigen::Dynamic, kUnknowns<D>> a(offsets.size(), kUnknowns<D>);
  Eigen::VectorXd b(offsets.size());
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const Vec<D> x = spread.template triangularView<Eigen::Lower>().solve(offsets[i]);
    Row row;
    row.template head<D>() = x.transpose();
    int at = D;
    for (int r = 0; r < D; ++r)
      for (int c = 0; c <= r; ++c) row[at++] = r == c ? 0.5 * x[r] * x[r] : x[r] * x[c];
    const double weight = 1.0 / x.norm();
    a.row(static_cast<Eigen::Index>(i)) = weight * row;
    b[static_cast<Eigen::Index>(i)] = weight * rises[i];
  }
  Eigen::CompleteOrthogonalDecomposition<decltype(a)> solver;
  solver.setThreshold(kSingular);
  solver.compute(a);
  full = solver.rank() == kUnknowns<D>;
  const Eigen::Matrix<double, kUnknowns<D>, 1> found = solver.solve(b);
  Sym<D> packed;
  std::copy_n(found.data() + D, packed.size(), packed.begin());
  const Mat<D> back = spread.template triangularView<Eigen::Lower>().solve(Mat<D>::Identity());
  return {back.transpose() * found.template head<D>(),
          to_sym<D>(back.transpose() * to_matrix<D>(packed) * back)};
}

template <int D>
Derivatives<D> derivatives_at(const Mesh<D>& mesh, const Neighbours& around,
                              const std::vector<double>& values, Index v) {
  std::vector<Index> patch;
  std::vector<Vec<D>> offsets;
  std::vector<double> rises;
  Derivatives<D> found;
  for (int ring = 1; ring <= kMostRings; ++ring) {
    const std::size_t before = patch.size();
    grow(around, v, patch);
    if (patch.size() == before) break;
    if (patch.size() < kFewest<D> && ring < kMostRings) continue;
    offsets.clear();
    rises.clear();
    for (const Index w : patch) {
      offsets.push_back(mesh.points[static_cast<std::size_t>(w)] - mesh.points[static_cast<std::size_t>(v)]);
      rises.push_back(values[static_cast<std::size_t>(w)] - values[static_cast<std::size_t>(v)]);
    }
    const std::optional<Mat<D>> spread = spread_of<D>(offsets);
    if (!spread) continue;
    bool full = false;
    found = fit<D>(offsets, rises, *spread, full);
    if (full) break;
  }
  return found;
}

/// |H| with no eigenvalue below `least`.
template <int D>
Metric<D> absolute(const Sym<D>& hessian, double least) {
  const Eigen::SelfAdjointEigenSolver<Mat<D>> solver(to_matrix<D>(hessian));
  const Vec<D> sizes = solver.eigenvalues().cwiseAbs().cwiseMax(least).cwiseSqrt().cwiseInverse();
  return Metric<D>::from_frame(solver.eigenvectors().transpose(), sizes);
}

}  // namespace

template <int D>
std::vector<Sym<D>> recover_hessian(const Mesh<D>& mesh, const std::vector<double>& values,
                                    std::vector<Vec<D>>* gradient) {
  if (values.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{} values for {} points: one for each point is needed",
                                                   values.size(), mesh.points.size()));
  const auto bad = std::find_if(values.begin(), values.end(), [](double u) { return !std::isfinite(u); });
  if (bad != values.end())
    throw Error(ErrorCode::kParameter,
                fmt::format("the value of point {} (counted from 0) is {}: it must be finite",
                            bad - values.begin(), *bad));
  const Neighbours around = neighbours(mesh);
  std::vector<Sym<D>> hessian(values.size());
  if (gradient != nullptr) gradient->resize(values.size());
  for_each_index(
      values.size(),
      [&](std::size_t v) {
        const Derivatives<D> found = derivatives_at<D>(mesh, around, values, static_cast<Index>(v));
        hessian[v] = found.hessian;
        if (gradient != nullptr) (*gradient)[v] = found.gradient;
      },
      kGrain);
  return hessian;
}

template <int D>
std::vector<Metric<D>> lp_metric(const Mesh<D>& mesh, const std::vector<Sym<D>>& hessian, double p,
                                 double complexity) {
  constexpr double kLeast = 1e-12;
  if (!(p >= 1.0) || !std::isfinite(p))
    throw Error(ErrorCode::kParameter, fmt::format("an error norm L^{:g}: p must be at least 1", p));
  if (!(complexity > 0.0) || !std::isfinite(complexity))
    throw Error(ErrorCode::kParameter, fmt::format("a complexity of {:g}: must be > 0", complexity));
  if (hessian.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{} Hessians for {} points: one for each point is needed",
                                                   hessian.size(), mesh.points.size()));
  double largest = 0.0;
  for (const Sym<D>& h : hessian) largest = std::max(largest, to_matrix<D>(h).norm());
  if (!(largest > 0.0))
    throw Error(ErrorCode::kParameter, "a field that is linear everywhere asks for no elements");
  std::vector<Metric<D>> metric(hessian.size());
  for_each_index(
      metric.size(),
      [&](std::size_t v) {
        const Metric<D> m = absolute<D>(hessian[v], kLeast * largest);
        const double det = m.sqrt_det() * m.sqrt_det();
        metric[v] = m.scaled(std::pow(det, 0.5 / (2.0 * p + D)));
      },
      kGrain);
  const double scale = std::pow(score<D>(mesh, metric).complexity / complexity, 1.0 / D);
  for_each_index(metric.size(), [&](std::size_t v) { metric[v] = metric[v].scaled(scale); });
  return metric;
}

template std::vector<Sym<2>> recover_hessian(const Mesh<2>&, const std::vector<double>&,
                                             std::vector<Vec<2>>*);
template std::vector<Sym<3>> recover_hessian(const Mesh<3>&, const std::vector<double>&,
                                             std::vector<Vec<3>>*);
template std::vector<Metric<2>> lp_metric(const Mesh<2>&, const std::vector<Sym<2>>&, double, double);
template std::vector<Metric<3>> lp_metric(const Mesh<3>&, const std::vector<Sym<3>>&, double, double);

}  // namespace lamina
