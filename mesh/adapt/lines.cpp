#include "mesh/adapt/lines.h"

#include <algorithm>
#include <tuple>

namespace lamina::adapt_detail {

std::vector<LineEdge> LineTable::list() const {
  std::vector<LineEdge> out;
  out.reserve(lines_.size());
  for (const auto& [edge, line] : lines_)
    out.push_back({static_cast<Index>(edge >> 32U), static_cast<Index>(edge & 0xffffffffU), line});
  return out;
}

PieceId line_of(const std::vector<LineEdge>& lines, Index a, Index b) {
  if (a > b) std::swap(a, b);
  const auto at = std::lower_bound(
      lines.begin(), lines.end(), std::pair(a, b),
      [](const LineEdge& e, const auto& k) { return std::tie(e.a, e.b) < std::tie(k.first, k.second); });
  return at != lines.end() && at->a == a && at->b == b ? at->line : PieceId{0};
}

}  // namespace lamina::adapt_detail
