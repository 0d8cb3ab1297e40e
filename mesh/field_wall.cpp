#include "mesh/field_wall.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/planar.h"
#include "mesh/hessian.h"

namespace lamina {
namespace {

/// Where the distance is 0 on the edges of the mesh, and points that are on the wall themselves.
template <int D>
Box<3> zero_bounds(const Mesh<D>& mesh, const std::vector<double>& distance, double on_wall) {
  Box<3> box;
  for (const auto& cell : mesh.cells) {
    for (const auto& [i, j] : kCellEdges<D>) {
      const auto p = static_cast<std::size_t>(cell[i]), q = static_cast<std::size_t>(cell[j]);
      const double a = distance[p], b = distance[q];
      if (std::abs(a) <= on_wall) box.extend(in_space<D>(mesh.points[p]));
      if (std::abs(b) <= on_wall) box.extend(in_space<D>(mesh.points[q]));
      if ((a < 0.0) == (b < 0.0)) continue;
      box.extend(in_space<D>(mesh.points[p] + a / (a - b) * (mesh.points[q] - mesh.points[p])));
    }
  }
  return box;
}

/// Principal curvatures and directions of the level through a point, from the derivatives of the distance.
void set_curvature(const Vec2& n, const Mat<2>& hessian, double slope, WallPoint& w) {
  const Vec2 t(-n[1], n[0]);
  w.T1 = in_space<2>(t);
  w.T2 = Vec3::UnitZ();
  w.k1 = t.dot(hessian * t) / slope;
  w.k2 = 0.0;
}
void set_curvature(const Vec3& n, const Mat3& hessian, double slope, WallPoint& w) {
  const Vec3 a = n.unitOrthogonal(), b = n.cross(a);
  Mat<2> shape;
  shape << a.dot(hessian * a), a.dot(hessian * b), a.dot(hessian * b), b.dot(hessian * b);
  Eigen::SelfAdjointEigenSolver<Mat<2>> solver;
  solver.computeDirect(shape / slope);
  const Vec2 k = solver.eigenvalues();
  const int first = std::abs(k[0]) >= std::abs(k[1]) ? 0 : 1;
  const auto direction = [&](int i) -> Vec3 {
    return (solver.eigenvectors()(0, i) * a + solver.eigenvectors()(1, i) * b).normalized();
  };
  w.k1 = k[first];
  w.k2 = k[1 - first];
  w.T1 = direction(first);
  w.T2 = n.cross(w.T1);
}

}  // namespace

template <int D>
FieldWall<D>::FieldWall(const Mesh<D>& mesh, std::shared_ptr<const CellFinder<D>> places,
                        std::vector<double> distance)
    : places_(std::move(places)), distance_(std::move(distance)) {
  constexpr double kOnWall = 1e-12;  // of the mesh: distances of vertices that a solver has on the wall
  hessian_ = recover_hessian<D>(mesh, distance_, &gradient_);
  bounds_ = zero_bounds<D>(mesh, distance_, kOnWall * places_->bounds().diagonal());
  if (bounds_.empty())
    throw Error(ErrorCode::kParameter, "the distance is nowhere 0: there is no wall in the mesh");
  coarseness_ = measure_coarseness(mesh);
}

template <int D>
double FieldWall<D>::measure_coarseness(const Mesh<D>& mesh) const {
  std::vector<double> turns;
  for (const auto& cell : mesh.cells) {
    for (const auto& [i, j] : kCellEdges<D>) {
      const auto p = static_cast<std::size_t>(cell[i]), q = static_cast<std::size_t>(cell[j]);
      const double a = distance_[p], b = distance_[q];
      if ((a < 0.0) == (b < 0.0)) continue;
      const Vec<D> edge = mesh.points[q] - mesh.points[p];
      turns.push_back(std::abs(at(in_space<D>(mesh.points[p] + a / (a - b) * edge)).k1) * edge.norm());
    }
  }
  if (turns.empty()) return 0.0;
  const auto middle = turns.begin() + static_cast<std::ptrdiff_t>(turns.size() / 2);
  std::nth_element(turns.begin(), middle, turns.end());
  return *middle;
}

template <int D>
typename FieldWall<D>::Sample FieldWall<D>::sample(const Vec<D>& x) const {
  const CellPlace<D> place = places_->find(x);
  Sample s;
  if (place.cell == kNone) return s;
  const auto& cell = places_->cell(place);
  Vec<D> there = Vec<D>::Zero();
  for (std::size_t k = 0; k <= D; ++k)
    there += place.weights[k] * places_->points()[static_cast<std::size_t>(cell[k])];
  for (std::size_t k = 0; k <= D; ++k) {
    const auto v = static_cast<std::size_t>(cell[k]);
    s.phi += place.weights[k] * (distance_[v] + 0.5 * gradient_[v].dot(there - places_->points()[v]));
    s.gradient += place.weights[k] * gradient_[v];
    s.hessian += place.weights[k] * to_matrix<D>(hessian_[v]);
  }
  return s;
}

/// Down the gradient to the wall, by Newton's steps.
template <int D>
Vec<D> FieldWall<D>::foot_of(const Vec<D>& x) const {
  constexpr int kSteps = 4;
  Vec<D> y = x;
  for (int i = 0; i < kSteps; ++i) {
    const Sample s = sample(y);
    const double slope2 = s.gradient.squaredNorm();
    if (!(slope2 > 0.0)) break;
    y -= s.phi / slope2 * s.gradient;
  }
  return y;
}

template <int D>
WallPoint FieldWall<D>::at(const Vec3& x) const {
  const Vec<D> p = section<D>(x), foot = foot_of(p);
  const Sample s = sample(foot);
  const double slope = s.gradient.norm();
  WallPoint w;
  w.phi = phi(x);
  w.closest = in_space<D>(foot);
  if (!(slope > 0.0)) return w;
  const Vec<D> n = s.gradient / slope;
  w.N = in_space<D>(n);
  set_curvature(n, s.hessian, slope, w);
  return w;
}

template <int D>
double FieldWall<D>::phi(const Vec3& x) const {
  return sample(section<D>(x)).phi;
}

template class FieldWall<2>;
template class FieldWall<3>;

}  // namespace lamina
