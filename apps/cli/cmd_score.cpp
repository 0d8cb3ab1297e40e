// `lamina score MESH`: validity and quality of any mesh, or of two side by side, from files only.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "apps/cli/command.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/detail/metric_family.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/score_picture.h"
#include "apps/pipeline/wall_judge.h"
#include "core/analytic_metric.h"
#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "mesh/background.h"
#include "mesh/io.h"
#include "mesh/solution.h"

namespace lamina::cli {
namespace {

struct State {
  std::vector<std::string> meshes, metrics;
  std::string analytic, case_file, body, picture;
  int threads = 0;
  bool json = false, compare = false;

  /// The metric file of a mesh; "" where none is given.
  [[nodiscard]] std::string metric_of(std::size_t number) const {
    return number < metrics.size() ? metrics[number] : std::string();
  }
};

/// Labels and texts of the lines of a table.
using Rows = std::vector<std::pair<std::string, std::string>>;

/// Everything about one mesh.
struct Judged {
  std::string name, origin;
  Validation validation;
  Json json;
  Rows rows;                   ///< of its own table
  Rows numbers;                ///< of a table of several: one number each
  std::optional<Score> score;  ///< none where the mesh names vertices that there are not
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
Judge<D> judge_by_body(const State& state, const std::string& name, const Mesh<D>& mesh) {
  Judge<D> judge;
  Case c = state.case_file.empty() ? Case{} : read_case(state.case_file);
  if (!state.body.empty()) c.body = state.body;
  judge.origin = c.body.string();
  judge.body = std::make_unique<const Body>(load_body(c, nullptr));
  if (judge.body->planar() != (D == 2))
    throw Error(ErrorCode::kUsage, fmt::format("{}: a mesh in {} dimensions, and {} is a body in {}", name, D,
                                               c.body.string(), judge.body->planar() ? 2 : 3));
  judge.wall = std::make_unique<const WallMetric>(wall_metric(*judge.body, resolve_case(c, *judge.body)));
  judge.family = metric_family<D>(*judge.wall);
  evaluate<D>(mesh, judge);
  return judge;
}

/// From a body, a formula, a file, or the mesh's own field "metric", whichever is given.
template <int D>
Judge<D> find_judge(const State& state, std::size_t number, const Mesh<D>& mesh) {
  const std::string &name = state.meshes[number], metric = state.metric_of(number);
  if (!state.case_file.empty() || !state.body.empty()) return judge_by_body<D>(state, name, mesh);
  Judge<D> judge;
  const std::size_t n = mesh.points.size();
  if (!state.analytic.empty()) {
    judge.origin = state.analytic;
    judge.formula = make_analytic_metric<D>(state.analytic);
    judge.family = std::make_unique<AnalyticFamily<D>>(*judge.formula);
    evaluate<D>(mesh, judge);
  } else if (!metric.empty()) {
    judge.origin = metric;
    const std::string extension = lower_extension(metric);
    if (extension == ".sol" || extension == ".solb") {
      judge.metric = read_metric<D>(metric);
      if (judge.metric.size() != n)
        throw Error(ErrorCode::kParameter, fmt::format("{}: holds {} tensors, but {} has {} points", metric,
                                                       judge.metric.size(), name, n));
    } else {
      const BackgroundMetric<D> background = BackgroundMetric<D>::read(metric);
      judge.metric.resize(n);
      for_each_index(
          n, [&](std::size_t i) { judge.metric[i] = background.at(mesh.points[i]); }, 256);
    }
  } else if (auto field = metric_field<D>(mesh, name)) {
    judge.origin = "field \"metric\" of the mesh";
    judge.metric = std::move(*field);
  } else {
    judge.metric.resize(n);
  }
  return judge;
}

Rows score_rows(const Validation& v, const Score& s, const std::string& origin) {
  Rows rows = {{"validity", v.summary()},
               {"counts", fmt::format("{} points, {} cells, {} edges, volume {:.12g}", s.points, s.cells,
                                      s.edges, v.volume)}};
  if (!origin.empty()) {
    rows.emplace_back("metric", origin);
    rows.emplace_back(
        "unit edges",
        fmt::format("{:.2f} %, lengths {:.3g} to {:.3g}, mean {:.3f}, below 1/2 {:.2f} %, above 2 {:.2f} %",
                    100.0 * s.unit_share, s.length_min, s.length_max, s.length_mean, 100.0 * s.short_share,
                    100.0 * s.long_share));
    rows.emplace_back("complexity", fmt::format("{:.6g}", s.complexity));
  } else {
    rows.emplace_back("metric", "none: Euclidean quality");
  }
  rows.emplace_back("quality", fmt::format("worst {:.4g}, mean {:.4f}", s.quality_min, s.quality_mean));
  rows.emplace_back("aspect", fmt::format("largest {:.4g}, 99 % below {:.4g}", s.aspect_max, s.aspect_p99));
  if (!s.worst.empty()) {
    const WorstCell& w = s.worst.front();
    rows.emplace_back("worst cell", fmt::format("cell {} near ({:.6g}, {:.6g}, {:.6g})", w.cell, w.center[0],
                                                w.center[1], w.center[2]));
  }
  return rows;
}

/// "-" for what a mesh without a metric does not have.
Rows score_numbers(const Validation& v, const Score& s, bool has_metric) {
  const auto percent = [&](double x) { return has_metric ? fmt::format("{:.2f} %", 100.0 * x) : "-"; };
  const auto number = [&](double x) { return has_metric ? fmt::format("{:.4g}", x) : "-"; };
  return {{"points", fmt::format("{}", s.points)},
          {"cells", fmt::format("{}", s.cells)},
          {"edges", fmt::format("{}", s.edges)},
          {"volume", fmt::format("{:.8g}", v.volume)},
          {"complexity", number(s.complexity)},
          {"unit edges", percent(s.unit_share)},
          {"shortest edge", number(s.length_min)},
          {"mean edge", number(s.length_mean)},
          {"longest edge", number(s.length_max)},
          {"below 1/2", percent(s.short_share)},
          {"above 2", percent(s.long_share)},
          {"worst quality", fmt::format("{:.4g}", s.quality_min)},
          {"mean quality", fmt::format("{:.4f}", s.quality_mean)},
          {"largest aspect", fmt::format("{:.4g}", s.aspect_max)},
          {"aspect, 99 %", fmt::format("{:.4g}", s.aspect_p99)}};
}

template <int D>
Judged judge_mesh(const State& state, std::size_t number, const Mesh<D>& mesh) {
  Judged out;
  out.name = state.meshes[number];
  out.validation = validate<D>(mesh);
  out.json = {{"mesh", out.name}, {"dimension", D}, {"validation", to_json(out.validation)}};
  out.rows = {{"validity", out.validation.summary()}};
  // Scoring follows indices, so a mesh that names missing vertices stops here.
  if (out.validation.bad_indices > 0) return out;
  const Judge<D> judge = find_judge<D>(state, number, mesh);
  out.origin = judge.origin;
  const Score& result = out.score.emplace(score<D>(mesh, judge.metric));
  std::vector<double> phi;
  if (judge.family) phi = wall_distances<D>(mesh, *judge.family);
  std::optional<LayerScore> layers;
  std::optional<WallFit> wall;
  if (judge.wall) wall = judge_wall<D>(mesh, phi, *judge.body, *judge.wall);
  if (!phi.empty()) layers = score_layers<D>(mesh, judge.metric, *judge.family, phi);
  out.json["metric"] = judge.origin.empty() ? Json() : Json(judge.origin);
  out.json["score"] = to_json(result);
  if (judge.origin.empty()) {  // lengths of edges mean nothing without a wanted size
    out.json["score"].erase("unit_share");
    out.json["score"].erase("length");
  }
  if (layers) out.json["levels"] = to_json(*layers);
  if (wall) out.json["wall"] = to_json(*wall);
  out.json["worst_cells"] = worst_cells_json(result);
  out.rows = score_rows(out.validation, result, judge.origin);
  out.numbers = score_numbers(out.validation, result, !judge.origin.empty());
  if (layers) {
    for (const auto& row : layer_rows(*layers)) out.rows.push_back(row);
    const auto points = static_cast<double>(std::max<std::int64_t>(layers->points, 1));
    out.numbers.emplace_back("on levels",
                             fmt::format("{:.1f} %", 100.0 * static_cast<double>(layers->on_level) / points));
    out.numbers.emplace_back("mean offset", fmt::format("{:.3f}", layers->mean_offset));
    out.numbers.emplace_back("aligned edges", fmt::format("{:.1f} %", 100.0 * layers->aligned_of_ideal()));
  }
  if (wall) out.rows.emplace_back("wall", wall_text(*wall, judge.wall->layer().h_min));
  return out;
}

Judged judge_file(const State& state, std::size_t number) {
  std::string ignored;
  const AnyMesh any = read_mesh_and_fields(state.meshes[number], ignored);
  if (!ignored.empty()) fmt::print(stderr, "lamina: warning: {}: ignored\n", ignored);
  return std::visit([&](const auto& mesh) { return judge_mesh(state, number, mesh); }, any);
}

/// The end of a name that fits a column.
std::string shortened(const std::string& name, std::size_t width) {
  return name.size() <= width ? name : "..." + name.substr(name.size() - width + 3);
}

void print_side_by_side(const std::vector<Judged>& all) {
  constexpr std::size_t kColumn = 24;
  const auto line = [&](const std::string& label, auto&& text) {
    fmt::print("{:<16}", label);
    for (const Judged& j : all) fmt::print("{:>{}}", shortened(text(j), kColumn), kColumn + 2);
    fmt::print("\n");
  };
  line("", [](const Judged& j) { return j.name; });
  line("validity", [](const Judged& j) { return j.validation.ok() ? std::string("valid") : "not valid"; });
  line("metric", [](const Judged& j) { return j.origin.empty() ? std::string("none") : j.origin; });
  for (const auto& [label, text] : all.front().numbers)
    line(label, [&](const Judged& j) {
      for (const auto& [other, value] : j.numbers)
        if (other == label) return value;
      return std::string("-");
    });
  for (const Judged& j : all)
    if (!j.validation.ok()) fmt::print("{}: {}\n", j.name, j.validation.summary());
}

void check_words(const State& state) {
  const std::size_t wanted = state.compare ? 2 : 1;
  if (state.meshes.size() != wanted)
    throw Error(ErrorCode::kUsage,
                state.compare ? fmt::format("--compare takes two meshes, {} are given", state.meshes.size())
                              : fmt::format("{}: one mesh is scored; two side by side with --compare",
                                            state.meshes[1]));
  if (state.metrics.size() > wanted)
    throw Error(ErrorCode::kUsage,
                fmt::format("--metric {}: there are more metrics than meshes", state.metrics.back()));
}

int run(const State& state) {
  check_words(state);
  OutputSet outputs;
  for (const std::string& metric : state.metrics) outputs.protect(metric);
  if (!state.picture.empty()) {
    require_extension(state.picture, "a picture", {".png", ".svg", ".pdf"});
    outputs.protect(state.meshes.back());
    outputs.expect(state.picture, state.meshes.front());
  }
  std::vector<Judged> all;
  for (std::size_t i = 0; i < state.meshes.size(); ++i) all.push_back(judge_file(state, i));
  if (!state.picture.empty()) {
    std::vector<ScoredMesh> scored;
    for (const Judged& j : all)
      if (j.score) scored.push_back({j.name, !j.origin.empty(), *j.score});
    outputs.write(state.picture, [&](const auto& path) { draw_scores(path, scored); });
    outputs.commit();
  }
  if (state.json && state.compare) {
    Json list = Json::array();
    for (const Judged& j : all) list.push_back(j.json);
    fmt::print("{}", json_text({{"meshes", list}}));
  } else if (state.json) {
    fmt::print("{}", json_text(all.front().json));
  } else if (state.compare) {
    print_side_by_side(all);
  } else {
    for (const auto& [label, text] : all.front().rows) fmt::print("{:<14}{}\n", label, text);
  }
  const bool valid = std::all_of(all.begin(), all.end(), [](const Judged& j) { return j.validation.ok(); });
  return valid ? kDone : kMissed;
}

}  // namespace

void add_score(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("score", "Validity and quality of a mesh, from files only");
  app->footer(
      "Without a metric: validity, aspect ratios and Euclidean quality. Exit code 3 when the mesh is not "
      "valid.\n"
      "Examples:\n  lamina score wing.meshb --metric wing.solb --json\n"
      "  lamina score wing.vtu --case wing.case.toml\n"
      "  lamina score --compare before.vtu after.vtu --picture both.png");
  auto state = std::make_shared<State>();
  app->add_option("MESH", state->meshes, readable_mesh_suffixes())->required()->expected(1, 2);
  app->add_flag("--compare", state->compare, "two meshes side by side; --metric may be given for each");
  auto* file = app->add_option("--metric", state->metrics,
                               "metric at the vertices, .sol or .solb, or another mesh with its metric, "
                               "interpolated (default: the point field \"metric\" of the mesh, of a .mesh or "
                               ".meshb the tensor in the .solb or .sol beside it)");
  file->type_size(1)->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
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
  app->add_option("--picture", state->picture,
                  "histograms of edge lengths and qualities to draw: .png, .svg or .pdf")
      ->type_name("FILE");
  commands.push_back({app, [state] {
                        const ThreadLimit limit(state->threads);
                        return run(*state);
                      }});
}

}  // namespace lamina::cli
