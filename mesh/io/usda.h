// USD ascii with one UsdGeomTetMesh, written only: points in single precision as the schema has them, facets
// as its surface, tags and fields as primvars, tagged facets and cells also as GeomSubsets by name.
#pragma once

#include "mesh/io/format.h"

namespace lamina::io {

void write_usda(WriteJob& job, const Mesh<3>& mesh);

}  // namespace lamina::io
