// Facets are gathered to flat faces of two or more. The bent smooth edges around a face are looked through
// for one that goes on with the turn of another: of the same sign, roughly parallel, of similar angle, across
// the face from it and only some facets away.
#include "vdb/detail/creases.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"

namespace lamina::detail {
namespace {

constexpr double kMildest = 6.0 * std::numbers::pi / 180.0;  // radians; milder creases count as smooth
constexpr double kFlat = 1e-3;                               // radians; between facets of a flat face
constexpr double kDrift = 0.9999;  // cosine; between any facet of a flat face and its first
constexpr double kAlone = 2.5;     // ratio to the turn of the next edge that makes a crease
constexpr double kStrip = 5.0;     // facets across which a face may be a strip of a bend
constexpr double kAcross = 0.5;    // sine of the least angle under which the next edge is seen from an edge

const Vec3& point(const Surface& s, Index v) { return s.points[static_cast<std::size_t>(v)]; }

bool is_bent(const Edge& e) {
  return e.regular && e.kind == EdgeKind::kSmooth && std::abs(e.angle) >= kMildest / kAlone;
}

struct FlatFaces {
  std::vector<Index> of;                   // per facet
  std::vector<int> facets;                 // per face: their number
  std::vector<std::vector<Index>> around;  // per face: its bent smooth edges
};

FlatFaces find_faces(const Topology& topo) {
  FlatFaces faces;
  faces.of.assign(topo.normals.size(), kNone);
  std::vector<Index> stack;
  for (std::size_t seed = 0; seed < topo.normals.size(); ++seed) {
    if (faces.of[seed] != kNone) continue;
    const auto face = static_cast<Index>(faces.facets.size());
    faces.facets.push_back(0);
    faces.of[seed] = face;
    stack.push_back(static_cast<Index>(seed));
    while (!stack.empty()) {
      const Index facet = stack.back();
      stack.pop_back();
      ++faces.facets.back();
      for (const Index id : topo.facet_edges[static_cast<std::size_t>(facet)]) {
        const Edge& e = topo.edges[static_cast<std::size_t>(id)];
        if (!e.regular || std::abs(e.angle) >= kFlat) continue;
        for (const Index h : topo.half_edges_of(e)) {
          const auto other = static_cast<std::size_t>(h / 4);
          if (faces.of[other] != kNone || topo.normals[other].dot(topo.normals[seed]) < kDrift) continue;
          faces.of[other] = face;
          stack.push_back(h / 4);
        }
      }
    }
  }
  faces.around.resize(faces.facets.size());
  for (std::size_t i = 0; i < topo.edges.size(); ++i) {
    if (!is_bent(topo.edges[i])) continue;
    for (const Index h : topo.half_edges_of(topo.edges[i]))
      faces.around[static_cast<std::size_t>(faces.of[static_cast<std::size_t>(h / 4)])].push_back(
          static_cast<Index>(i));
  }
  return faces;
}

// Does another edge of the face of a half edge go on with the turn of its edge?
bool goes_on(const Surface& s, const Topology& topo, const FlatFaces& faces, const Edge& e, Index half) {
  const Vec3 &a = point(s, e.a), &b = point(s, e.b);
  const Vec3 along = (b - a).normalized(), middle = 0.5 * (a + b);
  const auto facet = static_cast<std::size_t>(half / 4);
  Vec3 inward = point(s, s.triangles[facet][static_cast<std::size_t>((half % 4 + 2) % 3)]) - a;
  inward -= inward.dot(along) * along;
  const double altitude = inward.norm();
  if (!(altitude > 0.0)) return true;
  inward /= altitude;
  const std::vector<Index>& around = faces.around[static_cast<std::size_t>(faces.of[facet])];
  return std::any_of(around.begin(), around.end(), [&](Index id) {
    const Edge& next = topo.edges[static_cast<std::size_t>(id)];
    const Vec3& c = point(s, next.a);
    const Vec3 way = point(s, next.b) - c;
    const double length = way.norm();
    if (next.angle * e.angle <= 0.0 ||
        kAlone * std::abs(next.angle * along.dot(way)) < std::abs(e.angle) * length)
      return false;
    const double t = std::clamp((middle - c).dot(way) / (length * length), 0.0, 1.0);
    const Vec3 to = c + t * way - middle;
    const double across = to.dot(inward);
    return across > kAcross * to.norm() && across < kStrip * altitude;
  });
}

bool is_crease(const Surface& s, const Topology& topo, const FlatFaces& faces, const Edge& e) {
  if (!is_bent(e) || std::abs(e.angle) < kMildest) return false;
  const std::span<const Index> half = topo.half_edges_of(e);
  return std::all_of(half.begin(), half.end(), [&](Index h) {
    return faces.facets[static_cast<std::size_t>(faces.of[static_cast<std::size_t>(h / 4)])] > 1 &&
           !goes_on(s, topo, faces, e, h);
  });
}

}  // namespace

void mark_creases(const Surface& surface, Topology& topology) {
  const FlatFaces faces = find_faces(topology);
  std::vector<std::uint8_t> crease(topology.edges.size());
  for_each_index(crease.size(), [&](std::size_t i) {
    crease[i] = is_crease(surface, topology, faces, topology.edges[i]) ? 1 : 0;
  });
  for (std::size_t i = 0; i < crease.size(); ++i) {
    Edge& e = topology.edges[i];
    if (crease[i] != 0) e.kind = e.angle > 0.0 ? EdgeKind::kConvex : EdgeKind::kConcave;
  }
}

}  // namespace lamina::detail
