// The list of steps is in `adapt_mesh`; both kinds of metric end up as an AdaptMetric with sizes limited and
// scaled.
#include "apps/pipeline/adaptation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "apps/pipeline/detail/adapted.h"
#include "apps/pipeline/detail/json.h"
#include "apps/pipeline/detail/wanted_metric.h"
#include "apps/pipeline/output.h"
#include "apps/pipeline/report.h"
#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/predicates.h"
#include "core/words.h"
#include "mesh/box_facets.h"
#include "mesh/gradation.h"
#include "mesh/io.h"
#include "mesh/listed_parts.h"
#include "mesh/seed.h"
#include "mesh/solution.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

void check(const Adaptation& a) {
  const auto positive = [](double value, const char* option) {
    if (!(value >= 0.0) || !std::isfinite(value))
      throw Error(ErrorCode::kParameter, fmt::format("{} = {:g} must be positive", option, value));
  };
  positive(a.h_min, "--hmin");
  positive(a.h_max, "--hmax");
  positive(a.complexity, "--complexity");
  if (a.gradation != 0.0 && !(a.gradation > 1.0 && a.gradation <= 4.0))
    throw Error(ErrorCode::kParameter,
                fmt::format("--gradation = {:g} must be 0 (off) or in (1, 4]", a.gradation));
  if (a.h_max > 0.0 && a.h_max < a.h_min)
    throw Error(ErrorCode::kParameter, fmt::format("--hmax = {:g} is below --hmin = {:g}", a.h_max, a.h_min));
  if (!(a.quality_floor >= 0.0 && a.quality_floor <= 0.5))
    throw Error(ErrorCode::kParameter,
                fmt::format("--quality-floor = {:g} must be in [0, 0.5]", a.quality_floor));
  for (const LpHessian& wanted : a.lp_hessians)
    if (!(wanted.p >= 1.0) || !std::isfinite(wanted.p))
      throw Error(ErrorCode::kParameter,
                  fmt::format("--lp-hessian {} {:g}: the power of the norm must be at least 1", wanted.field,
                              wanted.p));
  if (!a.lp_hessians.empty() && !(a.complexity > 0.0))
    throw Error(ErrorCode::kUsage,
                "--lp-hessian tells where cells go, not how many: give --complexity N too");
  if (!a.lp_hessians.empty() && a.mesh.empty())
    throw Error(ErrorCode::kUsage, "--lp-hessian needs a mesh with fields");
  const bool scalable =
      !a.lp_hessians.empty() || !a.analytic.empty() || !a.metric.empty() || !a.intersect.empty();
  if (a.complexity > 0.0 && !a.level_set.empty() && !scalable)
    throw Error(ErrorCode::kUsage,
                "--complexity scales solution metrics, and --level-set alone has none: give --metric, "
                "--lp-hessian, --analytic or --intersect too");
  positive(a.hausdorff, "--hausdorff");
  if (!(a.ridge_angle > 0.0 && a.ridge_angle <= 90.0))
    throw Error(ErrorCode::kParameter,
                fmt::format("--ridge-angle = {:g} must be in (0, 90] degrees", a.ridge_angle));
  if (!a.analytic.empty() && !a.metric.empty())
    throw Error(ErrorCode::kUsage, "both --analytic and --metric are given: one metric is enough");
  if (a.mesh.empty() && a.analytic.empty())
    throw Error(ErrorCode::kUsage, "no mesh is given: name a mesh file, or a metric with --analytic");
  if (a.outputs.empty())
    throw Error(ErrorCode::kUsage, "no output is given: name a mesh file with -o FILE.meshb");
}

void expect_outputs(const Adaptation& a, OutputSet& outputs) {
  for (const fs::path& path : a.outputs) outputs.expect_mesh(path, a.mesh);
  if (a.metric_out) {
    require_extension(*a.metric_out, "a metric", {".sol", ".solb"});
    outputs.expect(*a.metric_out, a.mesh);
  }
  if (a.report) outputs.expect(*a.report, a.mesh);
}

