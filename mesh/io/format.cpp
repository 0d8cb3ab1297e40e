// The table of formats.
#include "mesh/io/format.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "core/error.h"
#include "core/words.h"
#include "mesh/io/cgns.h"
#include "mesh/io/foam.h"
#include "mesh/io/gmf.h"
#include "mesh/io/houdini.h"
#include "mesh/io/msh.h"
#include "mesh/io/su2.h"
#include "mesh/io/tetgen_files.h"
#include "mesh/io/ugrid.h"
#include "mesh/io/usda.h"
#include "mesh/io/vtu.h"
#include "mesh/io/xdmf.h"
#include "mesh/solution.h"

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

using Fields = MeshFormat::Fields;

template <int D>
bool fits_tensor(const MeshField& f) {
  return f.components == 1 || f.components == D || f.components == kSymSize<D>;
}

/// Reader of a format whose files stand alone.
template <AnyMesh (*Parse)(std::string_view, const std::string&)>
AnyMesh read_file(const fs::path& path) {
  const MappedFile file(path);
  return Parse(file.bytes(), path.string());
}

template <int D>
void add_lost_lines(const Mesh<D>& mesh, std::vector<std::string>& lost) {
  const auto add = [&](std::size_t n, const char* what) {
    if (n > 0) lost.push_back(counted(static_cast<std::int64_t>(n), what));
  };
  add(mesh.edges.size(), "edge");
  add(mesh.corners.size(), "corner");
}

template <int D>
void write_vtu_file(WriteJob& job, const Mesh<D>& mesh) {
  write_vtu(job.files.add(job.path), mesh, {.facets = job.options.facets, .compress = job.options.compress});
  if (job.options.facets) return;
  if (!mesh.facets.empty())
    job.lost.push_back(counted(static_cast<std::int64_t>(mesh.facets.size()), "facet"));
  if (!mesh.point_tags.empty()) job.lost.emplace_back("point tags");
  add_lost_lines(mesh, job.lost);
}

template <int D, bool Ascii>
void write_gmf_file(WriteJob& job, const Mesh<D>& mesh) {
  const std::string& version = job.options.version;
  write_gmf(job.files.add(job.path), mesh, {Ascii, version.empty() ? 0 : version[0] - '0'});
  const fs::path& path = job.options.solution;
  if (path.empty()) return;
  std::vector<MeshField> fields;
  std::string names;
  for (const MeshField& f : mesh.point_fields) {
    if (!fits_tensor<D>(f)) continue;
    fields.push_back(f);
    names += fmt::format("{}{} {}", fields.size() > 1 ? ", " : "", fields.size(), f.name);
  }
  if (fields.empty()) return;
  write_fields<D>(job.files.add(path), path, fields);
  const bool kept = fields.size() == 1 && fields[0].name == "metric";
  if (!kept) job.lost.push_back(fmt::format("the names of fields (in {}: {})", path.string(), names));
}

FormatEntry vtu_entry() {
  return {{.name = "VTK unstructured grid",
           .suffixes = {".vtu"},
           .point_tags = true,
           .edges = true,
           .point_fields = Fields::kAnyFields,
           .cell_fields = Fields::kAnyFields},
          read_file<parse_vtu>,
          write_vtu_file<2>,
          write_vtu_file<3>};
}

template <bool Ascii>
FormatEntry gmf_entry() {
  return {{.name = Ascii ? "GMF ascii" : "GMF binary",
           .suffixes = {Ascii ? ".mesh" : ".meshb"},
           .point_tags = true,
           .edges = true,
           .required = true,
           .solution = true,
           .versions = {"2", "3", "4"}},
          read_file<parse_gmf>,
          write_gmf_file<2, Ascii>,
          write_gmf_file<3, Ascii>};
}

FormatEntry msh_entry() {
  return {{.name = "Gmsh MSH",
           .suffixes = {".msh"},
           .cell_names = true,
           .facet_names = true,
           .edges = true,
           .point_fields = Fields::kTensorFields,
           .cell_fields = Fields::kTensorFields,
           .ascii = true,
           .binary = true,
           .versions = {"4.1", "2.2"}},
          read_file<parse_msh>,
          write_msh<2>,
          write_msh<3>};
}

FormatEntry su2_entry() {
  return {{.name = "SU2", .suffixes = {".su2"}, .cell_tags = false, .facet_names = true},
          read_file<parse_su2>,
          write_su2<2>,
          write_su2<3>};
}

FormatEntry tetgen_entry() {
  return {{.name = "TetGen, Triangle", .suffixes = {".node", ".ele", ".face"}, .point_tags = true},
          read_tetgen_files,
          write_tetgen_files<2>,
          write_tetgen_files<3>,
          tetgen_files};
}

FormatEntry ugrid_entry() {
  return {{.name = "UGRID",
           .suffixes = {".lb8.ugrid", ".b8.ugrid", ".lb8l.ugrid", ".b8l.ugrid", ".ugrid"},
           .plane = false,
           .cell_tags = false},
          read_ugrid,
          nullptr,
          write_ugrid};
}

FormatEntry foam_entry() {
  return {{.name = "OpenFOAM polyMesh",
           .suffixes = {"polyMesh", ".foam"},
           .plane = false,
           .prisms = true,
           .cell_names = true,
           .facet_names = true,
           .ascii = true,
           .binary = true},
          read_foam,
          write_foam_prisms,
          write_foam,
          foam_files};
}

#ifdef LAMINA_HDF5
FormatEntry xdmf_entry() {
  return {{.name = "XDMF with HDF5",
           .suffixes = {".xdmf"},
           .point_tags = true,
           .cell_names = true,
           .facet_names = true,
           .point_fields = Fields::kAnyFields,
           .cell_fields = Fields::kAnyFields},
          read_xdmf,
          write_xdmf<2>,
          write_xdmf<3>,
          xdmf_files};
}
#endif

