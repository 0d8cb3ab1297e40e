// Metric tensors: pure kernels on single metrics, edges and cells.
//
// A metric M is carried as its upper triangular factor U, M = U^T U, so that |U e| is the length of e in the
// metric and det M = (prod diag U)^2. Boundary-layer metrics are built from a frame and sizes by a QR step
// and are never diagonalised: a closed-form eigen-decomposition is wrong by 70 % at an aspect ratio of 1e4.
// Lengths use the logarithmic form [Loseille2011]; quality is the mean ratio in ONE constant metric per cell,
// that of the vertex with the largest determinant, so that a cell cannot turn inside out between two metrics.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/types.h"

namespace lamina {

template <int D>
class Metric {
 public:
  /// The Euclidean metric.
  Metric();
  /// Size h in every direction. REQUIRES h > 0.
  static Metric isotropic(double h);
  /// From orthonormal directions (rows of `axes`) and the size along each. REQUIRES sizes > 0.
  static Metric from_frame(const Mat<D>& axes, const Vec<D>& sizes);
  /// From a matrix A with M = A^T A. REQUIRES A regular.
  static Metric from_factor(const Mat<D>& A);
  /// From a tensor; empty when it is not (numerically) positive definite.
  static std::optional<Metric> from_tensor(const Sym<D>& tensor);
  /// exp(L) of a symmetric matrix. REQUIRES finite entries.
  static Metric from_log(const Sym<D>& L);

  /// U e.
  [[nodiscard]] Vec<D> map(const Vec<D>& e) const {
    if constexpr (D == 2) {
      return {u_[0] * e[0] + u_[1] * e[1], u_[2] * e[1]};
    } else {
      return {u_[0] * e[0] + u_[1] * e[1] + u_[2] * e[2], u_[3] * e[1] + u_[4] * e[2], u_[5] * e[2]};
    }
  }
  /// |U e|: length of e in the metric.
  [[nodiscard]] double length(const Vec<D>& e) const { return map(e).norm(); }
  /// Size along the unit vector d.
  [[nodiscard]] double size_along(const Vec<D>& d) const { return 1.0 / length(d); }
  /// sqrt(det M): volume in the metric per unit of volume.
  [[nodiscard]] double sqrt_det() const {
    if constexpr (D == 2) return u_[0] * u_[2];
    return u_[0] * u_[3] * u_[kSymSize<D> - 1];
  }
  [[nodiscard]] Mat<D> factor() const;
  [[nodiscard]] Sym<D> tensor() const;
  /// log(M): in single precision still exact to 1e-6 at aspect ratios where M itself has lost its
  /// definiteness.
  [[nodiscard]] Sym<D> log() const;
  /// The same directions with every size multiplied by s.
  [[nodiscard]] Metric scaled(double s) const;
  /// Principal sizes, ascending, and directions as rows of `axes`.
  struct Principal {
    Vec<D> sizes;
    Mat<D> axes;
  };
  [[nodiscard]] Principal principal() const;

