#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/metric_picture.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/picture.h"
#include "apps/pipeline/plan.h"
#include "core/parallel.h"

namespace lamina::cli {

namespace {

struct State {
  explicit State(CLI::App& app) : flags(app, all_tables()) {}
  CaseFlags flags;
  std::string color = "size";
  bool json = false;
};

MetricPictureOptions picture_options(const State& state, const Case& resolved) {
  MetricPictureOptions o;
  o.plane = resolved.picture_plane;
  o.window = *resolved.picture_window;  // filled in when there is a picture
  o.color = state.color == "ratio" ? MetricColor::kRatio : MetricColor::kSize;
  o.width_px = 1200;
  return o;
}

int run(const State& state) {
  const Case c = state.flags.read();
  const ThreadLimit limit(c.threads);
  OutputSet outputs;
  if (c.picture) {
    check_picture_extension(*c.picture);
    outputs.expect(*c.picture, c.body);
  }
  Terminal terminal(state.flags.verbosity());
  StageRecorder stages(&terminal);
  stages.stage("level set");
  const Body body = load_body(c, &stages);
  ResolvedCase resolved = resolve_case(c, body);
  stages.done(size_text(body));
  stages.stage("count");
  if (c.target_cells) fit_to_target(resolved, body, &stages);
  const WallMetric metric = wall_metric(body, resolved);
  const Prediction prediction = predict(metric, &stages, kFineLeaves);
  const auto limits = limits_of_input(resolved, body, prediction);
  resolved.warnings.insert(resolved.warnings.end(), limits.begin(), limits.end());
  pass_on_warnings(body, &resolved, stages);
  stages.done(fmt::format("{} evaluations of the metric", prediction.evaluations));
  if (c.picture) {
    stages.stage("picture");
    outputs.write(*c.picture,
                  [&](const auto& path) { draw_metric(path, metric, picture_options(state, resolved.c)); });
    stages.done(c.picture->string());
  }
  outputs.commit();
  fmt::print("{}", state.json ? plan_json(resolved, prediction) : plan_text(resolved, prediction));
  return kDone;
}

}  // namespace

void add_plan(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("plan", "Sizes, layers and expected counts of a mesh, without making it");
  app->footer(
      "Takes the options of `lamina mesh`; of its files it writes the picture, which shows the metric: sizes "
      "(or "
      "ratios), and ellipses for directions.\nExamples:\n"
      "  lamina plan wing.stl --re 3e6 --yplus 30 --json\n"
      "  lamina plan wing.stl --re 3e6 --picture sizes.png --picture-window 0.9 -0.05 1.1 0.05");
  auto state = std::make_shared<State>(*app);
  app->add_flag("--json", state->json, "print JSON");
  app->add_option("--color", state->color, "of the picture: size | ratio (default: size)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"size", "ratio"}));
  commands.push_back({app, [state] { return run(*state); }});
}

}  // namespace lamina::cli
