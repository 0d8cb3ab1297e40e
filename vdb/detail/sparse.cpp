#include "vdb/detail/sparse.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

std::size_t hash_of(Index i, Index j, Index k) {
  const auto part = [](Index v, std::uint64_t m) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v >> 3)) * m;
  };
  std::uint64_t h =
      part(i, 0x9e3779b97f4a7c15ULL) ^ part(j, 0xc2b2ae3d27d4eb4fULL) ^ part(k, 0x165667b19e3779f9ULL);
  h ^= h >> 29;
  return static_cast<std::size_t>(h * 0xbf58476d1ce4e5b9ULL >> 20);
}

// Weights of the cubic B-spline and its first two derivatives at fraction t.
struct Weights {
  std::array<double, 4> w, d, dd;
  explicit Weights(double t) {
    const double s = 1.0 - t;
    w = {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
         (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0, t * t * t / 6.0};
    d = {-0.5 * s * s, 1.5 * t * t - 2.0 * t, -1.5 * s * s + 2.0 * s, 0.5 * t * t};
    dd = {s, 3.0 * t - 2.0, 3.0 * s - 2.0, t};
  }
};

// (side middle side) along each axis: 10^3 values to 8^3.
void apply_taps(const std::vector<double>& in, double middle, double side, std::array<double, 512>& out) {
  const auto tap = [=](double a, double b, double c) { return side * (a + c) + middle * b; };
  std::array<double, 10 * 10 * 8> z{};
  for (std::size_t r = 0; r < 100; ++r)
    for (std::size_t k = 0; k < 8; ++k)
      z[r * 8 + k] = tap(in[r * 10 + k], in[r * 10 + k + 1], in[r * 10 + k + 2]);
  std::array<double, 10 * 8 * 8> y{};
  for (std::size_t i = 0; i < 10; ++i)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t at = (i * 10 + j) * 8 + k;
        y[(i * 8 + j) * 8 + k] = tap(z[at], z[at + 8], z[at + 16]);
      }
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t r = 0; r < 64; ++r)
      out[i * 64 + r] = tap(y[i * 64 + r], y[(i + 1) * 64 + r], y[(i + 2) * 64 + r]);
}

}  // namespace

SparseGrid::SparseGrid(std::vector<Block> blocks, double background)
    : blocks_(std::move(blocks)), background_(background) {
  std::size_t size = 16;
  while (size < 2 * blocks_.size()) size *= 2;
  table_.assign(size, kNone);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::array<Index, 3>& o = blocks_[b].origin;
    std::size_t slot = hash_of(o[0], o[1], o[2]) & (size - 1);
    while (table_[slot] != kNone) slot = (slot + 1) & (size - 1);
    table_[slot] = static_cast<Index>(b);
  }
}

const Block* SparseGrid::find(Index i, Index j, Index k) const {
  if (table_.empty()) return nullptr;
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = hash_of(i, j, k) & mask; table_[slot] != kNone; slot = (slot + 1) & mask) {
    const Block& b = blocks_[static_cast<std::size_t>(table_[slot])];
    if (b.origin[0] == (i & ~7) && b.origin[1] == (j & ~7) && b.origin[2] == (k & ~7)) return &b;
  }
  return nullptr;
}

bool SparseGrid::gather(const std::array<Index, 3>& lo, double* out) const {
  const Block* near[2][2][2];
  const bool two[3] = {(lo[0] & 7) > 4, (lo[1] & 7) > 4, (lo[2] & 7) > 4};
  for (int a = 0; a <= two[0]; ++a)
    for (int b = 0; b <= two[1]; ++b)
      for (int c = 0; c <= two[2]; ++c) near[a][b][c] = find(lo[0] + 3 * a, lo[1] + 3 * b, lo[2] + 3 * c);
  bool active = true;
  for (int i = 0; i < 4; ++i) {
    const int a = (lo[0] & 7) + i > 7;
    for (int j = 0; j < 4; ++j) {
      const int b = (lo[1] & 7) + j > 7;
      for (int k = 0; k < 4; ++k, ++out) {
        const int c = (lo[2] & 7) + k > 7;
        const Block* block = near[a][b][c];
        if (block == nullptr) {
          *out = background_;
          active = false;
          continue;
        }
        const std::size_t at = Block::offset(lo[0] + i, lo[1] + j, lo[2] + k);
        *out = block->value[at];
        active = active && block->is_active(at);
      }
    }
  }
  return active;
}

