#include "core/metric.h"

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

template <int D>
constexpr int upper_index(int row, int col) {
  if constexpr (D == 2) return row == 0 ? col : 2;
  return row == 0 ? col : (row == 1 ? 2 + col : 5);
}

// One-sided Jacobi: rotates the columns of C until they are orthogonal; V collects the rotations, C = W
// diag(s) V^T. Small singular values keep full relative accuracy, which an eigen-decomposition of C^T C would
// lose.
template <int D>
void orthogonalize_columns(Mat<D>& C, Mat<D>& V) {
  constexpr int kMaxSweeps = 30;
  constexpr double kTolerance = 1e-15;
  V.setIdentity();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    bool rotated = false;
    for (int p = 0; p < D; ++p) {
      for (int q = p + 1; q < D; ++q) {
        const double a = C.col(p).squaredNorm();
        const double b = C.col(q).squaredNorm();
        const double c = C.col(p).dot(C.col(q));
        if (std::abs(c) <= kTolerance * std::sqrt(a * b)) continue;
        rotated = true;
        const double zeta = (b - a) / (2.0 * c);
        const double t = (zeta >= 0.0 ? 1.0 : -1.0) / (std::abs(zeta) + std::sqrt(1.0 + zeta * zeta));
        const double cs = 1.0 / std::sqrt(1.0 + t * t);
        const double sn = cs * t;
        for (Mat<D>* m : {&C, &V}) {
          const Vec<D> mp = m->col(p);
          m->col(p) = cs * mp - sn * m->col(q);
          m->col(q) = sn * mp + cs * m->col(q);
        }
      }
    }
    if (!rotated) return;
  }
}

}  // namespace

template <int D>
Metric<D>::Metric() : Metric(isotropic(1.0)) {}

template <int D>
Metric<D> Metric<D>::isotropic(double h) {
  Metric m{std::array<double, kSymSize<D>>{}};
  for (int i = 0; i < D; ++i) m.u_[upper_index<D>(i, i)] = 1.0 / h;
  return m;
}

template <int D>
Metric<D> Metric<D>::from_frame(const Mat<D>& axes, const Vec<D>& sizes) {
  return from_factor(sizes.cwiseInverse().asDiagonal() * axes);
}

template <int D>
Metric<D> Metric<D>::from_factor(const Mat<D>& A) {
  // Householder QR; only R is kept, with a positive diagonal.
  Mat<D> R = A;
  for (int k = 0; k + 1 < D; ++k) {
    double tail = 0.0;
    for (int i = k + 1; i < D; ++i) tail += R(i, k) * R(i, k);
    if (tail == 0.0) continue;
    const double norm = std::sqrt(R(k, k) * R(k, k) + tail);
    const double alpha = R(k, k) > 0.0 ? -norm : norm;
    Vec<D> v = Vec<D>::Zero();
    v[k] = R(k, k) - alpha;
    for (int i = k + 1; i < D; ++i) v[i] = R(i, k);
    const double beta = 2.0 / (v[k] * v[k] + tail);
    for (int j = k; j < D; ++j) {
      double dot = 0.0;
      for (int i = k; i < D; ++i) dot += v[i] * R(i, j);
      for (int i = k; i < D; ++i) R(i, j) -= beta * dot * v[i];
    }
  }
  Metric m{std::array<double, kSymSize<D>>{}};
  for (int i = 0; i < D; ++i) {
    const double sign = R(i, i) < 0.0 ? -1.0 : 1.0;
    for (int j = i; j < D; ++j) m.u_[upper_index<D>(i, j)] = sign * R(i, j);
  }
  return m;
}

template <int D>
std::optional<Metric<D>> Metric<D>::from_tensor(const Sym<D>& t) {
  const Mat<D> M = to_matrix<D>(t);
  Metric m{std::array<double, kSymSize<D>>{}};
  for (int i = 0; i < D; ++i) {
    for (int j = i; j < D; ++j) {
      double s = M(i, j);
      for (int k = 0; k < i; ++k) s -= m.u_[upper_index<D>(k, i)] * m.u_[upper_index<D>(k, j)];
      if (i == j) {
        if (!(s > 0.0) || !std::isfinite(s)) return std::nullopt;
        m.u_[upper_index<D>(i, i)] = std::sqrt(s);
      } else {
        m.u_[upper_index<D>(i, j)] = s / m.u_[upper_index<D>(i, i)];
      }
    }
  }
  return m;
}

template <int D>
Mat<D> Metric<D>::factor() const {
  Mat<D> U = Mat<D>::Zero();
  for (int i = 0; i < D; ++i)
    for (int j = i; j < D; ++j) U(i, j) = u_[upper_index<D>(i, j)];
  return U;
}

template <int D>
Sym<D> Metric<D>::tensor() const {
  const Mat<D> U = factor();
  return to_sym<D>(U.transpose() * U);
}

template <int D>
Metric<D> Metric<D>::scaled(double s) const {
  Metric m = *this;
  for (double& u : m.u_) u /= s;
  return m;
}

