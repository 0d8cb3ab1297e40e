// OpenVDB itself, behind plain types: writes grids as others would and looks into files, for programs that
// judge what the library reads and writes.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/types.h"

namespace lamina::openvdb_oracle {

/// World coordinates of voxel centres: x = A ijk + origin.
struct Transform {
  Mat3 A = Mat3::Identity();
  Vec3 origin = Vec3::Zero();
};

/// Writes a float level set of `phi` (< 0 inside) over `bounds`, active where |phi| < half_width.
void write_level_set(const std::filesystem::path& path, const Transform& transform, const Box<3>& bounds,
                     double half_width, const std::function<double(const Vec3&)>& phi);

/// Voxels lo..hi (both included) of one value.
struct Painted {
  std::array<int, 3> lo, hi;
  double value;
};
/// Writes a float grid of these boxes, large ones as tiles, the rest inactive with value 0.
void write_painted(const std::filesystem::path& path, const std::string& name, const Transform& transform,
                   const std::vector<Painted>& boxes);

struct Voxel {
  std::array<int, 3> ijk;
  Vec3 x;  ///< its centre, by the transform in the file
  float value;
};
/// Active voxels of the float grid `name`.
std::vector<Voxel> active_voxels(const std::filesystem::path& path, const std::string& name);

/// Values of the active voxels of the Vec3S grid `name`, in the order of active_voxels().
std::vector<Vec3> active_vectors(const std::filesystem::path& path, const std::string& name);

/// What tools::checkLevelSet finds wrong with the float grid `name`, tests 1 to `tests`; empty when it
/// passes.
std::string check_level_set(const std::filesystem::path& path, const std::string& name, int tests);

}  // namespace lamina::openvdb_oracle