/// Files that are read, beside the mesh.
void protect_inputs(const Adaptation& a, OutputSet& outputs) {
  outputs.protect(a.metric);
  for (const fs::path& file : a.intersect) outputs.protect(file);
  outputs.protect(a.level_set);
  for (const LpHessian& wanted : a.lp_hessians) outputs.protect(wanted.field);
}

/// Points without a cell go, with corners there.
template <int D>
void drop_unused_points(Mesh<D>& mesh, const std::string& name) {
  std::vector<Index> number(mesh.points.size(), kNone);
  for (const auto& cell : mesh.cells)
    for (const Index v : cell) number[static_cast<std::size_t>(v)] = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kNone) continue;
    mesh.points[kept] = mesh.points[i];
    if (!mesh.point_tags.empty()) mesh.point_tags[kept] = mesh.point_tags[i];
    number[i] = static_cast<Index>(kept++);
  }
  mesh.points.resize(kept);
  if (!mesh.point_tags.empty()) mesh.point_tags.resize(kept);
  const auto renumber = [&](auto& list) {
    for (auto& simplex : list)
      for (Index& v : simplex) v = number[static_cast<std::size_t>(v)];
  };
  renumber(mesh.cells);
  renumber(mesh.facets);
  renumber(mesh.edges);
  for (const auto& edge : mesh.edges)
    if (edge[0] == kNone || edge[1] == kNone)
      throw Error(ErrorCode::kAdapt,
                  fmt::format("{}: a listed edge has a point that no cell has; --edges drop forgets listed "
                              "edges, corners and required parts",
                              name));
  for (std::vector<Index>* list : {&mesh.corners, &mesh.required.points}) {
    for (Index& v : *list) v = number[static_cast<std::size_t>(v)];
    std::erase(*list, kNone);
  }
}

/// Tags of points that will not be there, or not be known, in the new mesh.
template <int D>
std::int64_t count_loose_tags(const Mesh<D>& mesh) {
  if (mesh.point_tags.empty()) return 0;
  const auto has_tag = [](Index tag) { return tag != 0; };
  std::vector<Index> loose = mesh.point_tags;
  for (const std::vector<Index>* list : {&mesh.corners, &mesh.required.points})
    for (const Index v : *list) loose[static_cast<std::size_t>(v)] = 0;
  return std::count_if(loose.begin(), loose.end(), has_tag);
}

/// The mesh as the optimizer wants it: positive cells, no loose points, all of the boundary or nothing
/// listed. Throws kAdapt where that is not enough.
template <int D>
void make_ready(Mesh<D>& mesh, const std::string& name, Progress& progress) {
  Validation found = validate<D>(mesh);
  if (found.bad_indices > 0) throw Error(ErrorCode::kAdapt, fmt::format("{}: {}", name, found.summary()));
  std::int64_t turned = 0;
  if (found.nonpositive_cells > 0) {
    for (auto& cell : mesh.cells) {
      std::array<Vec<D>, D + 1> x;
      for (std::size_t k = 0; k <= D; ++k) x[k] = mesh.points[static_cast<std::size_t>(cell[k])];
      if (orient<D>(x) >= 0.0) continue;
      std::swap(cell[0], cell[1]);
      ++turned;
    }
    progress.warn(
        fmt::format("{}: {} turned", name, counted(turned, "inverted cell was", "inverted cells were")));
  }
  if (found.unused_points > 0) {
    drop_unused_points(mesh, name);
    progress.warn(
        fmt::format("{}: {} dropped", name,
                    counted(found.unused_points, "point without a cell was", "points without a cell were")));
  }
  if (found.boundary_mismatch > 0)
    if (const std::int64_t missing = list_missing_facets(mesh))
      progress.warn(fmt::format("{}: {} listed with tag 0", name,
                                counted(missing, "boundary facet that the file leaves out was",
                                        "boundary facets that the file leaves out were")));
  if (const std::int64_t loose = count_loose_tags(mesh))
    progress.warn(fmt::format("{}: {} dropped: those of corners and required points are kept", name,
                              counted(loose, "tag of a point is", "tags of points are")));
  found = validate<D>(mesh);
  if (!found.ok())
    throw Error(ErrorCode::kAdapt, fmt::format("{}: cannot be adapted: {}", name, found.summary()));
}

