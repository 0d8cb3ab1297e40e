// The boundary-layer metric of an immersed body [Billon2016, sections 3 and 4], evaluated directly at any
// point.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/boundary_layer.h"
#include "core/field.h"
#include "core/level.h"

namespace lamina {

enum class Profile { kLayered, kContinuous };
/// Size that a chord along a curved wall is measured by [eq. 29].
enum class Chord {
  kLocal,  ///< the normal size at the point
  kWall,   ///< h_min, at every height
};
enum class Region : int { kInside = 0, kLayer = 1, kBox2 = 2, kBox1 = 3 };

/// A box that no element larger than `size` may lie in.
struct SizedBox {
  std::string name;
  Box<3> box;
  double size = 0.0;
};

/// Faces of the domain, in the order of SizeOptions::walls.
inline constexpr std::array<const char*, 6> kFaceNames = {"x-", "x+", "y-", "y+", "z-", "z+"};

/// A face of the domain.
struct DomainFace {
  int axis;
  double plane;   ///< where it lies along the axis
  double inward;  ///< direction into the domain along the axis, 1 or -1
};
/// By its index in kFaceNames.
DomainFace domain_face(const Box<3>& domain, std::size_t face);

/// Sizes outside the boundary layer. Lengths in world units.
struct SizeOptions {
  double h2 = 0.0;  ///< largest size in Box2, > h_min
  double h1 = 0.0;  ///< largest size at the border of the domain (Box1), >= h2
  Box<3> domain, box2;
  std::optional<Box<3>> box1;  ///< where sizes have grown to h1; none: at the border of the domain
  Profile profile = Profile::kLayered;
  double growth_inside = 2.0;    ///< growth per layer inside the body below the mirrored layers, in (1, 4]
  int mirrored_layers = 3;       ///< layers repeated on the inside
  double corner_elements = 3.0;  ///< elements per 90 degrees of the fan around a sharp edge, in [1, 16]
  double edge_growth = 2.0;  ///< ratio of sizes per element along the wall, away from a sharp edge or from
                             ///< where two walls are equally near, in (1, 4]
  Chord chord = Chord::kLocal;
  std::vector<SizedBox> boxes;  ///< their sizes grow by `gradation` outside of them
  std::array<bool, 6> walls{};  ///< faces of the domain that carry layers too, the ground of a channel
  double gradation = 1.5;  ///< bound on the ratio of sizes per element beyond the layers, in (1, 4]; 0 = off
};

/// Sizes along N, T1, T2 of a wall point, before walls are intersected.
struct WallSizes {
  double hn = 0.0, ht1 = 0.0, ht2 = 0.0;
};

/// The whole metric at a point with its ingredients, for files, pictures and reports.
struct WallSample : WallSizes {
  WallPoint wall;
  Region region = Region::kBox1;
  Metric<3> metric;
};

class WallMetric : public MetricField<3> {
 public:
  /// No size in any direction exceeds those of `painted`, which spread by SizeOptions::gradation, or that of
  /// `user`, where there is one. REQUIRES wall, painted and user to outlive this. Errors: kParameter /
  /// kDomain naming the field and the inequality broken.
  WallMetric(const WallField& wall, const BoundaryLayer& layer, const SizeOptions& sizes,
             std::vector<const SizeField*> painted = {}, const MetricField<3>* user = nullptr);

