// Where a triangle surface crosses or overlaps itself.
//
// Two facets meet when they have more in common than touch: a stretch of line that lies inside at least one
// of them, or an area. So facets that share a corner or an edge, or whose edges lie along each other (hanging
// nodes), do not meet; a facet folded onto its neighbour does, and so does an edge laid into the inside of a
// facet. Decided exactly, by core/predicates.h, from the coordinates alone.
#pragma once

#include <array>
#include <cstdint>

#include "vdb/surface.h"

namespace lamina::detail {

struct Intersections {
  std::int64_t pairs = 0;                    ///< unordered pairs of facets that meet
  bool complete = true;                      ///< false: the search was ended, there are at least `pairs`
  std::array<Index, 2> first{kNone, kNone};  ///< of the pairs found, the one of the smallest numbers
  Vec3 place = Vec3::Zero();                 ///< a point that both facets of that pair hold, up to rounding
};

/// All pairs of facets that meet. REQUIRES finite coordinates and facets with an area, as clean() leaves
/// them. GUARANTEES (1) the same answer for every thread count; (2) memory of about 80 bytes per facet
/// whatever is found; (3) an end: where boxes overlap beyond measure (soups, fans of many thousand slivers)
/// the search stops after 2.5e7 comparisons of facets and 50 more per facet, or twice that. Cost: 1.2 CPU
/// seconds for a million facets of a clean body, half of it the tree.
Intersections find_intersections(const Surface& surface);

/// True when the facets i and j meet.
bool facets_meet(const Surface& surface, Index i, Index j);

}  // namespace lamina::detail
