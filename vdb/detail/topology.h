// Neighbourhood of a triangle surface: edges, vertex stars, shells, and which edges and vertices are sharp.
//
// Convex and concave are seen from the fluid, the side the facet normals point to. A sharp edge has an
// exterior dihedral angle above the feature angle; a run of sharp edges is prolonged through edges above half
// that angle, so that a crease does not break where it softens. Milder edges are sharp where flat faces meet,
// see creases.h. Rims of open shells are convex with the angle
// pi; where more than two facets meet, the edge is convex when the widest gap between neighbouring facets
// exceeds a half turn.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "vdb/surface.h"

namespace lamina::detail {

enum class EdgeKind : std::uint8_t { kSmooth, kConvex, kConcave };

struct Edge {
  Index a = kNone, b = kNone;  ///< a < b
  Index begin = 0, count = 0;  ///< its half edges: Topology::half_edges[begin, begin + count)
  double angle = 0.0;          ///< exterior dihedral angle, radians, > 0 convex, in [-pi, pi]; pi on rims
  EdgeKind kind = EdgeKind::kSmooth;
  Index partner = kNone;  ///< of a rim that runs along another rim, an unwelded seam: the facet beyond it
  bool regular = false;   ///< shared by exactly two facets of the same orientation
};

/// What a vertex is for rays that end in it, seen from one side.
struct VertexKind {
  std::uint8_t edges = 0;  ///< number of sharp edges, at most 255
  bool corner = false;
};

struct Topology {
  std::vector<Vec3> normals;  ///< unit facet normals; zero for facets without area
  std::vector<double> areas;
  std::vector<Edge> edges;
  std::vector<Index> half_edges;                  ///< 4 * facet + local edge, grouped by edge
  std::vector<std::array<Index, 3>> facet_edges;  ///< edge k joins corners k and k + 1
  std::vector<Index> star_begin;  ///< corners at vertex v: star[star_begin[v], star_begin[v + 1])
  std::vector<Index> star;        ///< 4 * facet + corner
  std::vector<Index> shell;       ///< per facet; shells are joined through regular edges
  Index shells = 0;
  std::vector<VertexKind> convex, concave;    ///< per vertex
  std::int64_t sharp_edges = 0, corners = 0;  ///< convex ones

  [[nodiscard]] std::span<const Index> star_of(Index v) const {
    const std::size_t i = static_cast<std::size_t>(v);
    return {star.data() + star_begin[i], static_cast<std::size_t>(star_begin[i + 1] - star_begin[i])};
  }
  [[nodiscard]] std::span<const Index> half_edges_of(const Edge& e) const {
    return {half_edges.data() + e.begin, static_cast<std::size_t>(e.count)};
  }
};

/// `feature_angle` in radians.
Topology make_topology(const Surface& surface, double feature_angle);

/// Angle of triangle `facet` at corner `k`.
double corner_angle(const Surface& surface, Index facet, int k);

}  // namespace lamina::detail
