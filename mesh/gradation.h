// A bound on how fast the sizes of a metric grow along the edges of the mesh that carries it [Alauzet2010].
//
// A metric spreads from a vertex p along an edge e by growing each of its sizes h_i by
//   (1 + |e| / h_i ln b)^t (1 + l ln b)^(1-t),   l the length of e in the metric of p, t = 1/8,
// the mixed-space law: with t = 1 sizes of all directions would grow by the same amount, and a thin layer
// would lose its anisotropy within a few heights; with t = 0 they keep their ratios, and the layers of one
// wall would cut down the sizes along a neighbouring, slightly turned one. Along a wall of radius R
// chords of sqrt(R h) are left alone at aspect ratios above 100, those of sqrt(2 R h), the longest of
// [Billon2016, eq. 29], are shortened by up to a third at lower ones.
#pragma once

#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina {

/// Lowers sizes until no vertex has a size larger than what spreads to it from a neighbour (to one part in a
/// thousand). Sizes of an isotropic metric then grow by at most the factor `bound` per unit of metric length.
/// REQUIRES bound > 1 and one metric per point. GUARANTEES (1) no size grows; (2) vertices that keep to the
/// bound are left as they are, bit for bit; (3) the same bits for every thread count. Returns the number of
/// sweeps. Errors: kParameter for the requirements, kInternal when no state is reached that holds.
template <int D>
int gradate(const Mesh<D>& mesh, std::vector<Metric<D>>& metric, double bound);

/// Largest factor by which a size exceeds what spreads to it along an edge; at most 1 where the bound holds.
template <int D>
double gradation_excess(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric, double bound);

}  // namespace lamina
