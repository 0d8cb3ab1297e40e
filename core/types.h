// Scalar, vector and box types shared by every part of Lamina.
//
// Conventions that hold everywhere: world coordinates in the unit of the input, `double`; phi < 0 inside the
// body; a positive cell is right-handed (det of the edge vectors from vertex 0 is > 0); symmetric matrices
// are stored xx, xy, yy (, xz, yz, zz), which is also the order of GMF .sol files.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

namespace lamina {

/// Index of a vertex, cell or facet. Meshes are limited to 2^31 - 1 of each.
using Index = std::int32_t;
inline constexpr Index kNone = -1;

template <int D>
using Vec = Eigen::Matrix<double, D, 1>;
template <int D>
using Mat = Eigen::Matrix<double, D, D>;
using Vec3 = Vec<3>;
using Vec2 = Vec<2>;
using Mat3 = Mat<3>;

/// Number of independent entries of a symmetric D x D matrix.
template <int D>
inline constexpr int kSymSize = D*(D + 1) / 2;

/// Symmetric matrix, entries xx, xy, yy (, xz, yz, zz).
template <int D>
using Sym = std::array<double, kSymSize<D>>;

/// The entries of a symmetric matrix, and back.
template <int D>
Sym<D> to_sym(const Mat<D>& m) {
  if constexpr (D == 2)
    return {m(0, 0), m(0, 1), m(1, 1)};
  else
    return {m(0, 0), m(0, 1), m(1, 1), m(0, 2), m(1, 2), m(2, 2)};
}
template <int D>
Mat<D> to_matrix(const Sym<D>& s) {
  Mat<D> m;
  if constexpr (D == 2)
    m << s[0], s[1], s[1], s[2];
  else
    m << s[0], s[1], s[3], s[1], s[2], s[4], s[3], s[4], s[5];
  return m;
}

/// Axis-aligned box; empty when any lo > hi.
template <int D>
struct Box {
  Vec<D> lo = Vec<D>::Constant(1e300);
  Vec<D> hi = Vec<D>::Constant(-1e300);

  [[nodiscard]] bool empty() const { return (lo.array() > hi.array()).any(); }
  [[nodiscard]] Vec<D> size() const { return hi - lo; }
  [[nodiscard]] Vec<D> center() const { return 0.5 * (lo + hi); }
  [[nodiscard]] double diagonal() const { return (hi - lo).norm(); }
  [[nodiscard]] double volume() const { return empty() ? 0.0 : (hi - lo).prod(); }
  [[nodiscard]] bool contains(const Vec<D>& x) const {
    return (x.array() >= lo.array()).all() && (x.array() <= hi.array()).all();
  }
  /// Distance from x to the box, 0 inside.
  [[nodiscard]] double outer_distance(const Vec<D>& x) const {
    return (lo - x).cwiseMax(x - hi).cwiseMax(0.0).norm();
  }
  /// Distance from x to the nearest face when inside, 0 outside.
  [[nodiscard]] double inner_distance(const Vec<D>& x) const {
    return std::max(0.0, (x - lo).cwiseMin(hi - x).minCoeff());
  }
  void extend(const Vec<D>& x) {
    lo = lo.cwiseMin(x);
    hi = hi.cwiseMax(x);
  }
  [[nodiscard]] Box padded(double margin) const {
    Box b = *this;
    b.lo.array() -= margin;
    b.hi.array() += margin;
    return b;
  }
};

}  // namespace lamina
