// XDMF: an .xdmf file that describes arrays in an .h5 file beside it, as FEniCS reads and writes them.
//
// One grid "mesh" of tetrahedra (triangles in 2D), one grid "facet_tags" of its facets, which shares the
// points: dolfinx reads them by read_mesh(name="mesh") and read_meshtags(mesh, name="facet_tags"). Cell tags
// are the attribute "region" of the cells, point tags that of the points, names of tags are Information
// elements. Symmetric tensors are Tensor6 (XX XY XZ YY YZ ZZ). Read: uniform grids of one kind of simplices
// with data in HDF5 or inline.
#pragma once

#ifdef LAMINA_HDF5

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mesh/io/format.h"

namespace lamina::io {

/// Reads data files from `folder`. Errors: kFileFormat with the line, kFileUnsupported (mixed grids, binary
/// data files).
AnyMesh parse_xdmf(std::string_view bytes, const std::string& name, const std::filesystem::path& folder);
AnyMesh read_xdmf(const std::filesystem::path& path);

template <int D>
void write_xdmf(WriteJob& job, const Mesh<D>& mesh);

std::vector<std::filesystem::path> xdmf_files(const std::filesystem::path& path);

}  // namespace lamina::io

#endif
