// Between a mesh as it is exchanged and the optimizer's own form: the pieces of the boundary are found, so
// that vertices can be kept on them, and the input's tags are restored.
#pragma once

#include <vector>

#include "mesh/adapt/blocks.h"

namespace lamina::adapt_detail {

/// What pieces of the boundary (mesh/adapt/pieces.h) were in the input.
struct BoundaryTags {
  std::vector<Index> of_piece{kNone};  ///< input tag of piece 1, 2, ...
  bool listed = false;                 ///< the input listed boundary facets ...
  bool tagged = false;                 ///< ... with tags
  std::vector<Index> cell_tags;        ///< the tag that all cells carry, or nothing
};

/// REQUIRES positive cells that meet facet to facet. Boundary facets are found from the cells; the list of
/// the input gives their tags. Errors: kAdapt without cells, with tagged interior facets, and with more
/// pieces than can be numbered.
template <int D>
GlobalMesh<D> import_mesh(const Mesh<D>& mesh, const AdaptOptions& options, BoundaryTags& tags);

/// Facets carry the input's tags, those of an input that lists none the numbers of their pieces.
template <int D>
void export_mesh(const GlobalMesh<D>& global, const BoundaryTags& tags, Mesh<D>& mesh);

}  // namespace lamina::adapt_detail
