// `lamina score MESH`: validity and quality of any mesh, from files only.
#include <fmt/format.h>

#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "core/analytic_metric.h"
#include "core/error.h"
#include "core/parallel.h"
#include "mesh/background.h"
#include "mesh/io.h"

namespace lamina::cli {
namespace {

struct State {
  std::string mesh, metric, analytic;
  int threads = 0;
  bool json = false;
};

/// A metric for the mesh, and where it came from: a formula, a file, the mesh's own field "metric", or none
/// (Euclidean).
template <int D>
std::vector<Metric<D>> find_metric(const State& state, const Mesh<D>& mesh, std::string& origin) {
  const std::size_t n = mesh.points.size();
  if (!state.analytic.empty()) {
    origin = state.analytic;
    const auto formula = make_analytic_metric<D>(state.analytic);
    std::vector<Metric<D>> metric(n);
    for_each_index(n, [&](std::size_t i) { metric[i] = formula->at(mesh.points[i]); });
    return metric;
  }
  if (!state.metric.empty()) {
    origin = state.metric;
    std::vector<Metric<D>> metric = read_metric<D>(state.metric);
    if (metric.size() != n)
      throw Error(ErrorCode::kParameter, fmt::format("{}: holds {} tensors, but {} has {} points",
                                                     state.metric, metric.size(), state.mesh, n));
    return metric;
  }
  const auto field = metric_field<D>(mesh, state.mesh);
  origin = field ? "field \"metric\" of the mesh" : "";
  return field ? *field : std::vector<Metric<D>>(n);
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
  std::string origin;
  Json json = {{"mesh", state.mesh}, {"dimension", D}, {"validation", to_json(validation)}};
  // Scoring follows indices, so a mesh that names missing vertices stops here.
  if (validation.bad_indices > 0) {
    if (state.json)
      fmt::print("{}", json_text(json));
    else
      fmt::print("{:<14}{}\n", "validity", validation.summary());
    return kMissed;
  }
  const std::vector<Metric<D>> metric = find_metric<D>(state, mesh, origin);
  const Score result = score<D>(mesh, metric);
  if (state.json) {
    json["metric"] = origin.empty() ? Json() : Json(origin);
    json["score"] = to_json(result);
    if (origin.empty()) {  // lengths of edges mean nothing without a wanted size
      json["score"].erase("unit_share");
      json["score"].erase("length");
    }
    json["worst_cells"] = worst_cells_json(result);
    fmt::print("{}", json_text(json));
  } else {
    print_score(validation, result, origin);
  }
  return validation.ok() ? kDone : kMissed;
}

}  // namespace

void add_score(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("score", "Validity and quality of a mesh, from files only");
  app->footer(
      "Without a metric: validity, aspect ratios and Euclidean quality. Exit code 3 when the mesh is not "
      "valid.\n"
      "Example:\n  lamina score wing.meshb --metric wing.solb --json");
  auto state = std::make_shared<State>();
  app->add_option("MESH", state->mesh, readable_mesh_suffixes())->required();
  auto* file = app->add_option(
      "--metric", state->metric,
      "metric at the vertices, .sol or .solb (default: the point field \"metric\" of the mesh)");
  file->type_name("FILE");
  app->add_option("--analytic", state->analytic, "metric given by a formula; lamina adapt --help lists them")
      ->type_name("NAME[:key=value,...]")
      ->excludes(file);
  app->add_option("--threads", state->threads, "worker threads (default: 0, all)")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
  app->add_flag("--json", state->json, "print JSON");
  commands.push_back({app, [state] {
                        const ThreadLimit limit(state->threads);
                        return std::visit([&](const auto& mesh) { return run(*state, mesh); },
                                          read_mesh(state->mesh));
                      }});
}

}  // namespace lamina::cli
