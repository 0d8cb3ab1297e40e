// The mesh between passes in its metric: what steers the optimizer, and which cells a pass should look at.
#pragma once

#include <vector>

#include "mesh/adapt.h"
#include "mesh/adapt/blocks.h"

namespace lamina::adapt_detail {

/// Metrics of all vertices under a size floor, and the energies of all cells; what differs from before counts
/// as changed at time `now`.
template <int D>
void evaluate_metric(GlobalMesh<D>& mesh, const AdaptMetric<D>& field, double floor, int now);

/// Counts, shares and qualities. Edges are counted once per cell, which is close enough to steer by.
template <int D>
AdaptStep measure(const GlobalMesh<D>& mesh);

/// Share of the unit edges alone, counted as measure() does.
template <int D>
double unit_share(const GlobalMesh<D>& mesh);

/// Length of the longest edge in space (m), and in the metric.
template <int D>
double longest_in_space(const GlobalMesh<D>& mesh);
template <int D>
double longest_in_metric(const GlobalMesh<D>& mesh);

/// Cells below that quality, ascending.
template <int D>
std::vector<Index> bad_cells(const GlobalMesh<D>& mesh, double quality);

/// Cells with an edge out of the unit range of which an end changed since that time, ascending.
template <int D>
std::vector<Index> loose_cells(const GlobalMesh<D>& mesh, int since);

}  // namespace lamina::adapt_detail
