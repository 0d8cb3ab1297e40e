// What a mesh file holds, before it is known whether it is a 2D or a 3D mesh; and the errors of the readers.
#pragma once

#include <cstddef>
#include <optional>
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
  TagNames names;
  std::string place;
};

struct RawMesh {
  int dimension = 3;         ///< of the coordinates as the file declares it
  std::vector<Vec3> points;  ///< z = 0 in 2D
  std::vector<Index> point_tags;
  RawCells<4> tets;
  RawCells<3> triangles;
  RawCells<2> edges;
  std::vector<Index> corners, ridges;  ///< points and edges, in any order
  RequiredParts required;              ///< facets: the triangles, also where these are the cells
  TagNames point_names;
  std::vector<MeshField> point_fields, cell_fields;  ///< cell_fields belong to the cells of highest dimension
};

/// Adds cells of one point as corners; their tags are those of the points where these have none.
void add_corners(const RawCells<1>& corners, RawMesh& raw);

/// Name of a tag for a format that knows names only: its own, or `kind` and the number ("wall_3").
std::string name_of_tag(const TagNames& names, Index tag, std::string_view kind);
/// Tags for the names of a file: those that are given, else the number of a name that name_of_tag made, else
/// numbers from 1 on that no other has; names that are not made of their number go to `names`.
std::vector<Index> tags_of_names(const std::vector<std::string>& names_in_file,
                                 const std::vector<std::optional<Index>>& given, std::string_view kind,
                                 TagNames& names);

/// Names of tags for formats whose names are words of letters, digits and _ . - : other characters become _,
/// and names that are not unique get their tag behind them. What is changed is told in `lost`.
std::vector<std::string> plain_names(const std::vector<Index>& tags, const TagNames& names,
                                     std::string_view kind, std::vector<std::string>& lost);

/// Sorted tags of so many items; {0} where there are items but no tags.
std::vector<Index> distinct_tags(const std::vector<Index>& tags, std::size_t items);

/// Items by their tags, in their order: order[start[k]] to order[start[k + 1] - 1] have tag tags[k].
struct TagGroups {
  std::vector<Index> tags, order;
  std::vector<std::size_t> start;
};
TagGroups group_by_tag(const std::vector<Index>& tags, std::size_t items);

/// Checks indices and coordinates and builds a 3D mesh where there are tetrahedra, a 2D one where there are
/// only triangles in the plane z = 0. Tags that are all 0 are dropped. Errors: kFileFormat (index out of
/// range, coordinate not finite), kFileUnsupported (no simplices; a surface in space).
AnyMesh assemble(RawMesh raw, const Source& source);

}  // namespace lamina::io
