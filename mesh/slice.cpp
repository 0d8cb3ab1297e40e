// A cell is cut when it has vertices on both sides of the plane, a vertex in the plane counting as above. So
// a facet that lies in the plane is shown once, by the cell below it; only when the plane is the lower face
// of the domain there is no such cell, and a second pass counts vertices in the plane as below.
#include "mesh/slice.h"

#include <array>
#include <iterator>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace lamina {
namespace {

constexpr std::size_t kGrain = 16384;

class Cutter {
 public:
  Cutter(const Mesh<3>& mesh, int axis, double offset, const std::vector<double>& scalar, bool plane_is_above)
      : mesh_(mesh),
        axis_(axis),
        u_(axis == 0 ? 1 : 0),
        v_(axis == 2 ? 1 : 2),
        offset_(offset),
        scalar_(scalar),
        plane_is_above_(plane_is_above) {}

  /// Appends the polygon of a cell to `to` if it has an area.
  void cut(Index cell, std::vector<SlicePolygon>& to) const {
    std::array<Index, 4> above, below;
    int n = 0, m = 0;
    for (const Index p : mesh_.cells[cell]) (is_above(p) ? above[n++] : below[m++]) = p;
    if (n == 0 || m == 0) return;
    SlicePolygon polygon;
    polygon.cell = cell;
    if (n == 2) {
      add(above[0], below[0], polygon);
      add(above[0], below[1], polygon);
      add(above[1], below[1], polygon);
      add(above[1], below[0], polygon);
    } else {
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) add(above[i], below[j], polygon);
    }
    if (polygon.corners.size() > 1 && polygon.corners.front() == polygon.corners.back()) {
      polygon.corners.pop_back();
      if (!polygon.phi.empty()) polygon.phi.pop_back();
    }
    if (polygon.corners.size() > 2) to.push_back(std::move(polygon));
  }

 private:
  [[nodiscard]] double height(Index p) const { return mesh_.points[p][axis_]; }
  [[nodiscard]] bool is_above(Index p) const {
    return plane_is_above_ ? height(p) >= offset_ : height(p) > offset_;
  }

  /// Adds where the edge meets the plane, unless it is the corner before. The same bits from every cell of
  /// the edge.
  void add(Index p, Index q, SlicePolygon& polygon) const {
    if (q < p) std::swap(p, q);
    const double a = height(p) - offset_, b = height(q) - offset_;
    const double t = b == 0.0 ? 1.0 : a / (a - b);
    const auto mix = [t](double x, double y) { return t == 1.0 ? y : x + t * (y - x); };
    const Vec3 &x = mesh_.points[p], &y = mesh_.points[q];
    const Vec2 corner(mix(x[u_], y[u_]), mix(x[v_], y[v_]));
    if (!polygon.corners.empty() && polygon.corners.back() == corner) return;
    polygon.corners.push_back(corner);
    if (!scalar_.empty()) polygon.phi.push_back(mix(scalar_[p], scalar_[q]));
  }

  const Mesh<3>& mesh_;
  int axis_, u_, v_;
  double offset_;
  const std::vector<double>& scalar_;
  bool plane_is_above_;
};

std::vector<SlicePolygon> cut_all(const Cutter& cutter, std::size_t cells) {
  std::vector<std::vector<SlicePolygon>> parts((cells + kGrain - 1) / kGrain);
  for_each_chunk(cells, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) cutter.cut(static_cast<Index>(i), parts[begin / kGrain]);
  });
  std::vector<SlicePolygon> all;
  for (auto& part : parts)
    all.insert(all.end(), std::make_move_iterator(part.begin()), std::make_move_iterator(part.end()));
  return all;
}

}  // namespace

std::vector<SlicePolygon> slice(const Mesh<3>& mesh, int axis, double offset,
                                const std::vector<double>& scalar) {
  if (axis < 0 || axis > 2)
    throw Error(ErrorCode::kParameter,
                "the axis of a slice is " + std::to_string(axis) + ", it must be 0, 1 or 2");
  if (!scalar.empty() && scalar.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, "a slice carries " + std::to_string(scalar.size()) + " values for " +
                                           std::to_string(mesh.points.size()) + " points");
  std::vector<SlicePolygon> polygons = cut_all(Cutter(mesh, axis, offset, scalar, true), mesh.cells.size());
  if (polygons.empty()) polygons = cut_all(Cutter(mesh, axis, offset, scalar, false), mesh.cells.size());
  return polygons;
}

}  // namespace lamina
