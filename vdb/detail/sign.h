// Inside or outside: the angle-weighted pseudonormal of the closest feature where the shells are closed and
// free of overlaps, the winding number elsewhere, always outside around open sheets.
#pragma once

#include <string>
#include <vector>

#include "vdb/detail/bvh.h"
#include "vdb/detail/topology.h"
#include "vdb/detail/winding.h"

namespace lamina::detail {

class SignRule {
 public:
  /// With `sheets` every open shell is a sheet, without it those that enclose nothing.
  SignRule(const Surface& surface, const Topology& topology, bool sheets = false);
  SignRule() = default;

  /// -1 when x, whose closest point is `hit`, lies inside the body, else +1.
  [[nodiscard]] double sign(const Surface& surface, const Topology& topology, const Vec3& x,
                            const TriangleHit& hit) const;
  /// The sign right in front of the closest point, as far as the wall is oriented there: where another shell
  /// holds the point the other shell is not asked. 0 at sheets and rims.
  [[nodiscard]] double side(const Surface& surface, const Topology& topology, const TriangleHit& hit) const;
  /// True for facets of a sheet: both sides of it are fluid.
  [[nodiscard]] bool two_sided(Index facet) const { return mode_[static_cast<std::size_t>(facet)] == kSheet; }
  [[nodiscard]] bool on_wall(Index facet) const {
    return mode_[static_cast<std::size_t>(facet)] != kSubmerged;
  }
  /// Every facet of the wall has fluid before it and the body behind it.
  [[nodiscard]] bool oriented() const { return oriented_; }
  /// Facets that bound the body: all but those wholly inside it.
  [[nodiscard]] const std::vector<Index>& wall() const { return wall_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  enum Mode : std::uint8_t { kPseudonormal, kNearby, kWinding, kSheet, kSubmerged };
  struct Closest {
    std::uint8_t mode;
    bool rim;
    Vec3 normal;
  };
  [[nodiscard]] Closest closest_feature(const Surface& surface, const Topology& topology,
                                        const TriangleHit& hit) const;
  void classify(const Surface& surface, const Topology& topology, const std::vector<std::uint8_t>& crossing,
                bool sheets);
  std::vector<std::uint8_t> find_sheets(const Surface& surface, const Topology& topology,
                                        const std::vector<std::uint8_t>& open) const;
  void find_nearby(const Surface& surface, const Topology& topology);
  void spread_modes(const Surface& surface, const Topology& topology);
  [[nodiscard]] double winding_sign(const Vec3& x) const;

  std::vector<std::uint8_t> mode_;          ///< per facet
  std::vector<double> nearby_;              ///< kNearby: squared distance from the centroid it is good for
  std::vector<std::uint8_t> edge_winding_;  ///< per edge: some facet of it needs the winding number
  std::vector<Vec3> vertex_normal_;         ///< angle weighted; zero where the winding number decides
  std::vector<std::uint8_t> vertex_mode_;
  std::vector<Index> wall_;
  Winding solid_;
  Box<3> solid_box_;
  bool oriented_ = true;
  std::string name_ = "pseudonormal";
  std::vector<std::string> warnings_;
};

/// 1 for every facet that properly crosses another one it shares no vertex with.
std::vector<std::uint8_t> crossing_facets(const Surface& surface);

/// Angle-weighted mean normal of the facets around v, not normalised.
Vec3 pseudonormal(const Surface& surface, const Topology& topology, Index v);

}  // namespace lamina::detail
