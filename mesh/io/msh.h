// Gmsh MSH, versions 4.1 and 2.2, ascii and binary of either byte order.
//
// Tags are the numbers of physical groups, which count from 1: tags of ours below that are groups named
// tag_<number>. Either everything is in a group or nothing, because Gmsh saves only what is in one. Where a
// file has no physical groups at all and several elementary entities, their numbers are the tags. Points and
// cells come in the order of their numbers in the file, so that the grouping by entity that version 4.1 asks
// for does not change ours. Fields are $NodeData and $ElementData: vectors of 3 components and tensors of 9;
// symmetric ones are read back as symmetric tensors, and what a file does not give is not a number. Lines in
// a 3D mesh and points are passed over; other elements, parametric nodes' parameters and partitions are not
// taken.
#pragma once

#include <string>
#include <string_view>

#include "mesh/io/format.h"

namespace lamina::io {

/// Names of groups that stand for tags below 1.
inline constexpr std::string_view kTagPrefix = "tag_";

/// Errors: kFileFormat with line or byte, kFileUnsupported.
AnyMesh parse_msh(std::string_view bytes, const std::string& name);

template <int D>
void write_msh(WriteJob& job, const Mesh<D>& mesh);

}  // namespace lamina::io
