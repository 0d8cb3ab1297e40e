// Fields of one mesh on the points of another.
#pragma once

#include <vector>

#include "mesh/cell_finder.h"
#include "mesh/mesh.h"

namespace lamina {

/// The fields at other points: linear within the cells of the mesh that carries them, beyond it as at its
/// nearest point. Symmetric tensors that are positive definite at every point of the mesh are interpolated as
/// metrics are, log-Euclidean; all others by components. REQUIRES values of as many points as `from` has.
/// GUARANTEES (1) no component leaves the range of those of the cell (but for metrics); (2) at a point of the
/// mesh itself the very bits; (3) the same bits for every thread count.
template <int D>
std::vector<MeshField> carry_fields(const CellFinder<D>& from, const std::vector<MeshField>& fields,
                                    const std::vector<Vec<D>>& points);

/// Smallest and largest of all components.
struct FieldRange {
  double least = 0.0, most = 0.0;
};
FieldRange range_of(const MeshField& field);

}  // namespace lamina
