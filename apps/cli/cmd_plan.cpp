#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/plan.h"
#include "core/parallel.h"

namespace lamina::cli {

void add_plan(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("plan", "Sizes, layers and expected counts of a mesh, without making it");
  app->footer(
      "Takes the options of `lamina mesh` and writes none of its files.\nExample:\n"
      "  lamina plan wing.stl --re 3e6 --yplus 30 --json");
  struct State {
    explicit State(CLI::App& a) : flags(a, all_tables()) {}
    CaseFlags flags;
    bool json = false;
  };
  auto state = std::make_shared<State>(*app);
  app->add_flag("--json", state->json, "print JSON");
  commands.push_back({app, [state] {
                        const Case c = state->flags.read();
                        const ThreadLimit limit(c.threads);
                        Terminal terminal(state->flags.verbosity());
                        StageRecorder stages(&terminal);
                        stages.stage("level set");
                        const Body body = load_body(c, &stages);
                        ResolvedCase resolved = resolve_case(c, body);
                        stages.done(fmt::format("{} voxels", body.level_set.report().active_voxels));
                        stages.stage("count");
                        const Prediction prediction = fit_to_target(resolved, body, &stages);
                        const auto limits = limits_of_input(resolved, body, prediction);
                        resolved.warnings.insert(resolved.warnings.end(), limits.begin(), limits.end());
                        pass_on_warnings(body, &resolved, stages);
                        stages.done(fmt::format("{} evaluations of the metric", prediction.evaluations));
                        fmt::print("{}", state->json ? plan_json(resolved, prediction)
                                                     : plan_text(resolved, prediction));
                        return kDone;
                      }});
}

}  // namespace lamina::cli
