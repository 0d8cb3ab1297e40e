// The bits of the cell coordinates are turned, level by level from the top, into the frame of the curve's
// sub-cube (reflections and exchanges of axes), then interleaved and Gray decoded.
#include "core/hilbert.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lamina {

template <int D>
std::uint64_t hilbert_key(const Vec<D>& x, const Box<D>& box) {
  constexpr int kBits = 63 / D;
  constexpr double kCells = static_cast<double>(std::uint64_t{1} << kBits);
  std::array<std::uint64_t, D> c;
  for (int i = 0; i < D; ++i) {
    const double u = (x[i] - box.lo[i]) / std::max(box.hi[i] - box.lo[i], 1e-300) * kCells;
    c[i] = static_cast<std::uint64_t>(std::clamp(u, 0.0, kCells - 1.0));
  }
  for (std::uint64_t q = std::uint64_t{1} << (kBits - 1); q > 1; q >>= 1U) {
    const std::uint64_t below = q - 1;
    for (int i = 0; i < D; ++i) {
      if (c[i] & q) {
        c[0] ^= below;
      } else {
        const std::uint64_t t = (c[0] ^ c[i]) & below;
        c[0] ^= t;
        c[i] ^= t;
      }
    }
  }
  for (int i = 1; i < D; ++i) c[i] ^= c[i - 1];
  std::uint64_t t = 0;
  for (std::uint64_t q = std::uint64_t{1} << (kBits - 1); q > 1; q >>= 1U)
    if (c[D - 1] & q) t ^= q - 1;
  std::uint64_t key = 0;
  for (int b = kBits - 1; b >= 0; --b)
    for (int i = 0; i < D; ++i) key = key << 1U | (((c[i] ^ t) >> static_cast<unsigned>(b)) & 1U);
  return key;
}

template std::uint64_t hilbert_key(const Vec2&, const Box<2>&);
template std::uint64_t hilbert_key(const Vec3&, const Box<3>&);

}  // namespace lamina
