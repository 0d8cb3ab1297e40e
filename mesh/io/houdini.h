// Houdini's ascii .geo (JSON): tetrahedra as a Tetrahedron_run, facets as a Polygon_run behind it, whose
// corners go clockwise as that program has it. Tags are the integer attributes "region" of primitives and
// points, fields attributes of the same names (cell fields are 0 on facets); those of six components are
// symmetric tensors in our order.
#pragma once

#include <string>
#include <string_view>

#include "mesh/io/format.h"

namespace lamina::io {

/// Errors: kFileFormat, kFileUnsupported (other primitives, the binary .bgeo form).
AnyMesh parse_geo(std::string_view bytes, const std::string& name);

/// Errors: kParameter for values that are not finite, which JSON cannot hold.
void write_geo(WriteJob& job, const Mesh<3>& mesh);

}  // namespace lamina::io
