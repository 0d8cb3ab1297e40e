#include "vdb/detail/graded_curvature.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr float kFlat = 1e18F;      // sqrt(1 / k) of a flat wall
constexpr double kStraight = 1e-9;  // curvature times diagonal below which a wall is flat

// Shapes that a facet joins, with their distance; each pair once per facet.
struct Links {
  std::vector<Index> begin;
  std::vector<std::pair<Index, float>> to;
};

Links make_links(const Surface& surface, const Curvature& curvature) {
  Links links;
  links.begin.assign(curvature.shapes.size() + 1, 0);
  const auto visit = [&](auto&& take) {
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        const Vec3 way = surface.points[static_cast<std::size_t>(surface.triangles[t][next])] -
                         surface.points[static_cast<std::size_t>(surface.triangles[t][k])];
        const auto length = static_cast<float>(way.norm());
        take(curvature.corner_shapes[t][k], curvature.corner_shapes[t][next], length);
        take(curvature.corner_shapes[t][next], curvature.corner_shapes[t][k], length);
      }
  };
  visit([&](Index a, Index, float) { ++links.begin[static_cast<std::size_t>(a) + 1]; });
  for (std::size_t i = 1; i < links.begin.size(); ++i) links.begin[i] += links.begin[i - 1];
  links.to.resize(static_cast<std::size_t>(links.begin.back()));
  std::vector<Index> next(links.begin.begin(), links.begin.end() - 1);
  visit([&](Index a, Index b, float length) {
    links.to[static_cast<std::size_t>(next[static_cast<std::size_t>(a)]++)] = {b, length};
  });
  return links;
}

// The least of values[j] + slope * distance(i, j) in every shape i. The order of the queue does not matter.
void bound_growth(const Links& links, float slope, std::vector<float>& values) {
  using Item = std::pair<float, Index>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  const auto spread = [&](Index from) {
    const float value = values[static_cast<std::size_t>(from)];
    for (Index i = links.begin[static_cast<std::size_t>(from)];
         i < links.begin[static_cast<std::size_t>(from) + 1]; ++i) {
      const auto& [to, length] = links.to[static_cast<std::size_t>(i)];
      const float most = value + slope * length;
      if (most >= values[static_cast<std::size_t>(to)]) continue;
      values[static_cast<std::size_t>(to)] = most;
      queue.emplace(most, to);
    }
  };
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] < kFlat) spread(static_cast<Index>(i));
  while (!queue.empty()) {
    const auto [value, from] = queue.top();
    queue.pop();
    if (value == values[static_cast<std::size_t>(from)]) spread(from);
  }
}

}  // namespace

GradedCurvature::GradedCurvature(const Surface& surface, const Curvature& curvature)
    : first_(std::sqrt(surface.bounds().diagonal()) * std::ldexp(1.0, 1 - kLevels)),
      values_(curvature.shapes.size()) {
  const Links links = make_links(surface, curvature);
  const double straight = kStraight / surface.bounds().diagonal();
  for_each_index(
      2,
      [&](std::size_t which) {
        std::vector<float> values(curvature.shapes.size());
        for (std::size_t i = 0; i < values.size(); ++i) {
          const Frame f = principal_frame(curvature.shapes[i].normal, curvature.shapes[i].shape);
          const double k = std::abs(which == 0 ? f.k1 : f.k2);
          values[i] = k > straight ? static_cast<float>(1.0 / std::sqrt(k)) : kFlat;
        }
        for (int level = 0; level < kLevels; ++level) {
          bound_growth(links, static_cast<float>(1.0 / std::ldexp(first_, level)), values);
          for (std::size_t i = 0; i < values.size(); ++i)
            values_[i][static_cast<std::size_t>(level)][which] = values[i];
        }
      },
      1);
}

std::array<double, 2> GradedCurvature::at(const std::array<Index, 3>& shapes,
                                          const std::array<double, 3>& bary, double root) const {
  int level = 0;
  double along = 2.0 - 1.0 / std::frexp(std::max(root / first_, 1.0), &level);
  if (--level >= kLevels - 1) {
    level = kLevels - 2;
    along = 1.0;
  }
  const auto l = static_cast<std::size_t>(level);
  std::array<double, 2> sum{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Values& v = values_[static_cast<std::size_t>(shapes[k])];
    for (std::size_t i = 0; i < 2; ++i)
      sum[i] +=
          bary[k] * ((1.0 - along) * static_cast<double>(v[l][i]) + along * static_cast<double>(v[l + 1][i]));
  }
  return {1.0 / (sum[0] * sum[0]), 1.0 / (sum[1] * sum[1])};
}

}  // namespace lamina::detail
