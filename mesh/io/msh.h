// Gmsh MSH, versions 4.1 and 2.2, ascii and binary of either byte order.
//
// Tags are the numbers of physical groups, which count from 1: tags of ours below that are groups named
// tag_<number>. Either everything is in a group or nothing, because Gmsh saves only what is in one. Where a
// file has no physical groups at all and several elementary entities, their numbers are the tags. Points and
// cells come in the order of their numbers in the file, which version 4.1 groups by entity: cells are written
// in as many blocks as keep their order, others in one for each tag, so that numbers count through the file,
// as meshio expects. Fields are $NodeData and $ElementData: vectors of 3 components and tensors of 9;
// symmetric ones are read back as symmetric tensors, and what a file does not give is not a number.
// Values of cells are written for all elements, since meshio counts them, not a number for others. Lines in a
// 3D mesh are its edges; elements of one node are corners, with their groups as tags of the points. Other
// elements, parametric nodes' parameters and partitions are not taken.
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
