// What a mesh lists beside cells and facets: edges, corners, required parts.
#pragma once

#include "mesh/mesh.h"

namespace lamina {

/// Forgets them, and names of their tags; tags of points stay.
template <int D>
void drop_listed_parts(Mesh<D>& mesh) {
  mesh.edges.clear();
  mesh.edge_tags.clear();
  mesh.ridges.clear();
  mesh.corners.clear();
  mesh.edge_names.clear();
  mesh.point_names.clear();
  mesh.required = {};
}

}  // namespace lamina
