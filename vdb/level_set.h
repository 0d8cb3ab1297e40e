// The body as a level set: an OpenVDB narrow-band grid, exact distances where the wall is a triangle surface,
// and the gradient and Hessian stencils that supply normals and principal curvatures.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/field.h"
#include "core/progress.h"
#include "core/wall_metric.h"
#include "vdb/outline.h"
#include "vdb/size_grid.h"
#include "vdb/surface.h"

namespace lamina {

struct LevelSetOptions {
  double voxel = 0.0;  ///< voxel edge, world units; 0: longest extent / 200, coarser if the budget asks
  double half_width_vox = 6.0;  ///< half width of the band in voxels, >= 3
  double max_memory = 2e9;      ///< bytes the grids may take; exceeded by an explicit voxel: kLevelSetBudget
  double feature_angle_degrees = 40.0;  ///< edges with a larger exterior dihedral angle are sharp
  bool sheets = false;                  ///< surfaces: every open shell is a two-sided wall of no thickness
  std::string grid;           ///< .vdb input: name of the grid; empty: the only level set, else "surface"
  std::optional<double> iso;  ///< .vdb input of fog class: iso value of the wall
};

struct LevelSetReport {
  double voxel = 0.0;
  std::int64_t active_voxels = 0;
  double grid_bytes = 0.0;
  std::int64_t polished_voxels = 0;  ///< voxels whose value of meshToVolume was off by more than 1e-3 voxel
  double worst_polish_vox = 0.0;     ///< largest correction, in voxels
  std::int64_t sharp_edges = 0, corners = 0;
  std::string sign_rule;  ///< "pseudonormal" or "winding number"
  std::vector<std::string> warnings;
};

/// What is in a .vdb file, for `lamina info`.
struct VdbGridInfo {
  std::string name, type, grid_class, transform;
  double voxel = 0.0, background = 0.0, min = 0.0, max = 0.0;
  std::int64_t active_voxels = 0;
  Box<3> bounds;
};
std::vector<VdbGridInfo> vdb_info(const std::filesystem::path& path);

class LevelSet : public WallField {
 public:
  /// From a cleaned surface: exact distance by a bounding volume hierarchy, sign by pseudonormal where shells
  /// are closed and free of overlaps and by winding number elsewhere (open sheets are two-sided), curvature
  /// from the triangles' tensor and, where that scatters from vertex to vertex, from the grid's stencils.
  /// Errors: kLevelSetBudget with the estimate and the smallest voxel that fits.
  static LevelSet from_surface(Surface surface, const LevelSetOptions& options, Progress* progress = nullptr);

  /// From a cleaned outline, extended along z without end: exact distances to its splines and chords, corners
  /// as sharp edges along z, see detail/outline_wall.h. The grid, of three voxels to either side of z = 0, is
  /// made when it is written. `name` is used in messages. Errors: kSurfaceInvalid where curves touch,
  /// kLevelSetBudget.
  static LevelSet from_outline(const Outline& outline, const LevelSetOptions& options,
                               const std::string& name);

  /// From a level set written by others: the wall is the zero set of the C2 cubic spline of the grid, closest
  /// points by Newton steps on it. Distances are multiplied by `scale` (unit conversion). Errors:
  /// kFileMissing, kFileFormat (corrupt, truncated), kLevelSetGrid naming the grids there are.
  static LevelSet from_vdb(const std::filesystem::path& path, const LevelSetOptions& options,
                           double scale = 1.0, Progress* progress = nullptr);

  LevelSet(LevelSet&&) noexcept;
  LevelSet& operator=(LevelSet&&) noexcept;
  ~LevelSet() override;

  [[nodiscard]] WallPoint at(const Vec3& x) const override;
  [[nodiscard]] WallPoint at_side(const Vec3& x, double sign) const override;
  [[nodiscard]] double phi(const Vec3& x) const override;
  [[nodiscard]] double distance(const Vec3& x, double eps) const override;
  int others(const Vec3& x, const WallPoint& nearest, double reach, std::span<WallPoint> out) const override;
  int edges_beside(const WallPoint& wall, double reach, std::span<WallEdge> out) const override;
  [[nodiscard]] std::array<double, 2> graded_curvatures(const WallPoint& wall, double root) const override;
  int bends_beside(const WallPoint& wall, double reach, std::span<WallBend> out) const override;
  [[nodiscard]] Box<3> bounds() const override;
  [[nodiscard]] const LevelSetReport& report() const;

  /// at() and phi() of many points: in parallel, and in an order that keeps what near points share in the
  /// cache. REQUIRES out.size() == points.size().
  void sample(std::span<const Vec3> points, std::span<WallPoint> out) const;
  void sample_phi(std::span<const Vec3> points, std::span<double> out) const;

  /// Writes on one narrow band `surface` (level set), `N`, `T1` and `k` (k1, k2, reliability), with a metric
  /// also `h` (its sizes along N, T1, T2), `logM_diag` and `logM_off` (its logarithm: xx yy zz, xy xz yz),
  /// and copies of `painted` grids: float32, blosc, metadata; atomically. Lengths are larger by metadata
  /// lamina:scale where there is one: OpenVDB takes no voxels below 1.4e-5. from_vdb() and SizeGrid undo it.
  /// REQUIRES a metric of this wall. Errors: kFileWrite, kLevelSetGrid where a painted grid has the name of
  /// another.
  void write(const std::filesystem::path& path, const WallMetric* metric = nullptr,
             std::span<const SizeGrid> painted = {}) const;

 private:
  struct Impl;
  explicit LevelSet(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The section of the wall of a .vdb body by the plane where coordinate `axis` is `offset` (after scaling),
/// in the other two coordinates in the order x, y, z: closed curves through points of the wall half a voxel
/// apart, splines unless they turn by more than 30 degrees from point to point. Curves of two voxels and less
/// are left out, with a warning. Errors: those of LevelSet::from_vdb and of slice(); kSurfaceInvalid where
/// the grid ends before the wall does; kDomain where all curves are left out.
Outline section_of_vdb(const std::filesystem::path& path, const LevelSetOptions& options, double scale,
                       int axis, double offset, std::vector<std::string>& warnings);

/// Number of grid voxels along the longest extent of the body when no voxel size is given.
inline constexpr double kDefaultVoxelsAcross = 200.0;

}  // namespace lamina
