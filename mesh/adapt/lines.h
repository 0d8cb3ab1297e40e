// Lines of edges and points that are kept beside the pieces of the boundary: those that a mesh lists.
//
// A line is a chain of listed edges of one kind between corners, or a loop. Its vertices stay on the input's
// edges and its edges follow them within the tolerance, as on ridges, wherever it runs: between pieces,
// within one, or inside a region. Edges of required lines, and their points, never change.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/types.h"
#include "mesh/adapt/piece_set.h"

namespace lamina::adapt_detail {

struct LineEdge {
  Index a = kNone, b = kNone;  ///< a < b
  PieceId line = 0;
  bool operator==(const LineEdge&) const = default;
};

/// What the mesh keeps between passes. Points on lines carry their numbers in their pieces too.
template <int D>
struct KeptParts {
  std::vector<LineEdge> lines;               ///< sorted by a, b
  std::vector<Index> corners, points;        ///< listed corners and required points, which do not move
  std::vector<std::array<Index, D>> facets;  ///< required, whose edges are required lines
};

/// The lines of some edges, of a piece of the mesh: vertices as it numbers them.
class LineTable {
 public:
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  /// 0: the edge lies on none.
  [[nodiscard]] PieceId at(Index a, Index b) const {
    const auto found = lines_.find(key(a, b));
    return found == lines_.end() ? PieceId{0} : found->second;
  }
  void set(Index a, Index b, PieceId line) { lines_[key(a, b)] = line; }
  void erase(Index a, Index b) { lines_.erase(key(a, b)); }
  /// In no order.
  [[nodiscard]] std::vector<LineEdge> list() const;

 private:
  static std::uint64_t key(Index a, Index b) {
    return static_cast<std::uint64_t>(a < b ? a : b) << 32U | static_cast<std::uint32_t>(a < b ? b : a);
  }
  std::unordered_map<std::uint64_t, PieceId> lines_;
};

/// The line of an edge in a sorted list; 0: none.
PieceId line_of(const std::vector<LineEdge>& lines, Index a, Index b);

}  // namespace lamina::adapt_detail
