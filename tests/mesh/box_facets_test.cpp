// Against a list that is found another way, and a boundary that is not that of a box.
#include "mesh/box_facets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "mesh/validate.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
std::set<std::pair<Index, std::array<Index, D>>> tagged(const Mesh<D>& mesh) {
  std::set<std::pair<Index, std::array<Index, D>>> all;
  for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
    std::array<Index, D> key = mesh.facets[f];
    std::sort(key.begin(), key.end());
    all.insert({mesh.facet_tags[f], key});
  }
  return all;
}

template <int D>
void box() {
  const Mesh<D> wanted = lattice<D>(4, 0.1);
  Mesh<D> mesh = wanted;
  mesh.facets.clear();
  mesh.facet_tags.clear();
  list_box_facets(mesh);
  EXPECT_EQ(tagged<D>(mesh), tagged<D>(wanted));
  EXPECT_EQ(mesh.facet_names.size(), std::size_t{2 * D});
  EXPECT_EQ(mesh.facet_names.at(1), "xmin");
  EXPECT_TRUE(validate<D>(mesh).ok());  // outward, too
}

template <int D>
void missing() {
  const Mesh<D> wanted = lattice<D>(3);
  Mesh<D> mesh = wanted;
  EXPECT_EQ(list_missing_facets(mesh), 0);
  const std::size_t half = wanted.facets.size() / 2;
  mesh.facets.resize(half);
  mesh.facet_tags.resize(half);
  EXPECT_EQ(list_missing_facets(mesh), static_cast<std::int64_t>(wanted.facets.size() - half));
  EXPECT_TRUE(validate<D>(mesh).ok());
  EXPECT_EQ(std::count(mesh.facet_tags.begin(), mesh.facet_tags.end(), 0),
            static_cast<std::ptrdiff_t>(wanted.facets.size() - half));
  EXPECT_EQ(mesh.facet_tags.front(), wanted.facet_tags.front());
}

TEST(BoxFacets, ThoseThatAreMissing) {
  missing<2>();
  missing<3>();
}

TEST(BoxFacets, OfABox) {
  box<2>();
  box<3>();
}

TEST(BoxFacets, SlantedOnesHaveATagOfTheirOwn) {
  Mesh<2> mesh;
  mesh.points = {{0, 0}, {1, 0}, {0, 1}};
  mesh.cells = {{0, 1, 2}};
  list_box_facets(mesh);
  EXPECT_EQ(tagged<2>(mesh),
            (std::set<std::pair<Index, std::array<Index, 2>>>{{1, {0, 2}}, {3, {0, 1}}, {5, {1, 2}}}));
  EXPECT_EQ(mesh.facet_names, (TagNames{{1, "xmin"}, {3, "ymin"}, {5, "boundary"}}));
}

}  // namespace
}  // namespace lamina
