// The determinant is first evaluated in doubles together with a bound of its rounding error. When the bound
// does not settle the sign, coordinate differences are taken as exact two-term expansions and the determinant
// is summed without error; the largest component then carries the sign. Degenerate input pays microseconds,
// all other input nanoseconds.
#include "core/predicates.h"

#include <array>
#include <cmath>

namespace lamina {
namespace {

constexpr double kEpsilon = 0x1p-53;
constexpr double kBound2 = (3.0 + 16.0 * kEpsilon) * kEpsilon;
constexpr double kBound3 = (7.0 + 56.0 * kEpsilon) * kEpsilon;

struct TwoTerm {
  double high, low;
};

TwoTerm two_sum(double a, double b) {
  const double x = a + b;
  const double bv = x - a;
  return {x, (a - (x - bv)) + (b - bv)};
}

TwoTerm two_diff(double a, double b) { return two_sum(a, -b); }

TwoTerm two_product(double a, double b) {
  const double x = a * b;
  return {x, std::fma(a, b, -x)};
}

// A sum of doubles without overlap, in increasing magnitude.
template <int N>
struct Expansion {
  std::array<double, N> term{};
  int size = 0;

  void push(double t) {
    if (t != 0.0) term[size++] = t;
  }
  [[nodiscard]] double leading() const { return size == 0 ? 0.0 : term[size - 1]; }
};

Expansion<2> difference(double a, double b) {
  const TwoTerm d = two_diff(a, b);
  Expansion<2> e;
  e.push(d.low);
  e.push(d.high);
  return e;
}

// Adds one double to an expansion (grow-expansion with elimination of zeros).
template <int N>
void add(Expansion<N>& e, double b) {
  Expansion<N> h;
  double q = b;
  for (int i = 0; i < e.size; ++i) {
    const TwoTerm s = two_sum(q, e.term[i]);
    h.push(s.low);
    q = s.high;
  }
  h.push(q);
  e = h;
}

// h += sign * e * f, exactly. Components of e * f number at most 2 |e| |f|.
template <int N, int A, int B>
void add_product(Expansion<N>& h, const Expansion<A>& e, const Expansion<B>& f, double sign) {
  for (int i = 0; i < e.size; ++i) {
    for (int j = 0; j < f.size; ++j) {
      const TwoTerm p = two_product(e.term[i], sign * f.term[j]);
      add(h, p.low);
      add(h, p.high);
    }
  }
}

double orient2d_exact(const Vec2& a, const Vec2& b, const Vec2& c) {
  Expansion<32> det;
  add_product(det, difference(b[0], a[0]), difference(c[1], a[1]), 1.0);
  add_product(det, difference(b[1], a[1]), difference(c[0], a[0]), -1.0);
  return det.leading();
}

double orient3d_exact(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  std::array<std::array<Expansion<2>, 3>, 3> m;
  for (int k = 0; k < 3; ++k) {
    m[0][k] = difference(b[k], a[k]);
    m[1][k] = difference(c[k], a[k]);
    m[2][k] = difference(d[k], a[k]);
  }
  Expansion<256> det;
  for (int k = 0; k < 3; ++k) {
    Expansion<32> minor;
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;
    add_product(minor, m[1][i], m[2][j], 1.0);
    add_product(minor, m[1][j], m[2][i], -1.0);
    add_product(det, minor, m[0][k], 1.0);
  }
  return det.leading();
}

}  // namespace

double orient2d(const Vec2& a, const Vec2& b, const Vec2& c) {
  const double left = (b[0] - a[0]) * (c[1] - a[1]);
  const double right = (b[1] - a[1]) * (c[0] - a[0]);
  const double det = left - right;
  const double bound = kBound2 * (std::abs(left) + std::abs(right));
  if (std::abs(det) > bound) return det;
  return orient2d_exact(a, b, c);
}

double orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a;
  const Vec3 v = c - a;
  const Vec3 w = d - a;
  const double vwx = v[1] * w[2];
  const double wvx = v[2] * w[1];
  const double vwy = v[2] * w[0];
  const double wvy = v[0] * w[2];
  const double vwz = v[0] * w[1];
  const double wvz = v[1] * w[0];
  const double det = u[0] * (vwx - wvx) + u[1] * (vwy - wvy) + u[2] * (vwz - wvz);
  const double permanent = std::abs(u[0]) * (std::abs(vwx) + std::abs(wvx)) +
                           std::abs(u[1]) * (std::abs(vwy) + std::abs(wvy)) +
                           std::abs(u[2]) * (std::abs(vwz) + std::abs(wvz));
  if (std::abs(det) > kBound3 * permanent) return det;
  return orient3d_exact(a, b, c, d);
}

}  // namespace lamina