/// A formula has no edges to bound its growth along, a mesh that is unit in it has: the formula is sampled
/// and bounded there, and from then on the mesh is adapted to the finer of both, twice, so that the bound is
/// resolved where it made sizes smaller.
template <int D>
void bound_growth(const Adaptation& a, AdaptOptions& options, WantedMetric<D>& wanted, Mesh<D>& mesh,
                  std::vector<Metric<D>>& metric, Progress& progress) {
  constexpr int kRounds = 2;
  options.start_size = options.end_size;
  for (int i = 0; i < kRounds; ++i) {
    metric = wanted.formula_at(mesh.points);
    gradate<D>(mesh, metric, a.gradation);
    wanted.bound_by(mesh, metric);
    options.follow = adapt<D>(mesh, *wanted.family(), metric, options, &progress).shape;
  }
}

/// The complexity of a formula, or of metrics on several meshes, was estimated before there was a mesh to
/// measure it on; now there is one, and the scale is corrected until it is within a percent. That of one
/// metric on MESH is exact there, but a coarse MESH has sizes between its points that a fine one sees: it is
/// corrected where it is off by more than 5 %. Such steps are small, so none of them needs the way from
/// coarse to fine.
template <int D>
void correct_complexity(const Adaptation& a, AdaptOptions& options, WantedMetric<D>& wanted, Mesh<D>& mesh,
                        std::vector<Metric<D>>& metric, Progress& progress) {
  const double close = wanted.complexity_is_estimate() ? 1e-2 : 5e-2;
  constexpr int kMostRounds = 4;
  for (int i = 0; i < kMostRounds; ++i) {
    const double ratio = score<D>(mesh, metric).complexity / a.complexity;
    if (std::abs(ratio - 1.0) <= close) return;
    wanted.rescale(std::pow(ratio, 1.0 / D));
    options.start_size = options.end_size = wanted.smallest();
    if (wanted.has_formula() && a.gradation > 0.0)
      bound_growth<D>(a, options, wanted, mesh, metric, progress);
    else
      options.follow = adapt<D>(mesh, *wanted.family(), metric, options, &progress).shape;
  }
}

/// The fields that go to the new mesh: all but the metric of the old one.
template <int D>
std::vector<MeshField> kept_fields(const Adaptation& a, const Mesh<D>& mesh) {
  std::vector<MeshField> kept;
  const auto solution = find_solution(a.mesh);
  std::error_code ec;
  const bool solution_is_metric = mesh_format(a.mesh)->solution && solution &&
                                  (a.metric.empty() ? a.lp_hessians.empty() && a.analytic.empty()
                                                    : fs::equivalent(*solution, a.metric, ec));
  if (solution_is_metric) return kept;
  for (const MeshField& f : mesh.point_fields)
    if (f.name != "metric") kept.push_back(f);
  return kept;
}

/// Where the fields go that a .mesh or .meshb cannot hold; the metric may have taken the first choice.
fs::path fields_path(const Adaptation& a, const fs::path& mesh) {
  fs::path path = solution_path(mesh);
  if (a.metric_out && *a.metric_out == path) path.replace_extension(".fields" + path.extension().string());
  return path;
}

bool takes_solution(const fs::path& mesh) { return mesh_format(mesh)->solution; }

