// Chooses the format by the extension; the formats themselves are in mesh/io.
#include "mesh/io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "mesh/io/format.h"
#include "mesh/io/gmf.h"

namespace lamina {
namespace {

std::string suffixes(bool MeshFormat::*can) {
  std::string list;
  for (const io::FormatEntry& e : io::format_entries())
    for (const std::string_view s : e.format.suffixes)
      if (e.format.*can) list.append(list.empty() ? "" : " ").append(s);
  return list;
}

void check_fields(const std::filesystem::path& path, const std::vector<MeshField>& fields,
                  std::size_t count) {
  for (const MeshField& f : fields)
    if (f.components < 1 || f.values.size() != count * static_cast<std::size_t>(f.components))
      throw Error(ErrorCode::kParameter,
                  fmt::format("{}: field \"{}\" holds {} values, expected {} x {}", path.string(), f.name,
                              f.values.size(), count, f.components));
}

template <int D>
void check_sizes(const std::filesystem::path& path, const Mesh<D>& mesh) {
  const auto fits = [](std::size_t tags, std::size_t items) { return tags == 0 || tags == items; };
  if (!fits(mesh.cell_tags.size(), mesh.cells.size()) || !fits(mesh.facet_tags.size(), mesh.facets.size()) ||
      !fits(mesh.point_tags.size(), mesh.points.size()) || !fits(mesh.edge_tags.size(), mesh.edges.size()))
    throw Error(ErrorCode::kParameter,
                fmt::format("{}: a mesh with another number of tags than of cells, facets, "
                            "edges or points cannot be written",
                            path.string()));
  check_fields(path, mesh.point_fields, mesh.points.size());
  check_fields(path, mesh.cell_fields, mesh.cells.size());
}

void check_options(const std::filesystem::path& path, const MeshFormat& format,
                   const MeshWriteOptions& options) {
  if (options.ascii && !(*options.ascii ? format.ascii : format.binary))
    throw Error(ErrorCode::kUsage, fmt::format("{}: {} has no choice between ascii and binary here",
                                               path.string(), format.name));
  const auto& known = format.versions;
  if (!options.version.empty() && std::find(known.begin(), known.end(), options.version) == known.end())
    throw Error(
        ErrorCode::kUsage,
        fmt::format("{}: version {} of {} is not written; {}", path.string(), options.version, format.name,
                    known.empty() ? std::string("there is one only")
                                  : fmt::format("known are {}", fmt::join(known, ", "))));
}

/// Errors: kFileUnsupported, or kUsage before a run.
const io::FormatEntry& require_writable(const std::filesystem::path& path, ErrorCode code) {
  const io::FormatEntry* entry = io::find_format(path);
  if (entry != nullptr && entry->format.writes) return *entry;
  throw Error(code, fmt::format("{}: a mesh is written as {}", path.string(), suffixes(&MeshFormat::writes)));
}

}  // namespace

const std::vector<MeshFormat>& mesh_formats() {
  static const std::vector<MeshFormat> formats = [] {
    std::vector<MeshFormat> list;
    for (const io::FormatEntry& e : io::format_entries()) list.push_back(e.format);
    return list;
  }();
  return formats;
}

const MeshFormat* mesh_format(const std::filesystem::path& path) {
  const io::FormatEntry* entry = io::find_format(path);
  return entry == nullptr ? nullptr : &entry->format;
}

bool is_readable_mesh(const std::filesystem::path& path) {
  const MeshFormat* format = mesh_format(path);
  return format != nullptr && format->reads;
}

bool is_writable_mesh(const std::filesystem::path& path) {
  const MeshFormat* format = mesh_format(path);
  return format != nullptr && format->writes;
}

std::string readable_mesh_suffixes() { return suffixes(&MeshFormat::reads); }
std::string writable_mesh_suffixes() { return suffixes(&MeshFormat::writes); }

AnyMesh read_mesh(const std::filesystem::path& path) {
  const io::FormatEntry* entry = io::find_format(path);
  if (entry == nullptr || !entry->format.reads)
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: unknown extension \"{}\"; known are {}", path.string(),
                            path.extension().string(), readable_mesh_suffixes()));
  try {
    return entry->read(path);
  } catch (const std::bad_alloc&) {  // zlib can pack a thousand times the size of the file into it
    throw Error(ErrorCode::kFileUnreadable,
                fmt::format("{}: the mesh does not fit in memory", path.string()));
  }
}

std::vector<std::filesystem::path> mesh_files(const std::filesystem::path& path) {
  const io::FormatEntry& entry = require_writable(path, ErrorCode::kUsage);
  if (entry.files == nullptr) return {path};
  return entry.files(path);
}

void check_writable_mesh(const std::filesystem::path& path) {
  for (std::filesystem::path file : mesh_files(path)) {
    std::error_code ec;
    std::filesystem::path folder = file.parent_path();
    // Formats of folders create theirs.
    if (file.parent_path() != path.parent_path())
      while (!folder.empty() && !std::filesystem::exists(folder, ec)) folder = folder.parent_path();
    if (folder != file.parent_path()) file = folder / file.filename();
    check_writable(file);
  }
}

template <int D>
std::vector<std::string> write_mesh(OutputFiles& files, const std::filesystem::path& path,
                                    const Mesh<D>& mesh, const MeshWriteOptions& options) {
  const io::FormatEntry& entry = require_writable(path, ErrorCode::kFileUnsupported);
  check_sizes(path, mesh);
  check_options(path, entry.format, options);
  std::vector<std::string> lost = io::not_held(entry.format, mesh, options);
  io::WriteJob job{files, path, options, lost};
  if constexpr (D == 2) {
    if (entry.write2 == nullptr)
      throw Error(ErrorCode::kFileUnsupported,
                  fmt::format("{}: {} does not hold 2D meshes", path.string(), entry.format.name));
    entry.write2(job, mesh);
  } else {
    entry.write3(job, mesh);
  }
  return lost;
}

template <int D>
std::vector<std::string> write_mesh(const std::filesystem::path& path, const Mesh<D>& mesh,
                                    const MeshWriteOptions& options) {
  OutputFiles files;
  std::vector<std::string> lost = write_mesh(files, path, mesh, options);
  files.commit();
  return lost;
}

template std::vector<std::string> write_mesh<2>(OutputFiles&, const std::filesystem::path&, const Mesh<2>&,
                                                const MeshWriteOptions&);
template std::vector<std::string> write_mesh<3>(OutputFiles&, const std::filesystem::path&, const Mesh<3>&,
                                                const MeshWriteOptions&);
template std::vector<std::string> write_mesh<2>(const std::filesystem::path&, const Mesh<2>&,
                                                const MeshWriteOptions&);
template std::vector<std::string> write_mesh<3>(const std::filesystem::path&, const Mesh<3>&,
                                                const MeshWriteOptions&);

}  // namespace lamina
