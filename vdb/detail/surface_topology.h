// Topology of a triangle surface: welding, edges, shells and their orientation. Private to clean().
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vdb/surface.h"

namespace lamina::detail {

/// Half-edge h = 3 t + k runs from corner k of triangle t to corner (k + 1) mod 3.
inline Index triangle_of(Index h) { return h / 3; }
inline Index next_in_triangle(Index h) { return h % 3 == 2 ? h - 2 : h + 1; }

inline constexpr Index kOpen = -1;         ///< opposite() of a half-edge whose edge has no other triangle
inline constexpr Index kNonManifold = -2;  ///< ... more than one other triangle

struct Welded {
  std::int64_t dropped = 0;         ///< triangles
  std::int64_t merged = 0;          ///< points used by a triangle that became one with another
  std::int64_t negative_zeros = 0;  ///< coordinates of points used by a triangle
};

/// Drops triangles with a coordinate that is not finite (or beyond 1e100, where squares overflow), welds
/// bit-equal points (-0.0 equals 0.0) and numbers points by first use.
Welded weld(Surface& surface);

/// Repairs triangles without area whose middle corner lies on the opposite edge (a T-junction closed by a
/// sliver): the triangle across that edge is cut at the corner instead, so that dropping the sliver opens no
/// crack. Returns how many were repaired.
std::int64_t cut_at_slivers(Surface& surface);

/// Drops triangles with repeated points or an area below 1e-12 of their longest edge squared.
std::int64_t drop_degenerate(Surface& surface);

struct Duplicates {
  std::int64_t copies = 0;  ///< dropped because another triangle has the same corners
  std::int64_t walls = 0;   ///< dropped besides: the first of each pair between two touching solids
};

/// Of triangles over the same three points, keeps the first; a patch of pairs of opposite orientation that is
/// bordered all round by other triangles is the wall between two touching solids and goes altogether.
Duplicates drop_duplicates(Surface& surface);

/// Numbers points by first use and removes those without a triangle.
void number_points(Surface& surface);

/// Triangles around each edge.
struct EdgeTable {
  explicit EdgeTable(const Surface& surface);

  /// Half-edges sorted by edge: those of one edge lie side by side in [first[e], first[e + 1]).
  std::vector<Index> half_edges;
  std::vector<std::int64_t> first;
  /// Per half-edge: the other one of its edge, kOpen or kNonManifold.
  std::vector<Index> opposite;

  [[nodiscard]] std::size_t size() const { return first.size() - 1; }
  [[nodiscard]] std::int64_t count(std::size_t e) const { return first[e + 1] - first[e]; }
};

/// Edge-connected components, joined across edges of any number of triangles: shell of each triangle,
/// numbered by first triangle. Returns their number.
Index find_shells(const Surface& surface, const EdgeTable& edges, std::vector<Index>& shell);

struct Turned {
  std::int64_t triangles = 0;
  std::int64_t whole = 0, mixed = 0;  ///< shells all of whose triangles were turned, and only some
  std::int64_t in_mixed = 0;          ///< of the triangles, those in shells turned in part
};

/// Orients the triangles: consistently across manifold edges, closed shells outward, cavities inward (see
/// surface_orient.cpp). The edge table must be built anew afterwards.
Turned orient(Surface& surface, const EdgeTable& edges);

}  // namespace lamina::detail
