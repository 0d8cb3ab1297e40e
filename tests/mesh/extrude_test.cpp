#include "mesh/extrude.h"

#include <gtest/gtest.h>

#include "mesh/seed.h"
#include "mesh/validate.h"

namespace lamina {
namespace {

TEST(Extrude, FillsTheBoxWithMatchingCells) {
  Mesh<2> flat = make_seed<2>({{0.0, 0.0}, {2.0, 1.0}}, 0.3, SeedKind::kLattice);
  flat.point_fields = {{"phi", 1, std::vector<double>(flat.points.size(), 4.0)},
                       {"N", 2, std::vector<double>(2 * flat.points.size(), 1.0)}};
  flat.cell_fields = {{"quality", 1, std::vector<double>(flat.cells.size(), 0.5)}};
  flat.cell_tags.assign(flat.cells.size(), 3);
  const Mesh<3> mesh = extrude(flat, 0.5);
  const Validation v = validate<3>(mesh, Box<3>{{0.0, 0.0, 0.0}, {2.0, 1.0, 0.5}});
  EXPECT_TRUE(v.ok()) << v.summary();
  EXPECT_EQ(v.inward_facets, 0);
  EXPECT_EQ(mesh.cells.size(), 3 * flat.cells.size());
  EXPECT_EQ(mesh.facets.size(), 2 * flat.facets.size() + 2 * flat.cells.size());
  EXPECT_EQ(*std::max_element(mesh.facet_tags.begin(), mesh.facet_tags.end()), 6);
  EXPECT_EQ(mesh.point_fields[0].values.size(), mesh.points.size());
  EXPECT_EQ(mesh.point_fields[1].components, 3);
  EXPECT_EQ(mesh.cell_fields[0].values.size(), mesh.cells.size());
}

}  // namespace
}  // namespace lamina
