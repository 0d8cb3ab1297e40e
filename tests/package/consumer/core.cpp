// Links Lamina::core alone: one call per kind of thing it holds.
#include <cmath>

#include "core/boundary_layer.h"
#include "core/metric.h"
#include "core/parallel.h"

int main() {
  const double height = lamina::first_height(4.25e6, 1.0, 5.0);
  const auto metric = lamina::Metric<3>::isotropic(0.5);
  const auto sum = lamina::reduce(
      1000, 0.0, [](std::size_t begin, std::size_t end) { return static_cast<double>(end - begin); },
      [](double a, double b) { return a + b; });
  const bool ok = std::abs(height - 3.068e-5) < 1e-8 && metric.size_along({0, 0, 1}) == 0.5 && sum == 1000.0;
  return ok ? 0 : 1;
}
