// Which cell of a mesh a point lies in, or is nearest to.
#pragma once

#include <array>
#include <vector>

#include "core/box_tree.h"
#include "mesh/mesh.h"

namespace lamina {

/// A place in a mesh: weights of the vertices of a cell, >= 0, of sum 1 up to rounding.
template <int D>
struct CellPlace {
  Index cell = kNone;
  std::array<double, D + 1> weights{};
};

/// A copy of the points and cells of a mesh with a tree over them. Thread safe.
template <int D>
class CellFinder {
 public:
  /// REQUIRES valid indices. Cost: n log n.
  explicit CellFinder(const Mesh<D>& mesh);

  /// The cell that holds x; beyond the mesh, the place nearest to it. No cell where the mesh has none.
  [[nodiscard]] CellPlace<D> find(const Vec<D>& x) const;
  [[nodiscard]] const std::array<Index, D + 1>& cell(const CellPlace<D>& place) const {
    return cells_[static_cast<std::size_t>(place.cell)];
  }
  [[nodiscard]] const std::vector<Vec<D>>& points() const { return points_; }
  [[nodiscard]] const Box<D>& bounds() const { return bounds_; }

 private:
  [[nodiscard]] std::array<Vec<D>, D + 1> corners_of(Index cell) const;

  std::vector<Vec<D>> points_;
  std::vector<std::array<Index, D + 1>> cells_;
  Vec3 origin_ = Vec3::Zero();  ///< the tree's coordinates are relative to this
  detail::BoxTree tree_;
  Box<D> bounds_;
};

}  // namespace lamina
