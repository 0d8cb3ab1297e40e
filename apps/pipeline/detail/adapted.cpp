#include "apps/pipeline/detail/adapted.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"

namespace lamina {

/// 64-bit FNV-1a over the words of coordinates and indices, in order.
template <int D>
std::uint64_t mesh_hash(const Mesh<D>& mesh) {
  std::uint64_t h = 1469598103934665603ull;
  const auto add = [&h](std::uint64_t word) { h = ((h ^ word) * 1099511628211ull) ^ (h >> 29); };
  for (const Vec<D>& x : mesh.points) {
    for (int k = 0; k < D; ++k) {
      std::uint64_t bits = 0;
      const double value = x[k];
      std::memcpy(&bits, &value, sizeof bits);
      add(bits);
    }
  }
  for (const auto& cell : mesh.cells)
    for (const Index v : cell) add(static_cast<std::uint64_t>(v));
  return h;
}

template <int D>
MeshField tensor_field(const std::vector<Metric<D>>& metric) {
  constexpr std::size_t kEntries = kSymSize<D>;
  MeshField field{"metric", kSymSize<D>, std::vector<double>(metric.size() * kEntries)};
  for_each_index(metric.size(), [&](std::size_t i) {
    const Sym<D> m = metric[i].tensor();
    std::copy(m.begin(), m.end(), field.values.begin() + static_cast<std::ptrdiff_t>(kEntries * i));
  });
  return field;
}

template <int D>
MeshField quality_field(const Mesh<D>& mesh, const std::vector<Metric<D>>& metric) {
  MeshField field{"quality", 1, std::vector<double>(mesh.cells.size())};
  for_each_index(mesh.cells.size(), [&](std::size_t i) {
    std::array<Vec<D>, D + 1> x;
    std::array<const Metric<D>*, D + 1> m{};
    for (std::size_t k = 0; k <= D; ++k) {
      const auto v = static_cast<std::size_t>(mesh.cells[i][k]);
      x[k] = mesh.points[v];
      m[k] = &metric[v];
    }
    field.values[i] = cell_quality<D>(x, m);
  });
  return field;
}

template <int D>
Validation require_valid(const Mesh<D>& mesh, const std::optional<Box<D>>& domain) {
  const Validation validation = validate<D>(mesh, domain);
  if (!validation.ok())
    throw Error(ErrorCode::kMeshInvalid,
                fmt::format("the adapted mesh is not valid and was not written: {}", validation.summary()));
  return validation;
}

template std::uint64_t mesh_hash(const Mesh<2>&);
template std::uint64_t mesh_hash(const Mesh<3>&);
template MeshField tensor_field(const std::vector<Metric<2>>&);
template MeshField tensor_field(const std::vector<Metric<3>>&);
template MeshField quality_field(const Mesh<2>&, const std::vector<Metric<2>>&);
template MeshField quality_field(const Mesh<3>&, const std::vector<Metric<3>>&);
template Validation require_valid(const Mesh<2>&, const std::optional<Box<2>>&);
template Validation require_valid(const Mesh<3>&, const std::optional<Box<3>>&);

}  // namespace lamina
