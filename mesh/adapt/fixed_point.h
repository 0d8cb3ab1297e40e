// An adapted mesh is a fixed point: one that is unit in the wanted metric already goes no way from coarse to
// fine, and is left as it is where polishing would move many vertices for next to nothing.
#pragma once

#include "mesh/adapt.h"
#include "mesh/adapt/blocks.h"

namespace lamina::adapt_detail {

/// Whether the mesh needs polishing at most. REQUIRES its metric, as wanted.
template <int D>
bool is_adapted(const GlobalMesh<D>& mesh);

/// Vertices that lie on levels are taken for placed there.
template <int D>
void find_levels(GlobalMesh<D>& mesh, const AdaptMetric<D>& field);

/// Whether what polishing made of `old` is enough of a gain.
template <int D>
bool is_worthwhile(const AdaptStep& before, const GlobalMesh<D>& old, const AdaptStep& after,
                   const GlobalMesh<D>& mesh, const AdaptOptions& options);

}  // namespace lamina::adapt_detail
