// `lamina adapt MESH`: any mesh, made unit in a metric from a formula or a file.
#include <fmt/format.h>

#include <memory>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/cli/terminal.h"
#include "apps/pipeline/adaptation.h"
#include "apps/pipeline/text.h"
#include "core/analytic_metric.h"
#include "core/error.h"

namespace lamina::cli {
namespace {

/// What a wall can be told; its first height is --hmin.
const std::vector<std::string> kWallOptions = {
    "body.unit",   "body.polyline", "body.spline", "body.sheet",    "body.grid",      "body.iso",
    "body.slice",  "flow.re",       "flow.length", "flow.velocity", "flow.viscosity", "flow.yplus",
    "flow.growth", "flow.regime",   "flow.delta",  "flow.layers",   "levelset"};

struct State {
  explicit State(CLI::App& app) : wall(app, kWallOptions) {}
  CaseFlags wall;
  Adaptation adaptation;
  std::vector<std::string> lp_hessians;  // FIELD P FIELD P ...
  std::string metric_out, report, align = "none", cell_tags = "keep", edges = "keep";
};

void add_metric_options(CLI::App& app, State& s) {
  Adaptation& a = s.adaptation;
  const char* group = "Metric";
  auto* analytic =
      app.add_option("--analytic", a.analytic,
                     "a metric given by a formula, evaluated wherever a vertex goes; listed below");
  analytic->type_name("NAME[:key=value,...]")->group(group);
  app.add_option("--metric", a.metric,
                 "a metric at vertices, interpolated: .sol or .solb of MESH, or another mesh with its metric "
                 "(.vtu with point data \"metric\", or .mesh, .meshb with a .sol, .solb of the same name) "
                 "(default: the metric of MESH)")
      ->type_name("FILE")
      ->group(group)
      ->excludes(analytic);
  app.add_option(
         "--lp-hessian", s.lp_hessians,
         "a metric from the Hessian of a point field of MESH (NAME, NAME:K for its K-th component, or a "
         ".sol of one scalar): linear interpolation has the least error in the norm L^P; with "
         "--complexity. May be repeated: all of them")
      ->type_name("FIELD P")
      ->type_size(2)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(group)
      ->excludes(analytic);
  app.add_option("--intersect", a.intersect,
                 "another metric, given as --metric: no size exceeds those of any; may be repeated")
      ->type_name("FILE")
      ->group(group)
      ->type_size(1)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option(
         "--level-set", a.level_set,
         "the boundary layer of a wall beside the other metrics, or alone: a point field of MESH with signed "
         "distances, < 0 inside, or a body as for lamina mesh. Beyond the layers sizes grow up to --hmax")
      ->type_name("FIELD|BODY")
      ->group(group);
  app.add_option("--hmin", a.h_min,
                 "no size is smaller; with --level-set also its first height unless --case has one (unit: "
                 "that of MESH; > 0; default: no bound)")
      ->type_name("X")
      ->group(group);
  app.add_option("--hmax", a.h_max,
                 "no size is larger (unit: that of MESH; > 0; default: no bound; with "
                 "--lp-hessian the diagonal of MESH)")
      ->type_name("X")
      ->group(group);
  app.add_option(
         "--gradation", a.gradation,
         "largest ratio of sizes per element, above 1 and at most 4; 0: no bound. A formula is bounded on "
         "meshes adapted to it; --lp-hessian in space wants 2 (default: 0)")
      ->type_name("X")
      ->group(group);
  app.add_option("--complexity", a.complexity,
                 "scales all sizes, within --hmin and --hmax, until the integral of sqrt(det M) is N; a mesh "
                 "has about 12 N cells in 3D, 2.3 N in 2D (default: sizes as given)")
      ->type_name("N")
      ->group(group);
}

void add_other_options(CLI::App& app, State& s) {
  Adaptation& a = s.adaptation;
  app.add_option("-o,--out", a.outputs, "mesh to write (formats: lamina convert --help); may be repeated")
      ->type_name("FILE")
      ->group("Output")
      ->type_size(1)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--metric-out", s.metric_out, "metric at the vertices to write: .sol or .solb")
      ->type_name("FILE")
      ->group("Output");
  app.add_option("--report", s.report, "report to write: .json")->type_name("FILE")->group("Output");
  app.add_option("--quality-floor", a.quality_floor,
                 fmt::format("quality (mean ratio, 1 is best) below which no operation may bring a cell "
                             "(0 to 0.5; default: {:g})",
                             a.quality_floor))
      ->type_name("X")
      ->check(CLI::Range(0.0, 0.5));
  app.add_option(
         "--hausdorff", a.hausdorff,
         fmt::format("largest distance of new facets of curved boundaries from those of MESH (unit: that of "
                     "MESH; > 0; default: {:g} of the diagonal of its box)",
                     kHausdorffShare))
      ->type_name("X")
      ->group("Boundary");
  app.add_option(
         "--ridge-angle", a.ridge_angle,
         fmt::format("angle between facets, in degrees, above which the boundary has a ridge, in 2D "
                     "a corner; ridges, corners and borders of tags are kept (0 to 90; default: {:g})",
                     a.ridge_angle))
      ->type_name("X")
      ->group("Boundary");
  app.add_option("--cell-tags", s.cell_tags,
                 "keep: cells of different tags stay apart, and facets between them are a boundary of either "
                 "side; drop: tags of cells are forgotten (keep | drop; default: keep)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"keep", "drop"}))
      ->group("Boundary");
  app.add_option(
         "--edges", s.edges,
         "keep: edges, corners and required parts that MESH lists stay, edges as ridges do; drop: they "
         "are forgotten (keep | drop; default: keep)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"keep", "drop"}))
      ->group("Boundary");
  app.add_option("--align", s.align,
                 "where vertices go: none, anywhere, which makes the most regular cells, or layers, onto the "
                 "levels of a metric with layers (none | layers; default: none)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"none", "layers"}));
  app.add_option("--threads", a.threads,
                 "worker threads; 0: all of the machine's. The mesh does not depend on it (default: 0)")
      ->type_name("N")
      ->check(CLI::Range(0, 4096));
}

LpHessian lp_hessian(const std::string& field, const std::string& power) {
  const auto p = parse_number(power);
  if (p) return {field, *p};
  throw Error(ErrorCode::kUsage,
              fmt::format("--lp-hessian {} {}: the power of the norm must be a number, as 2", field, power));
}

int run(State& s) {
  Adaptation a = s.adaptation;
  for (std::size_t i = 0; i + 1 < s.lp_hessians.size(); i += 2)
    a.lp_hessians.push_back(lp_hessian(s.lp_hessians[i], s.lp_hessians[i + 1]));
  a.wall = s.wall.read();
  if (a.level_set.empty() && s.wall.given({"body", "flow", "levelset"}))
    throw Error(ErrorCode::kUsage, "options of a wall are given, but no wall: name it with --level-set");
  if (!s.metric_out.empty()) a.metric_out = s.metric_out;
  if (!s.report.empty()) a.report = s.report;
  a.keep_cell_tags = s.cell_tags != "drop";
  a.keep_edges = s.edges != "drop";
  if (s.align == "layers") a.align = Align::kLayers;
  Terminal terminal(s.wall.verbosity());
  const AdaptationReport report = run_adaptation(a, &terminal);
  fmt::print("{}", adaptation_table(report));
  for (const std::string& line : report.missed) fmt::print(stderr, "lamina: missed: {}\n", line);
  return report.missed.empty() ? kDone : kMissed;
}

}  // namespace

void add_adapt(CLI::App& root, Commands& commands) {
  CLI::App* app = root.add_subcommand("adapt", "Adapt any mesh of triangles or tetrahedra to a metric");
  app->footer(
      "Point fields of MESH, of a .mesh or .meshb those of the .solb or .sol beside it, are carried to the "
      "new "
      "mesh: linear within the old cells.\n"
      "The boundary is followed: planes exactly, curved surfaces within --hausdorff; so are those\n"
      "between cells of different tags, and tagged ones that cut a part off. Tags are kept.\n"
      "Metrics for --analytic, with their keys and defaults:\n" +
      analytic_list() +
      "Examples:\n"
      "  lamina adapt coarse.meshb --metric wanted.sol -o fine.meshb --metric-out fine.sol\n"
      "  lamina adapt flow.vtu --lp-hessian mach 2 --complexity 20000 --gradation 1.5 -o finer.vtu\n"
      "  lamina adapt flow.vtu --lp-hessian mach 2 --complexity 50000 --level-set wing.stl --hmin 1e-3 -o "
      "next.vtu\n"
      "  lamina adapt --analytic tilted-plane:hmin=1e-3 -o plane.vtu\n"
      "Exit codes: 0 done; 1 internal failure; 2 bad input; 3 mesh written, but a wanted property was "
      "missed.");
  auto state = std::make_shared<State>(*app);
  app->add_option("MESH", state->adaptation.mesh,
                  "a mesh (default: with --analytic, a lattice in the box the metric is defined on)");
  add_metric_options(*app, *state);
  add_other_options(*app, *state);
  commands.push_back({app, [state] { return run(*state); }});
}

}  // namespace lamina::cli
