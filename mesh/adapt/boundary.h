// Between a mesh as it is exchanged and the optimizer's own form: its regions and the pieces of their
// boundaries are found, so that vertices can be kept on them, and the input's tags are restored.
#pragma once

#include <limits>
#include <vector>

#include "mesh/adapt/blocks.h"
#include "mesh/adapt/line_finder.h"

namespace lamina::adapt_detail {

inline constexpr Index kUnlisted = std::numeric_limits<Index>::min();

/// What regions and pieces of the boundary (mesh/adapt/pieces.h) were in the input.
struct BoundaryTags {
  std::vector<Index> of_piece{kNone};  ///< input tag of piece 1, 2, ...; kUnlisted: the input lists no facet
  bool listed = false;                 ///< the input listed boundary facets ...
  bool tagged = false;                 ///< ... with tags
  std::vector<Index> cell_tags;        ///< of the cells of region 0, 1, ...; or nothing
  std::vector<LineKind> lines;         ///< of line kFirstLine, ...
  std::vector<Index> corner_tags, required_point_tags;
};

/// REQUIRES positive cells that meet facet to facet. A region is the cells of one tag; where facets with tags
/// lie between cells of one tag, the connected parts that they cut these into. Boundary facets are found from
/// the cells; the list of the input gives their tags. Errors: kAdapt without cells, with tagged interior
/// facets that cut nothing off, with more regions or pieces than can be numbered, and those of find_lines.
template <int D>
GlobalMesh<D> import_mesh(const Mesh<D>& mesh, const AdaptOptions& options, BoundaryTags& tags);

/// Facets carry the input's tags, those of an input that lists none the numbers of their pieces. Of facets
/// between regions those are listed whose pieces were; they point out of the one with the lower tag.
template <int D>
void export_mesh(const GlobalMesh<D>& global, const BoundaryTags& tags, Mesh<D>& mesh);

}  // namespace lamina::adapt_detail
