// `lamina bench`: whole runs of one case over 1..N threads, where meshes must be equal and times are what is
// measured; or the benchmarks of the optimizer.
#include <fmt/format.h>

#include <memory>
#include <numeric>

#include "apps/cli/case_flags.h"
#include "apps/cli/command.h"
#include "apps/pipeline/adapt_suite.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/parallel.h"

namespace lamina::cli {
namespace {

struct State {
  explicit State(CLI::App& app) : flags(app, {"body", "flow", "sizes", "domain", "levelset", "mesh"}) {}
  CaseFlags flags;
  int repeat = 1;
  std::string csv, json, suite, data;
  bool large = false;
};

struct Row {
  int threads = 0, repeat = 0;
  double wall = 0.0, cpu = 0.0, peak = 0.0;
  std::int64_t cells = 0;
  std::uint64_t hash = 0;
  std::vector<StageCost> stages;
};

Row measure(Case c, int threads, int repeat, Progress& progress) {
  c.threads = threads;
  const Report report = run_case(c, &progress);
  Row row{.threads = threads,
          .repeat = repeat,
          .cells = report.cells(),
          .hash = report.mesh_hash,
          .stages = report.stages};
  const StageCost total = total_cost(report.stages);
  row.wall = total.wall_seconds;
  row.cpu = total.cpu_seconds;
  row.peak = total.peak_bytes;
  return row;
}

std::string csv_text(const std::vector<Row>& rows) {
  std::string out = "threads,repeat,cells,wall_seconds,cpu_seconds,cells_per_second,peak_bytes,mesh_hash";
  for (const StageCost& s : rows.front().stages) out += fmt::format(",{}_seconds", s.name);
  out += "\n";
  for (const Row& r : rows) {
    out += fmt::format("{},{},{},{:.4f},{:.4f},{:.1f},{:.0f},{:016x}", r.threads, r.repeat, r.cells, r.wall,
                       r.cpu, static_cast<double>(r.cells) / r.wall, r.peak, r.hash);
    for (const StageCost& s : r.stages) out += fmt::format(",{:.4f}", s.wall_seconds);
    out += "\n";
  }
  return out;
}

std::string rows_json(const std::vector<Row>& rows, const Case& c, bool identical) {
  Json runs = Json::array();
  for (const Row& r : rows) {
    Json stages = Json::array();
    for (const StageCost& s : r.stages)
      stages.push_back({{"name", s.name}, {"wall_seconds", s.wall_seconds}, {"cpu_seconds", s.cpu_seconds}});
    runs.push_back({{"threads", r.threads},
                    {"repeat", r.repeat},
                    {"cells", r.cells},
                    {"wall_seconds", r.wall},
                    {"cpu_seconds", r.cpu},
                    {"cells_per_second", static_cast<double>(r.cells) / r.wall},
                    {"peak_bytes", r.peak},
                    {"mesh_hash", fmt::format("{:016x}", r.hash)},
                    {"stages", stages}});
  }
  return json_text({{"lamina", version()},
                    {"hardware_threads", hardware_threads()},
                    {"case", to_json(c)},
                    {"identical_meshes", identical},
                    {"runs", runs}});
}

int run(const State& state) {
  Case c = state.flags.read();
  c.outputs.clear();
  c.metric_out = c.levelset_out = c.report = c.picture = std::nullopt;
  OutputSet outputs;
  for (const std::string& path : {state.csv, state.json})
    if (!path.empty()) outputs.expect(path, c.body);
  const int most = c.threads > 0 ? c.threads : hardware_threads();
  Terminal terminal(state.flags.verbosity());
  std::vector<Row> rows;
  fmt::print("threads repeat      cells     wall s      cpu s   cells/s  mesh\n");
  for (int threads = 1; threads <= most; ++threads) {
    for (int repeat = 1; repeat <= state.repeat; ++repeat) {
      const Row& r = rows.emplace_back(measure(c, threads, repeat, terminal));
      fmt::print("{:>7} {:>6} {:>10} {:>10.2f} {:>10.2f} {:>9.0f}  {:016x}\n", r.threads, r.repeat, r.cells,
                 r.wall, r.cpu, static_cast<double>(r.cells) / r.wall, r.hash);
      std::fflush(stdout);
    }
  }
  const bool identical =
      std::all_of(rows.begin(), rows.end(), [&](const Row& r) { return r.hash == rows[0].hash; });
  if (!state.csv.empty()) outputs.write_text(state.csv, csv_text(rows));
  if (!state.json.empty()) outputs.write_text(state.json, rows_json(rows, c, identical));
  outputs.commit();
  if (!identical)
    throw Error(ErrorCode::kInternal, "the mesh depends on the number of threads or on the run");
  return kDone;
}

/// `--suite adapt`: one row per analytic metric.
int run_suite(const State& state) {
  if (!state.csv.empty() || state.repeat != 1)
    throw Error(ErrorCode::kUsage, "--csv and --repeat are for whole runs, not for --suite");
  const Case given = state.flags.read_flags();
  if (!given.body.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("unexpected argument {}: a suite has no body", given.body.string()));
  const int threads = given.threads > 0 ? given.threads : 1;
  const std::vector<SuiteCase> cases = select_cases(state.flags.case_word(), state.large);
  OutputSet outputs;
  if (!state.json.empty()) outputs.expect(state.json, "");
  Terminal terminal(state.flags.verbosity());
  std::vector<SuiteRow> rows;
  fmt::print("{}", suite_header());
  for (const SuiteCase& c : cases) {
    fmt::print("{}", suite_line(rows.emplace_back(run_suite_case(c, state.data, threads, &terminal))));
    std::fflush(stdout);
  }
  if (!state.json.empty()) outputs.write_text(state.json, suite_json(rows));
  outputs.commit();
  bool all_met = true;
  for (const SuiteRow& r : rows) {
    const std::vector<std::string> missed = r.missed();
    if (!missed.empty()) fmt::print(stderr, "lamina: missed: {}: {}\n", r.wanted.name, join(missed));
    all_met = all_met && missed.empty();
  }
  return all_met ? kDone : kMissed;
}

}  // namespace

void add_bench(CLI::App& root, Commands& commands) {
  CLI::App* app =
      root.add_subcommand("bench", "Time whole runs of a case, or the optimizer on its benchmarks");
  app->footer(
      "Runs the case with 1, 2, ... up to --threads threads (default: all) and writes no mesh. Equal hashes "
      "mean\n"
      "equal meshes.\n"
      "With --suite adapt: adapts lattices to the analytic metrics of `lamina adapt`, on --threads threads\n"
      "(default: 1), and tells what was reached beside what must be: unit edges, worst and mean quality, "
      "and\n"
      "user seconds on one thread. Exit code 3 where something is missed, marked by \"!\". --case NAME runs "
      "one\n"
      "case alone. The lattices stand in for start meshes of the same boxes and sizes that benchmarks of "
      "other\n"
      "programs begin with (cubes of 6 tetrahedra; those of tilted-plane, cube, sphere and cube-linear are "
      "the\n"
      "same); --data DIR reads init-*.meshb from a folder instead.\n"
      "Examples:\n"
      "  lamina bench --case sphere.toml --threads 4 --repeat 3 --csv bench.csv\n"
      "  lamina bench --suite adapt --case cube-linear");
  auto state = std::make_shared<State>(*app);
  app->add_option("--repeat", state->repeat, "runs for each number of threads (default: 1)")
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  app->add_option("--csv", state->csv, "table to write")->type_name("FILE.csv");
  app->add_option("--json", state->json, "details to write")->type_name("FILE.json");
  auto* suite = app->add_option("--suite", state->suite, "benchmark to run instead of a case: adapt");
  suite->type_name("NAME")->check(CLI::IsMember({"adapt"}));
  app->add_flag("--large", state->large, "the large cases of the suite too")->needs(suite);
  app->add_option("--data", state->data, "folder of start meshes of the suite (default: lattices)")
      ->type_name("DIR")
      ->needs(suite);
  commands.push_back({app, [state] { return state->suite.empty() ? run(*state) : run_suite(*state); }});
}

}  // namespace lamina::cli