template <int D>
typename Metric<D>::Principal Metric<D>::principal() const {
  Mat<D> C = factor();
  Mat<D> V;
  orthogonalize_columns<D>(C, V);
  std::array<int, D> order;
  for (int i = 0; i < D; ++i) order[i] = i;
  const Vec<D> s = C.colwise().norm();
  std::sort(order.begin(), order.end(), [&](int a, int b) { return s[a] > s[b] || (s[a] == s[b] && a < b); });
  Principal p;
  for (int i = 0; i < D; ++i) {
    p.sizes[i] = 1.0 / s[order[i]];
    p.axes.row(i) = V.col(order[i]).transpose();
  }
  return p;
}

template <int D>
Metric<D> intersect(const Metric<D>& a, const Metric<D>& b) {
  // In the unit space of a, b is C = Ub Ua^-1 = W diag(s) V^T; sizes of b that are smaller (s > 1) win there.
  const Mat<D> Ua = a.factor();
  const Mat<D> inverse = Ua.template triangularView<Eigen::Upper>().solve(Mat<D>::Identity());
  Mat<D> C = b.factor() * inverse;
  Mat<D> V;
  orthogonalize_columns<D>(C, V);
  const Vec<D> s = C.colwise().norm();
  if ((s.array() <= 1.0).all()) return a;
  if ((s.array() >= 1.0).all()) return b;
  return Metric<D>::from_factor(s.cwiseMax(1.0).asDiagonal() * V.transpose() * Ua);
}

template <int D>
Sym<D> Metric<D>::log() const {
  const Principal p = principal();
  const Vec<D> l = -2.0 * p.sizes.array().log();
  return to_sym<D>(p.axes.transpose() * l.asDiagonal() * p.axes);
}

// Symmetric Jacobi rotations: the entries of a logarithm are of order 10, so no accuracy is lost.
template <int D>
Metric<D> Metric<D>::from_log(const Sym<D>& log) {
  Mat<D> L = to_matrix<D>(log);
  Mat<D> V = Mat<D>::Identity();
  constexpr int kSweeps = 12;
  constexpr double kSettled = 4e-15;  // of the diagonal: what rounding leaves; sizes feel its square
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double off = 0.0;
    for (int p = 0; p < D; ++p)
      for (int q = p + 1; q < D; ++q) off = std::max(off, std::abs(L(p, q)));
    if (off <= kSettled * L.diagonal().cwiseAbs().maxCoeff()) break;
    for (int p = 0; p < D; ++p) {
      for (int q = p + 1; q < D; ++q) {
        if (L(p, q) == 0.0) continue;
        const double theta = (L(q, q) - L(p, p)) / (2.0 * L(p, q));
        const double r = (theta >= 0.0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(1.0 + theta * theta));
        const double cs = 1.0 / std::sqrt(1.0 + r * r);
        Mat<D> J = Mat<D>::Identity();
        J(p, p) = J(q, q) = cs;
        J(p, q) = cs * r;
        J(q, p) = -cs * r;
        L = (J.transpose() * L * J).eval();
        V = (V * J).eval();
      }
    }
  }
  const Vec<D> sizes = (-0.5 * L.diagonal().array()).exp();
  return from_frame(V.transpose(), sizes);
}

template <int D>
Metric<D> interpolate_log_euclidean(const Metric<D>& a, const Metric<D>& b, double t) {
  const Sym<D> la = a.log(), lb = b.log();
  Sym<D> blend;
  for (std::size_t i = 0; i < blend.size(); ++i) blend[i] = (1.0 - t) * la[i] + t * lb[i];
  return Metric<D>::from_log(blend);
}

double edge_length(double la, double lb) {
  // Near la == lb the quotient loses digits; its series is the mean up to a relative (ratio - 1)^2 / 12.
  constexpr double kNear = 1e-3;
  const double low = std::min(la, lb);
  const double high = std::max(la, lb);
  if (high - low <= kNear * low) return 0.5 * (la + lb);
  return (high - low) / std::log(high / low);
}

template <int D>
double cell_quality(const std::array<Vec<D>, D + 1>& x, const std::array<const Metric<D>*, D + 1>& m) {
  int best = 0;
  for (int i = 1; i <= D; ++i)
    if (m[i]->sqrt_det() > m[best]->sqrt_det()) best = i;
  return mean_ratio<D>(x, *m[best]);
}

template class Metric<2>;
template class Metric<3>;
template Metric<2> intersect(const Metric<2>&, const Metric<2>&);
template Metric<3> intersect(const Metric<3>&, const Metric<3>&);
template Metric<2> interpolate_log_euclidean(const Metric<2>&, const Metric<2>&, double);
template Metric<3> interpolate_log_euclidean(const Metric<3>&, const Metric<3>&, double);
template double cell_quality<2>(const std::array<Vec2, 3>&, const std::array<const Metric<2>*, 3>&);
template double cell_quality<3>(const std::array<Vec3, 4>&, const std::array<const Metric<3>*, 4>&);

}  // namespace lamina
