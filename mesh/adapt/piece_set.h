// The pieces of the boundary, outer or between two regions, that a vertex, edge or facet lies on, in the
// eight bytes of a word.
#pragma once

#include <bit>
#include <cstdint>

namespace lamina::adapt_detail {

/// Number of a piece of the boundary: 1, 2, ...; 0 where there is none.
using PieceId = std::uint16_t;
inline constexpr int kMostPieces = 0xbfff;
/// Numbers above those of pieces are lines (mesh/adapt/lines.h).
inline constexpr int kFirstLine = 0xc000, kLastLine = 0xfffe;

/// Ascending numbers of at most four pieces, each in 16 bits; the last may be a line. A vertex on more of
/// them is a corner, which does not move: what the set has no place for only refuses it a few operations.
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
  /// Marks a corner that the number of its pieces need not tell; a line may have to give way.
  void fix() {
    if (size() == 4 && line() != 0) word_ |= std::uint64_t{kFixed} << 48U;
    add(kFixed);
  }
  /// 0: none.
  [[nodiscard]] int line() const {
    const int last = empty() ? 0 : (*this)[size() - 1];
    return last >= kFirstLine && last <= kLastLine ? last : 0;
  }
  /// Whether a vertex with these pieces may be one of a line; corners need not tell.
  [[nodiscard]] bool may_have_line() const {
    return size() == 4 || (!empty() && (*this)[size() - 1] >= kFirstLine);
  }
  /// Whether a vertex with these pieces has nowhere to go: a corner, in 2D every border of two pieces, in 3D
  /// lines where four meet.
  template <int D>
  [[nodiscard]] bool is_corner() const {
    const int n = size();
    if (n == 0) return false;
    const int last = (*this)[n - 1];
    return last == kFixed || n - (last >= kFirstLine ? 1 : 0) >= (D == 2 ? 2 : 4);
  }
  bool operator==(const PieceSet&) const = default;

 private:
  explicit PieceSet(std::uint64_t word) : word_(word) {}
  static constexpr int kFixed = 0xffff;
  std::uint64_t word_ = 0;
};

}  // namespace lamina::adapt_detail
