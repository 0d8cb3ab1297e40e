#include "vdb/detail/bends.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina::detail {
namespace {

constexpr double kFall = 4.0;     // ratio of curvatures within a facet that is a fall: sizes double
constexpr double kMildest = 1.0;  // curvature times diagonal below which no bend is worth a source

// Curvatures of the facets' corners, each by the shape that the facet uses there.
class Corners {
 public:
  explicit Corners(const Curvature& curvature) : curvature_(curvature) {
    for (const VertexShape& s : curvature.shapes)
      largest_.push_back(std::abs(principal_frame(s.normal, s.shape).k1));
  }

  [[nodiscard]] const VertexShape& shape(Index corner) const { return curvature_.shapes[id(corner)]; }
  [[nodiscard]] double largest(Index corner) const { return largest_[id(corner)]; }

  // Largest curvature along an edge as the facet of `half` sees it: that of its flatter end.
  [[nodiscard]] double along(Index half) const { return std::min(largest(half), largest(next(half))); }
  // Smallest curvature at the corners of the facet of `half`.
  [[nodiscard]] double flattest(Index half) const { return std::min(along(half), largest(next(next(half)))); }
  static Index next(Index corner) { return corner % 4 == 2 ? corner - 2 : corner + 1; }

 private:
  [[nodiscard]] std::size_t id(Index corner) const {
    return static_cast<std::size_t>(
        curvature_.corner_shapes[static_cast<std::size_t>(corner / 4)][static_cast<std::size_t>(corner % 4)]);
  }
  const Curvature& curvature_;
  std::vector<double> largest_;  // |k1| per shape
};

}  // namespace

Bends::Bends(const Surface& surface, const Topology& topology, const Curvature& curvature) {
  const Corners corners(curvature);
  const double least = kMildest / surface.bounds().diagonal();
  std::vector<std::array<Vec3, 2>> segments;
  std::vector<std::array<Index, 2>> ends;
  std::vector<std::uint8_t> covered(surface.points.size(), 0);
  const auto add = [&](Index a, Index b, const Vec3& normal, const Sym<3>& shape) {
    const Frame f = principal_frame(normal, shape);
    segments.push_back(
        {surface.points[static_cast<std::size_t>(a)], surface.points[static_cast<std::size_t>(b)]});
    ends.push_back({a, b});
    bends_.push_back({f.T1, f.k1, f.k2});
    covered[static_cast<std::size_t>(a)] = covered[static_cast<std::size_t>(b)] = 1;
  };
  for (const Edge& e : topology.edges) {
    if (e.kind != EdgeKind::kSmooth) continue;
    Index steep = kNone;
    double most = least, flattest = std::numeric_limits<double>::infinity();
    for (const Index half : topology.half_edges_of(e)) {
      flattest = std::min(flattest, corners.flattest(half));
      if (corners.along(half) <= most) continue;
      most = corners.along(half);
      steep = half;
    }
    if (steep == kNone || most < kFall * flattest) continue;
    const VertexShape &a = corners.shape(steep), &b = corners.shape(Corners::next(steep));
    Sym<3> mean;
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5 * (a.shape[i] + b.shape[i]);
    add(e.a, e.b, (a.normal + b.normal).normalized(), mean);
  }
  for (std::size_t v = 0; v < surface.points.size(); ++v) {
    if (covered[v]) continue;
    for (const Index corner : topology.star_of(static_cast<Index>(v))) {
      const double own = corners.largest(corner);
      if (own <= least || own < kFall * corners.flattest(corner)) continue;
      add(static_cast<Index>(v), static_cast<Index>(v), corners.shape(corner).normal,
          corners.shape(corner).shape);
      break;
    }
  }
  segments_ = SeededSegments(surface, segments);
  minima_ = SegmentMinima(surface.points, ends);
}

void Bends::describe(const Surface& surface, Index facet, WallPoint& wall) const {
  if (segments_.empty()) return;
  const SegmentHit hit = segments_.closest(surface, facet, wall.closest);
  const Bend& bend = bends_[static_cast<std::size_t>(hit.segment)];
  wall.bend_distance = std::sqrt(hit.d2);
  wall.bend_direction = bend.direction;
  wall.bend_k1 = bend.k1;
  wall.bend_k2 = bend.k2;
}

int Bends::beside(const WallPoint& wall, double reach, std::span<WallBend> out) const {
  std::size_t count = 0;
  minima_.visit(wall.closest, reach, [&](const SegmentHit& hit) {
    const Bend& bend = bends_[static_cast<std::size_t>(hit.segment)];
    const double distance = std::sqrt(hit.d2);
    if (distance <= wall.bend_distance && bend.k1 == wall.bend_k1 && bend.direction == wall.bend_direction)
      return;
    keep_nearest({distance, bend.direction, bend.k1, bend.k2}, out, count, reach);
  });
  return static_cast<int>(count);
}

}  // namespace lamina::detail
