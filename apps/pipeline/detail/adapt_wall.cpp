#include "apps/pipeline/detail/adapt_wall.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/planar.h"
#include "mesh/field_wall.h"

namespace lamina {
namespace {

/// The options of the wall with what the adaptation says of it. Sizes beyond the layers are left to the other
/// metrics: they may be as large as --hmax, or the mesh.
template <int D>
Case wall_case(const Adaptation& a, const Box<D>& bounds) {
  Case c = a.wall;
  if (a.h_min > 0.0 && !c.flow.h_min) c.flow.h_min = a.h_min;
  if (a.gradation > 0.0) c.gradation = a.gradation;
  const double far = a.h_max > 0.0 ? a.h_max : bounds.diagonal();
  if (!c.h2) c.h2 = c.h1 ? std::min(far, *c.h1) : far;
  if (!c.h1) c.h1 = std::max(far, *c.h2);
  if constexpr (D == 2)
    c.domain = endless(bounds.lo, bounds.hi);
  else
    c.domain = bounds;
  return c;
}

template <int D>
Box<D> bounds_of(const Mesh<D>& mesh) {
  Box<D> bounds;
  for (const Vec<D>& x : mesh.points) bounds.extend(x);
  return bounds;
}

/// The name of a field of the input, or not.
template <int D>
bool names_field(const std::string& word, const Carrier<D>& input) {
  return std::any_of(input.mesh.point_fields.begin(), input.mesh.point_fields.end(),
                     [&](const MeshField& f) { return word == f.name || word.rfind(f.name + ":", 0) == 0; });
}

}  // namespace

template <int D>
AdaptWall<D>::AdaptWall(const Adaptation& a, const Carrier<D>* input, const Mesh<D>& mesh,
                        Progress& progress) {
  const Case c = wall_case<D>(a, bounds_of<D>(mesh));
  const bool is_field =
      input != nullptr && (names_field<D>(a.level_set, *input) || is_solution(a.level_set) ||
                           !std::filesystem::exists(a.level_set));
  if (is_field)
    from_field(a, c, *input, progress);
  else
    from_body(a, c, progress);
  if (a.h_min > smallest_)
    throw Error(ErrorCode::kParameter,
                fmt::format("--hmin = {:g} is above the sizes at the wall, {:.4g}: lower it, or ask for "
                            "thicker layers",
                            a.h_min, smallest_));
}

template <int D>
void AdaptWall<D>::from_field(const Adaptation& a, Case c, const Carrier<D>& input, Progress& progress) {
  constexpr double kTooCoarse = 1.0;
  std::vector<double> distance = scalar_field<D>(input.mesh, a.level_set, "--level-set", a.mesh.string());
  try {
    auto wall = std::make_unique<const FieldWall<D>>(input.mesh, input.places, std::move(distance));
    if (wall->coarseness() > kTooCoarse)
      progress.warn(fmt::format(
          "{}: most of its edges across the wall of {} are longer than {:.2g} times the radius of curvature "
          "there: "
          "the layers follow what the field says between such points. Adapt to them without --align layers, "
          "evaluate the field on that mesh, and adapt it again",
          a.mesh.string(), a.level_set, wall->coarseness()));
    const BoundaryLayer layer = resolve(c.flow, wall->bounds().size().maxCoeff());
    c.box2 = c.box1 = c.domain;
    metric_ = std::make_unique<const WallMetric>(*wall, layer, size_options(c));
    field_ = std::move(wall);
    smallest_ = layer.h_min;
  } catch (const Error& e) {
    throw Error(e.code(), fmt::format("--level-set {}: {}", a.level_set, e.what()));
  }
}

template <int D>
void AdaptWall<D>::from_body(const Adaptation& a, Case c, Progress& progress) {
  c.body = a.level_set;
  body_ = std::make_unique<const Body>(load_body(c, &progress));
  if (body_->planar() != (D == 2))
    throw Error(ErrorCode::kUsage, fmt::format("{}: a mesh in {} dimensions, and {} is a body in {}",
                                               a.mesh.string(), D, a.level_set, body_->planar() ? 2 : 3));
  const ResolvedCase r = resolve_case(c, *body_);
  pass_on_warnings(*body_, &r, progress);
  metric_ = std::make_unique<const WallMetric>(wall_metric(*body_, r));
  smallest_ = smallest_size(r, *body_);
}

template class AdaptWall<2>;
template class AdaptWall<3>;

}  // namespace lamina
