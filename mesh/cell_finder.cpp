#include "mesh/cell_finder.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "core/planar.h"

namespace lamina {
namespace {

/// Closest point of the simplex with the corners in `used` to x, as weights of the corners. Where the closest
/// point of their affine hull is outside, it is on a side that lacks one of the corners with a negative
/// weight.
template <int D>
double closest_weights(const std::array<Vec<D>, D + 1>& corners, const std::vector<int>& used,
                       const Vec<D>& x, std::array<double, D + 1>& weights) {
  const int n = static_cast<int>(used.size()) - 1;
  const auto corner = [&](int k) -> const Vec<D>& {
    return corners[static_cast<std::size_t>(used[static_cast<std::size_t>(k)])];
  };
  using Edges = Eigen::Matrix<double, D, Eigen::Dynamic, 0, D, D>;
  Edges edges(D, n);
  for (int k = 0; k < n; ++k) edges.col(k) = corner(k + 1) - corner(0);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, D, 1> b(n);
  if (n > 0) b = edges.colPivHouseholderQr().solve(x - corner(0));
  weights.fill(0.0);
  const auto weight = [&](int k) -> double& {
    return weights[static_cast<std::size_t>(used[static_cast<std::size_t>(k)])];
  };
  weight(0) = 1.0;
  Vec<D> foot = corner(0);
  for (int k = 0; k < n; ++k) {
    weight(k + 1) = b[k];
    weight(0) -= b[k];
    foot += b[k] * edges.col(k);
  }
  if (std::all_of(weights.begin(), weights.end(), [](double w) { return w >= 0.0; }))
    return (x - foot).squaredNorm();
  const std::array<double, D + 1> hull = weights;
  double best = std::numeric_limits<double>::infinity();
  for (const int out : used) {
    if (hull[static_cast<std::size_t>(out)] >= 0.0) continue;
    std::vector<int> side;
    for (const int k : used)
      if (k != out) side.push_back(k);
    std::array<double, D + 1> there;
    const double d2 = closest_weights<D>(corners, side, x, there);
    if (!(d2 < best)) continue;
    best = d2;
    weights = there;
  }
  return best;
}

/// Weights of x in a cell that holds it, up to rounding: between two cells, or on the border, x may be found
/// just outside of all. False where it is outside.
template <int D>
bool inner_weights(const std::array<Vec<D>, D + 1>& corners, const Vec<D>& x,
                   std::array<double, D + 1>& weights) {
  constexpr double kRounding = 1e-10;
  Mat<D> edges;
  for (int k = 0; k < D; ++k) edges.col(k) = corners[static_cast<std::size_t>(k + 1)] - corners[0];
  const Vec<D> b = edges.inverse() * (x - corners[0]);
  weights[0] = 1.0 - b.sum();
  for (int k = 0; k < D; ++k) weights[static_cast<std::size_t>(k + 1)] = b[k];
  if (!std::all_of(weights.begin(), weights.end(), [](double w) { return w >= -kRounding; })) return false;
  for (double& w : weights) w = std::max(w, 0.0);
  return true;
}

}  // namespace

template <int D>
CellFinder<D>::CellFinder(const Mesh<D>& mesh) : points_(mesh.points), cells_(mesh.cells) {
  for (const Vec<D>& x : points_) bounds_.extend(x);
  origin_ = in_space<D>(bounds_.center());
  std::vector<detail::BoxRef> refs(cells_.size());
  for_each_index(refs.size(), [&](std::size_t c) {
    std::array<Vec3, D + 1> corners;
    for (std::size_t k = 0; k <= D; ++k)
      corners[k] = in_space<D>(points_[static_cast<std::size_t>(cells_[c][k])]) - origin_;
    refs[c] = detail::BoxRef::around(corners.data(), D + 1, static_cast<Index>(c));
  });
  tree_ = detail::build_box_tree(std::move(refs));
}

/// Nearly all points lie in a cell, which is found without looking at those that are merely near.
template <int D>
CellPlace<D> CellFinder<D>::find(const Vec<D>& x) const {
  const Vec3 local = in_space<D>(x) - origin_;
  CellPlace<D> place;
  double best = std::numeric_limits<double>::min();  // only boxes that hold x are nearer
  detail::visit_nearest(tree_, local.data(), best, 1.0, [&](int begin, int count) {
    for (int i = begin; i < begin + count && best > 0.0; ++i) {
      const Index id = tree_.ids[static_cast<std::size_t>(i)];
      if (!inner_weights<D>(corners_of(id), x, place.weights)) continue;
      place.cell = id;
      best = 0.0;
    }
  });
  if (place.cell != kNone) return place;
  std::vector<int> all(D + 1);
  std::iota(all.begin(), all.end(), 0);
  best = std::numeric_limits<double>::infinity();
  detail::visit_nearest(tree_, local.data(), best, 1.0, [&](int begin, int count) {
    for (int i = begin; i < begin + count; ++i) {
      const Index id = tree_.ids[static_cast<std::size_t>(i)];
      std::array<double, D + 1> weights;
      const double d2 = closest_weights<D>(corners_of(id), all, x, weights);
      if (!(d2 < best)) continue;
      best = d2;
      place = {id, weights};
    }
  });
  return place;
}

template <int D>
std::array<Vec<D>, D + 1> CellFinder<D>::corners_of(Index cell) const {
  std::array<Vec<D>, D + 1> corners;
  for (std::size_t k = 0; k <= D; ++k)
    corners[k] = points_[static_cast<std::size_t>(cells_[static_cast<std::size_t>(cell)][k])];
  return corners;
}

template class CellFinder<2>;
template class CellFinder<3>;

}  // namespace lamina