#ifdef LAMINA_CGNS
FormatEntry cgns_entry() {
  return {{.name = "CGNS",
           .suffixes = {".cgns"},
           .point_tags = true,
           .facet_names = true,
           .point_fields = Fields::kTensorFields,
           .cell_fields = Fields::kTensorFields},
          read_cgns,
          write_cgns<2>,
          write_cgns<3>};
}
#endif

FormatEntry houdini_entry() {
  return {{.name = "Houdini geometry",
           .suffixes = {".geo"},
           .plane = false,
           .point_tags = true,
           .point_fields = Fields::kAnyFields,
           .cell_fields = Fields::kAnyFields},
          read_file<parse_geo>,
          nullptr,
          write_geo};
}

FormatEntry usda_entry() {
  return {{.name = "USD TetMesh",
           .suffixes = {".usda"},
           .plane = false,
           .point_tags = true,
           .cell_names = true,
           .facet_names = true,
           .point_fields = Fields::kAnyFields,
           .cell_fields = Fields::kAnyFields,
           .exact = false},
          read_file<parse_usda>,
          nullptr,
          write_usda};
}

std::vector<FormatEntry> make_entries() {
  return {
      vtu_entry(),     gmf_entry<true>(), gmf_entry<false>(), msh_entry(),
      su2_entry(),     tetgen_entry(),    ugrid_entry(),      foam_entry(),
#ifdef LAMINA_HDF5
      xdmf_entry(),
#endif
#ifdef LAMINA_CGNS
      cgns_entry(),
#endif
      houdini_entry(), usda_entry(),
  };
}

std::string lower(std::string_view text) {
  std::string name(text);
  for (char& c : name)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return name;
}

/// The end of a path in lower case, without a slash behind it.
std::string lower_name(const fs::path& path) {
  return lower((path.has_filename() ? path : path.parent_path()).filename().string());
}

/// A suffix without a dot is the whole name of a folder.
bool ends_so(const std::string& name, std::string_view suffix) {
  if (suffix.front() != '.') return name == lower(suffix);
  return name.size() > suffix.size() && name.compare(name.size() - suffix.size(), suffix.size(), suffix) == 0;
}

template <int D>
void add_lost_fields(const MeshFormat& format, const Mesh<D>& mesh, const MeshWriteOptions& options,
                     std::vector<std::string>& lost) {
  std::vector<std::string> names;
  const auto add = [&](const std::vector<MeshField>& fields, Fields held) {
    for (const MeshField& f : fields) {
      if (held == Fields::kAnyFields || (held == Fields::kTensorFields && fits_tensor<D>(f))) continue;
      names.push_back(f.name);
    }
  };
  add(mesh.point_fields,
      format.solution && !options.solution.empty() ? Fields::kTensorFields : format.point_fields);
  add(mesh.cell_fields, format.cell_fields);
  if (!names.empty()) lost.push_back(fmt::format("the fields {}", fmt::join(names, ", ")));
}

/// Formats with corners hold the tags of these.
template <int D>
bool has_tags_to_lose(const MeshFormat& format, const Mesh<D>& mesh) {
  const auto is_tag = [](Index tag) { return tag != 0; };
  std::vector<Index> tags = mesh.point_tags;
  if (format.edges && !tags.empty())
    for (const Index v : mesh.corners) tags[static_cast<std::size_t>(v)] = 0;
  return std::any_of(tags.begin(), tags.end(), is_tag);
}

}  // namespace

const std::vector<FormatEntry>& format_entries() {
  static const std::vector<FormatEntry> entries = make_entries();
  return entries;
}

const FormatEntry* find_format(const fs::path& path) {
  const std::string name = lower_name(path);
  const FormatEntry* found = nullptr;
  std::size_t longest = 0;
  for (const FormatEntry& e : format_entries()) {
    for (const std::string_view suffix : e.format.suffixes) {
      if (suffix.size() <= longest || !ends_so(name, suffix)) continue;
      longest = suffix.size();
      found = &e;
    }
  }
  return found;
}

template <int D>
std::vector<std::string> not_held(const MeshFormat& format, const Mesh<D>& mesh,
                                  const MeshWriteOptions& options) {
  std::vector<std::string> lost;
  if (!format.exact) lost.emplace_back("coordinates beyond single precision");
  if (!format.facets && !mesh.facets.empty())
    lost.push_back(counted(static_cast<std::int64_t>(mesh.facets.size()), "facet"));
  if (!format.cell_tags && !mesh.cell_tags.empty()) lost.emplace_back("cell tags");
  if (format.facets && !format.facet_tags && !mesh.facet_tags.empty()) lost.emplace_back("facet tags");
  if (!format.point_tags && has_tags_to_lose(format, mesh)) lost.emplace_back("point tags");
  if ((!format.cell_names && !mesh.cell_names.empty()) ||
      (!format.facet_names && !mesh.facet_names.empty()) ||
      (format.edges && !format.facet_names && !(mesh.edge_names.empty() && mesh.point_names.empty())))
    lost.emplace_back("names of tags");
  if (!format.edges) add_lost_lines(mesh, lost);
  if (!format.required) {
    if (!mesh.ridges.empty() && format.edges) lost.emplace_back("which edges are ridges");
    if (!mesh.required.empty()) lost.emplace_back("which parts are required");
  }
  add_lost_fields(format, mesh, options, lost);
  return lost;
}

template std::vector<std::string> not_held<2>(const MeshFormat&, const Mesh<2>&, const MeshWriteOptions&);
template std::vector<std::string> not_held<3>(const MeshFormat&, const Mesh<3>&, const MeshWriteOptions&);

}  // namespace lamina::io
