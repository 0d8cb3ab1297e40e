#include "mesh/extrude.h"

#include <algorithm>

namespace lamina {
namespace {

constexpr std::size_t kParts = 3;  // tetrahedra of a prism, triangles of its bottom and top together plus one

/// Values of a field in space.
std::vector<double> in_space(const MeshField& f, double height) {
  std::vector<double> out;
  const auto n = static_cast<std::size_t>(f.components);
  for (std::size_t i = 0; i + n <= f.values.size(); i += n) {
    out.insert(out.end(), f.values.begin() + static_cast<std::ptrdiff_t>(i),
               f.values.begin() + static_cast<std::ptrdiff_t>(i + n));
    if (f.components == 2) out.push_back(0.0);
    if (f.components == kSymSize<2>) out.insert(out.end(), {0.0, 0.0, 1.0 / (height * height)});
  }
  return out;
}

MeshField repeated(const MeshField& f, double height, bool each) {
  MeshField out{f.name, f.components == 2 ? 3 : f.components == kSymSize<2> ? kSymSize<3> : f.components, {}};
  const std::vector<double> once = in_space(f, height);
  if (!each) {  // all points, then all of them again
    out.values = once;
    out.values.insert(out.values.end(), once.begin(), once.end());
    return out;
  }
  const auto n = static_cast<std::ptrdiff_t>(out.components);
  for (auto at = once.begin(); at != once.end(); at += n)
    for (std::size_t k = 0; k < kParts; ++k) out.values.insert(out.values.end(), at, at + n);
  return out;
}

/// The three tetrahedra over a triangle a < b < c are a b c c', a b c' b' and a b' c' a', whichever way it
/// turns.
void add_prism(const std::array<Index, 3>& triangle, Index n, Mesh<3>& out) {
  std::array<Index, 3> v = triangle;
  std::sort(v.begin(), v.end());
  int inversions = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i + 1; j < 3; ++j) inversions += triangle[i] > triangle[j];
  const auto [a, b, c] = v;
  std::array<std::array<Index, 4>, kParts> cells{
      {{a, b, c, c + n}, {a, b, c + n, b + n}, {a, b + n, c + n, a + n}}};
  for (std::array<Index, 4>& cell : cells) {
    if (inversions % 2 == 1) std::swap(cell[0], cell[1]);
    out.cells.push_back(cell);
  }
}

/// The quadrilateral over an edge, cut from the lower end of its smaller vertex.
void add_side(const std::array<Index, 2>& edge, Index n, Mesh<3>& out) {
  const auto [a, b] = edge;
  if (a < b) {
    out.facets.push_back({a, b, b + n});
    out.facets.push_back({a, b + n, a + n});
  } else {
    out.facets.push_back({a, b, a + n});
    out.facets.push_back({b, b + n, a + n});
  }
}

}  // namespace

Mesh<3> extrude(const Mesh<2>& mesh, double height) {
  Mesh<3> out;
  const auto n = static_cast<Index>(mesh.points.size());
  for (const double z : {0.0, height})
    for (const Vec2& x : mesh.points) out.points.emplace_back(x[0], x[1], z);
  for (const auto& cell : mesh.cells) add_prism(cell, n, out);
  for (const Index tag : mesh.cell_tags) out.cell_tags.insert(out.cell_tags.end(), kParts, tag);
  Index last = 0;
  for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
    add_side(mesh.facets[f], n, out);
    const Index tag = mesh.facet_tags.empty() ? 0 : mesh.facet_tags[f];
    out.facet_tags.insert(out.facet_tags.end(), 2, tag);
    last = std::max(last, tag);
  }
  for (const auto& [a, b, c] : mesh.cells) {
    out.facets.push_back({a, c, b});
    out.facets.push_back({a + n, b + n, c + n});
    out.facet_tags.insert(out.facet_tags.end(), {last + 1, last + 2});
  }
  out.cell_names = mesh.cell_names;
  out.facet_names = mesh.facet_names;
  if (!out.facet_names.empty()) {
    out.facet_names[last + 1] = "zmin";
    out.facet_names[last + 2] = "zmax";
  }
  for (const MeshField& f : mesh.point_fields) out.point_fields.push_back(repeated(f, height, false));
  for (const MeshField& f : mesh.cell_fields) out.cell_fields.push_back(repeated(f, height, true));
  return out;
}

}  // namespace lamina
