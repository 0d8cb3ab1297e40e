// clean() in order: weld, cut neighbours at slivers, drop degenerate and duplicate triangles, orient, tell
// the repairs, measure, warn.
#include "vdb/surface.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/words.h"
#include "vdb/detail/surface_topology.h"

namespace lamina {
namespace {

using detail::EdgeTable;
using detail::triangle_of;

/// Edges with a larger dihedral angle are sharp by intent, not chords of a round wall.
constexpr double kSmoothAngle = 40.0 * M_PI / 180.0;

/// Half-edges are numbered 3 t + k.
constexpr std::int64_t kMostTriangles = std::numeric_limits<Index>::max() / 3;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::string text(const Vec3& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]); }

Vec3 area_vector(const Surface& surface, Index t) {
  const auto& v = surface.triangles[at(t)];
  const Vec3& a = surface.points[at(v[0])];
  return 0.5 * (surface.points[at(v[1])] - a).cross(surface.points[at(v[2])] - a);
}

/// What the edges of a surface show, with one place for each kind of flaw.
struct EdgeFindings {
  double open_length = 0.0;
  Vec3 open_at = Vec3::Zero();
  Vec3 nonmanifold_at = Vec3::Zero();
};

/// How far the chord over the edge h of facet width e misses a round wall: e theta / 8; 0 for sharp edges.
double sag(const Surface& surface, Index h, Index opposite, double length) {
  const Vec3 a = area_vector(surface, triangle_of(h)), b = area_vector(surface, triangle_of(opposite));
  const double theta = std::atan2(a.cross(b).norm(), a.dot(b));
  const double width = 2.0 * std::min(a.norm(), b.norm()) / length;
  return theta < kSmoothAngle ? width * theta / 8.0 : 0.0;
}

EdgeFindings examine_edges(const Surface& surface, const EdgeTable& edges, SurfaceReport& report) {
  EdgeFindings findings;
  report.shortest_edge = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Index h = edges.half_edges[static_cast<std::size_t>(edges.first[e])];
    const auto& v = surface.triangles[at(triangle_of(h))];
    const Index ia = v[at(h % 3)], ib = v[at((h + 1) % 3)];
    const Vec3& a = surface.points[at(ia)];
    const Vec3& b = surface.points[at(ib)];
    const double length = (b - a).norm();
    report.shortest_edge = std::min(report.shortest_edge, length);
    report.longest_edge = std::max(report.longest_edge, length);
    const Index other = edges.opposite[at(h)];
    if (other == detail::kOpen) {
      if (report.open_edges++ == 0) findings.open_at = 0.5 * (a + b);
      findings.open_length += length;
    } else if (other == detail::kNonManifold) {
      if (report.nonmanifold_edges++ == 0) findings.nonmanifold_at = 0.5 * (a + b);
    } else if (surface.triangles[at(triangle_of(other))][at(other % 3)] == ia) {
      ++report.misoriented_edges;  // both run the same way
    } else {
      report.facet_sag = std::max(report.facet_sag, sag(surface, h, other, length));
    }
  }
  return findings;
}

void examine_triangles(const Surface& surface, SurfaceReport& report) {
  const Vec3 centre = surface.bounds().center();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3 area = area_vector(surface, static_cast<Index>(t));
    report.area += area.norm();
    report.volume += area.dot(surface.points[at(surface.triangles[t][0])] - centre) / 3.0;
  }
  if (report.open_edges > 0) report.volume = 0.0;
}

void warn_of_size(const Surface& surface, const std::string& name, SurfaceReport& report) {
  const Box<3> box = surface.bounds();
  const double extent = box.size().maxCoeff();
  if (extent > 1e6)
    report.warnings.push_back(fmt::format("{}: huge: longest extent {:.4g}; check the unit", name, extent));
  else if (extent > 100.0)
    report.warnings.push_back(
        fmt::format("{}: longest extent {:.4g}; looks like millimetres: --unit mm", name, extent));
  else if (extent < 1e-3)
    report.warnings.push_back(fmt::format("{}: tiny: longest extent {:.4g}; check the unit", name, extent));
  const double far = std::max(box.lo.cwiseAbs().maxCoeff(), box.hi.cwiseAbs().maxCoeff());
  if (far > 1e4 * extent)
    report.warnings.push_back(
        fmt::format("{}: the body of extent {:.4g} lies {:.4g} from the origin, where 32-bit "
                    "coordinates are {:.2g} apart; move it to the origin before export",
                    name, extent, far, far * std::numeric_limits<float>::epsilon()));
  if (box.size().minCoeff() == 0.0)
    report.warnings.push_back(fmt::format("{}: a flat sheet: its extent along one axis is 0", name));
}

void warn(const Surface& surface, const std::string& name, const EdgeFindings& findings,
          SurfaceReport& report) {
  auto& warnings = report.warnings;
  if (report.open_edges > 0)
    warnings.push_back(fmt::format("{}: not closed: {}, {:.4g} long in all, one at {}", name,
                                   counted(report.open_edges, "open edge"), findings.open_length,
                                   text(findings.open_at)));
  if (report.nonmanifold_edges > 0)
    warnings.push_back(fmt::format("{}: {} with more than two triangles, one at {}", name,
                                   counted(report.nonmanifold_edges, "edge"), text(findings.nonmanifold_at)));
  if (report.misoriented_edges > 0)
    warnings.push_back(fmt::format("{}: {} whose triangles cannot be oriented alike (a one-sided surface)",
                                   name, counted(report.misoriented_edges, "edge")));
  if (report.shells > 1)
    warnings.push_back(
        fmt::format("{}: {} separate shells; where they overlap their union is meant", name, report.shells));
  warn_of_size(surface, name, report);
}

