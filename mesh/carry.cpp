#include "mesh/carry.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/metric.h"
#include "core/parallel.h"

namespace lamina {
namespace {

template <int D>
Sym<D> tensor_at(const MeshField& field, std::size_t i) {
  Sym<D> tensor;
  std::copy_n(field.values.begin() + static_cast<std::ptrdiff_t>(i * tensor.size()), tensor.size(),
              tensor.begin());
  return tensor;
}

/// Logarithms of the tensors, when all of them are metrics.
template <int D>
std::optional<std::vector<double>> logs_of(const MeshField& field) {
  if (field.components != kSymSize<D>) return std::nullopt;
  const std::size_t width = kSymSize<D>, n = field.values.size() / width;
  for (std::size_t i = 0; i < n; ++i)
    if (!Metric<D>::from_tensor(tensor_at<D>(field, i))) return std::nullopt;
  std::vector<double> logs(field.values.size());
  for_each_index(n, [&](std::size_t i) {
    const Sym<D> log = Metric<D>::from_tensor(tensor_at<D>(field, i))->log();
    std::copy(log.begin(), log.end(), logs.begin() + static_cast<std::ptrdiff_t>(i * width));
  });
  return logs;
}

/// The corner whose point x is, or D + 1.
template <int D>
std::size_t corner_at(const CellFinder<D>& from, const std::array<Index, D + 1>& cell, const Vec<D>& x) {
  std::size_t k = 0;
  while (k <= D && from.points()[static_cast<std::size_t>(cell[k])] != x) ++k;
  return k;
}

/// The mean of the corners' values, kept within their range against rounding.
template <int D>
double mean(const std::vector<double>& values, std::size_t width, std::size_t component,
            const std::array<Index, D + 1>& cell, const std::array<double, D + 1>& weights) {
  double sum = 0.0, least = std::numeric_limits<double>::infinity(), most = -least;
  for (std::size_t k = 0; k <= D; ++k) {
    const double value = values[static_cast<std::size_t>(cell[k]) * width + component];
    sum += weights[k] * value;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  return std::clamp(sum, least, most);
}

template <int D>
MeshField carry(const CellFinder<D>& from, const MeshField& field, const std::vector<CellPlace<D>>& places,
                const std::vector<Vec<D>>& points) {
  const auto width = static_cast<std::size_t>(field.components);
  MeshField out{field.name, field.components, std::vector<double>(points.size() * width)};
  const std::optional<std::vector<double>> logs = logs_of<D>(field);
  const std::vector<double>& values = logs ? *logs : field.values;
  for_each_index(points.size(), [&](std::size_t i) {
    if (places[i].cell == kNone) return;
    double* to = out.values.data() + i * width;
    const std::array<Index, D + 1>& cell = from.cell(places[i]);
    const std::size_t corner = corner_at<D>(from, cell, points[i]);
    if (corner <= D) {
      std::copy_n(field.values.data() + static_cast<std::size_t>(cell[corner]) * width, width, to);
      return;
    }
    for (std::size_t c = 0; c < width; ++c) to[c] = mean<D>(values, width, c, cell, places[i].weights);
    if (!logs) return;
    Sym<D> log;
    std::copy_n(to, log.size(), log.begin());
    const Sym<D> tensor = Metric<D>::from_log(log).tensor();
    std::copy(tensor.begin(), tensor.end(), to);
  });
  return out;
}

}  // namespace

template <int D>
std::vector<MeshField> carry_fields(const CellFinder<D>& from, const std::vector<MeshField>& fields,
                                    const std::vector<Vec<D>>& points) {
  if (fields.empty()) return {};
  std::vector<CellPlace<D>> places(points.size());
  for_each_index(
      points.size(), [&](std::size_t i) { places[i] = from.find(points[i]); }, 256);
  std::vector<MeshField> out;
  for (const MeshField& f : fields) out.push_back(carry<D>(from, f, places, points));
  return out;
}

FieldRange range_of(const MeshField& field) {
  if (field.values.empty()) return {};
  const auto [least, most] = std::minmax_element(field.values.begin(), field.values.end());
  return {*least, *most};
}

template std::vector<MeshField> carry_fields(const CellFinder<2>&, const std::vector<MeshField>&,
                                             const std::vector<Vec<2>>&);
template std::vector<MeshField> carry_fields(const CellFinder<3>&, const std::vector<MeshField>&,
                                             const std::vector<Vec<3>>&);

}  // namespace lamina
