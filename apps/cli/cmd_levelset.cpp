#include <fmt/format.h>

#include <memory>
#include <optional>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/pipeline.h"
#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"

namespace lamina::cli {

void add_levelset(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("levelset", "Write the level set of a body with normals and curvatures");
  app->footer(
      "The file holds the grids surface (signed distance, < 0 inside), N, T1 and k (k1, k2, reliability), "
      "the "
      "painted sizes of --size-grid and, with --with-metric or any option of flow, sizes or domain, also h "
      "(sizes "
      "along N, T1, T2), logM_diag and logM_off (the logarithm of the metric: xx yy zz, xy xz "
      "yz).\nExamples:\n"
      "  lamina levelset wing.stl --unit mm --voxel 0.005 -o wing.vdb\n"
      "  lamina levelset wing.stl --re 3e6 --size-grid paint.vdb:density -o wing.vdb");
  struct State {
    explicit State(CLI::App& a) : flags(a, {"body", "flow", "sizes", "domain", "levelset", "mesh.threads"}) {}
    [[nodiscard]] bool with_metric() const { return metric || flags.given({"flow", "sizes", "domain"}); }
    CaseFlags flags;
    std::string out;
    bool json = false, metric = false;
  };
  auto state = std::make_shared<State>(*app);
  app->add_option("-o,--out", state->out, "file to write")->required()->type_name("FILE.vdb");
  app->add_flag("--with-metric", state->metric, "write the metric and its sizes too");
  app->add_flag("--json", state->json, "print what was made as JSON");
  commands.push_back(
      {app, [state] {
         const Case c = state->flags.read();
         if (lower_extension(state->out) != ".vdb")
           throw Error(ErrorCode::kUsage, fmt::format("{}: a level set is written as .vdb", state->out));
         OutputSet outputs;
         outputs.expect(state->out, c.body);
         const ThreadLimit limit(c.threads);
         Terminal terminal(state->flags.verbosity());
         StageRecorder stages(&terminal);
         stages.stage("level set");
         const Body body = load_body(c, &stages);
         const LevelSetReport& r = body.level_set.report();
         std::optional<ResolvedCase> resolved;
         std::optional<WallMetric> metric;
         if (state->with_metric()) {
           resolved = resolve_case(c, body);
           metric = wall_metric(body, *resolved);
         }
         pass_on_warnings(body, resolved ? &*resolved : nullptr, stages);
         outputs.write(state->out, [&](const auto& path) {
           body.level_set.write(path, metric ? &*metric : nullptr, body.painted);
         });
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
