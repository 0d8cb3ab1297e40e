// The wall of a level set grid: the zero set of the C2 cubic spline through its values.
//
// Distances are exact to the spline's zero set whatever the values are away from it, so that grids in voxel
// units, with |grad| off one, or under any affine transform need no repair; re-distancing them would move the
// wall by up to 0.08 voxels.
#pragma once

#include "vdb/detail/facet_wall.h"
#include "vdb/detail/grid.h"
#include "vdb/detail/sparse.h"
#include "vdb/outline.h"

namespace lamina::detail {

inline constexpr double kSharpest = 2.0;  ///< curvature times voxel: a grid cannot tell what is sharper

class SplineWall : public WallField {
 public:
  /// `grid.values` as read; they are prefiltered here.
  explicit SplineWall(LoadedGrid grid);

  [[nodiscard]] WallPoint at(const Vec3& x) const override;
  [[nodiscard]] double phi(const Vec3& x) const override;
  int others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const override;
  [[nodiscard]] Box<3> bounds() const override { return facets_.bounds(); }

  [[nodiscard]] const SparseGrid& values() const { return values_; }
  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  [[nodiscard]] double voxel() const { return voxel_; }
  /// Where the plane "coordinate `axis` is `offset`" cuts the zero set: closed curves of points half a voxel
  /// apart, in the coordinates of slice(), smooth unless they turn sharply from point to point. `name` is
  /// used in messages. Errors: those of slice(), kSurfaceInvalid for a curve that ends.
  [[nodiscard]] Outline section(int axis, double offset, const std::string& name,
                                std::vector<std::string>& warnings) const;
  /// Standard deviation of the blur under normals and curvatures, voxels; 0 when the values need none.
  [[nodiscard]] double blur() const;

 private:
  struct Foot {
    Vec3 q;  ///< closest point
    double phi;
  };
  [[nodiscard]] double disagreement(const SparseGrid& a, const SparseGrid& b) const;
  void choose_blur();
  struct Sample {
    double f;
    Vec3 g;
    Mat3 H;
  };
  [[nodiscard]] Sample sample(const SparseGrid& grid, const Vec3& x) const;
  [[nodiscard]] Foot foot(const Vec3& x, const Vec3& start) const;
  [[nodiscard]] bool newton(const Vec3& x, Vec3& q) const;
  [[nodiscard]] WallPoint describe(const Foot& foot) const;
  /// Newton steps along the plane onto the zero set; false where they do not get there.
  [[nodiscard]] bool settle_in_plane(int axis, Vec3& q) const;
  [[nodiscard]] double curvature_in_plane(int axis, const Vec3& q) const;

  SparseGrid values_;
  SparseGrid blurred_;  ///< used for curvature when blur_passes_ > 0
  int blur_passes_ = 0;
  Lattice lattice_;
  Mat3 to_index_;
  double voxel_ = 1.0;
  FacetWall facets_;  ///< the zero set as triangles: where Newton starts
};

}  // namespace lamina::detail
