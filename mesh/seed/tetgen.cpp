// The only file that sees TetGen (AGPL-3). The box is given as a piecewise linear complex whose edges TetGen
// refines itself; quality 1.4 and a volume bound from the wanted edge length give a coarse, near-isotropic
// mesh.
#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "core/predicates.h"
#include "mesh/box_facets.h"
#include "mesh/seed/seed_kinds.h"

#ifdef LAMINA_TETGEN
#include <tetgen.h>
#endif

namespace lamina {

#ifdef LAMINA_TETGEN

bool have_tetgen() { return true; }

namespace {

void describe_box(const Box<3>& box, tetgenio& in) {
  in.numberofpoints = 8;
  in.pointlist = new REAL[24];
  for (int p = 0; p < 8; ++p)
    for (int i = 0; i < 3; ++i) in.pointlist[3 * p + i] = (p >> i & 1) ? box.hi[i] : box.lo[i];
  constexpr int kFaces[6][4] = {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}};
  in.numberoffacets = 6;
  in.facetlist = new tetgenio::facet[6];
  in.facetmarkerlist = new int[6];
  for (int f = 0; f < 6; ++f) {
    tetgenio::facet& facet = in.facetlist[f];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::polygon& polygon = facet.polygonlist[0];
    tetgenio::init(&polygon);
    polygon.numberofvertices = 4;
    polygon.vertexlist = new int[4];
    for (int k = 0; k < 4; ++k) polygon.vertexlist[k] = kFaces[f][k];
    in.facetmarkerlist[f] = f + 1;
  }
}

}  // namespace

Mesh<3> make_tetgen_seed(const Box<3>& box, double size, int max_cells_per_axis) {
  size = std::max(size, box.size().maxCoeff() / max_cells_per_axis);
  const double volume = size * size * size / (6.0 * std::sqrt(2.0));
  tetgenio in;
  tetgenio out;
  describe_box(box, in);
  std::string switches = fmt::format("pq1.4a{:.17g}Q", volume);
  try {
    tetrahedralize(switches.data(), &in, &out);
  } catch (int code) {
    throw Error(ErrorCode::kSeed,
                fmt::format("TetGen failed on the domain box (code {}): use --seed lattice", code));
  }
  Mesh<3> mesh;
  for (int p = 0; p < out.numberofpoints; ++p) {
    Vec3 x(out.pointlist[3 * p], out.pointlist[3 * p + 1], out.pointlist[3 * p + 2]);
    // Points of a face come back within rounding of it; the box is to be filled exactly.
    const double tolerance = 1e-12 * box.diagonal();
    for (int i = 0; i < 3; ++i) {
      if (std::abs(x[i] - box.lo[i]) < tolerance) x[i] = box.lo[i];
      if (std::abs(x[i] - box.hi[i]) < tolerance) x[i] = box.hi[i];
    }
    mesh.points.push_back(x);
  }
  for (int c = 0; c < out.numberoftetrahedra; ++c) {
    const int* v = out.tetrahedronlist + static_cast<std::ptrdiff_t>(c) * out.numberofcorners;
    std::array<Index, 4> cell = {v[0], v[1], v[2], v[3]};
    if (orient3d(mesh.points[v[0]], mesh.points[v[1]], mesh.points[v[2]], mesh.points[v[3]]) < 0.0)
      std::swap(cell[2], cell[3]);
    mesh.cells.push_back(cell);
  }
  list_box_facets(mesh);
  return mesh;
}

#else

bool have_tetgen() { return false; }

Mesh<3> make_tetgen_seed(const Box<3>&, double, int) {
  throw Error(ErrorCode::kSeed, "this build has no TetGen (LAMINA_TETGEN=OFF): use --seed lattice");
}

#endif

}  // namespace lamina