template <int D>
void write_results(const Adaptation& a, Mesh<D>& mesh, const std::vector<Metric<D>>& metric,
                   const std::vector<MeshField>& carried, OutputSet& outputs, Progress& progress) {
  const MeshField quality = quality_field<D>(mesh, metric);
  for (const fs::path& path : a.outputs) {
    MeshWriteOptions options;
    mesh.point_fields = carried;
    mesh.cell_fields.clear();
    if (!takes_solution(path)) {
      mesh.point_fields.push_back(tensor_field<D>(metric));
      mesh.cell_fields = {quality};
    } else if (!carried.empty()) {
      options.solution = fields_path(a, path);
    }
    const std::vector<std::string> lost = write_mesh<D>(outputs.files(), path, mesh, options);
    if (!carried.empty() && !lost.empty())
      progress.warn(fmt::format("{} cannot hold {}: dropped", path.string(), join(lost)));
    progress.check_cancelled();
  }
  if (a.metric_out) outputs.write(*a.metric_out, [&](const fs::path& p) { write_metric<D>(p, metric); });
}

template <int D>
void adapt_mesh(const Adaptation& a, Mesh<D>& mesh, OutputSet& outputs, StageRecorder& stages,
                AdaptationReport& report) {
  const std::string name = a.mesh.empty() ? a.analytic : a.mesh.string();
  report.dimension = D;
  report.points_before = static_cast<std::int64_t>(mesh.points.size());
  report.cells_before = static_cast<std::int64_t>(mesh.cells.size());
  if (mesh.cells.empty())
    throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: the mesh has no cells", name));

  stages.stage("metric");
  const std::vector<MeshField> kept = a.mesh.empty() ? std::vector<MeshField>{} : kept_fields<D>(a, mesh);
  if (!kept.empty())
    for (const fs::path& path : a.outputs)
      if (takes_solution(path)) outputs.expect(fields_path(a, path), a.mesh);
  std::shared_ptr<const Carrier<D>> input;
  if (!kept.empty() || WantedMetric<D>::needs_input(a)) input = std::make_shared<const Carrier<D>>(mesh);
  WantedMetric<D> wanted(a, input, mesh, stages);
  if (wanted.wall() != nullptr) report.wall_layer = wanted.wall()->layer();
  for (const MeshField& f : mesh.cell_fields)
    if (f.name != "quality")
      stages.warn(fmt::format("{}: its cell field {} is dropped: those of points go along", name, f.name));
  mesh.point_fields.clear();
  mesh.cell_fields.clear();
  if (!a.keep_edges) drop_listed_parts(mesh);
  make_ready<D>(mesh, name, stages);
  stages.done(fmt::format("smallest size {:.4g}", wanted.smallest()));

  stages.stage("adapt");
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.quality_floor = a.quality_floor;
  options.align = a.align;
  options.hausdorff = a.hausdorff;
  options.ridge_angle = a.ridge_angle;
  options.keep_cell_tags = a.keep_cell_tags;
  options.end_size = wanted.smallest();
  options.keep_shape = a.gradation > 0.0 || a.complexity > 0.0;  // for the rounds that may follow
  report.adapt = adapt<D>(mesh, *wanted.family(), metric, options, &stages);
  options.follow = std::move(report.adapt.shape);
  if (wanted.has_formula() && a.gradation > 0.0) bound_growth<D>(a, options, wanted, mesh, metric, stages);
  if (a.complexity > 0.0) correct_complexity<D>(a, options, wanted, mesh, metric, stages);
  report.scale = wanted.scale();
  stages.done(fmt::format("{} cells, {} points", mesh.cells.size(), mesh.points.size()));

  stages.stage("check");
  report.validation = require_valid<D>(mesh);
  report.score = score<D>(mesh, metric);
  const std::unique_ptr<const AdaptMetric<D>> family = wanted.family();
  if (const std::vector<double> phi = wall_distances<D>(mesh, *family); !phi.empty())
    report.layers = score_layers<D>(mesh, metric, *family, phi);
  stages.done(fmt::format("valid, {:.1f} % unit edges, worst quality {:.3g}", 100.0 * report.score.unit_share,
                          report.score.quality_min));

  stages.stage("write");
  std::vector<MeshField> carried;
  if (!kept.empty()) carried = carry_fields<D>(*input->places, kept, mesh.points);
  for (std::size_t i = 0; i < kept.size(); ++i)
    report.fields.push_back({kept[i].name, kept[i].components, range_of(kept[i]), range_of(carried[i])});
  write_results<D>(a, mesh, metric, carried, outputs, stages);
  stages.done(fmt::format("{} files", outputs.targets().size()));
  report.points = static_cast<std::int64_t>(mesh.points.size());
  report.cells = static_cast<std::int64_t>(mesh.cells.size());
  report.facets = static_cast<std::int64_t>(mesh.facets.size());
  report.mesh_hash = mesh_hash(mesh);
}

