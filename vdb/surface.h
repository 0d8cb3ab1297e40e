// A triangle surface as read from a file, its intake report and its repair.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/types.h"

namespace lamina {

/// Triangles counter-clockwise seen from the fluid. Coordinates in world units.
struct Surface {
  std::vector<Vec3> points;
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> tags;  ///< one per triangle: index into tag_names (STL solids, OBJ/PLY groups)
  std::vector<std::string> tag_names;  ///< at least one entry when there are triangles

  [[nodiscard]] Box<3> bounds() const;
};

/// What was found in a surface, and what clean() did to it.
struct SurfaceReport {
  std::int64_t triangles_read = 0;
  std::int64_t merged = 0;                 ///< points welded into another one of equal coordinates
  std::int64_t negative_zeros = 0;         ///< coordinates -0.0 replaced by 0.0
  std::int64_t points = 0, triangles = 0;  ///< after cleaning
  std::int64_t shells = 0;                 ///< edge-connected components
  std::int64_t nonfinite = 0, degenerate = 0, duplicate = 0;  ///< triangles dropped
  std::int64_t cut = 0;      ///< triangles without area replaced by a cut of their neighbour, not dropped
  std::int64_t flipped = 0;  ///< triangles turned so that each shell is oriented, outward
  std::int64_t shells_turned = 0, shells_mixed = 0;  ///< ... of shells turned as a whole, and in part
  std::int64_t open_edges = 0, nonmanifold_edges = 0, misoriented_edges = 0;  ///< after cleaning
  double area = 0.0, volume = 0.0;                                            ///< volume: signed, 0 when open
  double shortest_edge = 0.0, longest_edge = 0.0;
  double facet_sag = 0.0;  ///< largest e theta / 8 over smooth edges: how far facets miss a round wall
  std::vector<std::string> repairs;   ///< each repair that was made: how often and why, one line each
  std::vector<std::string> warnings;  ///< one line each; among them the repairs that change the shape

  [[nodiscard]] bool watertight() const { return open_edges == 0 && nonmanifold_edges == 0; }
};

/// Welds bit-equal points (also -0.0), drops non-finite, degenerate and duplicate triangles, orients each
/// shell and turns closed shells outward. Errors: kSurfaceEmpty when nothing is left (says why). `name` is
/// used in messages only.
SurfaceReport clean(Surface& surface, const std::string& name);

}  // namespace lamina
