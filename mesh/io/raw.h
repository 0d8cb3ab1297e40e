// What a mesh file holds, before it is known whether it is a 2D or a 3D mesh; and the errors of the readers.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "mesh/mesh.h"

namespace lamina::io {

/// The bytes of a file and the name it is called by in messages.
struct Source {
  std::string_view bytes;
  std::string name;
};

/// "line 12": the line that holds byte `offset`, counted from 1.
std::string line_of(const Source& source, std::size_t offset);
/// "byte 345".
std::string byte_of(std::size_t offset);
/// Throws kFileFormat "name: place: what".
[[noreturn]] void fail_format(const Source& source, const std::string& place, const std::string& what);
/// Throws kFileUnsupported "name: what".
[[noreturn]] void fail_unsupported(const Source& source, const std::string& what);

/// Simplices of one kind with their tags (empty or one each) and where they stand in the file.
template <int N>
struct RawCells {
  std::vector<std::array<Index, N>> cells;
  std::vector<Index> tags;
  std::string place;
};

struct RawMesh {
  int dimension = 3;         ///< of the coordinates as the file declares it
  std::vector<Vec3> points;  ///< z = 0 in 2D
  std::vector<Index> point_tags;
  RawCells<4> tets;
  RawCells<3> triangles;
  RawCells<2> edges;
  std::vector<MeshField> point_fields, cell_fields;  ///< cell_fields belong to the cells of highest dimension
};

/// Checks indices and coordinates and builds a 3D mesh where there are tetrahedra, a 2D one where there are
/// only triangles in the plane z = 0. Tags that are all 0 are dropped. Errors: kFileFormat (index out of
/// range, coordinate not finite), kFileUnsupported (no simplices; a surface in space).
AnyMesh assemble(RawMesh raw, const Source& source);

}  // namespace lamina::io
