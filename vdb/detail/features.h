// Sharp edges and corners of a wall: what a point on the wall needs to know of the nearest ones.
#pragma once

#include <vector>

#include "core/field.h"
#include "vdb/detail/seeded_segments.h"
#include "vdb/detail/segment_minima.h"
#include "vdb/detail/sign.h"
#include "vdb/detail/topology.h"

namespace lamina::detail {

/// A sharp edge as a piece of a curve.
struct EdgePoint {
  Vec3 tangent = Vec3::Zero();    ///< unit, interpolated along the curve
  Vec3 curvature = Vec3::Zero();  ///< curvature vector of the curve, 1/length, towards its centre
  double angle = 0.0;             ///< exterior dihedral angle, in (0, pi]
};

class Features {
 public:
  Features(const Surface& surface, const Topology& topology, const SignRule& sign);
  Features() = default;

  /// Fills edge_distance, edge_direction, edge_angle and corner_distance of `wall`, whose closest point lies
  /// on `facet`.
  void describe(const Surface& surface, Index facet, WallPoint& wall) const;
  /// As WallField::edges_beside().
  int beside(const Surface& surface, const WallPoint& wall, double reach, std::span<WallEdge> out) const;
  /// Sharp edge `edge` at position t in [0, 1] from its a to its b.
  [[nodiscard]] EdgePoint on_edge(const Surface& surface, const Topology& topology, Index edge,
                                  double t) const;
  /// Distance from x to the nearest sharp edge, convex or concave, or `limit` when it is farther.
  [[nodiscard]] double sharp_distance(const Vec3& x, double limit) const;

 private:
  struct Segment {
    Index a, b;
    double angle;
  };
  void gather(const Surface& surface, const Topology& topology, const SignRule& sign);
  void measure_curves(const Surface& surface, const Topology& topology);
  /// 1 - d / R where a curve of radius R lies at a distance d, around `at`: 0 where `at` is its centre.
  [[nodiscard]] double widening_at(const Surface& surface, const SegmentHit& hit, const Vec3& at,
                                   double& curvature) const;
  [[nodiscard]] Vec3 curvature_at(Index a, Index b, double t) const;
  [[nodiscard]] Vec3 tangent_at(const Surface& surface, Index a, Index b, double t) const;

  std::vector<Segment> segments_;
  SeededSegments edges_, corners_;
  SegmentMinima minima_;
  std::vector<std::uint8_t> is_corner_;    ///< per vertex, of either kind
  std::vector<Vec3> tangent_, curvature_;  ///< per vertex of a sharp curve; zero at corners
};

}  // namespace lamina::detail
