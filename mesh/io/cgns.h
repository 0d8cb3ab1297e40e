// CGNS through its library: one base, one unstructured zone of tetrahedra (triangles in 2D).
//
// The facets of every tag are a section and a boundary condition (BC_t) with the tag as Ordinal_t; its name
// is that of the tag, or facet_<tag>. Tags of cells and points, and fields, are arrays of the solutions
// "Cells" and "Points": vectors get X, Y, Z behind their names, symmetric tensors XX, XY, YY, XZ, YZ, ZZ, and
// are put together again when read.
#pragma once

#ifdef LAMINA_CGNS

#include <filesystem>

#include "mesh/io/format.h"

namespace lamina::io {

/// Errors: kFileFormat, kFileUnsupported (several bases or zones, other cells).
AnyMesh read_cgns(const std::filesystem::path& path);

template <int D>
void write_cgns(WriteJob& job, const Mesh<D>& mesh);

}  // namespace lamina::io

#endif
