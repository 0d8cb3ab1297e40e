#include <fmt/format.h>

#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"

namespace lamina::cli {
namespace {

/// What the format of `out` cannot hold, in words; empty when nothing is lost.
template <int D>
std::string dropped(const Mesh<D>& mesh, const std::string& out) {
  if (lower_extension(out) == ".vtu") {
    std::vector<std::string> lost;
    if (!mesh.facets.empty())
      lost.push_back(fmt::format("{} boundary facets and their tags", mesh.facets.size()));
    if (!mesh.point_tags.empty()) lost.push_back("point tags");
    return join(lost);
  }
  std::vector<std::string> names;
  for (const auto* fields : {&mesh.point_fields, &mesh.cell_fields})
    for (const MeshField& f : *fields) names.push_back(f.name);
  return names.empty() ? "" : "the fields " + join(names);
}

}  // namespace

void add_convert(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("convert", "Turn a mesh into another format");
  app->footer(
      "What the target format cannot hold is named on stderr.\nExample:\n  lamina convert wing.vtu "
      "wing.meshb");
  struct State {
    std::string in, out;
  };
  auto state = std::make_shared<State>();
  app->add_option("IN", state->in, ".vtu .mesh .meshb")->required();
  app->add_option("OUT", state->out, ".vtu .mesh .meshb")->required();
  commands.push_back(
      {app, [state] {
         if (!is_writable_mesh(state->out))
           throw Error(ErrorCode::kUsage,
                       fmt::format("{}: a mesh is written as .vtu, .mesh or .meshb", state->out));
         OutputSet outputs;
         outputs.expect(state->out, state->in);
         const AnyMesh any = read_mesh(state->in);
         const std::string lost = std::visit(
             [&](const auto& mesh) {
               outputs.write(state->out, [&](const auto& path) { write_mesh(path, mesh); });
               return dropped(mesh, state->out);
             },
             any);
         outputs.commit();
         if (!lost.empty())
           fmt::print(stderr, "lamina: warning: {} cannot hold {}: dropped\n", state->out, lost);
         return kDone;
       }});
}

}  // namespace lamina::cli
