// A wall that is known by its signed distance at the vertices of a mesh, as solvers have it.
//
// Between vertices the distance is the mean of what the vertices of the cell expect at the point, each by
// half of its gradient, which is exact for parabolas. Normals and curvatures come from the parabolas that
// mesh/hessian.h fits.
#pragma once

#include <memory>
#include <vector>

#include "core/field.h"
#include "mesh/cell_finder.h"
#include "mesh/mesh.h"

namespace lamina {

/// Sharp edges, other walls and the far side of thin bodies are not told apart. Beyond the mesh everything is
/// as at its nearest point.
template <int D>
class FieldWall : public WallField {
 public:
  /// REQUIRES one distance per point of `mesh`, < 0 inside the body, and `places` to be of `mesh`. Errors:
  /// kParameter (number of values; values that are not finite; no wall: the distance is nowhere 0).
  FieldWall(const Mesh<D>& mesh, std::shared_ptr<const CellFinder<D>> places, std::vector<double> distance);

  [[nodiscard]] WallPoint at(const Vec3& x) const override;
  [[nodiscard]] double phi(const Vec3& x) const override;
  int others(const Vec3&, const WallPoint&, double, std::span<WallPoint>) const override { return 0; }
  [[nodiscard]] Box<3> bounds() const override { return bounds_; }
  /// The median over edges across the wall of their length times the curvature there. Above 1 the mesh
  /// turns by more than a radian from point to point, and does not tell the wall's shape.
  [[nodiscard]] double coarseness() const { return coarseness_; }

 private:
  struct Sample {
    double phi = 0.0;
    Vec<D> gradient = Vec<D>::Zero();
    Mat<D> hessian = Mat<D>::Zero();
  };
  [[nodiscard]] Sample sample(const Vec<D>& x) const;
  [[nodiscard]] double measure_coarseness(const Mesh<D>& mesh) const;
  [[nodiscard]] Vec<D> foot_of(const Vec<D>& x) const;

  std::shared_ptr<const CellFinder<D>> places_;
  std::vector<double> distance_;
  std::vector<Vec<D>> gradient_;
  std::vector<Sym<D>> hessian_;
  Box<3> bounds_;
  double coarseness_ = 0.0;
};

}  // namespace lamina