/// The start of a benchmark. A metric of any dimension starts in 3D.
AnyMesh start_mesh(const std::string& analytic) {
  const auto lattice = [&]<int D>() {
    const auto metric = make_analytic_metric<D>(analytic);
    return AnyMesh(make_seed<D>(metric->domain(), metric->start_size(), SeedKind::kLattice));
  };
  return analytic_dimension(analytic) == 2 ? lattice.template operator()<2>()
                                           : lattice.template operator()<3>();
}

template <int D>
bool has_layers(const std::string& analytic) {
  const auto metric = make_analytic_metric<D>(analytic);
  return metric->wall_distance(metric->domain().center()).has_value();
}

/// An unknown or malformed formula, and layers that there are not, are told before any file is read.
void check_formula(const Adaptation& a) {
  const bool layers =
      !a.analytic.empty() &&
      (analytic_dimension(a.analytic) == 2 ? has_layers<2>(a.analytic) : has_layers<3>(a.analytic));
  if (a.align == Align::kLayers && !layers && a.level_set.empty())
    throw Error(
        ErrorCode::kUsage,
        "--align layers needs a metric with layers: --level-set, or those of --analytic whose names hold "
        "\"-bl\"");
}

Json given(double value) { return value > 0.0 ? Json(value) : Json(); }
Json given(const std::string& value) { return value.empty() ? Json() : Json(value); }

}  // namespace

AdaptationReport run_adaptation(const Adaptation& a, Progress* progress) {
  const ThreadLimit limit(a.threads);
  check(a);
  check_formula(a);
  StageRecorder stages(progress);
  OutputSet outputs;
  protect_inputs(a, outputs);
  expect_outputs(a, outputs);
  AdaptationReport report;
  report.adaptation = a;
  report.threads = a.threads > 0 ? a.threads : hardware_threads();

  stages.stage("read");
  std::string ignored;
  AnyMesh any = a.mesh.empty() ? start_mesh(a.analytic) : read_mesh_and_fields(a.mesh, ignored);
  if (!ignored.empty()) stages.warn(fmt::format("{}: ignored", ignored));
  stages.done(std::visit(
      [](const auto& mesh) {
        return fmt::format("{} cells, {} points", mesh.cells.size(), mesh.points.size());
      },
      any));
  std::visit([&](auto& mesh) { adapt_mesh(a, mesh, outputs, stages, report); }, any);

  report.stages = stages.costs();
  report.warnings = stages.warnings();
  report.missed = missed_properties(report.score);
  constexpr double kCloseEnough = 0.1;  // files are interpolated: the mesh does not see all of their metric
  if (a.complexity > 0.0 && std::abs(report.score.complexity / a.complexity - 1.0) > kCloseEnough)
    report.missed.push_back(
        fmt::format("complexity: {:.4g}, wanted {:.4g}", report.score.complexity, a.complexity));
  report.files = outputs.targets();
  if (a.report) outputs.write_text(*a.report, adaptation_json(report));
  stages.check_cancelled();
  outputs.commit();
  return report;
}

