// Mesh and metric files: VTU (.vtu), GMF ascii and binary (.mesh, .meshb with .sol, .solb).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina {

/// True when the extension of `path` (any case) names a mesh format that can be read / written.
bool is_readable_mesh(const std::filesystem::path& path);
bool is_writable_mesh(const std::filesystem::path& path);

/// Reads a mesh; the format follows from the extension, the dimension from the content (a file with z = 0
/// throughout and triangles only is 2D). Fields of a .vtu become point/cell fields; its cell data "region"
/// the cell tags. Triangles beside tetrahedra (.vtu, .mesh) and edges beside triangles become facets;
/// orientation is kept as it is; tags that are all 0 are dropped. Errors: kFileMissing, kFileFormat (with
/// line or byte offset), kFileUnsupported (no simplices, mixed cells). Counts of the file are checked against
/// its size before anything is allocated.
AnyMesh read_mesh(const std::filesystem::path& path);

/// Writes atomically. .vtu: appended binary, zlib compressed, UInt64 header, Int64 connectivity where needed;
/// all fields; cell tags as cell data "region"; facets and point tags are not part of it. .mesh/.meshb:
/// points, cells, facets with their tags (64-bit positions from version 3 on where the file needs them);
/// fields are not part of these formats.
template <int D>
void write_mesh(const std::filesystem::path& path, const Mesh<D>& mesh);

/// Reads a GMF .sol/.solb with one tensor (or scalar size, turned into an isotropic metric) per vertex.
/// Errors: kFileFormat, kParameter naming the first vertex whose tensor is not positive definite.
template <int D>
std::vector<Metric<D>> read_metric(const std::filesystem::path& path);

/// Writes one tensor per vertex.
template <int D>
void write_metric(const std::filesystem::path& path, const std::vector<Metric<D>>& metric);

}  // namespace lamina