 private:
  explicit Metric(const std::array<double, kSymSize<D>>& u) : u_(u) {}
  std::array<double, kSymSize<D>> u_;  // rows of the upper triangle
};

/// Largest metric below both: the size in no direction exceeds that of a or of b. Simultaneous reduction by
/// one-sided Jacobi rotations, accurate for any aspect ratio; a and b have symmetric roles up to rounding.
template <int D>
Metric<D> intersect(const Metric<D>& a, const Metric<D>& b);

/// Interpolation exp((1-t) log a + t log b); t in [0, 1].
template <int D>
Metric<D> interpolate_log_euclidean(const Metric<D>& a, const Metric<D>& b, double t);

/// Length of an edge from its lengths la, lb in the metrics of its two ends: (la - lb) / ln(la / lb).
double edge_length(double la, double lb);

/// Length of the edge p -> q between vertices with metrics a and b.
template <int D>
double edge_length(const Vec<D>& p, const Metric<D>& a, const Vec<D>& q, const Metric<D>& b) {
  const Vec<D> e = q - p;
  return edge_length(a.length(e), b.length(e));
}

/// Cube root, within two units in the last place; the same bits on every machine, unlike std::cbrt. 0 for |x|
/// < 1e-300.
inline double cube_root(double x) {
  const double a = std::abs(x);
  if (a < 1e-300) return 0.0;
  // A third of the exponent gives a start within 4 %, two Halley steps cube the error twice.
  constexpr std::uint64_t kBias = 0x2A9F7893782DA1CEULL;
  double y = std::bit_cast<double>(std::bit_cast<std::uint64_t>(a) / 3 + kBias);
  for (int i = 0; i < 2; ++i) {
    const double cube = y * y * y;
    y *= (cube + a + a) / (cube + cube + a);
  }
  y -= (y * y * y - a) / (3.0 * y * y);
  return x < 0.0 ? -y : y;
}

/// What the shape of a simplex is made of, in the metric.
struct SimplexMeasure {
  double squared_edges;  ///< sum of all squared edge lengths
  double volume;         ///< D! times the signed volume
};

template <int D>
SimplexMeasure measure_simplex(const std::array<const Vec<D>*, D + 1>& x, const Metric<D>& m) {
  // The edges e from vertex 0 tell all the others: the squares of all sum up to (D + 1) sum |e|^2 - |sum
  // e|^2, which is at least sum |e|^2, so that nothing cancels.
  std::array<Vec<D>, D> e;
  double squares = 0.0;
  Vec<D> sum = Vec<D>::Zero();
  for (int i = 0; i < D; ++i) {
    e[i] = m.map(*x[i + 1] - *x[0]);
    squares += e[i].squaredNorm();
    sum += e[i];
  }
  squares = (D + 1) * squares - sum.squaredNorm();
  if constexpr (D == 2) {
    return {squares, e[0][0] * e[1][1] - e[0][1] * e[1][0]};
  } else {
    return {squares, e[0].dot(e[1].cross(e[2]))};
  }
}

/// Mean-ratio quality in (0, 1] of a simplex with vertices x in the constant metric m; 1 for the regular
/// simplex, <= 0 when the cell is not positive.
template <int D>
double mean_ratio(const std::array<const Vec<D>*, D + 1>& x, const Metric<D>& m) {
  const SimplexMeasure s = measure_simplex<D>(x, m);
  if constexpr (D == 2) return 2.0 * 1.7320508075688772 * s.volume / s.squared_edges;
  return 12.0 * cube_root(0.25 * s.volume * std::abs(s.volume)) / s.squared_edges;
}

/// Shape energy of a simplex, mean_ratio^(-D/2): 1 for the regular simplex, infinite when the cell is not
/// positive. Ranks cells as mean_ratio does, costs no root of degree three, and is smooth in the vertices.
template <int D>
double shape_energy(const SimplexMeasure& s) {
  if (!(s.volume > 0.0)) return std::numeric_limits<double>::infinity();
  constexpr double kRegular = D == 2 ? 0.28867513459481288 : 0.048112522432468816;  // of volume / edges^(D/2)
  if constexpr (D == 2) return kRegular * s.squared_edges / s.volume;
  return kRegular * s.squared_edges * std::sqrt(s.squared_edges) / s.volume;
}

template <int D>
double shape_energy(const std::array<const Vec<D>*, D + 1>& x, const Metric<D>& m) {
  return shape_energy<D>(measure_simplex<D>(x, m));
}

template <int D>
double mean_ratio(const std::array<Vec<D>, D + 1>& x, const Metric<D>& m) {
  std::array<const Vec<D>*, D + 1> p;
  for (int i = 0; i <= D; ++i) p[i] = &x[i];
  return mean_ratio<D>(p, m);
}

/// Quality of a cell: mean_ratio in the vertex metric of the largest determinant (ties: the first).
template <int D>
double cell_quality(const std::array<Vec<D>, D + 1>& x, const std::array<const Metric<D>*, D + 1>& m);

/// Edge lengths in [1/sqrt2, sqrt2] are "unit".
inline constexpr double kUnitMin = 0.70710678118654752;
inline constexpr double kUnitMax = 1.41421356237309505;

}  // namespace lamina
