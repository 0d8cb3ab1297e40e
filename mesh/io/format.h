// What every format brings to the table of mesh/io.h.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/file.h"
#include "mesh/io.h"
#include "mesh/mesh.h"

namespace lamina::io {

/// Where and how a mesh is to be written.
struct WriteJob {
  OutputFiles& files;
  const std::filesystem::path& path;
  const MeshWriteOptions& options;
  std::vector<std::string>& lost;  ///< what of this mesh finds no place, beyond what the table says

  [[nodiscard]] bool ascii() const { return options.ascii.value_or(false); }
};

struct FormatEntry {
  MeshFormat format;
  AnyMesh (*read)(const std::filesystem::path&) = nullptr;
  void (*write2)(WriteJob&, const Mesh<2>&) = nullptr;
  void (*write3)(WriteJob&, const Mesh<3>&) = nullptr;
  /// Names of the files; nullptr: the path itself.
  std::vector<std::filesystem::path> (*files)(const std::filesystem::path&) = nullptr;
};

const std::vector<FormatEntry>& format_entries();
/// nullptr when the end of `path` names no format.
const FormatEntry* find_format(const std::filesystem::path& path);
/// What of the mesh the format cannot hold by the table, in words.
template <int D>
std::vector<std::string> not_held(const MeshFormat& format, const Mesh<D>& mesh,
                                  const MeshWriteOptions& options);

}  // namespace lamina::io
