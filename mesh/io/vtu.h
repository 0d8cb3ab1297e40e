// VTU, the XML file of a vtkUnstructuredGrid.
//
// Written: one piece, appended raw data, zlib blocks of 1 MiB or none, UInt64 header words, Float64 points
// and fields, Int32 connectivity and offsets (Int64 where they do not fit), cell tags as Int32 cell data
// "region". Facets, on request, are cells behind ours, and so are edges of 3D meshes
// and corners: cell fields are not a number there. Plane meshes get z
// = 0, their vectors a third component 0. A symmetric tensor is stored with six components in the order of
// ParaView, XX YY ZZ XY YZ XZ (ours is xx, xy, yy, xz, yz, zz); six components are read back in that order.
// Read: what VTK 9 and meshio write, in any byte order. Triangles beside tetrahedra, and lines beside
// triangles, become facets, lines beside tetrahedra edges, vertices (cell type 1) corners; their tags are
// those of their points where these have none.
#pragma once

#include <string>
#include <string_view>

#include "core/file.h"
#include "mesh/mesh.h"

namespace lamina::io {

/// Errors: kFileFormat with the line, kFileUnsupported (other cells, several pieces, other compressors).
AnyMesh parse_vtu(std::string_view bytes, const std::string& name);

struct VtuOptions {
  bool facets = false;  ///< and edges and corners, with their tags; point tags as point data "region"
  bool compress = true;
};

template <int D>
void write_vtu(OutputFile& out, const Mesh<D>& mesh, VtuOptions options = {});

}  // namespace lamina::io
