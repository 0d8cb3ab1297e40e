// A sparse grid of values in plain memory, and the C2 cubic B-spline through it.
//
// Blocks of 8^3 values in OpenVDB's leaf order (x slowest). Positions are in index space: voxel centres at
// integers.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/types.h"

namespace lamina::detail {

struct Block {
  std::array<Index, 3> origin{};  ///< multiples of 8
  std::array<double, 512> value{};
  std::array<std::uint64_t, 8> active{};

  [[nodiscard]] bool is_active(std::size_t i) const { return (active[i >> 6] >> (i & 63) & 1) != 0; }
  static std::size_t offset(int x, int y, int z) {
    return static_cast<std::size_t>((x & 7) << 6 | (y & 7) << 3 | (z & 7));
  }
};

/// World coordinates of index space: x = A ijk + origin.
struct Lattice {
  Mat3 A = Mat3::Identity();
  Vec3 origin = Vec3::Zero();
};

/// Value, gradient and Hessian in index space; `active` when all 64 values under it are.
struct SplineSample {
  double f = 0.0;
  Vec3 g = Vec3::Zero();
  Mat3 H = Mat3::Zero();
  bool active = false;
};

class SparseGrid {
 public:
  SparseGrid() = default;
  /// REQUIRES distinct origins. `background` is the value outside all blocks.
  SparseGrid(std::vector<Block> blocks, double background);

  [[nodiscard]] const Block* find(Index i, Index j, Index k) const;
  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }
  [[nodiscard]] double background() const { return background_; }

  /// Turns active values into spline coefficients by `rounds` corrections c += f - B c. Two rounds bring the
  /// spline to within 1e-5 of a voxel of the values; more rounds let the end of the band in.
  void prefilter(int rounds);
  /// A Gaussian pass of standard deviation 1.633 voxels over the active values: four box passes of width
  /// three.
  void blur();
  /// The spline whose coefficients are the values.
  [[nodiscard]] SplineSample spline(const Vec3& ijk) const;

 private:
  /// Values of all blocks after (side middle side) along each axis.
  [[nodiscard]] std::vector<std::array<double, 512>> convolve(double middle, double side) const;
  [[nodiscard]] bool gather(const std::array<Index, 3>& lo, double* out) const;

  std::vector<Block> blocks_;
  std::vector<Index> table_;  ///< open addressing by block position
  double background_ = 0.0;
};

}  // namespace lamina::detail
