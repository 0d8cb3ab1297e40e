// Bodies with known answers: their triangles and, for the smooth ones, the exact frame of the wall they stand
// for.
#pragma once

#include <functional>
#include <optional>
#include <random>
#include <string>

#include "vdb/surface.h"

namespace lamina::targets {

/// What is known of the smooth wall at its point closest to q.
struct Truth {
  Vec3 N = Vec3::Zero();
  double k1 = 0.0, k2 = 0.0;  ///< convex > 0
  Vec3 T1 = Vec3::Zero();     ///< direction of k1; zero where k1 = k2 or nothing is known
};
/// Empty where q is on no part of the wall that is judged (caps, rims).
using TruthAt = std::function<std::optional<Truth>(const Vec3& q, const Vec3& facet_normal)>;

struct Body {
  std::string name;
  Surface surface;  ///< cleaned
  TruthAt truth;
};

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double uniform(double lo, double hi) {
    return lo + (hi - lo) * static_cast<double>(engine_() >> 11) * 0x1.0p-53;
  }
  Vec3 in(const Box<3>& box) {
    const double x = uniform(box.lo[0], box.hi[0]), y = uniform(box.lo[1], box.hi[1]);
    return {x, y, uniform(box.lo[2], box.hi[2])};
  }
  double gauss();

 private:
  std::mt19937_64 engine_;
};

/// Uniform over the area of a surface.
class WallSampler {
 public:
  WallSampler(const Surface& surface, std::uint64_t seed);
  struct Sample {
    Vec3 q, normal;  ///< a point inside a facet, and the facet's unit normal
    std::size_t facet;
  };
  Sample next();

 private:
  const Surface& surface_;
  std::vector<double> cumulative_;
  Dice dice_;
};

/// make_shape and clean.
Surface shape(const std::string& name, double facet = 0.0);
/// The sphere of make_shape with 20 n^2 facets.
Surface icosphere(int n);
/// That sphere with bumps of 8 %: r = 0.5 (1 + 0.08 sin 9x sin 11y sin 13z), of unit coordinates.
Surface lumpy(int n);
/// Closed cylinder of radius 0.3 along z, n strips of full length, caps as fans.
Surface strip_cylinder(int n);
Surface box(const Vec3& lo, const Vec3& hi);
/// Triangles of both; not cleaned.
Surface joined(const Surface& a, const Surface& b);
/// All triangles turned, scaled about the origin; not cleaned.
Surface turned(Surface s);
Surface scaled(Surface s, double factor);
Surface cleaned(Surface s);

inline constexpr double kMajor = 0.35, kMinor = 0.15;  // the torus of make_shape
double torus_distance(const Vec3& x);
Truth torus_truth(const Vec3& q);

Body sphere_body(int n);
Body cylinder_body(int n);
Body torus_body();
/// The torus with vertices moved along the normal by a Gaussian of 2 % of the mean edge, diagonals included.
Body noisy_torus_body();
Body ellipsoid_body();
/// Cube of edge 1 with edges rounded at radius 0.1.
Body round_cube_body();
Body naca_body();

/// Distance from q, on a plane face of the body, to the end of that face; < 0 where q is on none.
double ahmed_margin(const Vec3& q, const Vec3& facet_normal);
double round_cube_margin(const Vec3& q);
double cube_margin(const Vec3& q);

}  // namespace lamina::targets
