// Whether a mesh is what it claims to be: positive cells, conforming facets, and a given box filled exactly.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mesh/mesh.h"

namespace lamina {

struct Validation {
  std::int64_t nonpositive_cells = 0;   ///< by an exact orientation predicate
  std::int64_t bad_indices = 0;         ///< cells or facets that name a missing or repeated vertex
  std::int64_t overshared_facets = 0;   ///< facets with more than two cells
  std::int64_t misoriented_facets = 0;  ///< interior facets seen with the same orientation from both cells
  std::int64_t unused_points = 0;
  std::int64_t boundary_facets = 0;    ///< facets with exactly one cell
  std::int64_t boundary_mismatch = 0;  ///< listed facets that are not the boundary (interior ones with a tag
                                       ///< other than 0 are allowed), listed twice, or missing from the list;
                                       ///< an empty list is taken as not given
  std::int64_t inward_facets = 0;      ///< listed boundary facets whose normal points into the mesh
  std::int64_t off_box_facets =
      0;                      ///< boundary facets not lying exactly in a face of the box (when one is given)
  double volume = 0.0;        ///< sum of cell volumes
  double volume_error = 0.0;  ///< |volume / box volume - 1| (when a box is given)
  double boundary_area_error = 0.0;  ///< |boundary area / box area - 1| (when a box is given)

  /// All counts zero (but for boundary_facets, inward_facets and unused_points), and the errors below 1e-10.
  [[nodiscard]] bool ok() const;
  /// One line that names what is wrong, or "valid".
  [[nodiscard]] std::string summary() const;
};

/// Checks everything in Validation; cheap checks first. Never throws on a bad mesh: it counts.
template <int D>
Validation validate(const Mesh<D>& mesh, const std::optional<Box<D>>& box = std::nullopt);

}  // namespace lamina
