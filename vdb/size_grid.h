// Element sizes painted into a float grid of a .vdb file, as artists do in Houdini or Blender.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/field.h"

namespace lamina {

/// Every active voxel (or tile) bounds the element size within its box by its value, and beyond by its value
/// plus a rate times the distance. Inactive voxels ask for nothing.
class SizeGrid : public SizeField {
 public:
  /// Reads grid `name` of a file; coordinates and values are multiplied by `scale` (unit conversion). Values
  /// are lengths in the units of the coordinates. Errors: kFileMissing, kFileFormat (corrupt, truncated),
  /// kLevelSetGrid naming the grids there are, or the value that is no size, with its place.
  static SizeGrid read(const std::filesystem::path& path, const std::string& name, double scale = 1.0);

  [[nodiscard]] double bound(const Vec3& x, double rate, double limit) const override;
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Smallest and largest size painted, world units.
  [[nodiscard]] std::pair<double, double> range() const;
  /// Bounds of the painted voxels.
  [[nodiscard]] Box<3> bounds() const;

  struct Impl;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  SizeGrid(std::string name, std::shared_ptr<const Impl> impl);
  std::string name_;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace lamina
