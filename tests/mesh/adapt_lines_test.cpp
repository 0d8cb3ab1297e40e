// Listed edges, corners and required parts: on the borders of planes, within them, inside a region, round a
// ball.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/adapt.h"
#include "mesh/score.h"
#include "mesh/validate.h"
#include "tests/mesh/lattice.h"

namespace lamina {
namespace {

template <int D>
class Uniform : public AdaptMetric<D> {
 public:
  explicit Uniform(double h) : h_(h) {}
  Metric<D> at(const Vec<D>&, double floor) const override {
    return Metric<D>::isotropic(std::max(h_, floor));
  }

 private:
  double h_;
};

constexpr int kSide = 6;

Index at(int i, int j, int k) { return i + (kSide + 1) * (j + (kSide + 1) * k); }

void add_line(Mesh<3>& mesh, Index tag, const std::vector<Index>& points) {
  for (std::size_t p = 1; p < points.size(); ++p) {
    mesh.edges.push_back({points[p - 1], points[p]});
    mesh.edge_tags.push_back(tag);
  }
}

// The unit cube: 1 on a ridge, 2 within a face, 3 along a diagonal inside, 4 from a face inwards, 5 a square
// within a face, whose corners are ends of nothing.
Mesh<3> lined_cube() {
  Mesh<3> mesh = lattice<3>(kSide);
  std::vector<Index> ridge, face, diagonal, inwards;
  for (int s = 0; s <= kSide; ++s) ridge.push_back(at(s, 0, 0));
  for (int s = 1; s < kSide; ++s) face.push_back(at(s, 2, 0));
  for (int s = 1; s < kSide; ++s) diagonal.push_back(at(s, s, s));
  for (int s = 0; s < 4; ++s) inwards.push_back(at(s, 3, 2));
  add_line(mesh, 1, ridge);
  add_line(mesh, 2, face);
  add_line(mesh, 3, diagonal);
  add_line(mesh, 4, inwards);
  add_line(mesh, 5,
           {at(6, 1, 1), at(6, 2, 1), at(6, 3, 1), at(6, 3, 2), at(6, 3, 3), at(6, 2, 3), at(6, 1, 3),
            at(6, 1, 2), at(6, 1, 1)});
  mesh.ridges = {0, 1, 2, 3, 4, 5};
  mesh.corners = {at(0, 0, 0), at(3, 3, 4)};
  mesh.point_tags.assign(mesh.points.size(), 0);
  mesh.point_tags[at(3, 3, 4)] = 9;
  mesh.point_tags[at(1, 1, 1)] = 8;
  mesh.edge_names = {{2, "weld"}};
  mesh.point_names = {{9, "probe"}};
  return mesh;
}

/// The edges of cells, ascending.
std::set<std::array<Index, 2>> edges_of_cells(const Mesh<3>& mesh) {
  std::set<std::array<Index, 2>> edges;
  for (const auto& cell : mesh.cells)
    for (const auto& e : kCellEdges<3>)
      edges.insert({std::min(cell[e[0]], cell[e[1]]), std::max(cell[e[0]], cell[e[1]])});
  return edges;
}

/// Lengths by tags, and whether each point between ends has two edges.
std::map<Index, double> lengths(const Mesh<3>& mesh) {
  std::map<Index, double> sums;
  for (std::size_t e = 0; e < mesh.edges.size(); ++e)
    sums[mesh.edge_tags[e]] += (mesh.points[mesh.edges[e][0]] - mesh.points[mesh.edges[e][1]]).norm();
  return sums;
}

std::map<Index, int> ends(const Mesh<3>& mesh) {
  std::map<std::pair<Index, Index>, int> degree;
  for (std::size_t e = 0; e < mesh.edges.size(); ++e)
    for (const Index v : mesh.edges[e]) ++degree[{mesh.edge_tags[e], v}];
  std::map<Index, int> count;
  for (const auto& [key, n] : degree) {
    EXPECT_LE(n, 2);
    count[key.first] += n == 1;
  }
  return count;
}

/// The distance of a point from the line of that tag.
double distance(const Vec3& x, Index tag) {
  switch (tag) {
    case 1:
      return std::hypot(x[1], x[2]);
    case 2:
      return std::hypot(x[1] - 2.0 / kSide, x[2]);
    case 3:
      return (x - Vec3::Constant(x.mean())).norm();
    case 4:
      return std::hypot(x[1] - 3.0 / kSide, x[2] - 2.0 / kSide);
    default:
      return std::hypot(x[0] - 1.0,
                        std::max(std::abs(x[1] - 2.0 / kSide), std::abs(x[2] - 2.0 / kSide)) - 1.0 / kSide);
  }
}

TEST(AdaptLines, StraightOnesKeepTheirPlacesAndTags) {
  const Mesh<3> input = lined_cube();
  const auto wanted = lengths(input);
  for (const double size : {0.06, 0.13, 0.5}) {
    Mesh<3> mesh = input;
    std::vector<Metric<3>> metric;
    AdaptOptions options;
    options.end_size = size;
    options.block_vertices = 300;
    adapt<3>(mesh, Uniform<3>(size), metric, options);
    const Validation v = validate<3>(mesh, Box<3>{Vec3::Zero(), Vec3::Ones()});
    EXPECT_TRUE(v.ok()) << v.summary();
    const auto known = edges_of_cells(mesh);
    for (std::size_t e = 0; e < mesh.edges.size(); ++e) {
      EXPECT_TRUE(known.count(mesh.edges[e])) << e;
      for (const Index p : mesh.edges[e]) EXPECT_LE(distance(mesh.points[p], mesh.edge_tags[e]), 1e-14);
    }
    for (const auto& [tag, length] : lengths(mesh)) EXPECT_NEAR(length, wanted.at(tag), 1e-12) << tag;
    EXPECT_EQ(ends(mesh), ends(input));
    for (std::size_t e = 0; e < mesh.edges.size(); ++e)
      EXPECT_EQ(std::binary_search(mesh.ridges.begin(), mesh.ridges.end(), static_cast<Index>(e)),
                mesh.edge_tags[e] == 1);
    const auto own = static_cast<double>(std::count(mesh.edge_tags.begin(), mesh.edge_tags.end(), 1));
    EXPECT_GE(own * size, 0.7);
    EXPECT_LE(own * size, 1.6);
    ASSERT_EQ(mesh.corners.size(), 2U);
    for (const Index c : mesh.corners) {
      const bool origin = mesh.points[c].isZero(0.0);
      EXPECT_TRUE(origin || mesh.points[c] == input.points[at(3, 3, 4)]);
      EXPECT_EQ(mesh.point_tags[c], origin ? 0 : 9);
    }
    EXPECT_EQ(mesh.edge_names, input.edge_names);
    EXPECT_EQ(mesh.point_names, input.point_names);
    const Score s = score<3>(mesh, metric);
    EXPECT_GE(s.unit_share, size < 0.1 ? 0.99 : 0.8);
    EXPECT_GE(s.quality_min, 0.1) << size;
  }
}

TEST(AdaptLines, RoundOnesFollowTheInputWithinTheTolerance) {
  constexpr int kCells = 8;
  Mesh<3> input = lattice<3>(kCells);
  const auto number = [](int i, int j) { return i + (kCells + 1) * (j + (kCells + 1) * kCells / 2); };
  std::vector<Index> equator;
  for (int s = 0; s <= 4 * kCells; ++s) {
    const int t = s % kCells, side = s / kCells % 4;
    equator.push_back(side == 0   ? number(t, 0)
                      : side == 1 ? number(kCells, t)
                      : side == 2 ? number(kCells - t, kCells)
                                  : number(0, kCells - t));
  }
  add_line(input, 3, equator);
  for (Vec3& x : input.points) {
    const Vec3 y = 2.0 * x - Vec3::Ones();
    x = y.norm() > 0.0 ? Vec3(y * (y.cwiseAbs().maxCoeff() / y.norm())) : y;
  }
  std::fill(input.facet_tags.begin(), input.facet_tags.end(), 5);
  const double sagitta = 1.0 - std::cos(std::numbers::pi / 4.0 / kCells * 1.3);
  for (const double size : {0.1, 0.4}) {
    Mesh<3> mesh = input;
    std::vector<Metric<3>> metric;
    AdaptOptions options;
    options.end_size = size;
    options.hausdorff = 1e-2;
    adapt<3>(mesh, Uniform<3>(size), metric, options);
    EXPECT_TRUE(validate<3>(mesh).ok());
    EXPECT_EQ(ends(mesh).at(3), 0);
    EXPECT_NEAR(lengths(mesh).at(3), lengths(input).at(3), 0.05);
    for (const auto& e : mesh.edges) {
      for (const double t : {0.0, 0.3, 0.5, 1.0}) {
        const Vec3 x = (1.0 - t) * mesh.points[e[0]] + t * mesh.points[e[1]];
        EXPECT_LE(std::abs(x[2]), 1e-12);
        EXPECT_LE(x.norm(), 1.0 + 1e-12);
        EXPECT_GE(x.norm(), 1.0 - sagitta - 1e-2);
      }
    }
    EXPECT_GE(score<3>(mesh, metric).quality_min, 0.1);
  }
}

template <int D>
using Corners = std::vector<std::array<double, D>>;

template <int D, std::size_t N>
Corners<D> sorted_corners(const Mesh<D>& mesh, const std::array<Index, N>& simplex) {
  Corners<D> out;
  for (const Index v : simplex) {
    std::array<double, D> x;
    std::copy_n(mesh.points[static_cast<std::size_t>(v)].data(), D, x.begin());
    out.push_back(x);
  }
  std::sort(out.begin(), out.end());
  return out;
}

template <int D, std::size_t N>
std::set<Corners<D>> places(const Mesh<D>& mesh, const std::vector<std::array<Index, N>>& simplices,
                            const std::vector<Index>& which) {
  std::set<Corners<D>> out;
  for (const Index i : which) out.insert(sorted_corners(mesh, simplices[static_cast<std::size_t>(i)]));
  return out;
}

template <int D>
void expect_required_kept(const Mesh<D>& input, double size) {
  Mesh<D> mesh = input;
  std::vector<Metric<D>> metric;
  AdaptOptions options;
  options.end_size = size;
  options.block_vertices = 300;
  adapt<D>(mesh, Uniform<D>(size), metric, options);
  EXPECT_TRUE(validate<D>(mesh).ok());
  EXPECT_EQ(places(mesh, mesh.facets, mesh.required.facets),
            places(input, input.facets, input.required.facets));
  EXPECT_EQ(places(mesh, mesh.edges, mesh.required.edges), places(input, input.edges, input.required.edges));
  EXPECT_EQ(mesh.required.facets.size(), input.required.facets.size());
  EXPECT_EQ(mesh.edges.size(), input.required.edges.size());
  ASSERT_EQ(mesh.required.points.size(), input.required.points.size());
  std::set<Corners<D>> points, wanted;
  for (const Index v : mesh.required.points) points.insert(sorted_corners(mesh, std::array{v}));
  for (const Index v : input.required.points) wanted.insert(sorted_corners(input, std::array{v}));
  EXPECT_EQ(points, wanted);
}

TEST(AdaptLines, RequiredPartsStayAsTheyAre) {
  for (const double size : {0.08, 0.4}) {
    Mesh<3> solid = lattice<3>(kSide);
    add_line(solid, 2, {at(1, 1, 1), at(2, 1, 1), at(3, 1, 1)});
    solid.required.edges = {0, 1};
    solid.required.facets = {0, 7, 8, 40};
    solid.required.points = {at(3, 2, 4), at(0, 3, 3)};
    expect_required_kept(solid, size);
    Mesh<2> plane = lattice<2>(8);
    plane.required.facets = {0, 1, 9};
    plane.required.points = {40};
    expect_required_kept(plane, size);
  }
}

TEST(AdaptLines, SameBitsForEveryThreadCount) {
  Mesh<3> first;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    Mesh<3> mesh = lined_cube();
    std::vector<Metric<3>> metric;
    AdaptOptions options;
    options.end_size = 0.05;
    options.block_vertices = 500;
    adapt<3>(mesh, Uniform<3>(0.05), metric, options);
    if (first.points.empty()) first = mesh;
    ASSERT_EQ(mesh.points.size(), first.points.size());
    EXPECT_EQ(0, std::memcmp(mesh.points.data(), first.points.data(), mesh.points.size() * sizeof(Vec3)));
    EXPECT_EQ(mesh.cells, first.cells);
    EXPECT_EQ(mesh.edges, first.edges);
    EXPECT_EQ(mesh.edge_tags, first.edge_tags);
  }
}

TEST(AdaptLines, GoOnFromASnapshotToTheSameBits) {
  std::vector<Metric<3>> metric;
  AdaptOptions options;
  options.end_size = 0.08;
  std::string snapshot;
  options.after_step = [&](const AdaptStep& step, Snapshot take) {
    if (step.number == 1) snapshot = take();
    return true;
  };
  Mesh<3> mesh = lined_cube(), again = mesh;
  adapt<3>(mesh, Uniform<3>(0.08), metric, options);
  ASSERT_FALSE(snapshot.empty());
  options.after_step = {};
  options.resume = snapshot;
  adapt<3>(again, Uniform<3>(0.08), metric, options);
  EXPECT_EQ(mesh.cells, again.cells);
  EXPECT_EQ(mesh.edges, again.edges);
  EXPECT_EQ(mesh.corners, again.corners);
}

template <int D>
std::string message_of(Mesh<D> mesh) {
  std::vector<Metric<D>> metric;
  try {
    adapt<D>(mesh, Uniform<D>(0.2), metric, {});
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kAdapt);
    return error.what();
  }
  return "none";
}

