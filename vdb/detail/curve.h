// Curves of an outline as arcs: cubic polynomials of little turning, or straight lines.
//
// A smooth curve is a cubic spline in the length of the chords between its points, twice continuously
// differentiable, with third derivatives that agree at the points next to an end (not-a-knot); it is cut at
// its corners. A curve that is not smooth keeps its chords; their normals and curvatures are those of the
// round wall they stand for, as with facets: they are interpolated along each chord.
#pragma once

#include <array>
#include <vector>

#include "vdb/outline.h"

namespace lamina::detail {

inline double cross(const Vec2& a, const Vec2& b) { return a[0] * b[1] - a[1] * b[0]; }

/// Tangent and curvature of a curve, > 0 where it turns left.
struct Bend2 {
  Vec2 tangent = Vec2::UnitX();
  double curvature = 0.0;
};

/// p(u) = c0 + u (c1 + u (c2 + u c3)), u in [0, 1].
struct Arc {
  std::array<Vec2, 4> c{Vec2::Zero(), Vec2::Zero(), Vec2::Zero(), Vec2::Zero()};
  bool straight = true;
  std::array<Bend2, 2> ends;  ///< where the arc is straight: of the wall that it stands for

  [[nodiscard]] Vec2 at(double u) const { return c[0] + u * (c[1] + u * (c[2] + u * c[3])); }
  [[nodiscard]] Vec2 slope(double u) const { return c[1] + u * (2.0 * c[2] + 3.0 * u * c[3]); }
  [[nodiscard]] Vec2 second(double u) const { return 2.0 * c[2] + 6.0 * u * c[3]; }
  [[nodiscard]] Bend2 bend(double u) const;
  /// The exact bounds.
  [[nodiscard]] Box<2> bounds() const;
};

/// Closest point of an arc: u is 0 or 1 exactly where it is an end.
struct ArcPoint {
  double d2 = 0.0, u = 0.0;
  Vec2 point = Vec2::Zero(), offset = Vec2::Zero();  ///< offset: x - point
};

/// Newton's method on the derivative of the distance, kept within the arc. An arc turns so little that its
/// distance has one minimum from anywhere but near its centre of curvature, where any of them is as good.
ArcPoint closest_on(const Arc& arc, const Vec2& x);
/// The same where the distance has its minimum inside the arc; false where it has it at an end.
bool interior_minimum(const Arc& arc, const Vec2& x, ArcPoint& out);

/// The start of arc i of a path; of an open path also the end of its last.
struct Joint {
  double turn = 0.0;    ///< radians, > 0 to the left; at the ends of an open path pi
  bool corner = false;  ///< sharp
};

struct Path {
  std::vector<Arc> arcs;
  std::vector<Joint> joints;  ///< one per arc, and one more where the path is open
  bool closed = true;

  [[nodiscard]] std::size_t next_joint(std::size_t arc) const {
    return closed && arc + 1 == arcs.size() ? 0 : arc + 1;
  }
};

/// REQUIRES a cleaned outline. `feature_angle` in radians: chords that turn by more meet in a corner; points
/// of a smooth curve do where they turn by more than that and than their neighbours, or by 75 degrees.
std::vector<Path> make_paths(const Outline& outline, double feature_angle);

/// Throws kSurfaceInvalid where arcs cross or touch that do not follow each other, naming the place.
void require_apart(const std::vector<Path>& paths, const std::string& name);

}  // namespace lamina::detail
