#include "apps/pipeline/detail/wanted_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/words.h"
#include "mesh/complexity.h"
#include "mesh/gradation.h"
#include "mesh/hessian.h"
#include "mesh/io.h"
#include "mesh/score.h"
#include "mesh/solution.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

bool is_solution(const fs::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".sol" || extension == ".solb";
}

/// The number behind the last colon, and the name before it.
std::optional<std::pair<std::string, int>> split_component(const std::string& spec) {
  const std::size_t at = spec.rfind(':');
  if (at == std::string::npos) return std::nullopt;
  const auto number = parse_number(std::string_view(spec).substr(at + 1));
  if (!number || *number < 1.0 || *number > 1e6 || *number != std::floor(*number)) return std::nullopt;
  return std::pair(spec.substr(0, at), static_cast<int>(*number));
}

std::vector<double> component_of(const MeshField& field, int number) {
  const auto width = static_cast<std::size_t>(field.components);
  std::vector<double> values(field.values.size() / width);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = field.values[i * width + static_cast<std::size_t>(number - 1)];
  return values;
}

template <int D>
std::vector<double> scalar_of_file(const Mesh<D>& mesh, const std::string& file,
                                   const std::string& mesh_name) {
  std::vector<MeshField> fields = read_fields<D>(file);
  if (fields.size() != 1 || fields[0].components != 1)
    throw Error(
        ErrorCode::kParameter,
        fmt::format("{}: holds {} of {} components; one scalar is needed", file,
                    counted(static_cast<std::int64_t>(fields.size()), "field"), fields[0].components));
  if (fields[0].values.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{}: holds {} values, but {} has {} points", file,
                                                   fields[0].values.size(), mesh_name, mesh.points.size()));
  return std::move(fields[0].values);
}

}  // namespace

template <int D>
std::vector<double> scalar_field(const Mesh<D>& mesh, const std::string& spec, const char* option,
                                 const std::string& mesh_name) {
  const MeshField* field = mesh.point_field(spec);
  if (field != nullptr && field->components == 1) return field->values;
  if (field != nullptr)
    throw Error(ErrorCode::kUsage, fmt::format("{} {}: has {} components; name one of them, as {}:1", option,
                                               spec, field->components, spec));
  if (is_solution(spec)) return scalar_of_file<D>(mesh, spec, mesh_name);
  if (const auto part = split_component(spec)) {
    field = mesh.point_field(part->first);
    if (field != nullptr && part->second <= field->components) return component_of(*field, part->second);
    if (field != nullptr)
      throw Error(ErrorCode::kUsage, fmt::format("{} {}: {} has {}", option, spec, part->first,
                                                 counted(field->components, "component")));
  }
  std::vector<std::string> names;
  for (const MeshField& f : mesh.point_fields) names.push_back(f.name);
  throw Error(ErrorCode::kUsage,
              fmt::format("{} {}: {} has no such point field{}; {}", option, spec, mesh_name,
                          did_you_mean(spec, names),
                          names.empty() ? "it has none" : fmt::format("it has {}", join(names))));
}

template <int D>
bool WantedMetric<D>::needs_input(const Adaptation& a) {
  const auto on_points = [](const fs::path& file) { return is_solution(file); };
  return (a.analytic.empty() && a.metric.empty()) || on_points(a.metric) || !a.lp_hessians.empty() ||
         std::any_of(a.intersect.begin(), a.intersect.end(), on_points);
}

template <int D>
WantedMetric<D>::WantedMetric(const Adaptation& a, std::shared_ptr<const Carrier<D>> input,
                              const Mesh<D>& domain, Progress& progress)
    : a_(a), input_(std::move(input)) {
  limits_.h_min = a.h_min;
  if (a.h_max > 0.0) {
    limits_.h_max = a.h_max;
  } else if (!a.lp_hessians.empty()) {
    limits_.h_max = input_->places->bounds().diagonal();
  }
  if (!a.analytic.empty()) formula_ = make_analytic_metric<D>(a.analytic);
  if (!a.metric.empty()) {
    add_file(a.metric);
  } else if (!formula_ && a.lp_hessians.empty()) {
    add_on_input(metric_of<D>(input_->mesh, a.mesh));
  }
  add_hessians(progress);
  for (const fs::path& file : a.intersect) add_file(file);
  apply(&progress);
  if (a.complexity > 0.0) fit_complexity(domain, progress);
}

/// Metrics on the points of the input become one; those on other meshes stay apart.
template <int D>
void WantedMetric<D>::add_file(const fs::path& file) {
  if (!is_solution(file)) {
    Mesh<D> mesh;
    std::vector<Metric<D>> metric = read_mesh_with_metric<D>(file, mesh);
    stored_.push_back({std::make_shared<const Carrier<D>>(std::move(mesh)), std::move(metric), {}});
    return;
  }
  std::vector<Metric<D>> metric = read_metric<D>(file);
  if (metric.size() != input_->mesh.points.size())
    throw Error(ErrorCode::kParameter,
                fmt::format("{}: holds {} tensors, but {} has {} points", file.string(), metric.size(),
                            a_.mesh.string(), input_->mesh.points.size()));
  add_on_input(std::move(metric));
}

