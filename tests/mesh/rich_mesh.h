// A mesh that has everything a file can hold, and comparisons.
#pragma once

#include <gtest/gtest.h>

#include "tests/mesh/lattice.h"

namespace lamina {

/// A mesh with tags and fields of every kind and coordinates that need all 17 digits.
template <int D>
Mesh<D> rich_mesh(int n) {
  Mesh<D> mesh = lattice<D>(n, 0.1);
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) mesh.cell_tags.push_back(static_cast<Index>(i % 4));
  for (std::size_t i = 0; i < mesh.points.size(); ++i) mesh.point_tags.push_back(static_cast<Index>(i % 3));
  const auto field = [](const std::string& name, int components, std::size_t count) {
    MeshField f{name, components, {}};
    for (std::size_t i = 0; i < count * static_cast<std::size_t>(components); ++i)
      f.values.push_back(noise(i, static_cast<std::uint64_t>(components)));
    return f;
  };
  mesh.point_fields = {field("phi", 1, mesh.points.size()), field("normal & <more>", D, mesh.points.size()),
                       field("metric", kSymSize<D>, mesh.points.size())};
  mesh.cell_fields = {field("quality", 1, mesh.cells.size())};
  return mesh;
}

template <int D>
void expect_same_geometry(const Mesh<D>& a, const Mesh<D>& b) {
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) ASSERT_EQ(a.points[i], b.points[i]) << "point " << i;
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.cell_tags, b.cell_tags);
}

inline void expect_same_fields(const std::vector<MeshField>& a, const std::vector<MeshField>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].components, b[i].components);
    EXPECT_EQ(a[i].values, b[i].values) << a[i].name;
  }
}

}  // namespace lamina
