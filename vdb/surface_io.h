// Readers of triangle surfaces (.stl binary and ascii, .obj, .ply ascii and binary) and a binary STL writer.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vdb/surface.h"

namespace lamina {

/// True when the extension (any case) is .stl, .obj or .ply.
bool is_surface_file(const std::filesystem::path& path);

/// Reads triangles (polygons are fanned); one point per corner for STL, not welded: call clean() next.
/// Lenient where a usable surface remains (truncated, wrong count, bad normals): each such finding is
/// appended to `warnings`. Errors: kFileMissing, kFileUnreadable, kFileFormat with line or byte offset,
/// kFileUnsupported (extension, PLY triangle strips, more than Index can number), kSurfaceEmpty.
/// Memory is bounded by the file's size, never by counts it claims.
Surface read_surface(const std::filesystem::path& path, std::vector<std::string>& warnings);

/// Binary STL, written atomically. Tags are not part of the format.
void write_stl(const std::filesystem::path& path, const Surface& surface);

}  // namespace lamina
