// What every adapted mesh gets, whichever way it was made.
#pragma once

#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"
#include "mesh/score.h"
#include "mesh/validate.h"

namespace lamina {

/// Of points and cells: equal hashes, equal meshes.
template <int D>
std::uint64_t mesh_hash(const Mesh<D>& mesh);

/// Tensors of the points as field "metric".
template <int D>
MeshField tensor_field(const std::vector<Metric<D>>& metric);

/// Mean ratio of the cells in the metric as field "quality".
template <int D>
MeshField quality_field(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric);

/// Throws kMeshInvalid unless the mesh is what it claims to be: such a mesh is a defect of Lamina and is
/// never written.
template <int D>
Validation require_valid(const Mesh<D>& mesh, const std::optional<Box<D>>& domain = std::nullopt);

}  // namespace lamina
