// Where the level set and the mesh meet: what is known of the wall near a point, and the metric at a point.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "core/metric.h"
#include "core/types.h"

namespace lamina {

/// The kind of surface element that holds the closest point.
enum class WallFeature : std::uint8_t { kFace, kEdge, kCorner };

/// What the level set knows of the wall, seen from a point x. Curvatures and frame belong to the closest
/// surface point, so that all points of a wall-normal ray share them.
struct WallPoint {
  double phi = std::numeric_limits<double>::infinity();  ///< signed distance, < 0 inside the body
  Vec3 closest = Vec3::Zero();                           ///< closest point of the wall
  Vec3 N = Vec3::UnitZ();  ///< unit normal into the fluid: smoothed surface normal on faces; on the rays of a
                           ///< sharp edge or corner the direction of the ray, oriented into the fluid
  Vec3 T1 =
      Vec3::UnitX();  ///< principal direction of k1; N, T1, T2 orthonormal. On an edge ray: across the edge
  Vec3 T2 = Vec3::UnitY();  ///< principal direction of k2. On an edge ray: along the edge
  double k1 = 0.0;  ///< principal curvatures of the wall, 1/length, > 0 convex (body bulges to the fluid),
  double k2 = 0.0;  ///< |k1| >= |k2|; 0 where flat; across a sharp edge infinity
  WallFeature feature = WallFeature::kFace;
  /// From `closest` to the nearest sharp edge or corner of the wall, convex or concave: near both the frame
  /// turns within one element.
  double edge_distance = std::numeric_limits<double>::infinity();
  Vec3 edge_direction =
      Vec3::Zero();             ///< unit tangent of that edge; zero where it is a corner or there is none
  double edge_curvature = 0.0;  ///< of the curve through `closest` that runs beside the curve of this edge,
                                ///< 1/length, >= 0, infinity in its centre
  double edge_angle = 0.0;  ///< exterior dihedral angle of that edge, radians in (0, pi]; a sheet's rim: pi
  double corner_distance = std::numeric_limits<double>::infinity();  ///< the same, to the nearest corner
  /// From `closest` to the nearest place where curvature falls too fast for sizes to follow, the border of a
  /// fillet: there sizes start at those of its curvatures and grow with this distance.
  double bend_distance = std::numeric_limits<double>::infinity();
  Vec3 bend_direction = Vec3::Zero();   ///< unit principal direction of bend_k1 there
  double bend_k1 = 0.0, bend_k2 = 0.0;  ///< |bend_k1| >= |bend_k2|
  /// How far k1, k2, T1 and T2 can be relied on, in [0, 1]: 1 where the wall is smooth and resolved, 1/2
  /// where its normal turns by half a radian per facet (or voxel) or where curvature differs by 10 % from one
  /// vertex to the next, 0 on the rays of sharp edges and corners.
  double reliability = 1.0;
  /// Where `closest` lies in the wall's own terms: barycentric coordinates on a facet, or kNone.
  Index facet = kNone;
  std::array<double, 3> bary{};
};

/// A sharp edge beside a point of the wall.
struct WallEdge {
  double distance = 0.0;
  Vec3 direction = Vec3::Zero();  ///< as WallPoint::edge_direction, and so on
  double curvature = 0.0, angle = 0.0;
};

/// A bend beside a point of the wall.
struct WallBend {
  double distance = 0.0;
  Vec3 direction = Vec3::Zero();
  double k1 = 0.0, k2 = 0.0;
};

/// The wall of an immersed body. Thread safe.
class WallField {
 public:
  virtual ~WallField() = default;
  /// Everything about x. Exact where the wall is a triangle surface.
  [[nodiscard]] virtual WallPoint at(const Vec3& x) const = 0;
  /// at(x) where the side of the wall is known: `sign` of phi, 1 or -1. Cheaper where sides are hard to tell.
  [[nodiscard]] virtual WallPoint at_side(const Vec3& x, double /*sign*/) const { return at(x); }
  /// Signed distance alone, the same bits as at(x).phi.
  [[nodiscard]] virtual double phi(const Vec3& x) const = 0;
  /// Unsigned distance, too large by at most the factor 1 + eps: far away much cheaper than phi().
  [[nodiscard]] virtual double distance(const Vec3& x, double /*eps*/) const { return std::abs(phi(x)); }
  /// Other walls seen from x: closest points of wall patches, other than the closest one, that are local
  /// minima of the distance, no farther than `reach`, and whose direction from x differs by more than 10
  /// degrees from the closest one's and from each other's; nearest first, at most out.size(). Returns how
  /// many were written.
  virtual int others(const Vec3& x, const WallPoint& nearest, double reach,
                     std::span<WallPoint> out) const = 0;
  /// Sharp edges beside the closest point of `wall`, other than the nearest: where the distance along the
  /// curves of the edges has local minima no larger than `reach`, except at corners; the nearest first, at
  /// most out.size(). A minimum that is about to vanish, near the centre of a curve, counts as farther than
  /// it is. Returns how many were written.
  virtual int edges_beside(const WallPoint& /*wall*/, double /*reach*/, std::span<WallEdge> /*out*/) const {
    return 0;
  }
  /// The same for bends.
  virtual int bends_beside(const WallPoint& /*wall*/, double /*reach*/, std::span<WallBend> /*out*/) const {
    return 0;
  }
  /// Magnitudes that stand for k1 and k2 of `wall` where sizes must not grow too fast, 1/length: sqrt(1 / k)
  /// grows along a smooth wall by at most the distance over `root`, in sqrt(length).
  [[nodiscard]] virtual std::array<double, 2> graded_curvatures(const WallPoint& wall,
                                                                double /*root*/) const {
    return {std::abs(wall.k1), std::abs(wall.k2)};
  }
  /// Bounds of the wall.
  [[nodiscard]] virtual Box<3> bounds() const = 0;
};

/// Sizes painted by a user: upper bounds of the element size. Thread safe.
class SizeField {
 public:
  virtual ~SizeField() = default;
  /// The least of `limit` and of size(y) + rate |x - y| over all painted points y; lengths in world units.
  [[nodiscard]] virtual double bound(const Vec3& x, double rate, double limit) const = 0;
};

/// A metric that can be evaluated at any point of the domain. Thread safe.
template <int D>
class MetricField {
 public:
  virtual ~MetricField() = default;
  [[nodiscard]] virtual Metric<D> at(const Vec<D>& x) const = 0;
};

}  // namespace lamina
