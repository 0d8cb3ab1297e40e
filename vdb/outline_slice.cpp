// Corners on the plane count as above it, so that each facet is cut in one segment between two of its edges,
// or not at all; segments that share an edge follow each other.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/error.h"
#include "vdb/outline.h"

namespace lamina {
namespace {

using EdgeKey = std::pair<Index, Index>;

/// Cut edges and the two segments at each; kNone where there is one.
struct Cuts {
  std::vector<Vec2> points;
  std::vector<std::array<Index, 2>> neighbors;  ///< points that a segment joins it with
};

class Cutter {
 public:
  Cutter(const Surface& surface, int axis, double offset, const std::string& name)
      : surface_(surface), axis_(axis), offset_(offset), name_(name) {
    for (const auto& t : surface.triangles) add(t);
  }
  [[nodiscard]] const Cuts& cuts() const { return cuts_; }

 private:
  [[nodiscard]] double height(Index v) const {
    return surface_.points[static_cast<std::size_t>(v)][axis_] - offset_;
  }

  Index point_on(Index a, Index b) {
    const EdgeKey key = std::minmax(a, b);
    const auto [entry, is_new] = known_.emplace(key, static_cast<Index>(cuts_.points.size()));
    if (is_new) {
      const Vec3 &p = surface_.points[static_cast<std::size_t>(key.first)],
                 &q = surface_.points[static_cast<std::size_t>(key.second)];
      const double hp = height(key.first), hq = height(key.second);
      const Vec3 x = p + hp / (hp - hq) * (q - p);
      cuts_.points.emplace_back(x[axis_ == 0 ? 1 : 0], x[axis_ == 2 ? 1 : 2]);
      cuts_.neighbors.push_back({kNone, kNone});
    }
    return entry->second;
  }

  void join(Index a, Index b) {
    auto& n = cuts_.neighbors[static_cast<std::size_t>(a)];
    if (n[1] != kNone) {
      const Vec2& x = cuts_.points[static_cast<std::size_t>(a)];
      throw Error(ErrorCode::kSurfaceInvalid,
                  fmt::format("{}: more than two facets meet at ({:g}, {:g}) of the section: move the plane, "
                              "or mend the surface",
                              name_, x[0], x[1]));
    }
    n[n[0] == kNone ? 0 : 1] = b;
  }

  void add(const std::array<Index, 3>& t) {
    std::array<Index, 2> ends{};
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      if ((height(a) >= 0.0) != (height(b) >= 0.0) && count < 2) ends[count++] = point_on(a, b);
    }
    if (count < 2) return;
    join(ends[0], ends[1]);
    join(ends[1], ends[0]);
  }

  const Surface& surface_;
  int axis_;
  double offset_;
  const std::string& name_;
  std::map<EdgeKey, Index> known_;
  Cuts cuts_;
};

/// Follows the segments from a point; marks what it passes.
OutlineCurve follow(const Cuts& cuts, Index start, std::vector<std::uint8_t>& seen) {
  OutlineCurve curve{.points = {}, .closed = false, .smooth = false};
  Index before = kNone, at = start;
  while (at != kNone && seen[static_cast<std::size_t>(at)] == 0) {
    seen[static_cast<std::size_t>(at)] = 1;
    curve.points.push_back(cuts.points[static_cast<std::size_t>(at)]);
    const auto& n = cuts.neighbors[static_cast<std::size_t>(at)];
    const Index next = n[0] != before ? n[0] : n[1];
    before = at;
    at = next;
  }
  curve.closed = at == start && curve.points.size() > 2;
  return curve;
}

}  // namespace

Outline slice(const Surface& surface, int axis, double offset, const std::string& name) {
  const Cutter cutter(surface, axis, offset, name);
  const Cuts& cuts = cutter.cuts();
  if (cuts.points.empty()) {
    const Box<3> b = surface.bounds();
    throw Error(ErrorCode::kDomain,
                fmt::format("--slice {}={:g} misses the body {}, which reaches from {:g} to {:g}",
                            "xyz"[axis], offset, name, b.lo[axis], b.hi[axis]));
  }
  Outline outline;
  std::vector<std::uint8_t> seen(cuts.points.size(), 0);
  const auto collect = [&](bool ends_only) {
    for (std::size_t i = 0; i < cuts.points.size(); ++i)
      if (seen[i] == 0 && (!ends_only || cuts.neighbors[i][1] == kNone))
        outline.curves.push_back(follow(cuts, static_cast<Index>(i), seen));
  };
  collect(true);
  collect(false);
  return outline;
}

}  // namespace lamina
