// Every format of the table: what it says it holds comes back with every bit, what it cannot hold is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/io.h"
#include "tests/mesh/rich_mesh.h"
#include "tests/mesh/scratch.h"

namespace lamina {
namespace {

template <int D>
Mesh<D> named_mesh(int n) {
  Mesh<D> mesh = rich_mesh<D>(n);
  mesh.facet_names = {{1, "inlet"}, {2, "outlet"}, {4, "wall-top"}};
  mesh.cell_names = {{1, "air"}, {3, "steel"}};
  mesh.corners = {0, 2, 7};
  mesh.required.points = {1, 7};
  mesh.required.facets = {0, 3};
  if constexpr (D == 3) {
    for (Index c = 0; c < 5; ++c) mesh.edges.push_back({mesh.cells[6 * c][0], mesh.cells[6 * c][3]});
    mesh.edge_tags = {2, 1, -4, 2, 5};
    mesh.edge_names = {{1, "seam"}};
    mesh.ridges = {1, 2};
    mesh.required.edges = {0, 4};
  }
  mesh.point_names = {{2, "probe"}};
  return mesh;
}

/// True when b is a with its corners turned in a way that keeps the orientation.
template <std::size_t N>
bool same_simplex(std::array<Index, N> a, std::array<Index, N> b) {
  int swaps = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const auto at = std::find(b.begin() + static_cast<std::ptrdiff_t>(i), b.end(), a[i]);
    if (at == b.end()) return false;
    if (*at != b[i] || at != b.begin() + static_cast<std::ptrdiff_t>(i)) {
      std::swap(*at, b[i]);
      ++swaps;
    }
  }
  return swaps % 2 == 0;
}

template <int D>
std::vector<std::pair<Index, std::array<Index, 2>>> tagged_edges(const Mesh<D>& mesh) {
  std::vector<std::pair<Index, std::array<Index, 2>>> list;
  for (std::size_t e = 0; e < mesh.edges.size(); ++e) list.emplace_back(mesh.edge_tags.at(e), mesh.edges[e]);
  std::sort(list.begin(), list.end());
  return list;
}

template <int D>
void expect_held(const MeshFormat& format, const Mesh<D>& mesh, const Mesh<D>& back) {
  using Fields = MeshFormat::Fields;
  ASSERT_EQ(mesh.points.size(), back.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (format.exact) {
      ASSERT_EQ(mesh.points[i], back.points[i]) << "point " << i;
    } else {
      ASSERT_EQ(mesh.points[i].template cast<float>(), back.points[i].template cast<float>())
          << "point " << i;
    }
  }
  ASSERT_EQ(mesh.cells.size(), back.cells.size());
  for (std::size_t i = 0; i < mesh.cells.size(); ++i)
    ASSERT_TRUE(same_simplex(mesh.cells[i], back.cells[i])) << "cell " << i;
  EXPECT_EQ(back.cell_tags, format.cell_tags ? mesh.cell_tags : std::vector<Index>{});
  std::vector<Index> point_tags = mesh.point_tags;
  if (!format.point_tags) {
    point_tags.assign(format.edges ? mesh.points.size() : 0, 0);
    if (format.edges)
      for (const Index v : mesh.corners) point_tags[v] = mesh.point_tags[v];
  }
  EXPECT_EQ(back.point_tags, point_tags);
  using List = std::vector<Index>;
  EXPECT_EQ(tagged_edges(back), tagged_edges(format.edges ? mesh : Mesh<D>()));
  EXPECT_EQ(back.corners, format.edges ? mesh.corners : List{});
  EXPECT_EQ(back.ridges, format.required ? mesh.ridges : List{});
  EXPECT_EQ(back.required, format.required ? mesh.required : RequiredParts{});
  EXPECT_EQ(back.edge_names, format.edges && format.facet_names ? mesh.edge_names : TagNames{});
  EXPECT_EQ(back.point_names, format.edges && format.facet_names ? mesh.point_names : TagNames{});
  // Formats that group facets by tag change their order.
  const auto sorted = [](const Mesh<D>& m) {
    std::vector<std::pair<std::array<Index, D>, Index>> list;
    for (std::size_t i = 0; i < m.facets.size(); ++i) {
      auto f = m.facets[i];
      std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
      if (D == 2) f = m.facets[i];
      list.emplace_back(f, m.facet_tags.empty() ? 0 : m.facet_tags[i]);
    }
    std::sort(list.begin(), list.end());
    return list;
  };
  if (format.facets && format.facet_tags) {
    EXPECT_EQ(sorted(mesh), sorted(back));
  }
  EXPECT_EQ(back.facet_names, format.facet_names ? mesh.facet_names : TagNames{});
  EXPECT_EQ(back.cell_names, format.cell_names ? mesh.cell_names : TagNames{});
  expect_same_fields(format.point_fields == Fields::kNoFields ? std::vector<MeshField>{} : mesh.point_fields,
                     back.point_fields);
  expect_same_fields(format.cell_fields == Fields::kNoFields ? std::vector<MeshField>{} : mesh.cell_fields,
                     back.cell_fields);
}

template <int D>
void round_trip(const MeshFormat& format, std::string_view suffix, MeshWriteOptions options) {
  const Scratch folder;
  const auto path = folder / (suffix.front() == '.' ? "m" + std::string(suffix) : std::string(suffix));
  const Mesh<D> mesh = named_mesh<D>(4);
  options.facets = true;
  const std::vector<std::string> lost = write_mesh(path, mesh, options);
  const bool all = format.exact && format.cell_tags && format.facets && format.point_tags &&
                   format.cell_names && format.facet_names && format.edges && format.required &&
                   format.point_fields != MeshFormat::Fields::kNoFields &&
                   format.cell_fields != MeshFormat::Fields::kNoFields;
  EXPECT_EQ(lost.empty(), all);
  expect_held(format, mesh, std::get<Mesh<D>>(read_mesh(path)));
}

TEST(Formats, RoundTripKeepsWhatTheTableSays) {
  for (const MeshFormat& format : mesh_formats()) {
    if (!format.reads) continue;
    std::vector<MeshWriteOptions> forms = {{}};
    if (format.ascii) forms.push_back({.ascii = true, .version = {}});
    for (const std::string_view version : format.versions) {
      forms.push_back({.ascii = {}, .version = std::string(version)});
      if (format.ascii) forms.push_back({.ascii = true, .version = std::string(version)});
    }
    for (const std::string_view suffix : format.suffixes) {
      for (const MeshWriteOptions& options : forms) {
        SCOPED_TRACE(std::string(suffix) + (options.ascii.value_or(false) ? " ascii " : " ") +
                     options.version);
        round_trip<3>(format, suffix, options);
        if (format.plane) round_trip<2>(format, suffix, options);
      }
    }
  }
}

TEST(Formats, BareMeshesStayBare) {
  for (const MeshFormat& format : mesh_formats()) {
    if (!format.reads) continue;
    SCOPED_TRACE(format.name);
    const Scratch folder;
    const auto path = folder / (format.suffixes[0].front() == '.' ? "m" + std::string(format.suffixes[0])
                                                                  : std::string(format.suffixes[0]));
    Mesh<3> mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.cells = {{0, 1, 2, 3}};
    const std::vector<std::string> lost = write_mesh(path, mesh);
    EXPECT_TRUE(lost.empty() || !format.exact);
    const auto back = std::get<Mesh<3>>(read_mesh(path));
    EXPECT_TRUE(same_simplex(back.cells.at(0), mesh.cells[0]));
    EXPECT_TRUE(back.cell_tags.empty());
    EXPECT_TRUE(back.facet_tags.empty());
    EXPECT_TRUE(back.cell_names.empty());
  }
}

TEST(Formats, SameBytesForEveryThreadCount) {
  const Mesh<3> mesh = named_mesh<3>(20);
  for (const MeshFormat& format : mesh_formats()) {
    if (!format.writes || format.suffixes[0] == ".cgns") continue;  // its library stores the time
    SCOPED_TRACE(format.name);
    std::string first;
    for (const int threads : {1, 2, 5}) {
      const ThreadLimit limit(threads);
      const Scratch folder;
      const auto path = folder / (format.suffixes[0].front() == '.' ? "m" + std::string(format.suffixes[0])
                                                                    : std::string(format.suffixes[0]));
      write_mesh(path, mesh);
      std::string bytes;
      for (const auto& file : mesh_files(path)) bytes += read_text(file);
      if (first.empty()) first = bytes;
      EXPECT_TRUE(first == bytes) << threads << " threads";
    }
  }
}

TEST(Formats, WritingIsAllOrNothing) {
  for (const MeshFormat& format : mesh_formats()) {
    if (!format.writes) continue;
    SCOPED_TRACE(format.name);
    const Scratch folder;
    Mesh<3> mesh = named_mesh<3>(2);
    OutputFiles files;
    const auto path = folder / (format.suffixes[0].front() == '.' ? "m" + std::string(format.suffixes[0])
                                                                  : "a/" + std::string(format.suffixes[0]));
    {
      OutputFiles not_committed;
      write_mesh(not_committed, path, mesh);
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
    mesh.cell_tags.pop_back();
    EXPECT_THROW(write_mesh(path, mesh), Error);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  }
}

TEST(Formats, OptionsThatAFormatLacksAreRefused) {
  const Scratch folder;
  const Mesh<2> mesh = named_mesh<2>(1);
  EXPECT_THROW(write_mesh(folder / "m.su2", mesh, {.ascii = false, .version = {}}), Error);
  EXPECT_THROW(write_mesh(folder / "m.msh", mesh, {.ascii = {}, .version = "3"}), Error);
  EXPECT_THROW(write_mesh(folder / "m.lb8.ugrid", mesh), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace lamina
