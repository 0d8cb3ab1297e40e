// GMF, the format of INRIA's libMeshb: .mesh / .sol (ascii) and .meshb / .solb (binary).
//
// Binary files are a chain of sections: int32 keyword, position of the next keyword, count, records. The
// header int32 is 1 in the byte order of the writer. Version 1: float32 reals; 2: float64; 3: float64 and
// 64-bit positions; 4: 64-bit integers as well. We write version 2 while positions fit 31 bits, else 3 (4 on
// request), in little-endian order. Read are Vertices, Edges, Triangles, Tetrahedra, Corners, Ridges (in 2D
// they say nothing), RequiredVertices, RequiredEdges, RequiredTriangles and SolAtVertices; every other
// keyword is skipped: in binary by the position of the next one, which must grow and stay inside the file, in
// ascii up to the next word. Whether a file is ascii or binary follows from its first bytes, not
// from its name.
#pragma once

#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "core/file.h"
#include "mesh/mesh.h"

namespace lamina::io {

/// Errors: kFileFormat with line or byte, kFileUnsupported. Never allocates more than the bytes can describe.
AnyMesh parse_gmf(std::string_view bytes, const std::string& name);

/// The fields of a .sol file, without names: of each 1 (scalar), `dimension` (vector) or
/// kSymSize<dimension> (symmetric tensor) values a vertex, those of a vertex one field after the other.
struct GmfSolution {
  int dimension = 3;
  std::vector<int> components;
  std::vector<double> values;

  [[nodiscard]] std::size_t width() const {
    return std::accumulate(components.begin(), components.end(), std::size_t{0});
  }
};

/// Errors as parse_gmf; kFileUnsupported when a field is a full matrix.
GmfSolution parse_gmf_solution(std::string_view bytes, const std::string& name);

struct GmfForm {
  bool ascii = false;
  int version = 0;  ///< 2, 3 or 4; 0: 2, or 3 where positions need 64 bits
};

/// Ascii coordinates are the shortest decimals that read back to the same bits.
template <int D>
void write_gmf(OutputFile& out, const Mesh<D>& mesh, GmfForm form);

void write_gmf_solution(OutputFile& out, const GmfSolution& solution, GmfForm form);

}  // namespace lamina::io
