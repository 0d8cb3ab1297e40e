// The values of a painted size grid, and the tree that finds the least bound.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/box_tree.h"
#include "vdb/detail/sparse.h"
#include "vdb/size_grid.h"

namespace lamina::detail {

/// A cube of voxels: a block of 8^3 of them, each with its own size or none, or an active tile of one size.
struct SizeCube {
  std::array<Index, 3> origin{};  ///< lowest voxel
  Index side = 8;
  std::int64_t values = -1;        ///< of a block: where its 512 values begin, in Block order
  float least = 0.0F;              ///< smallest size in it
  std::array<float, 8> octants{};  ///< of a block: smallest size in each 4^3; x slowest
};

struct SizeValues {
  std::vector<SizeCube> cubes;
  std::vector<float> values;  ///< infinity where nothing is asked for
  Lattice lattice;
};

/// Reads what SizeGrid::read needs, with its errors.
SizeValues load_sizes(const std::filesystem::path& path, const std::string& name, double scale);

}  // namespace lamina::detail

namespace lamina {

struct SizeGrid::Impl {
  explicit Impl(detail::SizeValues values);

  detail::SizeValues painted;
  detail::BoxTree tree;                     ///< over the cubes, in index space
  std::vector<std::array<float, 2>> least;  ///< per node and child of the tree
  Mat3 to_index;
  double shortest = 0.0;  ///< world length of one unit of index space, in its shortest direction
};

}  // namespace lamina
