// Normals and curvatures from the gradient and Hessian stencils of the level set grid.
#pragma once

#include "core/progress.h"
#include "vdb/detail/facet_wall.h"
#include "vdb/detail/grid.h"

namespace lamina::detail {

/// Replaces normals and shape tensors of the vertices of `wall` by those of the grids' stencils where these
/// can be trusted. `base` is the polished grid of the finest level; coarser levels, each of twice the voxel,
/// are built here as far as facet widths ask for them. Returns the number of vertices replaced.
std::int64_t refine_by_stencils(FacetWall& wall, const BandGrid& base, double half_width_vox,
                                Progress* progress);

}  // namespace lamina::detail