/// What clean() did to the triangles.
struct Repairs {
  detail::Welded welded;
  std::int64_t cut = 0, degenerate = 0;
  detail::Duplicates duplicates;
  detail::Turned turned;
};

/// "1 shell whole (inside out in the file) and 2 shells in part (7 triangles against their neighbours)".
std::string turned_shells(const detail::Turned& turned) {
  std::string words;
  if (turned.whole > 0) words = counted(turned.whole, "shell") + " whole (inside out in the file)";
  if (turned.mixed > 0)
    words += fmt::format("{}{} in part ({} against the others of the shell)", words.empty() ? "" : " and ",
                         counted(turned.mixed, "shell"), counted(turned.in_mixed, "triangle"));
  return words;
}

/// Enters the repairs into the report, counts and one line for each kind. Those that change the shape, rather
/// than how it is written down, are warnings as well.
void tell_repairs(const Repairs& r, const std::string& name, SurfaceReport& report) {
  report.nonfinite = r.welded.dropped;
  report.merged = r.welded.merged;
  report.negative_zeros = r.welded.negative_zeros;
  report.cut = r.cut;
  report.degenerate = r.degenerate;
  report.duplicate = r.duplicates.copies + r.duplicates.walls;
  report.flipped = r.turned.triangles;
  report.shells_turned = r.turned.whole;
  report.shells_mixed = r.turned.mixed;
  const auto tell = [&](std::int64_t count, bool warns, const std::string& words) {
    if (count == 0) return;
    report.repairs.push_back(words);
    if (warns) report.warnings.push_back(name + ": " + words);
  };
  const auto dropped = [&](std::int64_t count, std::string_view why) {
    tell(count, true, fmt::format("{} dropped: {}", counted(count, "triangle"), why));
  };
  dropped(r.welded.dropped, "coordinates that are not finite or beyond 1e100");
  tell(r.welded.merged, false,
       counted(r.welded.merged, "point") +
           " merged with one of the same coordinates, so that neighbours share corners");
  tell(r.welded.negative_zeros, false,
       counted(r.welded.negative_zeros, "coordinate") +
           " changed from -0.0 to 0.0, so that equal points have equal bits");
  tell(r.cut, true,
       counted(r.cut, "triangle") +
           " without area replaced by a cut of the neighbour, on whose edge a corner lay");
  dropped(r.degenerate, "without area (equal corners, or corners on one line)");
  dropped(r.duplicates.copies, "duplicate, with the corners of another one");
  dropped(r.duplicates.walls, "wall between touching solids, whose facets coincide");
  tell(r.turned.triangles, true,
       fmt::format("{} of {} turned to orient the shells outward: {}", r.turned.triangles,
                   counted(report.triangles, "triangle"), turned_shells(r.turned)));
}

/// Welds and drops what is no wall. Errors: kSurfaceEmpty.
void drop_useless(Surface& surface, const std::string& name, Repairs& repairs, const SurfaceReport& report) {
  repairs.welded = detail::weld(surface);
  repairs.cut = detail::cut_at_slivers(surface);
  repairs.degenerate = detail::drop_degenerate(surface);
  repairs.duplicates = detail::drop_duplicates(surface);
  const std::int64_t duplicate = repairs.duplicates.copies + repairs.duplicates.walls;
  if (surface.triangles.empty())
    throw Error(
        ErrorCode::kSurfaceEmpty,
        fmt::format("{}: no usable triangle among {}: {} with coordinates that are not finite, {} without "
                    "area, {} duplicate",
                    name, report.triangles_read, repairs.welded.dropped, repairs.degenerate, duplicate));
  if (repairs.cut + repairs.degenerate + duplicate > 0) detail::number_points(surface);
}

}  // namespace

Box<3> Surface::bounds() const {
  Box<3> box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

SurfaceReport clean(Surface& surface, const std::string& name) {
  SurfaceReport report;
  report.triangles_read = static_cast<std::int64_t>(surface.triangles.size());
  surface.tags.resize(surface.triangles.size(), 0);
  if (surface.tag_names.empty()) surface.tag_names.emplace_back("surface");
  if (report.triangles_read > kMostTriangles)
    throw Error(ErrorCode::kSurfaceInvalid, fmt::format("{}: {} triangles, limit {}; thin the surface out",
                                                        name, report.triangles_read, kMostTriangles));
  Repairs repairs;
  drop_useless(surface, name, repairs, report);
  EdgeTable edges(surface);
  repairs.turned = detail::orient(surface, edges);
  if (repairs.turned.triangles > 0) {
    detail::number_points(surface);
    edges = EdgeTable(surface);
  }
  std::vector<Index> shell;
  report.shells = detail::find_shells(surface, edges, shell);
  report.points = static_cast<std::int64_t>(surface.points.size());
  report.triangles = static_cast<std::int64_t>(surface.triangles.size());
  tell_repairs(repairs, name, report);
  const EdgeFindings findings = examine_edges(surface, edges, report);
  examine_triangles(surface, report);
  warn(surface, name, findings, report);
  return report;
}

}  // namespace lamina
