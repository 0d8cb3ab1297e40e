// The bits of the cell coordinates are turned, level by level from the top, into the frame of the curve's
// sub-cube (reflections and exchanges of axes), then interleaved and Gray decoded.
#include "core/hilbert.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lamina {
namespace {

// Moves bit k of the low 63 / D bits to bit D k.
template <int D>
std::uint64_t spread(std::uint64_t x) {
  if constexpr (D == 2) {
    x = (x | x << 16U) & 0x0000FFFF0000FFFFULL;
    x = (x | x << 8U) & 0x00FF00FF00FF00FFULL;
    x = (x | x << 4U) & 0x0F0F0F0F0F0F0F0FULL;
    x = (x | x << 2U) & 0x3333333333333333ULL;
    return (x | x << 1U) & 0x5555555555555555ULL;
  } else {
    x = (x | x << 32U) & 0x001F00000000FFFFULL;
    x = (x | x << 16U) & 0x001F0000FF0000FFULL;
    x = (x | x << 8U) & 0x100F00F00F00F00FULL;
    x = (x | x << 4U) & 0x10C30C30C30C30C3ULL;
    return (x | x << 2U) & 0x1249249249249249ULL;
  }
}

}  // namespace

template <int D>
std::uint64_t hilbert_key(const Vec<D>& x, const Box<D>& box) {
  constexpr int kBits = 63 / D;
  constexpr double kCells = static_cast<double>(std::uint64_t{1} << kBits);
  std::array<std::uint64_t, D> c;
  for (int i = 0; i < D; ++i) {
    const double u = (x[i] - box.lo[i]) / std::max(box.hi[i] - box.lo[i], 1e-300) * kCells;
    c[i] = static_cast<std::uint64_t>(std::clamp(u, 0.0, kCells - 1.0));
  }
  // Without branches: the bits are as good as random.
  for (unsigned bit = kBits - 1; bit > 0; --bit) {
    const std::uint64_t below = (std::uint64_t{1} << bit) - 1;
    for (int i = 0; i < D; ++i) {
      const std::uint64_t set = 0 - ((c[i] >> bit) & 1U);
      const std::uint64_t exchange = (c[0] ^ c[i]) & below & ~set;
      c[0] ^= exchange | (below & set);
      c[i] ^= exchange;
    }
  }
  for (int i = 1; i < D; ++i) c[i] ^= c[i - 1];
  std::uint64_t above = c[D - 1] >> 1U;  // parity of the higher bits of the last coordinate
  for (unsigned shift = 1; shift < kBits; shift *= 2) above ^= above >> shift;
  std::uint64_t key = 0;
  for (int i = 0; i < D; ++i) key |= spread<D>(c[i] ^ above) << static_cast<unsigned>(D - 1 - i);
  return key;
}

template std::uint64_t hilbert_key(const Vec2&, const Box<2>&);
template std::uint64_t hilbert_key(const Vec3&, const Box<3>&);

}  // namespace lamina
