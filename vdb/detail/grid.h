// The narrow-band level set grid as OpenVDB keeps it, behind plain types: OpenVDB's headers stay in grid.cpp
// and vdb_file.cpp.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/field.h"
#include "core/parallel.h"
#include "vdb/detail/sparse.h"
#include "vdb/level_set.h"
#include "vdb/size_grid.h"
#include "vdb/surface.h"

namespace lamina::detail {

/// A float level set with values in voxels: OpenVDB's tolerances are absolute, and voxels of a small body
/// would drown in them.
class BandGrid {
 public:
  BandGrid();
  ~BandGrid();
  BandGrid(BandGrid&&) noexcept;
  BandGrid& operator=(BandGrid&&) noexcept;

  /// Voxels of edge `voxel` with one centre at `origin`. The distances are those of tools::meshToVolume:
  /// exact next to the facets, too large by up to 1.5 voxels elsewhere.
  static BandGrid from_surface(const Surface& surface, double voxel, double half_width_vox,
                               const Vec3& origin);
  /// A band with the topology of `grid`, without values: polish() follows. `unit` is the length values are
  /// divided by.
  static BandGrid like(const SparseGrid& grid, const Lattice& lattice, double unit, double half_width_vox);

  struct Polish {
    std::int64_t changed = 0;  ///< voxels off by more than kPolishTolerance voxels
    double worst = 0.0;        ///< largest correction, voxels
  };
  /// Replaces every active value by `exact`(world point, upper bound of the distance), both in world units,
  /// and drops voxels beyond the half width.
  Polish polish(FunctionRef<double(const Vec3&, double)> exact);

  [[nodiscard]] BandGrid copy() const;
  /// One Gaussian pass of standard deviation kGaussianSigma voxels.
  void smooth();
  [[nodiscard]] SparseGrid extract() const;

  [[nodiscard]] const Lattice& lattice() const { return lattice_; }
  [[nodiscard]] double voxel() const { return unit_; }
  [[nodiscard]] std::int64_t active_voxels() const;
  [[nodiscard]] double bytes() const;

  /// The grids of LevelSet::write, all lengths times stored_scale(voxel()). h and log_metric of the samples
  /// are written when `with_metric`. `at` gets a voxel's centre and its value. Errors: kFileWrite.
  struct Sample {
    WallPoint wall;
    Vec3 h = Vec3::Zero();
    Sym<3> log_metric{};
  };
  void write(const std::filesystem::path& path, FunctionRef<Sample(const Vec3&, double)> at, bool with_metric,
             std::span<const SizeGrid> painted) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  Lattice lattice_;
  double unit_ = 1.0;
};

inline constexpr double kGaussianSigma = 1.633;   ///< voxels: four box passes of width three
inline constexpr double kPolishTolerance = 1e-3;  ///< voxels

/// OpenVDB takes no transform of voxels below about 1.4e-5. What is stored is as many times larger, a power
/// of 1000, and the grids say so under this name.
double stored_scale(double voxel);
inline constexpr const char* kScaleMetadata = "lamina:scale";

/// Bytes that building the band of a surface takes at its peak.
double band_bytes(double area, double voxel, double half_width_vox);
/// The voxel whose band takes `bytes`.
double band_voxel(double area, double bytes, double half_width_vox);

/// A scalar grid read from a file, < 0 inside.
struct LoadedGrid {
  SparseGrid values;
  Lattice lattice;
  double half_width_vox = 3.0;
  Surface wall;  ///< the zero set as triangles, outward oriented, to a fraction of a voxel
};

/// Chooses and reads a grid, see LevelSet::from_vdb.
LoadedGrid load_grid(const std::filesystem::path& path, const LevelSetOptions& options, double scale);

}  // namespace lamina::detail
