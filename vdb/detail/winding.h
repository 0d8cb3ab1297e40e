// Generalised winding number of a set of triangles: 1 inside a closed outward oriented shell, 0 outside,
// smooth across holes.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/box_tree.h"

namespace lamina::detail {

using Corners = std::array<Vec3, 3>;

/// Winding number by cluster expansions [Barill2018].
class DipoleTree {
 public:
  explicit DipoleTree(std::vector<Corners> triangles);
  DipoleTree() = default;
  /// Near triangles exactly, clusters seen under a small angle by their second-order expansion; error below
  /// 0.02.
  [[nodiscard]] double at(const Vec3& x) const { return expand(x, 1.0); }
  /// The same with an error below kRoughError, in two fifths of the time.
  [[nodiscard]] double roughly_at(const Vec3& x) const { return expand(x, kRoughReach2); }
  static constexpr double kRoughError = 0.1;

 private:
  static constexpr double kRoughReach2 = 0.3;  ///< of the square of at()'s
  struct Cluster {
    Vec3 center = Vec3::Zero();
    double radius = 0.0;
    Vec3 dipole = Vec3::Zero();  ///< sum of area times normal
    Mat3 moment = Mat3::Zero();  ///< sum of area times (centroid - center) normal^T
  };
  /// The clusters of both children of a node side by side, for arithmetic on both at once.
  struct Pair {
    std::array<Eigen::Array2d, 3> center, dipole;
    std::array<Eigen::Array2d, 6> moment;  ///< xx, yy, zz and the sums of yz, zx, xy with their mirrors
    Eigen::Array2d trace, reach2;          ///< far: squared distance of the centre beyond reach2
    void set(int child, const Cluster& cluster);
    [[nodiscard]] Eigen::Array2d flux(const Eigen::Array2d* r, const Eigen::Array2d& d2) const;
  };
  [[nodiscard]] double expand(const Vec3& x, double reach2) const;
  Cluster summarize(std::int32_t code, std::vector<Index>& leaves);

  BoxTree tree_;
  std::vector<Pair> clusters_;      ///< of the children of each node
  std::vector<Corners> triangles_;  ///< in leaf order
};

class Winding {
 public:
  Winding(std::span<const Vec3> points, std::span<const std::array<Index, 3>> triangles,
          std::span<const Index> subset);
  Winding() = default;

  [[nodiscard]] double at(const Vec3& x) const { return crossings(turned(x)) - caps_.at(x); }
  /// Whether |at(x)| exceeds 1/2.
  [[nodiscard]] bool encloses(const Vec3& x) const;

 private:
  /// Signed number of triangles and caps that the ray from x along +X leaves through; exact. x is turned().
  [[nodiscard]] int crossings(const Vec3& x) const;
  /// The coordinates in another order: the first is the one in which rays are shortest.
  [[nodiscard]] Vec3 turned(const Vec3& x) const {
    return {x[first_], x[(first_ + 1) % 3], x[(first_ + 2) % 3]};
  }

  int first_ = 0;
  BoxTree tree_;
  std::vector<Corners> closed_;  ///< triangles and caps, turned(), in leaf order
  DipoleTree caps_;
};

}  // namespace lamina::detail