std::string adaptation_json(const AdaptationReport& r) {
  const Adaptation& a = r.adaptation;
  Json hessians = Json::array(), intersected = Json::array(), fields = Json::array();
  for (const LpHessian& wanted : a.lp_hessians)
    hessians.push_back({{"field", wanted.field}, {"p", wanted.p}});
  for (const fs::path& file : a.intersect) intersected.push_back(file.string());
  for (const CarriedField& f : r.fields)
    fields.push_back({{"name", f.name},
                      {"components", f.components},
                      {"range_before", {f.before.least, f.before.most}},
                      {"range", {f.after.least, f.after.most}}});
  Json json = {
      {"lamina", version()},
      {"dimension", r.dimension},
      {"mesh", {{"file", given(a.mesh.string())}, {"points", r.points_before}, {"cells", r.cells_before}}},
      {"metric",
       {{"analytic", given(a.analytic)},
        {"file", given(a.metric.string())},
        {"lp_hessian", std::move(hessians)},
        {"intersect", std::move(intersected)},
        {"level_set", given(a.level_set)},
        {"layers", r.wall_layer ? to_json(*r.wall_layer) : Json()},
        {"hmin", given(a.h_min)},
        {"hmax", given(a.h_max)},
        {"gradation", given(a.gradation)},
        {"wanted_complexity", given(a.complexity)},
        {"scale", r.scale}}},
      {"quality_floor", a.quality_floor},
      {"hausdorff", given(a.hausdorff)},
      {"ridge_angle", a.ridge_angle},
      {"cell_tags", a.keep_cell_tags ? "keep" : "drop"},
      {"edges", a.keep_edges ? "keep" : "drop"},
      {"align", a.align == Align::kLayers ? "layers" : "none"},
      {"cells", r.cells},
      {"points", r.points},
      {"facets", r.facets},
      {"mesh_hash", fmt::format("{:016x}", r.mesh_hash)},
      {"validation", to_json(r.validation)},
      {"score", to_json(r.score)},
      {"fields", std::move(fields)},
      {"levels", r.layers ? to_json(*r.layers) : Json()},
      {"worst_cells", worst_cells_json(r.score)},
  };
  append_outcome(json, r);
  return json_text(json);
}

std::string adaptation_table(const AdaptationReport& r) {
  std::string out;
  const auto row = [&](const char* name, const std::string& text) {
    out += fmt::format("{:<14}{}\n", name, text);
  };
  row("points", fmt::format("{:>12}  from {}", r.points, r.points_before));
  row("cells", fmt::format("{:>12}  from {}", r.cells, r.cells_before));
  if (r.wall_layer)
    row("layers", fmt::format("{} of growth {:g}: h_min {:.4g}, top {:.4g}", r.wall_layer->layers,
                              r.wall_layer->growth, r.wall_layer->h_min, r.wall_layer->top()));
  row("complexity", fmt::format("{:.6g}", r.score.complexity));
  row("unit edges", fmt::format("{:.2f} %, metric lengths {:.3g} to {:.3g}", 100.0 * r.score.unit_share,
                                r.score.length_min, r.score.length_max));
  row("quality", fmt::format("worst {:.3g}, mean {:.3f}", r.score.quality_min, r.score.quality_mean));
  row("aspect", fmt::format("largest {:.4g}, 99 % below {:.4g}", r.score.aspect_max, r.score.aspect_p99));
  if (r.layers)
    for (const auto& [name, text] : layer_rows(*r.layers)) row(name.c_str(), text);
  for (const CarriedField& f : r.fields)
    row("field", fmt::format("{}, linear on the input mesh: {:.6g} to {:.6g}, before {:.6g} to {:.6g}",
                             f.name, f.after.least, f.after.most, f.before.least, f.before.most));
  row("time", cost_text(r.stages, r.threads));
  for (const auto& file : r.files) row("file", file.string());
  return out;
}

}  // namespace lamina
