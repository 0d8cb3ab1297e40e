// How many elements a metric asks for.
#pragma once

#include "core/metric.h"
#include "core/parallel.h"
#include "mesh/mesh.h"

namespace lamina {

/// Estimates the integral of sqrt(det M) over the mesh from about `samples` points spread evenly over its
/// volume, whatever its cells are. A unit mesh has about 12 (3D) or 2.3 (2D) cells per unit of it. Error a
/// few percent for layers of 1e-3 of the mesh, more for thinner ones. Same bits for every thread count.
/// `metric` is called from several threads.
template <int D>
double estimate_complexity(const Mesh<D>& mesh, FunctionRef<Metric<D>(const Vec<D>&)> metric,
                           std::size_t samples = 200000);

}  // namespace lamina
