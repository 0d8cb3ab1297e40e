// At each level, from the top, the curve runs through the sub-cubes in an order that depends on how the cube
// is turned: axes exchanged and reflected as in Skilling's algorithm, and the parity of the Gray code. These
// states are enumerated at compile time; a key is a walk through their table, two levels a step.
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

// How the cube of a level is turned: its coordinate i is bit axis[i] of the point, reflected or not.
template <int D>
struct Turn {
  std::array<unsigned, D> axis{}, flip{};
  unsigned parity = 0;
  constexpr bool operator==(const Turn&) const = default;
};

// The place along the curve of the sub-cube `digit` (axis 0 in the highest bit); turns into that sub-cube.
template <int D>
constexpr unsigned descend(Turn<D>& t, unsigned digit) {
  std::array<unsigned, D> bit{};
  for (int i = 0; i < D; ++i)
    bit[i] = ((digit >> (static_cast<unsigned>(D) - 1U - t.axis[i])) & 1U) ^ t.flip[i];
  unsigned place = 0, gray = 0;
  for (int i = 0; i < D; ++i) {
    gray ^= bit[i];
    place = place << 1U | (gray ^ t.parity);
    if (bit[i] != 0) {
      t.flip[0] ^= 1U;
    } else if (i > 0) {
      std::swap(t.axis[0], t.axis[i]);
      std::swap(t.flip[0], t.flip[i]);
    }
  }
  t.parity ^= gray;
  return place;
}

template <int D>
struct Curve {
  static constexpr unsigned kDigits = 1U << static_cast<unsigned>(D);
  static constexpr unsigned kMostTurns = D == 2 ? 16 : 96;
  // [turn][digit]: place, and the next turn above it.
  std::array<std::array<std::uint16_t, kDigits>, kMostTurns> one{};
  std::array<std::array<std::uint16_t, kDigits * kDigits>, kMostTurns> two{};

  constexpr Curve() {
    std::array<Turn<D>, kMostTurns> turns{};
    for (int i = 0; i < D; ++i) turns[0].axis[i] = static_cast<unsigned>(i);
    unsigned count = 1;
    for (unsigned k = 0; k < count; ++k) {
      for (unsigned digit = 0; digit < kDigits; ++digit) {
        Turn<D> t = turns[k];
        const unsigned place = descend<D>(t, digit);
        unsigned next = 0;
        while (next < count && !(turns[next] == t)) ++next;
        if (next == count) turns[count++] = t;
        one[k][digit] = static_cast<std::uint16_t>(next * kDigits + place);
      }
    }
    for (unsigned k = 0; k < count; ++k) {
      for (unsigned digits = 0; digits < kDigits * kDigits; ++digits) {
        const unsigned upper = one[k][digits / kDigits];
        const unsigned lower = one[upper / kDigits][digits % kDigits];
        two[k][digits] = static_cast<std::uint16_t>((lower / kDigits * kDigits + upper % kDigits) * kDigits +
                                                    lower % kDigits);
      }
    }
  }
};

template <int D>
constexpr Curve<D> kCurve;

}  // namespace

template <int D>
std::uint64_t hilbert_key(const Vec<D>& x, const Box<D>& box) {
  constexpr int kBits = 63 / D;
  static_assert(kBits % 2 == 1);
  constexpr double kCells = static_cast<double>(std::uint64_t{1} << kBits);
  std::uint64_t digits = 0;
  for (int i = 0; i < D; ++i) {
    const double u = (x[i] - box.lo[i]) / std::max(box.hi[i] - box.lo[i], 1e-300) * kCells;
    digits |= spread<D>(static_cast<std::uint64_t>(std::clamp(u, 0.0, kCells - 1.0)))
              << static_cast<unsigned>(D - 1 - i);
  }
  constexpr unsigned kStep = 2 * D, kPlaces = 1U << kStep;
  unsigned shift = D * (kBits - 1);
  unsigned entry = kCurve<D>.one[0][digits >> shift];
  std::uint64_t key = entry % Curve<D>::kDigits;
  unsigned turn = entry / Curve<D>::kDigits;
  while (shift > 0) {
    shift -= kStep;
    entry = kCurve<D>.two[turn][(digits >> shift) % kPlaces];
    key = key << kStep | entry % kPlaces;
    turn = entry / kPlaces;
  }
  return key;
}

template std::uint64_t hilbert_key(const Vec2&, const Box<2>&);
template std::uint64_t hilbert_key(const Vec3&, const Box<3>&);

}  // namespace lamina
