// The wall of a mesh against that of its body.
#pragma once

#include <vector>

#include "apps/pipeline/pipeline.h"
#include "mesh/wall_fit.h"

namespace lamina {

/// Points of a wall, about `across` along its longest extent: the closest ones to the centres of an octree's
/// (in 2D: a quadtree's) leaves. In a fixed order.
template <int D>
std::vector<Vec<D>> sample_wall(const WallField& wall, int across);

/// `phi` holds the wall distances of the mesh's points.
template <int D>
WallFit judge_wall(const Mesh<D>& mesh, const std::vector<double>& phi, const Body& body,
                   const WallMetric& metric);

}  // namespace lamina
