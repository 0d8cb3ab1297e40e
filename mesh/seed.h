// Coarse seed meshes of the domain: a box, in the plane any closed curve.
#pragma once

#include <string>
#include <vector>

#include "mesh/mesh.h"

namespace lamina {

enum class SeedKind { kTetgen, kLattice };

/// True when Lamina was built with TetGen (LAMINA_TETGEN).
bool have_tetgen();

/// Tetrahedra (triangles for D = 2) that fill `box` exactly, of edge length about `size` but at least one and
/// at most `max_cells_per_axis` cells along each axis. Facets carry tags 1..2D: x-, x+, y-, y+ (, z-, z+),
/// named xmin, xmax, ymin, ymax (, zmin, zmax).
/// kTetgen is 3D only. Errors: kSeed (TetGen missing from this build or failing), kDomain (empty box).
template <int D>
Mesh<D> make_seed(const Box<D>& box, double size, SeedKind kind, int max_cells_per_axis = 200);

/// A closed polygon, counter-clockwise, that does not touch itself.
struct DomainBorder {
  std::vector<Vec2> points;
  std::vector<Index> tags;  ///< of the segments from point i to the next
  TagNames names;
};

/// Errors: kDomain, naming `name`, for a border that touches itself or has fewer than three points. Time
/// quadratic in the points at worst.
void require_simple(const DomainBorder& border, const std::string& name);

/// Triangles between the points of the border. Errors: those of require_simple(), and kDomain for a border
/// with spikes. Time quadratic in the points.
Mesh<2> make_seed(const DomainBorder& border);

/// The part of a disc around the origin with x below 0 and |y| up to height / 2, and the rectangle of that
/// height from x = 0 to `length`. Tags 1 to 4: inlet, outlet, lower, upper. Errors: kDomain.
DomainBorder c_border(double radius, double length, double height);

}  // namespace lamina
