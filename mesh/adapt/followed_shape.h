// What a run knows of the boundary in the end, for the next run on its mesh.
#pragma once

#include <memory>

#include "mesh/adapt/boundary.h"

namespace lamina::adapt_detail {

/// Takes what later runs need; the rest of `global` is left as it is.
template <int D>
std::shared_ptr<const FollowedShape> remember_shape(GlobalMesh<D>& global, BoundaryTags& tags);

/// The mesh of that run, as import_mesh() would make it from its input. Errors: kAdapt when `mesh` is
/// another.
template <int D>
GlobalMesh<D> recall_mesh(const Mesh<D>& mesh, const FollowedShape& shape, BoundaryTags& tags);

}  // namespace lamina::adapt_detail
