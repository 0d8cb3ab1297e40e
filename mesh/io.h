// Mesh files. mesh_formats() is the one list of formats: reading, writing, messages, help and the warnings
// about what a format cannot hold follow from it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/file.h"
#include "mesh/mesh.h"

namespace lamina {

/// What a format is called, how its files are named, and what they can hold. Points and cells are held by
/// all.
struct MeshFormat {
  std::string_view name;
  std::vector<std::string_view> suffixes;  ///< compared in any case; that of a folder has no dot
  bool reads = true, writes = true;
  bool plane = true;    ///< 2D meshes
  bool prisms = false;  ///< 2D meshes as one layer of prisms, see MeshWriteOptions::height
  bool facets = true;
  bool cell_tags = true, facet_tags = true, point_tags = false;
  bool cell_names = false, facet_names = false;
  bool edges = false;  ///< in 3D lines, with tags; in 2D and 3D corners; names of their tags with facet_names
  bool required = false;  ///< required parts, and which edges are ridges
  /// Components of the fields it can hold: none, 1 and D and kSymSize<D>, or any number.
  enum class Fields { kNoFields, kTensorFields, kAnyFields };
  Fields point_fields = Fields::kNoFields, cell_fields = Fields::kNoFields;
  bool solution = false;                        ///< point fields can be in a file beside it, without names
  bool exact = true;                            ///< coordinates keep their bits
  bool ascii = false, binary = false;           ///< forms a writer can choose from by MeshWriteOptions::ascii
  std::vector<std::string_view> versions = {};  ///< that can be written, the default first
};

const std::vector<MeshFormat>& mesh_formats();

/// The format that the end of `path` (any case) names; nullptr when there is none.
const MeshFormat* mesh_format(const std::filesystem::path& path);

/// True when `path` names a mesh format that can be read / written.
bool is_readable_mesh(const std::filesystem::path& path);
bool is_writable_mesh(const std::filesystem::path& path);
/// ".vtu .mesh ..." of the formats that can be read / written, for help and messages.
std::string readable_mesh_suffixes();
std::string writable_mesh_suffixes();

/// Reads a mesh; the dimension follows from the content (a file with z = 0 throughout and triangles only is
/// 2D). Triangles beside tetrahedra, and edges beside triangles, become facets; orientation is kept as it is;
/// tags that are all 0 are dropped. Errors: kFileMissing, kFileFormat (with line or byte offset),
/// kFileUnsupported (no simplices, other cells). Counts of a file are checked against its size before
/// anything is allocated.
AnyMesh read_mesh(const std::filesystem::path& path);

struct MeshWriteOptions {
  std::optional<bool> ascii;  ///< for formats with both forms; DEFAULT: binary
  std::string version;        ///< of formats with several; DEFAULT: the first of MeshFormat::versions
  /// .vtu: facets with their tags as triangles beside the tetrahedra, point tags as point data "region".
  /// DEFAULT: cells only, as viewers like it.
  bool facets = false;
  bool compress = true;  ///< .vtu
  /// Of the prisms that a format with MeshFormat::prisms holds a 2D mesh as, > 0.
  std::optional<double> height = {};
  /// .mesh, .meshb: where point fields go, see solution_path (mesh/solution.h). DEFAULT: nowhere
  std::filesystem::path solution = {};
};

/// The files that make up the mesh `path`, in the order they are written.
std::vector<std::filesystem::path> mesh_files(const std::filesystem::path& path);

/// Errors: kUsage naming the formats unless `path` is a mesh that can be written; kFileWrite when one of its
/// files could not be created.
void check_writable_mesh(const std::filesystem::path& path);

/// Writes into `files`, which the caller commits. Returns what the format cannot hold, in words, empty when
/// nothing is lost. Errors: kUsage (options the format does not have), kParameter (sizes of tags and fields
/// that do not fit the mesh), kFileWrite.
template <int D>
std::vector<std::string> write_mesh(OutputFiles& files, const std::filesystem::path& path,
                                    const Mesh<D>& mesh, const MeshWriteOptions& options = {});

/// The same, committed: all files appear or none.
template <int D>
std::vector<std::string> write_mesh(const std::filesystem::path& path, const Mesh<D>& mesh,
                                    const MeshWriteOptions& options = {});

}  // namespace lamina
