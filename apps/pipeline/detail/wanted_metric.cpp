#include "apps/pipeline/detail/wanted_metric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/complexity.h"
#include "mesh/gradation.h"
#include "mesh/hessian.h"
#include "mesh/io.h"
#include "mesh/score.h"
#include "mesh/solution.h"

namespace lamina {

namespace fs = std::filesystem;

template <int D>
bool WantedMetric<D>::needs_input(const Adaptation& a) {
  const auto on_points = [](const fs::path& file) { return is_solution(file); };
  return (a.analytic.empty() && a.metric.empty() && a.level_set.empty()) || on_points(a.metric) ||
         !a.lp_hessians.empty() || (!a.level_set.empty() && !a.mesh.empty()) ||
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
  } else if (!formula_ && a.lp_hessians.empty() && a.level_set.empty()) {
    add_on_input(metric_of<D>(input_->mesh, a.mesh));
  }
  add_hessians(progress);
  for (const fs::path& file : a.intersect) add_file(file);
  if (!a.level_set.empty()) wall_ = std::make_unique<const AdaptWall<D>>(a, input_.get(), domain, progress);
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
  constexpr std::size_t kSamples =
      50000;  // each try takes as many: the mesh tells more, see correct_complexity
  const auto metric = family();
  return estimate_complexity<D>(
      domain, [&](const Vec<D>& x) { return metric->at(x, 0.0); }, kSamples);
}

/// Secants of the logarithms. The complexity never grows with the scale, as scale^-D where no limit holds and
/// hardly at all where limits hold most sizes.
template <int D>
void WantedMetric<D>::fit_complexity(const Mesh<D>& domain, Progress& progress) {
  constexpr double kClose = 2e-3, kFlattest = 0.05;
  constexpr int kMostTries = 30;
  const double wanted = std::log(a_.complexity);
  double slope = -D, position = std::log(limits_.scale), excess = std::log(complexity_on(domain)) - wanted;
  double nearest = excess;
  for (int i = 0; i < kMostTries && std::abs(excess) > kClose; ++i) {
    progress.check_cancelled();
    const double next = position - excess / slope;
    limits_.scale = std::exp(next);
    apply(&progress);
    const double there = std::log(complexity_on(domain)) - wanted;
    slope = std::clamp((there - excess) / (next - position), -static_cast<double>(D), -kFlattest);
    position = next;
    excess = there;
    if (std::abs(excess) < std::abs(nearest)) nearest = excess;
  }
  if (!(std::abs(excess) <= kClose))
    throw Error(
        ErrorCode::kParameter,
        fmt::format("--complexity = {:g} is out of reach within --hmin and --hmax{}: {:.4g} is the nearest",
                    a_.complexity, wall_ ? " and with the layers of --level-set" : "",
                    std::exp(wanted + nearest)));
}

template <int D>
std::unique_ptr<const AdaptMetric<D>> WantedMetric<D>::family() const {
  typename IntersectionFamily<D>::Parts parts;
  if (wall_) parts.push_back(wall_->family());
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
  if (wall_) least = std::min(least, wall_->smallest());
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

}  // namespace lamina
