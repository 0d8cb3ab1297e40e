#include "apps/pipeline/adapt_suite.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/pipeline/detail/adapted.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/detail/metric_family.h"
#include "apps/pipeline/pipeline.h"
#include "apps/pipeline/report.h"
#include "apps/pipeline/stages.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/parallel.h"
#include "mesh/io.h"
#include "mesh/seed.h"
#include "vdb/shapes.h"

namespace lamina {
namespace {

template <int D>
Mesh<D> start_mesh(const SuiteCase& c, const AnalyticMetric<D>& metric, const std::filesystem::path& data) {
  if (data.empty()) return make_seed<D>(metric.domain(), metric.start_size(), SeedKind::kLattice);
  const std::filesystem::path file = data / c.start;
  AnyMesh any = read_mesh(file);
  auto* mesh = std::get_if<Mesh<D>>(&any);
  if (mesh == nullptr)
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: not a mesh in {} dimensions", file.string(), D));
  return std::move(*mesh);
}

// Adapts the start mesh and fills in everything but the case. `before` are the user seconds at its begin.
template <int D>
SuiteRow run(Mesh<D> mesh, const AdaptMetric<D>& family, const AdaptOptions& options, const Box<D>& domain,
             double before, StageRecorder& stages) {
  SuiteRow row;
  row.start_cells = static_cast<std::int64_t>(mesh.cells.size());
  std::vector<Metric<D>> metric;
  adapt<D>(mesh, family, metric, options, &stages);
  row.user_seconds = user_seconds() - before;
  stages.done(fmt::format("{} cells", mesh.cells.size()));
  row.wall_seconds = stages.costs().back().wall_seconds;
  row.peak_bytes = stages.costs().back().peak_bytes;
  require_valid<D>(mesh, domain);
  const Score s = score<D>(mesh, metric);
  row.cells = s.cells;
  row.points = s.points;
  row.unit_share = s.unit_share;
  row.quality_min = s.quality_min;
  row.quality_mean = s.quality_mean;
  if (options.align == Align::kLayers)
    row.layers = score_layers<D>(mesh, metric, family, wall_distances<D>(mesh, family));
  return row;
}

template <int D>
SuiteRow run_analytic(const SuiteCase& c, const std::filesystem::path& data, StageRecorder& stages) {
  const auto formula = make_analytic_metric<D>(c.metric());
  AdaptOptions options;
  options.end_size = formula->smallest();
  if (c.aligned()) options.align = Align::kLayers;
  Mesh<D> mesh = start_mesh<D>(c, *formula, data);
  stages.stage(c.name);
  return run<D>(std::move(mesh), AnalyticFamily<D>(*formula), options, formula->domain(), user_seconds(),
                stages);
}

SuiteRow run_body(const SuiteCase& c, StageRecorder& stages) {
  stages.stage(c.name);
  const double before = user_seconds();
  Case settings = c.body->settings;
  settings.align = c.aligned() ? Align::kLayers : Align::kAnywhere;
  const Body body = surface_body(settings, make_shape(c.body->shape, {}), c.body->shape, &stages);
  const ResolvedCase r = resolve_case(settings, body);
  const WallMetric metric = wall_metric(body, r);
  return run<3>(make_seed<3>(r.sizes.domain, r.sizes.h1, r.c.seed), *metric_family<3>(metric),
                adapt_options(r, body), r.sizes.domain, before, stages);
}

// The cube of the analytic metric of that name, whose sizes jump at its edges. Here corners and gradation
// follow Lamina's rules.
SuiteBody cube() {
  Case c;
  c.flow.h_min = 2e-4;
  c.h2 = c.h1 = 0.1;
  c.profile = Profile::kContinuous;
  c.domain = Box<3>{Vec3::Constant(-0.5), Vec3::Constant(0.5)};
  return {"cube", c};
}

// The Ahmed body at the settings of [Billon2016], section 5.
SuiteBody ahmed() {
  Case c;
  c.flow.reynolds = 4.25e6;
  c.flow.length = 1.0;
  c.flow.y_plus = 5.0;
  c.flow.layers = 27;
  c.h2 = 0.1;
  c.h1 = 0.5;
  c.domain = Box<3>{Vec3(-2.0, -1.0, 0.0), Vec3(8.0, 1.0, 1.5)};
  return {"ahmed", c};
}

}  // namespace

const std::vector<SuiteCase>& adapt_suite() {
  static const std::string unit_cube = "init-unit-cube-10.meshb";
  static const std::vector<SuiteCase> cases = {
      {"tilted-plane", 0.99, 0.30, 0.90, 6.0, unit_cube},
      {"tilted-plane:hmin=1e-5", 0.985, 0.28, 0.88, 9.0, unit_cube},
      {"cube", 0.96, 0.15, 0.85, 25.0, "", false, cube()},
      {"sphere", 0.98, 0.25, 0.86, 15.0, unit_cube},
      {"plane-bl", 0.994, 0.40, 0.905, 15.0, "init-plane-bl.meshb"},
      {"cube-linear", 0.995, 0.45, 0.90, 2.5, "init-cube-linear.meshb"},
      {"polar-2", 0.98, 0.40, 0.87, 4.0, "init-polar-2.meshb"},
      {"sphere-bl-mild", 0.98, 0.25, 0.86, 45.0, "init-sphere-bl.meshb", true},
      {"plane-bl/layers", 0.97, 0.20, 0.78, 18.0, "init-plane-bl.meshb"},
      {"sphere-bl-mild/layers", 0.97, 0.20, 0.78, 54.0, "init-sphere-bl.meshb", true},
      {"ahmed", 0.97, 0.10, 0.0, 100.0, "", true, ahmed()},
      {"ahmed/layers", 0.97, 0.20, 0.78, 120.0, "", true, ahmed()},
      {"circle-bl", 0.998, 0.40, 0.96, 0.8, "init-circle-bl.meshb"},
  };
  return cases;
}

std::vector<std::string> SuiteRow::missed() const {
  std::vector<std::string> out;
  if (!(unit_share >= wanted.unit_share)) out.emplace_back("unit share");
  if (!(quality_min >= wanted.quality_min)) out.emplace_back("worst quality");
  if (!(quality_mean >= wanted.quality_mean)) out.emplace_back("mean quality");
  if (layers) {
    if (!(layers->mean_offset <= kWantedOffset)) out.emplace_back("offset from levels");
    if (!(layers->wall_share() >= kWantedOnWall)) out.emplace_back("points on the wall");
    if (!(layers->aligned_of_ideal() >= kWantedAligned)) out.emplace_back("aligned edges");
  }
  if (threads == 1 && !(user_seconds <= wanted.seconds)) out.emplace_back("seconds");
  return out;
}

std::vector<SuiteCase> select_cases(const std::string& name, bool large) {
  std::vector<SuiteCase> out;
  std::vector<std::string> names;
  for (const SuiteCase& c : adapt_suite()) {
    names.push_back(c.name);
    if (name.empty() ? large || !c.large : c.name == name) out.push_back(c);
  }
  if (out.empty())
    throw Error(ErrorCode::kUsage, fmt::format("--case {}: no case of this name{}; known are {}", name,
                                               did_you_mean(name, names), join(names)));
  return out;
}

SuiteRow run_suite_case(const SuiteCase& c, const std::filesystem::path& data, int threads,
                        Progress* progress) {
  const ThreadLimit limit(threads);
  StageRecorder stages(progress);
  SuiteRow row = c.body                                ? run_body(c, stages)
                 : analytic_dimension(c.metric()) == 2 ? run_analytic<2>(c, data, stages)
                                                       : run_analytic<3>(c, data, stages);
  row.wanted = c;
  row.threads = threads > 0 ? threads : hardware_threads();
  return row;
}

std::string suite_header() {
  return fmt::format("{:<24}{:>9}{:>18}{:>18}{:>18}{:>18}{:>9}{:>10}\n", "case", "cells", "unit %", "Qmin",
                     "Qmean", "user s", "wall s", "peak MiB");
}

std::string suite_line(const SuiteRow& r) {
  const SuiteCase& w = r.wanted;
  const std::vector<std::string> missed = r.missed();
  const auto cell = [&](const char* what, const std::string& text) {
    const bool bad = std::find(missed.begin(), missed.end(), what) != missed.end();
    return text + (bad ? " !" : "  ");
  };
  std::string line = fmt::format(
      "{:<24}{:>9}{:>18}{:>18}{:>18}{:>18}{:>9.2f}{:>10.0f}\n", w.name, r.cells,
      cell("unit share", fmt::format("{:.2f} >= {:.1f}", 100.0 * r.unit_share, 100.0 * w.unit_share)),
      cell("worst quality", fmt::format("{:.3f} >= {:.2f}", r.quality_min, w.quality_min)),
      cell("mean quality", fmt::format("{:.3f} >= {:.3f}", r.quality_mean, w.quality_mean)),
      cell("seconds", fmt::format("{:.2f} <= {:.1f}", r.user_seconds, w.seconds)), r.wall_seconds,
      r.peak_bytes / 1048576.0);
  if (r.layers)
    line += fmt::format(
        "  mean offset {} of a layer, points on the wall {}, aligned edges {} of right columns\n",
        cell("offset from levels", fmt::format("{:.4f} <= {:.2f}", r.layers->mean_offset, kWantedOffset)),
        cell("points on the wall",
             fmt::format("{:.1f} >= {:.0f} %", 100.0 * r.layers->wall_share(), 100.0 * kWantedOnWall)),
        cell("aligned edges", fmt::format("{:.1f} >= {:.0f} %", 100.0 * r.layers->aligned_of_ideal(),
                                          100.0 * kWantedAligned)));
  return line;
}

std::string suite_json(const std::vector<SuiteRow>& rows) {
  Json cases = Json::array();
  for (const SuiteRow& r : rows) {
    cases.push_back({{"name", r.wanted.name},
                     {"start_cells", r.start_cells},
                     {"cells", r.cells},
                     {"points", r.points},
                     {"unit_share", r.unit_share},
                     {"quality_min", r.quality_min},
                     {"quality_mean", r.quality_mean},
                     {"user_seconds", r.user_seconds},
                     {"wall_seconds", r.wall_seconds},
                     {"peak_bytes", r.peak_bytes},
                     {"threads", r.threads},
                     {"targets",
                      {{"unit_share", r.wanted.unit_share},
                       {"quality_min", r.wanted.quality_min},
                       {"quality_mean", r.wanted.quality_mean},
                       {"user_seconds", r.wanted.seconds}}},
                     {"missed", r.missed()}});
    if (r.layers) cases.back()["levels"] = to_json(*r.layers);
  }
  return json_text({{"lamina", version()}, {"hardware_threads", hardware_threads()}, {"cases", cases}});
}

}  // namespace lamina
