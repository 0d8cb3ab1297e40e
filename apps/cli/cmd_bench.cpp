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
#include "apps/pipeline/picture.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/speedup_picture.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/parallel.h"

namespace lamina::cli {
namespace {

struct State {
  explicit State(CLI::App& app) : flags(app, {"body", "flow", "sizes", "domain", "levelset", "mesh"}) {}
  CaseFlags flags;
  int repeat = 1;
  std::string csv, json, plot, suite, data;
  bool large = false;
};

struct Row {
  int threads = 0, repeat = 0;
  double wall = 0.0, cpu = 0.0, peak = 0.0, serial = 0.0;  ///< serial: share of the work
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
  row.serial = total.serial_fraction(threads);
  return row;
}

std::string csv_text(const std::vector<Row>& rows) {
  std::string out = "threads,repeat,cells,wall_seconds,cpu_seconds,cells_per_second,peak_bytes,mesh_hash";
  for (const StageCost& s : rows.front().stages)
    out += fmt::format(",{}_seconds,{}_serial_seconds", s.name, s.name);
  out += "\n";
  for (const Row& r : rows) {
    out += fmt::format("{},{},{},{:.4f},{:.4f},{:.1f},{:.0f},{:016x}", r.threads, r.repeat, r.cells, r.wall,
                       r.cpu, static_cast<double>(r.cells) / r.wall, r.peak, r.hash);
    for (const StageCost& s : r.stages)
      out += fmt::format(",{:.4f},{:.4f}", s.wall_seconds, s.serial_seconds);
    out += "\n";
  }
  return out;
}

std::string rows_json(const std::vector<Row>& rows, const Case& c, bool identical) {
  Json runs = Json::array();
  for (const Row& r : rows) {
    Json stages = Json::array();
    for (const StageCost& s : r.stages)
      stages.push_back({{"name", s.name},
                        {"wall_seconds", s.wall_seconds},
                        {"cpu_seconds", s.cpu_seconds},
                        {"user_seconds", s.user_seconds},
                        {"serial_seconds", s.serial_seconds}});
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

/// The fastest run on that many threads.
const Row& fastest(const std::vector<Row>& rows, int threads) {
  const Row* best = nullptr;
  for (const Row& r : rows)
    if (r.threads == threads && (best == nullptr || r.wall < best->wall)) best = &r;
  return *best;
}

/// How much faster runs and their parts are than on one thread.
std::vector<Speedup> speedups(const std::vector<Row>& rows) {
  const Row& one = fastest(rows, 1);
  std::vector<Speedup> out = {{.name = "whole run"}};
  for (const StageCost& s : one.stages)
    if (s.wall_seconds > 0.05 * one.wall) out.push_back({.name = s.name});
  for (int threads = 1; threads <= rows.back().threads; ++threads) {
    const Row& r = fastest(rows, threads);
    out[0].values.push_back(one.wall / r.wall);
    for (std::size_t i = 0; i < one.stages.size(); ++i)
      for (Speedup& line : out)
        if (line.name == one.stages[i].name)
          line.values.push_back(one.stages[i].wall_seconds / r.stages[i].wall_seconds);
  }
  return out;
}

void print_speedups(const std::vector<Row>& rows) {
  const Row& one = fastest(rows, 1);
  fmt::print("\n{:<14}{:>10}{:>10}{:>10}  speed-up on 1, 2, ... threads\n", "stage", "wall s", "serial s",
             "serial %");
  const auto lines = speedups(rows);
  const auto print = [&](const std::string& name, const StageCost& cost) {
    fmt::print("{:<14}{:>10.2f}{:>10.2f}{:>10.2f}  ", name, cost.wall_seconds, cost.serial_seconds,
               100.0 * cost.serial_fraction(1));
    for (const Speedup& line : lines)
      if (line.name == name)
        for (const double v : line.values) fmt::print(" {:.2f}", v);
    fmt::print("\n");
  };
  for (const StageCost& s : one.stages) print(s.name, s);
  print("whole run", total_cost(one.stages));
}

int run(const State& state) {
  Case c = state.flags.read();
  c.outputs.clear();
  c.metric_out = c.levelset_out = c.report = c.picture = c.checkpoint = std::nullopt;
  OutputSet outputs;
  for (const std::string& path : {state.csv, state.json, state.plot})
    if (!path.empty()) outputs.expect(path, c.body);
  if (!state.plot.empty()) check_picture_extension(state.plot);
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
  print_speedups(rows);
  if (!state.plot.empty())
    outputs.write(state.plot, [&](const auto& path) { draw_speedups(path, speedups(rows)); });
  if (!state.csv.empty()) outputs.write_text(state.csv, csv_text(rows));
  if (!state.json.empty()) outputs.write_text(state.json, rows_json(rows, c, identical));
  outputs.commit();
  if (!identical)
    throw Error(ErrorCode::kInternal, "the mesh depends on the number of threads or on the run");
  return kDone;
}

/// `--suite adapt`: one row per analytic metric.
int run_suite(const State& state) {
  if (!state.csv.empty() || !state.plot.empty() || state.repeat != 1)
    throw Error(ErrorCode::kUsage, "--csv, --plot and --repeat are for whole runs, not for --suite");
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
  app->add_option("--plot", state->plot, "speed-up over threads to draw: .png, .svg or .pdf")
      ->type_name("FILE");
  auto* suite = app->add_option("--suite", state->suite, "benchmark to run instead of a case: adapt");
  suite->type_name("NAME")->check(CLI::IsMember({"adapt"}));
  app->add_flag("--large", state->large, "the large cases of the suite too")->needs(suite);
  app->add_option("--data", state->data, "folder of start meshes of the suite (default: lattices)")
      ->type_name("DIR")
      ->needs(suite);
  commands.push_back({app, [state] { return state->suite.empty() ? run(*state) : run_suite(*state); }});
}

}  // namespace lamina::cli
