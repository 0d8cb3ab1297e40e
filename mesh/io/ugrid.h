// UGRID of AFLR: .lb8.ugrid and .b8.ugrid (little- and big-endian streams of 64-bit reals and 32-bit
// integers), .lb8l.ugrid and .b8l.ugrid (64-bit integers), .ugrid (ascii). Tetrahedra and boundary triangles
// with their surface ids, which are the facet tags; triangles point into the domain there and are turned on
// the way in and out. Quadrilaterals, pyramids, prisms and hexahedra are refused; sections behind them are
// passed over.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "mesh/io/format.h"

namespace lamina::io {

struct UgridForm {
  bool ascii = false, big_endian = false, wide = false;
};

/// Errors: kFileFormat with line or byte, kFileUnsupported.
AnyMesh parse_ugrid(std::string_view bytes, const std::string& name, UgridForm form);
AnyMesh read_ugrid(const std::filesystem::path& path);

void write_ugrid(WriteJob& job, const Mesh<3>& mesh);

}  // namespace lamina::io
