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

struct Voxel {
  std::array<int, 3> ijk;
  Vec3 x;  ///< its centre, by the transform in the file
  float value;
};
/// Active voxels of the float grid `name`.
std::vector<Voxel> active_voxels(const std::filesystem::path& path, const std::string& name);

/// What tools::checkLevelSet finds wrong with the float grid `name`, tests 1 to `tests`; empty when it
/// passes.
std::string check_level_set(const std::filesystem::path& path, const std::string& name, int tests);

}  // namespace lamina::openvdb_oracle
