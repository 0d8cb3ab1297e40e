// USD ascii with one UsdGeomTetMesh: points in single precision as the schema has them, facets as its
// surface, tags and fields as primvars, tagged facets and cells also as GeomSubsets by name. What is no
// identifier of USD is told by displayName, the tag of a subset by an attribute "tag".
#pragma once

#include <string>
#include <string_view>

#include "mesh/io/format.h"

namespace lamina::io {

/// Reads one TetMesh, wherever it stands, with primvars of numbers (values of a point or of a cell) and its
/// GeomSubsets; what else there is is passed over. Coordinates are taken as they stand, without units.
/// Errors: kFileFormat naming the line, kFileUnsupported (binary forms, no or several TetMeshes, values that
/// change with time, transforms).
AnyMesh parse_usda(std::string_view bytes, const std::string& name);

void write_usda(WriteJob& job, const Mesh<3>& mesh);

}  // namespace lamina::io
