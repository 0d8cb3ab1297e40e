#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/pipeline.h"
#include "core/error.h"
#include "core/file.h"

namespace lamina::cli {

void add_levelset(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("levelset", "Write the level set of a body with normals and curvatures");
  app->footer(
      "The file holds the grids surface (signed distance, < 0 inside), N, T1 and k (k1, k2, 0).\nExample:\n"
      "  lamina levelset wing.stl --unit mm --voxel 0.005 -o wing.vdb");
  struct State {
    explicit State(CLI::App& a) : flags(a, {"body", "levelset"}) {}
    CaseFlags flags;
    std::string out;
    bool json = false;
  };
  auto state = std::make_shared<State>(*app);
  app->add_option("-o,--out", state->out, "file to write")->required()->type_name("FILE.vdb");
  app->add_flag("--json", state->json, "print what was made as JSON");
  commands.push_back(
      {app, [state] {
         const Case c = state->flags.read();
         if (lower_extension(state->out) != ".vdb")
           throw Error(ErrorCode::kUsage, fmt::format("{}: a level set is written as .vdb", state->out));
         OutputSet outputs;
         outputs.expect(state->out, c.body);
         Terminal terminal(state->flags.verbosity());
         StageRecorder stages(&terminal);
         stages.stage("level set");
         const Body body = load_body(c, &stages);
         const LevelSetReport& r = body.level_set.report();
         for (const auto* list : {&body.surface.warnings, &r.warnings})
           for (const std::string& w : *list) stages.warn(w);
         outputs.write(state->out, [&](const auto& path) { body.level_set.write(path); });
         stages.check_cancelled();
         outputs.commit();
         stages.done(fmt::format("{} voxels", r.active_voxels));
         if (state->json)
           fmt::print("{}", json_text(to_json(r)));
         else
           fmt::print("voxel {:g}, {} active voxels, {:.1f} MiB, {} sharp edges, {} corners\n", r.voxel,
                      r.active_voxels, r.grid_bytes / 1048576.0, r.sharp_edges, r.corners);
         return kDone;
       }});
}

}  // namespace lamina::cli
