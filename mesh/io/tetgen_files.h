// TetGen's .node, .ele and .face (Triangle's .node, .ele and .edge in 2D): ascii, read by the name of any of
// them, counted from 0 or 1, written from 1. Point tags are boundary markers of points, cell tags the one
// region attribute of cells, facet tags the boundary markers of faces. Further attributes are read as the
// field "attributes".
#pragma once

#include <filesystem>
#include <vector>

#include "mesh/io/format.h"
#include "mesh/io/raw.h"

namespace lamina::io {

/// The texts of the three files; `facets` is empty when there is none. For parsing without files.
struct TetgenTexts {
  Source nodes, cells, facets;
};

/// Errors: kFileFormat with the line, kFileUnsupported (cells of second order).
AnyMesh parse_tetgen(const TetgenTexts& texts);
AnyMesh read_tetgen_files(const std::filesystem::path& path);

template <int D>
void write_tetgen_files(WriteJob& job, const Mesh<D>& mesh);

std::vector<std::filesystem::path> tetgen_files(const std::filesystem::path& path);

}  // namespace lamina::io