template <int D>
void WantedMetric<D>::add_on_input(std::vector<Metric<D>> metric) {
  const auto there =
      std::find_if(stored_.begin(), stored_.end(), [&](const Stored& s) { return s.carrier == input_; });
  if (there == stored_.end()) {
    stored_.push_back({input_, std::move(metric), {}});
    return;
  }
  for_each_index(metric.size(),
                 [&](std::size_t i) { there->given[i] = intersect(there->given[i], metric[i]); });
}

template <int D>
void WantedMetric<D>::add_hessians(Progress& progress) {
  for (const LpHessian& wanted : a_.lp_hessians) {
    progress.check_cancelled();
    const std::string name = fmt::format("--lp-hessian {}", wanted.field);
    const std::vector<double> values =
        scalar_field<D>(input_->mesh, wanted.field, "--lp-hessian", a_.mesh.string());
    try {
      add_on_input(
          lp_metric<D>(input_->mesh, recover_hessian<D>(input_->mesh, values), wanted.p, a_.complexity));
    } catch (const Error& e) {
      throw Error(e.code(), fmt::format("{}: {}", name, e.what()));
    }
  }
}

/// Limits and bounds what was given.
template <int D>
void WantedMetric<D>::apply(Progress* progress) {
  backgrounds_.clear();
  for (Stored& s : stored_) {
    if (progress != nullptr) progress->check_cancelled();
    s.limited.resize(s.given.size());
    for_each_index(s.given.size(),
                   [&](std::size_t i) { s.limited[i] = lamina::limited<D>(s.given[i], limits_); });
    if (a_.gradation > 0.0) gradate<D>(s.carrier->mesh, s.limited, a_.gradation);
    backgrounds_.push_back(std::make_unique<const BackgroundMetric<D>>(s.carrier->places, s.limited));
  }
}

template <int D>
double WantedMetric<D>::complexity_on(const Mesh<D>& domain) const {
  if (!complexity_is_estimate()) return score<D>(stored_[0].carrier->mesh, stored_[0].limited).complexity;
  const auto metric = family();
  return estimate_complexity<D>(domain, [&](const Vec<D>& x) { return metric->at(x, 0.0); });
}

template <int D>
void WantedMetric<D>::fit_complexity(const Mesh<D>& domain, Progress& progress) {
  constexpr double kClose = 2e-3;
  constexpr int kMostTries = 30;
  double reached = 0.0;
  for (int i = 0; i < kMostTries; ++i) {
    progress.check_cancelled();
    reached = complexity_on(domain);
    if (std::abs(reached / a_.complexity - 1.0) <= kClose) return;
    limits_.scale *= std::pow(reached / a_.complexity, 1.0 / D);
    apply(&progress);
  }
  throw Error(
      ErrorCode::kParameter,
      fmt::format("--complexity = {:g} is out of reach within --hmin and --hmax: {:.4g} is the nearest",
                  a_.complexity, reached));
}

template <int D>
std::unique_ptr<const AdaptMetric<D>> WantedMetric<D>::family() const {
  typename IntersectionFamily<D>::Parts parts;
  if (formula_) parts.push_back(std::make_unique<AnalyticFamily<D>>(*formula_, limits_));
  for (const auto& background : backgrounds_)
    parts.push_back(std::make_unique<BackgroundFamily<D>>(*background));
  if (bound_) parts.push_back(std::make_unique<BackgroundFamily<D>>(*bound_));
  if (parts.size() == 1) return std::move(parts[0]);
  return std::make_unique<IntersectionFamily<D>>(std::move(parts));
}

template <int D>
double WantedMetric<D>::smallest() const {
  double least = formula_ ? limits_.of(formula_->smallest()) : std::numeric_limits<double>::infinity();
  for (const auto& background : backgrounds_) least = std::min(least, background->smallest());
  return least;
}

template <int D>
void WantedMetric<D>::rescale(double factor) {
  limits_.scale *= factor;
  apply(nullptr);
}

template <int D>
std::vector<Metric<D>> WantedMetric<D>::formula_at(const std::vector<Vec<D>>& points) const {
  const AnalyticFamily<D> family(*formula_, limits_);
  std::vector<Metric<D>> metric(points.size());
  for_each_index(points.size(), [&](std::size_t v) { metric[v] = family.at(points[v], 0.0); });
  return metric;
}

template <int D>
void WantedMetric<D>::bound_by(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric) {
  bound_ = std::make_unique<const BackgroundMetric<D>>(mesh, metric);
}

template class WantedMetric<2>;
template class WantedMetric<3>;
template std::vector<double> scalar_field(const Mesh<2>&, const std::string&, const char*,
                                          const std::string&);
template std::vector<double> scalar_field(const Mesh<3>&, const std::string&, const char*,
                                          const std::string&);

}  // namespace lamina
