// What the tests of curved boundaries and of curved borders between regions have in common.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "mesh/adapt.h"
#include "mesh/validate.h"

namespace lamina {

/// visit(x) at points all over a facet.
template <int D, class Visit>
void sample_facet(const Mesh<D>& mesh, const std::array<Index, D>& f, Visit&& visit) {
  constexpr int kParts = 6;
  for (int i = 0; i <= kParts; ++i) {
    for (int j = 0; j <= (D == 2 ? 0 : kParts - i); ++j) {
      const Vec<D> x = (i * mesh.points[f[0]] + (kParts - i - j) * mesh.points[f[1]]) / kParts;
      visit(Vec<D>(x + static_cast<double>(j) / kParts * mesh.points[f[D - 1]]));
    }
  }
}

/// The mesh adapted to the field, whose smallest size is given, within the tolerance
/// (AdaptOptions::hausdorff); expects it to be valid.
template <int D>
Mesh<D> followed(Mesh<D> mesh, const AdaptMetric<D>& field, double size, double tolerance,
                 std::vector<Metric<D>>& metric) {
  AdaptOptions options;
  options.end_size = size;
  options.hausdorff = tolerance;
  adapt<D>(mesh, field, metric, options);
  const Validation v = validate<D>(mesh);
  EXPECT_TRUE(v.ok()) << v.summary();
  return mesh;
}

}  // namespace lamina
