// Second derivatives of a field that is known at vertices, and the metric that makes its interpolation error
// least for a number of cells [Loseille2011].
#pragma once

#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina {

/// The Hessian at every vertex: of the parabola through the vertex that is closest to the values around it,
/// by least squares over its neighbours, and their neighbours where they are too few. Exact for polynomials
/// of degree two, on the boundary too, and independent of how a patch is stretched. Unit: that of the values
/// over length squared. REQUIRES one value per point and a mesh whose indices are valid. GUARANTEES the same
/// bits for every thread count. Vertices without enough neighbours to tell get the smallest Hessian that
/// fits; those without a cell get zero. `gradient` receives that of the same parabolas. Errors: kParameter
/// (number of values; a value that is not finite).
template <int D>
std::vector<Sym<D>> recover_hessian(const Mesh<D>& mesh, const std::vector<double>& values,
                                    std::vector<Vec<D>>* gradient = nullptr);

/// The metric of `complexity` elements in which linear interpolation of a field with these Hessians has the
/// least error in the norm L^p: det(|H|)^(-1/(2p+D)) |H|, scaled. Curvatures below 1e-12
/// of the largest in the mesh count as that. REQUIRES p >= 1, complexity > 0, one Hessian per point. Errors:
/// kParameter for the requirements, and when all Hessians are 0: a linear field asks for no elements.
template <int D>
std::vector<Metric<D>> lp_metric(const Mesh<D>& mesh, const std::vector<Sym<D>>& hessian, double p,
                                 double complexity);

}  // namespace lamina
