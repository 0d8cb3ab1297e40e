// Every cell gets points in proportion to its volume. Rejected: halving cells until they are small in the
// metric; pieces of tilted cells do not align with thin layers, and their number explodes.
#include "mesh/complexity.h"

#include <algorithm>
#include <cmath>

#include "core/predicates.h"
#include "mesh/topology/sum.h"

namespace lamina {
namespace {

/// The k-th point of an additive low-discrepancy sequence in the unit cube, moved by a number of its own for
/// every cell. Multipliers are powers of the inverse of the root of x^(D+1) = x + 1.
template <int D>
std::array<double, D> spread(std::size_t cell, std::size_t k) {
  constexpr double kRoot = D == 2 ? 1.32471795724474602596 : 1.22074408460575947536;
  std::array<double, D> u;
  double step = 1.0;
  for (double& value : u) {
    step /= kRoot;
    const double x =
        0.5 + 0.6180339887498949 * static_cast<double>(cell % 65536) + step * static_cast<double>(k);
    value = x - std::floor(x);
  }
  return u;
}

/// Uniform in the simplex when u is uniform in the cube: gaps between sorted numbers are its weights.
template <int D>
Vec<D> point_in(const std::array<Vec<D>, D + 1>& x, std::array<double, D> u) {
  std::sort(u.begin(), u.end());
  Vec<D> p = (1.0 - u[D - 1]) * x[D];
  for (int k = 0; k < D; ++k) p += (u[k] - (k == 0 ? 0.0 : u[k - 1])) * x[k];
  return p;
}

}  // namespace

template <int D>
double estimate_complexity(const Mesh<D>& mesh, FunctionRef<Metric<D>(const Vec<D>&)> metric,
                           std::size_t samples) {
  constexpr double kParallelepiped = D == 2 ? 2.0 : 6.0;
  constexpr std::size_t kGrain = 64;
  const auto corners = [&](std::size_t c) {
    std::array<Vec<D>, D + 1> x;
    for (int k = 0; k <= D; ++k) x[k] = mesh.points[mesh.cells[c][k]];
    return x;
  };
  const auto sum = [&](auto&& value) {
    return reduce(
        mesh.cells.size(), 0.0,
        [&](std::size_t begin, std::size_t end) {
          CompensatedSum s;
          for (std::size_t c = begin; c < end; ++c) s.add(value(c));
          return s.value();
        },
        [](double a, double b) { return a + b; }, kGrain);
  };
  const auto volume = [&](std::size_t c) { return std::abs(orient<D>(corners(c))) / kParallelepiped; };
  const double total = sum(volume);
  return sum([&](std::size_t c) {
    const auto x = corners(c);
    const double share = volume(c) / total * static_cast<double>(samples);
    const auto count = static_cast<std::size_t>(std::max(1.0, std::ceil(share)));
    double density = 0.0;
    for (std::size_t k = 0; k < count; ++k) density += metric(point_in<D>(x, spread<D>(c, k))).sqrt_det();
    return volume(c) * density / static_cast<double>(count);
  });
}

template double estimate_complexity(const Mesh<2>&, FunctionRef<Metric<2>(const Vec<2>&)>, std::size_t);
template double estimate_complexity(const Mesh<3>&, FunctionRef<Metric<3>(const Vec<3>&)>, std::size_t);

}  // namespace lamina
