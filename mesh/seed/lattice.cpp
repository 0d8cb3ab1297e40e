// Every grid cell of the box is cut into the D! simplices of Kuhn's triangulation, all along the same
// diagonal, so that neighbouring grid cells match without further care.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "mesh/box_facets.h"
#include "mesh/seed/seed_kinds.h"

namespace lamina {
namespace {

// n[i] grid cells along axis i.
template <int D>
Mesh<D> make_lattice(const Box<D>& box, const std::array<int, D>& n) {
  Mesh<D> mesh;
  std::array<Index, D> stride;
  Index points = 1;
  for (int i = 0; i < D; ++i) {
    stride[i] = points;
    points *= n[i] + 1;
  }
  mesh.points.resize(points);
  for (Index p = 0; p < points; ++p) {
    for (int i = 0; i < D; ++i) {
      const int k = (p / stride[i]) % (n[i] + 1);
      // The last plane is the face of the box itself, bit for bit.
      mesh.points[p][i] = k == n[i] ? box.hi[i] : box.lo[i] + (box.hi[i] - box.lo[i]) * k / n[i];
    }
  }
  std::array<int, D> axes;
  for (Index p = 0; p < points; ++p) {
    bool last = false;
    for (int i = 0; i < D; ++i) last = last || (p / stride[i]) % (n[i] + 1) == n[i];
    if (last) continue;
    for (int i = 0; i < D; ++i) axes[i] = i;
    do {
      std::array<Index, D + 1> cell;
      cell[0] = p;
      for (int i = 0; i < D; ++i) cell[i + 1] = cell[i] + stride[axes[i]];
      int inversions = 0;
      for (int i = 0; i < D; ++i)
        for (int j = i + 1; j < D; ++j) inversions += axes[i] > axes[j];
      if (inversions % 2 == 1) std::swap(cell[D - 1], cell[D]);
      mesh.cells.push_back(cell);
    } while (std::next_permutation(axes.begin(), axes.end()));
  }
  list_box_facets(mesh);
  return mesh;
}

}  // namespace

template <int D>
Mesh<D> make_seed(const Box<D>& box, double size, SeedKind kind, int max_cells_per_axis) {
  if ((box.size().array() <= 0.0).any() || !box.size().allFinite())
    throw Error(ErrorCode::kDomain, "the domain box is empty: each upper bound must exceed the lower one");
  if (!(size > 0.0)) throw Error(ErrorCode::kParameter, "seed size must be > 0");
  if constexpr (D == 3) {
    if (kind == SeedKind::kTetgen) return make_tetgen_seed(box, size, max_cells_per_axis);
  }
  std::array<int, D> n;
  for (int i = 0; i < D; ++i)
    n[i] = static_cast<int>(std::clamp(std::round(box.size()[i] / size), 1.0, double(max_cells_per_axis)));
  return make_lattice<D>(box, n);
}

template Mesh<2> make_seed(const Box<2>&, double, SeedKind, int);
template Mesh<3> make_seed(const Box<3>&, double, SeedKind, int);

}  // namespace lamina
