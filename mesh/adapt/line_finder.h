// The lines of a mesh: what it lists as edges, cut into chains at corners.
#pragma once

#include <vector>

#include "mesh/adapt/lines.h"
#include "mesh/adapt/pieces.h"
#include "mesh/mesh.h"
#include "mesh/topology/incidence.h"

namespace lamina::adapt_detail {

/// What the edges of a line are.
struct LineKind {
  static constexpr std::uint32_t kListed = 1;    ///< among the edges of the mesh, not only those of a facet
  static constexpr std::uint32_t kSharp = 2;     ///< among its ridges
  static constexpr std::uint32_t kRequired = 4;  ///< no operation changes them

  Index tag = 0;
  std::uint32_t flags = 0;

  bool operator==(const LineKind&) const = default;
};

template <int D>
struct FoundLines {
  KeptParts<D> kept;
  std::vector<LineKind> kinds;  ///< of line kFirstLine, ...
};

/// Whether the mesh lists edges, corners or required parts.
template <int D>
bool lists_kept_parts(const Mesh<D>& mesh) {
  return !mesh.edges.empty() || !mesh.corners.empty() || !mesh.required.empty();
}

/// Adds the lines to the pieces of points and to the shape. Lines end at listed corners, where other than two
/// edges or edges of two kinds meet, where they turn by more than `ridge_angle` (degrees), and where they go
/// from one set of pieces to another; points there do not move. `facets`: those of the boundaries, `cells`:
/// those around each point. Errors: kAdapt when an edge is listed twice or is none of a cell, with required
/// cells, required facets that are on no boundary, and more lines than can be numbered.
template <int D>
FoundLines<D> find_lines(const Mesh<D>& mesh, const std::vector<BoundaryFacet<D>>& facets, Pieces<D>& pieces,
                         const Incidence& cells, double ridge_angle);

}  // namespace lamina::adapt_detail