TEST(AdaptLines, WhatCannotBeKeptIsRefused) {
  Mesh<3> mesh = lined_cube();
  add_line(mesh, 1, {at(0, 0, 0), at(0, 5, 5)});
  EXPECT_NE(message_of(mesh).find("is not one of a cell"), std::string::npos);
  mesh = lined_cube();
  add_line(mesh, 7, {at(1, 0, 0), at(0, 0, 0)});
  EXPECT_NE(message_of(mesh).find("listed twice"), std::string::npos);
  mesh = lattice<3>(3);
  const auto& cell = mesh.cells[0];
  mesh.facets.push_back({cell[0], cell[1], cell[2]});
  mesh.facet_tags.push_back(0);
  mesh.required.facets = {static_cast<Index>(mesh.facets.size() - 1)};
  for (const auto& corners : kCellFacets<3>) {  // whichever of its facets lies inside
    mesh.facets.back() = {cell[corners[0]], cell[corners[1]], cell[corners[2]]};
    auto key = mesh.facets.back();
    std::sort(key.begin(), key.end());
    const auto same = [&](std::array<Index, 3> f) {
      std::sort(f.begin(), f.end());
      return f == key;
    };
    if (std::count_if(mesh.facets.begin(), mesh.facets.end(), same) == 1) break;
  }
  EXPECT_NE(message_of(mesh).find("lies within a region"), std::string::npos);
  Mesh<2> plane = lattice<2>(3);
  plane.required.cells = {0};
  EXPECT_NE(message_of(plane).find("required cell"), std::string::npos);
}

}  // namespace
}  // namespace lamina
