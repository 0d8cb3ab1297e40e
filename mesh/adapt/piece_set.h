// The pieces of the boundary, outer or between two regions, that a vertex, edge or facet lies on, in the
// eight bytes of a word.
#pragma once

#include <bit>
#include <cstdint>

namespace lamina::adapt_detail {

/// Number of a piece of the boundary: 1, 2, ...; 0 where there is none.
using PieceId = std::uint16_t;
inline constexpr int kMostPieces = 0xfffe;

/// Ascending numbers of at most four pieces, each in 16 bits. A vertex on more of them is a corner, which
/// does not move: what the set has no place for only refuses it a few operations.
class PieceSet {
 public:
  PieceSet() = default;
  static PieceSet of(int piece) { return PieceSet(static_cast<std::uint64_t>(piece)); }

  [[nodiscard]] bool empty() const { return word_ == 0; }
  [[nodiscard]] int size() const { return (64 - std::countl_zero(word_) + 15) / 16; }
  [[nodiscard]] int operator[](int k) const { return static_cast<int>(word_ >> 16 * k & 0xffffU); }
  [[nodiscard]] bool contains(int piece) const {
    for (std::uint64_t rest = word_; rest != 0; rest >>= 16U)
      if (static_cast<int>(rest & 0xffffU) == piece) return true;
    return false;
  }
  [[nodiscard]] bool within(PieceSet other) const {
    for (std::uint64_t rest = word_; rest != 0; rest >>= 16U)
      if (!other.contains(static_cast<int>(rest & 0xffffU))) return false;
    return true;
  }
  /// The lowest four stay.
  void add(int piece) {
    if (contains(piece)) return;
    int k = 0;
    while (k < size() && (*this)[k] < piece) ++k;
    if (k == 4) return;
    const std::uint64_t below = (std::uint64_t{1} << 16 * k) - 1;
    const std::uint64_t above = k == 3 ? 0 : (word_ & ~below) << 16U;
    word_ = (word_ & below) | static_cast<std::uint64_t>(piece) << 16 * k | above;
  }
  /// Marks a corner that the number of its pieces need not tell.
  void fix() { add(kFixed); }
  /// Whether a vertex with these pieces has nowhere to go: a corner, in 2D every border of two pieces, in 3D
  /// lines where four meet.
  template <int D>
  [[nodiscard]] bool is_corner() const {
    const int n = size();
    return n >= (D == 2 ? 2 : 4) || (n > 0 && (*this)[n - 1] == kFixed);
  }
  bool operator==(const PieceSet&) const = default;

 private:
  explicit PieceSet(std::uint64_t word) : word_(word) {}
  static constexpr int kFixed = 0xffff;
  std::uint64_t word_ = 0;
};

}  // namespace lamina::adapt_detail