  [[nodiscard]] Metric<3> at(const Vec3& x) const override { return at_coarsened(x, 0.0); }
  /// The same metric with every size below `floor` raised to it: one step of the way from the seed's size to
  /// h_min.
  [[nodiscard]] Metric<3> at_coarsened(const Vec3& x, double floor) const;
  /// The level nearest to x in the layers, mirrored ones included; none beyond them, where layers are thinner
  /// than `floor`, and where other sizes than those of the layers rule.
  [[nodiscard]] std::optional<Level<3>> level(const Vec3& x, double floor) const;
  [[nodiscard]] WallSample sample(const Vec3& x) const { return sample(x, wall_->at(x)); }
  /// The same where the wall point of x is known.
  [[nodiscard]] WallSample sample(const Vec3& x, const WallPoint& wall) const;
  /// Its sizes alone, for much less.
  [[nodiscard]] WallSizes sizes_at(const Vec3& x, const WallPoint& wall) const {
    return wall_sizes(x, wall, bounds_at(x));
  }
  [[nodiscard]] Region region(const Vec3& x, double phi) const;
  /// Normal size at signed distance phi, x being used for the distances to the boxes only.
  [[nodiscard]] double normal_size(const Vec3& x, double phi) const;

  [[nodiscard]] const BoundaryLayer& layer() const { return layer_; }
  [[nodiscard]] const SizeOptions& sizes() const { return sizes_; }
  [[nodiscard]] const WallField& wall() const { return *wall_; }

 private:
  /// What bounds the sizes at a place whatever the wall.
  struct Bounds {
    double far;      ///< far_size()
    double painted;  ///< by painted sizes and boxes
  };
  [[nodiscard]] Bounds bounds_at(const Vec3& x) const;
  [[nodiscard]] double normal_size(const Vec3& x, double phi, double far) const;
  [[nodiscard]] double layer_size(double height) const;
  [[nodiscard]] double inside_size(double depth) const;
  [[nodiscard]] double hasty(double depth) const;
  [[nodiscard]] double far_size(const Vec3& x) const;
  [[nodiscard]] double corner_size(double hn, double phi) const;
  [[nodiscard]] double tangential_size(double curvature, double graded, double hn, double phi,
                                       double largest) const;
  [[nodiscard]] double chord_stray(double hn, double phi) const;
  [[nodiscard]] WallSizes wall_sizes(const Vec3& x, const WallPoint& wall, const Bounds& bounds) const;
  struct Walls {
    std::array<WallPoint, 7> points;  // the nearest first
    std::size_t count = 0;
    bool on_face = false;  // the nearest is a face of the domain
  };
  [[nodiscard]] Walls list_walls(const Vec3& x, const WallPoint& body) const;
  [[nodiscard]] WallPoint face_wall(const Vec3& x, std::size_t face) const;
  struct Bounded {
    Metric<3> metric;
    double least, widest;  // no size along the wall is smaller, none at all larger
  };
  [[nodiscard]] std::optional<Bounded> bend_metric(const WallPoint& wall, const WallBend& bend,
                                                   const WallSizes& sizes, double floor) const;
  [[nodiscard]] std::optional<Bounded> edge_metric(const WallPoint& wall, const WallEdge& edge,
                                                   const WallSizes& sizes, double floor) const;
  [[nodiscard]] Bounded wall_metric(const WallPoint& wall, const WallSizes& sizes, double floor,
                                    double widest) const;
  [[nodiscard]] Metric<3> metric(const Vec3& x, const WallPoint& body, double floor) const;
  [[nodiscard]] Metric<3> walls_metric(const Vec3& x, const WallPoint& body, double floor) const;
  [[nodiscard]] Metric<3> metric(const Vec3& x, const WallPoint& body, const WallPoint& main,
                                 std::span<const WallPoint> beside, double floor) const;
  [[nodiscard]] double reach(const Vec3& x, double size) const;

  const WallField* wall_;
  BoundaryLayer layer_;
  SizeOptions sizes_;
  std::vector<const SizeField*> painted_;
  const MetricField<3>* user_;
  Box<3> box1_;         ///< without walls of the domain: those sides are infinitely far
  double start_ = 0.0;  ///< normal size at the top of the layers
  bool has_walls_ = false;
  double rate_;         ///< growth of sizes per unit of length that keeps to SizeOptions::gradation
  double edge_rate_;    ///< growth per unit of length that makes a ratio of edge_growth per element
  double inside_rate_;  ///< the same of growth_inside
};

}  // namespace lamina
