#include <fmt/format.h>

#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/text.h"
#include "core/file.h"
#include "mesh/box_facets.h"
#include "mesh/io.h"
#include "mesh/listed_parts.h"
#include "mesh/solution.h"

namespace lamina::cli {
namespace {

/// One line a format: name, suffixes, what it holds.
std::string format_list() {
  std::string text =
      "Formats (c f p: tags of cells, facets, points; e: edges and corners; N: names of tags; F: fields, of\n"
      ".mesh and .meshb in the .sol or .solb beside it; 2: 2D too):\n";
  for (const MeshFormat& f : mesh_formats()) {
    std::string holds;
    const auto add = [&](bool held, char letter) { holds += held ? letter : '-'; };
    add(f.cell_tags, 'c');
    add(f.facet_tags, 'f');
    add(f.point_tags, 'p');
    add(f.edges, 'e');
    add(f.facet_names, 'N');
    add(f.point_fields != MeshFormat::Fields::kNoFields || f.solution, 'F');
    add(f.plane, '2');
    text += fmt::format("  {:24}{}  {}{}\n", f.name, holds, fmt::join(f.suffixes, " "),
                        f.reads ? "" : " (written only)");
  }
  return text;
}

struct State {
  std::string in, out;
  bool ascii = false, binary = false, cells_only = false, no_compress = false;
  std::string version;
};

/// Words on facets that the input does not name.
void tell_listed(const State& state, const AnyMesh& any) {
  std::visit(
      [&](const auto& mesh) {
        std::vector<std::string> names;
        for (const auto& [tag, name] : mesh.facet_names) names.push_back(name);
        fmt::print(stderr,
                   "lamina: warning: {} names no facets: the {} of its boundary are tagged by the faces of "
                   "its bounding box, {}\n",
                   state.in, mesh.facets.size(), join(names));
      },
      any);
}

int convert(const State& state) {
  OutputSet outputs;
  outputs.expect_mesh(state.out, state.in);
  MeshWriteOptions options;
  if (state.ascii || state.binary) options.ascii = state.ascii;
  options.version = state.version;
  options.facets = !state.cells_only;
  options.compress = !state.no_compress;
  std::string ignored;
  AnyMesh any = read_mesh_and_fields(state.in, ignored);
  if (!ignored.empty()) fmt::print(stderr, "lamina: warning: {}: ignored\n", ignored);
  const bool fields = std::visit([](const auto& mesh) { return !mesh.point_fields.empty(); }, any);
  if (fields && mesh_format(state.out)->solution) {
    options.solution = solution_path(state.out);
    if (const auto solution = find_solution(state.in)) outputs.protect(*solution);
    outputs.expect(options.solution, state.in);
  }
  const bool bare = std::visit([](const auto& mesh) { return mesh.facets.empty(); }, any);
  const bool list = bare && !state.cells_only && lower_extension(state.out) != ".vtu";
  const std::vector<std::string> lost = std::visit(
      [&](auto& mesh) {
        if (state.cells_only) {
          mesh.facets.clear();
          mesh.facet_tags.clear();
          mesh.facet_names.clear();
          drop_listed_parts(mesh);
        }
        if (list) list_box_facets(mesh);
        return write_mesh(outputs.files(), state.out, mesh, options);
      },
      any);
  outputs.commit();
  if (list) tell_listed(state, any);
  if (!lost.empty())
    fmt::print(stderr, "lamina: warning: {} cannot hold {}: dropped\n", state.out, join(lost));
  return kDone;
}

}  // namespace

void add_convert(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("convert", "Turn a mesh into another format");
  app->footer(format_list() +
              "What the target format cannot hold is named on stderr.\nExamples:\n  lamina convert wing.vtu "
              "wing.meshb\n  lamina convert wing.meshb wing.msh --format-version 2.2 --ascii");
  auto state = std::make_shared<State>();
  app->add_option("IN", state->in, readable_mesh_suffixes())->required();
  app->add_option("OUT", state->out, writable_mesh_suffixes())->required();
  CLI::Option* ascii = app->add_flag("--ascii", state->ascii, "text, where the format has both");
  app->add_flag("--binary", state->binary, "binary, where the format has both (default)")->excludes(ascii);
  app->add_option("--format-version", state->version,
                  "of the format: .msh 4.1 or 2.2; .mesh, .meshb 2, 3 or 4");
  app->add_flag("--cells-only", state->cells_only, "leave out facets, edges and corners");
  app->add_flag("--no-compress", state->no_compress, "faster and larger .vtu");
  commands.push_back({app, [state] { return convert(*state); }});
}

}  // namespace lamina::cli
