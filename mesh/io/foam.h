// OpenFOAM's polyMesh: the folder constant/polyMesh with points, faces, owner, neighbour, boundary and
// cellZones.
//
// Named by the folder (.../polyMesh) or by the file `case.foam` beside `constant`, which is what ParaView
// opens; it is written empty. Inner faces stand in the upper triangular order of OpenFOAM (by owner, then
// neighbour), boundary faces behind them by patch. Facet tags are patches (facet_<tag> without a name), cell
// tags cell zones; the entry `tag` of a patch or a zone, which OpenFOAM passes over, keeps the number.
// Boundary faces that no facet names are the patch defaultFaces, facets between cells have no place. Read:
// ascii and binary (32- or 64-bit labels, little-endian), cells of four triangles.
// Plane meshes are written as prisms, which are not read.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mesh/io/format.h"
#include "mesh/io/raw.h"

namespace lamina::io {

/// The texts of the files; `zones` may be empty.
struct FoamTexts {
  Source points, faces, owner, neighbour, boundary, zones;
};

/// Errors: kFileFormat with line or byte, kFileUnsupported (other cells, compressed files).
AnyMesh parse_foam(const FoamTexts& texts);
AnyMesh read_foam(const std::filesystem::path& path);

void write_foam(WriteJob& job, const Mesh<3>& mesh);
/// A plane mesh as one layer of prisms of MeshWriteOptions::height; bottom and top are the patch frontAndBack
/// of type empty, which makes it a case in two dimensions. Errors: kFileUnsupported without a height.
/// REQUIRES positive cells.
void write_foam_prisms(WriteJob& job, const Mesh<2>& mesh);

std::vector<std::filesystem::path> foam_files(const std::filesystem::path& path);

}  // namespace lamina::io
