// `lamina score MESH`: validity and quality of any mesh, from files only.
#include <fmt/format.h>

#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/detail/metric_family.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/wall_judge.h"
#include "core/analytic_metric.h"
#include "core/error.h"
#include "core/parallel.h"
#include "mesh/background.h"
#include "mesh/io.h"
#include "mesh/solution.h"

namespace lamina::cli {
namespace {

struct State {
  std::string mesh, metric, analytic, case_file, body;
  int threads = 0;
  bool json = false;
};

/// What a mesh is judged by: metrics of its points and where they come from ("": Euclidean), and what is
/// known of them elsewhere.
template <int D>
struct Judge {
  std::vector<Metric<D>> metric;
  std::string origin;
  std::unique_ptr<const AnalyticMetric<D>> formula;
  std::unique_ptr<const Body> body;
  std::unique_ptr<const WallMetric> wall;
  std::unique_ptr<const AdaptMetric<D>> family;  ///< of a formula or a body
};

template <int D>
void evaluate(const Mesh<D>& mesh, Judge<D>& judge) {
  judge.metric.resize(mesh.points.size());
  for_each_index(
      mesh.points.size(), [&](std::size_t i) { judge.metric[i] = judge.family->at(mesh.points[i], 0.0); },
      256);
}

/// The metric of a body, as `lamina mesh` has it.
template <int D>
Judge<D> judge_by_body(const State& state, const Mesh<D>& mesh) {
  Judge<D> judge;
  Case c = state.case_file.empty() ? Case{} : read_case(state.case_file);
  if (!state.body.empty()) c.body = state.body;
  judge.origin = c.body.string();
  judge.body = std::make_unique<const Body>(load_body(c, nullptr));
  if (judge.body->planar() != (D == 2))
    throw Error(ErrorCode::kUsage, fmt::format("{}: a mesh in {} dimensions, and {} is a body in {}",
                                               state.mesh, D, c.body.string(), judge.body->planar() ? 2 : 3));
  judge.wall = std::make_unique<const WallMetric>(wall_metric(*judge.body, resolve_case(c, *judge.body)));
  judge.family = metric_family<D>(*judge.wall);
  evaluate<D>(mesh, judge);
  return judge;
}

/// From a body, a formula, a file, or the mesh's own field "metric", whichever is given.
template <int D>
Judge<D> find_judge(const State& state, const Mesh<D>& mesh) {
  if (!state.case_file.empty() || !state.body.empty()) return judge_by_body<D>(state, mesh);
  Judge<D> judge;
  const std::size_t n = mesh.points.size();
  if (!state.analytic.empty()) {
    judge.origin = state.analytic;
    judge.formula = make_analytic_metric<D>(state.analytic);
    judge.family = std::make_unique<AnalyticFamily<D>>(*judge.formula);
    evaluate<D>(mesh, judge);
  } else if (!state.metric.empty()) {
    judge.origin = state.metric;
    judge.metric = read_metric<D>(state.metric);
    if (judge.metric.size() != n)
      throw Error(ErrorCode::kParameter, fmt::format("{}: holds {} tensors, but {} has {} points",
                                                     state.metric, judge.metric.size(), state.mesh, n));
  } else if (auto field = metric_field<D>(mesh, state.mesh)) {
    judge.origin = "field \"metric\" of the mesh";
    judge.metric = std::move(*field);
  } else {
    judge.metric.resize(n);
  }
  return judge;
}

void print_score(const Validation& v, const Score& s, const std::string& origin) {
  fmt::print("{:<14}{}\n", "validity", v.summary());
  fmt::print("{:<14}{} points, {} cells, {} edges, volume {:.12g}\n", "counts", s.points, s.cells, s.edges,
             v.volume);
  if (!origin.empty()) {
    fmt::print("{:<14}{}\n", "metric", origin);
    fmt::print(
        "{:<14}{:.2f} %, lengths {:.3g} to {:.3g}, mean {:.3f}, below 1/2 {:.2f} %, above 2 {:.2f} %\n",
        "unit edges", 100.0 * s.unit_share, s.length_min, s.length_max, s.length_mean, 100.0 * s.short_share,
        100.0 * s.long_share);
    fmt::print("{:<14}{:.6g}\n", "complexity", s.complexity);
  } else {
    fmt::print("{:<14}none: Euclidean quality\n", "metric");
  }
  fmt::print("{:<14}worst {:.4g}, mean {:.4f}\n", "quality", s.quality_min, s.quality_mean);
  fmt::print("{:<14}largest {:.4g}, 99 % below {:.4g}\n", "aspect", s.aspect_max, s.aspect_p99);
  if (!s.worst.empty()) {
    const WorstCell& w = s.worst.front();
    fmt::print("{:<14}cell {} near ({:.6g}, {:.6g}, {:.6g})\n", "worst cell", w.cell, w.center[0],
               w.center[1], w.center[2]);
  }
}

template <int D>
int run(const State& state, const Mesh<D>& mesh) {
  const Validation validation = validate<D>(mesh);
  Json json = {{"mesh", state.mesh}, {"dimension", D}, {"validation", to_json(validation)}};
  // Scoring follows indices, so a mesh that names missing vertices stops here.
  if (validation.bad_indices > 0) {
    if (state.json)
      fmt::print("{}", json_text(json));
    else
      fmt::print("{:<14}{}\n", "validity", validation.summary());
    return kMissed;
  }
  const Judge<D> judge = find_judge<D>(state, mesh);
  const std::string& origin = judge.origin;
  const Score result = score<D>(mesh, judge.metric);
  std::vector<double> phi;
  if (judge.family) phi = wall_distances<D>(mesh, *judge.family);
  std::optional<LayerScore> layers;
  std::optional<WallFit> wall;
  if (judge.wall) wall = judge_wall<D>(mesh, phi, *judge.body, *judge.wall);
  if (!phi.empty()) layers = score_layers<D>(mesh, judge.metric, *judge.family, phi);
  if (state.json) {
    json["metric"] = origin.empty() ? Json() : Json(origin);
    json["score"] = to_json(result);
    if (origin.empty()) {  // lengths of edges mean nothing without a wanted size
      json["score"].erase("unit_share");
      json["score"].erase("length");
    }
    if (layers) json["levels"] = to_json(*layers);
    if (wall) json["wall"] = to_json(*wall);
    json["worst_cells"] = worst_cells_json(result);
    fmt::print("{}", json_text(json));
  } else {
    print_score(validation, result, origin);
    if (layers)
      for (const auto& [name, text] : layer_rows(*layers)) fmt::print("{:<14}{}\n", name, text);
    if (wall) fmt::print("{:<14}{}\n", "wall", wall_text(*wall, judge.wall->layer().h_min));
  }
  return validation.ok() ? kDone : kMissed;
}

}  // namespace

void add_score(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("score", "Validity and quality of a mesh, from files only");
  app->footer(
      "Without a metric: validity, aspect ratios and Euclidean quality. Exit code 3 when the mesh is not "
      "valid.\n"
      "Examples:\n  lamina score wing.meshb --metric wing.solb --json\n"
      "  lamina score wing.vtu --case wing.case.toml");
  auto state = std::make_shared<State>();
  app->add_option("MESH", state->mesh, readable_mesh_suffixes())->required();
  auto* file = app->add_option(
      "--metric", state->metric,
      "metric at the vertices, .sol or .solb (default: the point field \"metric\" of the mesh, of a .mesh or "
      ".meshb the tensor in the .solb or .sol beside it)");
  file->type_name("FILE");
  app->add_option("--analytic", state->analytic, "metric given by a formula; lamina adapt --help lists them")
      ->type_name("NAME[:key=value,...]")
      ->excludes(file);
  auto* case_file =
      app->add_option("--case", state->case_file,
                      "case file of the mesh: judges it by the metric and the layers of its body");
  case_file->type_name("FILE.toml")->excludes(file);
  auto* body = app->add_option("--body", state->body, "the body, in place of the one that --case names");
  body->type_name("FILE")->excludes(file);
  app->get_option("--analytic")->excludes(case_file)->excludes(body);
  app->add_option("--threads", state->threads, "worker threads (default: 0, all)")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
  app->add_flag("--json", state->json, "print JSON");
  commands.push_back({app, [state] {
                        const ThreadLimit limit(state->threads);
                        std::string ignored;
                        const AnyMesh any = read_mesh_and_fields(state->mesh, ignored);
                        if (!ignored.empty()) fmt::print(stderr, "lamina: warning: {}: ignored\n", ignored);
                        return std::visit([&](const auto& mesh) { return run(*state, mesh); }, any);
                      }});
}

}  // namespace lamina::cli
