// SU2's native mesh, 2D and 3D. Facets are grouped in markers: those of a tag that has no name are called
// marker_<tag>. A comment at the head of our files tells the tags of named markers ("% tag 7 is wall"), so
// that they come back; in other files markers without a number get tags from 1 on in their order.
#pragma once

#include <string>
#include <string_view>

#include "mesh/io/format.h"

namespace lamina::io {

/// Errors: kFileFormat with the line, kFileUnsupported (other elements, several zones).
AnyMesh parse_su2(std::string_view bytes, const std::string& name);

template <int D>
void write_su2(WriteJob& job, const Mesh<D>& mesh);

}  // namespace lamina::io