SplineSample SparseGrid::spline(const Vec3& ijk) const {
  SplineSample s;
  if (!(ijk.cwiseAbs().maxCoeff() < 1e9)) {
    s.f = background_;
    return s;
  }
  const std::array<double, 3> base{std::floor(ijk[0]), std::floor(ijk[1]), std::floor(ijk[2])};
  const std::array<Index, 3> lo{static_cast<Index>(base[0]) - 1, static_cast<Index>(base[1]) - 1,
                                static_cast<Index>(base[2]) - 1};
  double v[64];
  s.active = gather(lo, v);
  const Weights x(ijk[0] - base[0]), y(ijk[1] - base[1]), z(ijk[2] - base[2]);
  for (std::size_t i = 0; i < 4; ++i) {
    double f = 0.0, fy = 0.0, fz = 0.0, fyy = 0.0, fyz = 0.0, fzz = 0.0;
    for (std::size_t j = 0; j < 4; ++j) {
      const double* row = v + 16 * i + 4 * j;
      const double r = row[0] * z.w[0] + row[1] * z.w[1] + row[2] * z.w[2] + row[3] * z.w[3];
      const double rz = row[0] * z.d[0] + row[1] * z.d[1] + row[2] * z.d[2] + row[3] * z.d[3];
      const double rzz = row[0] * z.dd[0] + row[1] * z.dd[1] + row[2] * z.dd[2] + row[3] * z.dd[3];
      f += y.w[j] * r;
      fy += y.d[j] * r;
      fyy += y.dd[j] * r;
      fz += y.w[j] * rz;
      fyz += y.d[j] * rz;
      fzz += y.w[j] * rzz;
    }
    s.f += x.w[i] * f;
    s.g += Vec3(x.d[i] * f, x.w[i] * fy, x.w[i] * fz);
    s.H(0, 0) += x.dd[i] * f;
    s.H(0, 1) += x.d[i] * fy;
    s.H(0, 2) += x.d[i] * fz;
    s.H(1, 1) += x.w[i] * fyy;
    s.H(1, 2) += x.w[i] * fyz;
    s.H(2, 2) += x.w[i] * fzz;
  }
  s.H(1, 0) = s.H(0, 1);
  s.H(2, 0) = s.H(0, 2);
  s.H(2, 1) = s.H(1, 2);
  return s;
}

std::vector<std::array<double, 512>> SparseGrid::convolve(double middle, double side) const {
  std::vector<std::array<double, 512>> out(blocks_.size());
  for_each_chunk(blocks_.size(), 16, [&](std::size_t begin, std::size_t end) {
    std::vector<double> halo(1000);
    for (std::size_t b = begin; b < end; ++b) {
      const std::array<Index, 3>& o = blocks_[b].origin;
      const Block* near[3][3][3];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          for (int k = 0; k < 3; ++k)
            near[i][j][k] = find(o[0] + 8 * (i - 1), o[1] + 8 * (j - 1), o[2] + 8 * (k - 1));
      for (int i = -1; i < 9; ++i)
        for (int j = -1; j < 9; ++j)
          for (int k = -1; k < 9; ++k) {
            const Block* n = near[(i + 8) >> 3][(j + 8) >> 3][(k + 8) >> 3];
            halo[static_cast<std::size_t>((i + 1) * 100 + (j + 1) * 10 + k + 1)] =
                n == nullptr ? background_ : n->value[Block::offset(i, j, k)];
          }
      apply_taps(halo, middle, side, out[b]);
    }
  });
  return out;
}

void SparseGrid::prefilter(int rounds) {
  std::vector<std::array<double, 512>> f(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) f[b] = blocks_[b].value;
  for (int round = 0; round < rounds; ++round) {
    const std::vector<std::array<double, 512>> smooth = convolve(4.0 / 6.0, 1.0 / 6.0);
    for_each_index(
        blocks_.size(),
        [&](std::size_t b) {
          for (std::size_t i = 0; i < 512; ++i)
            if (blocks_[b].is_active(i)) blocks_[b].value[i] += f[b][i] - smooth[b][i];
        },
        64);
  }
}

void SparseGrid::blur() {
  for (int pass = 0; pass < 4; ++pass) {
    const std::vector<std::array<double, 512>> smooth = convolve(1.0 / 3.0, 1.0 / 3.0);
    for_each_index(
        blocks_.size(),
        [&](std::size_t b) {
          for (std::size_t i = 0; i < 512; ++i)
            if (blocks_[b].is_active(i)) blocks_[b].value[i] = smooth[b][i];
        },
        64);
  }
}

}  // namespace lamina::detail
