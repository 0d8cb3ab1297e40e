// The writing half of mesh/io/foam.h.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "core/words.h"
#include "mesh/io/foam.h"
#include "mesh/io/records.h"
#include "mesh/topology/incidence.h"

namespace lamina::io {
namespace {

/// Facets of the mesh: triangles, of a plane mesh edges that carry quadrilaterals.
template <int D>
using Facet = std::array<Index, D>;

template <int D>
Facet<D> sorted(Facet<D> f) {
  std::sort(f.begin(), f.end());
  return f;
}

template <int D>
struct Face {
  Facet<D> corners;
  Index owner, neighbour;  ///< kNone: boundary
};

/// Faces in the order of OpenFOAM; boundary faces behind the inner ones, by patch.
template <int D>
struct Faces {
  std::vector<Face<D>> list;
  std::size_t inner = 0;
  std::vector<std::size_t> patch_start;  ///< one more than patches; the last patch holds unnamed faces
  std::size_t facets_inside = 0;         ///< facets that are no boundary faces
};

/// The cell on the other side of facet k of cell c, or kNone.
template <int D>
Index other_cell(const Mesh<D>& mesh, const Incidence& cells, std::size_t c, const Facet<D>& facet) {
  for (const Index other : cells.of(facet[0])) {
    if (static_cast<std::size_t>(other) == c) continue;
    const auto& v = mesh.cells[other];
    if (std::all_of(facet.begin() + 1, facet.end(),
                    [&](Index p) { return std::find(v.begin(), v.end(), p) != v.end(); }))
      return other;
  }
  return kNone;
}

/// Facet k of cell c, outward whatever the cell's orientation.
template <int D>
Facet<D> facet_of(const Mesh<D>& mesh, std::size_t c, int k) {
  const auto& cell = mesh.cells[c];
  Facet<D> f;
  for (int j = 0; j < D; ++j) f[j] = cell[kCellFacets<D>[k][j]];
  Eigen::Matrix<double, D, D> edges;
  for (int j = 0; j < D; ++j) edges.col(j) = mesh.points[cell[j + 1]] - mesh.points[cell[0]];
  if (edges.determinant() < 0.0) std::swap(f[D - 2], f[D - 1]);
  return f;
}

/// Patch of every boundary face by its sorted corners.
template <int D>
class PatchOfFacet {
 public:
  explicit PatchOfFacet(const Mesh<D>& mesh, const TagGroups& groups) {
    for (std::size_t k = 0; k < groups.tags.size(); ++k)
      for (std::size_t i = groups.start[k]; i < groups.start[k + 1]; ++i)
        known_.emplace_back(sorted<D>(mesh.facets[groups.order[i]]), k);
    std::sort(known_.begin(), known_.end());
  }
  [[nodiscard]] std::size_t find(const Facet<D>& facet, std::size_t none) const {
    const Facet<D> key = sorted<D>(facet);
    const auto at = std::lower_bound(known_.begin(), known_.end(), std::pair(key, std::size_t{0}));
    return at != known_.end() && at->first == key ? at->second : none;
  }

 private:
  std::vector<std::pair<Facet<D>, std::size_t>> known_;
};

template <int D>
Faces<D> list_faces(const Mesh<D>& mesh, const TagGroups& groups) {
  const std::size_t n = mesh.cells.size();
  const Incidence cells = incidence(mesh.points.size(), mesh.cells);
  std::vector<std::array<Index, D + 1>> neighbours(n);
  for_each_index(
      n,
      [&](std::size_t c) {
        for (int k = 0; k <= D; ++k) neighbours[c][k] = other_cell<D>(mesh, cells, c, facet_of(mesh, c, k));
      },
      8192);
  Faces<D> faces;
  for (std::size_t c = 0; c < n; ++c) {
    std::array<int, D + 1> order;
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return neighbours[c][a] < neighbours[c][b]; });
    for (const int k : order)
      if (neighbours[c][k] > static_cast<Index>(c))
        faces.list.push_back({facet_of(mesh, c, k), static_cast<Index>(c), neighbours[c][k]});
  }
  faces.inner = faces.list.size();
  const PatchOfFacet<D> patch_of(mesh, groups);
  const std::size_t patches = groups.tags.size();
  std::vector<std::vector<Face<D>>> by_patch(patches + 1);
  for (std::size_t c = 0; c < n; ++c) {
    for (int k = 0; k <= D; ++k) {
      if (neighbours[c][k] != kNone) continue;
      const Facet<D> facet = facet_of(mesh, c, k);
      by_patch[patch_of.find(facet, patches)].push_back({facet, static_cast<Index>(c), kNone});
    }
  }
  for (const auto& patch : by_patch) {
    faces.patch_start.push_back(faces.list.size());
    faces.list.insert(faces.list.end(), patch.begin(), patch.end());
  }
  const std::size_t named = faces.patch_start.back() - faces.inner;
  faces.facets_inside = mesh.facets.size() - std::min(named, mesh.facets.size());
  faces.patch_start.push_back(faces.list.size());
  return faces;
}

/// A mesh of tetrahedra, or the prisms between z = 0 and z = height over a plane one: point i stands below
/// and i + n above, and the bottom and the top of every cell follow the other faces, two by two.
template <int D>
class FoamWriter {
 public:
  FoamWriter(WriteJob& job, const Mesh<D>& mesh, double height)
      : job_(job),
        mesh_(mesh),
        height_(height),
        points_(D == 2 ? 2 * mesh.points.size() : mesh.points.size()),
        ascii_(job.ascii()),
        groups_(group_by_tag(mesh.facet_tags, mesh.facets.size())),
        faces_(list_faces(mesh, groups_)),
        total_(faces_.list.size() + (D == 2 ? 2 * mesh.cells.size() : 0)),
        note_(fmt::format("nPoints:{}  nCells:{}  nFaces:{}  nInternalFaces:{}", points_, mesh.cells.size(),
                          total_, faces_.inner)) {}

  void write() {
    const std::vector<std::filesystem::path> files = foam_files(job_.path);
    job_.files.add_folder(files[0].parent_path());
    points(job_.files.add(files[0]));
    faces(job_.files.add(files[1]));
    labels(job_.files.add(files[2]), "owner", total_, [&](std::size_t i) {
      const std::size_t n = faces_.list.size();
      return i < n ? faces_.list[i].owner : static_cast<Index>((i - n) / 2);
    });
    labels(job_.files.add(files[3]), "neighbour", faces_.inner,
           [&](std::size_t i) { return faces_.list[i].neighbour; });
    boundary(job_.files.add(files[4]));
    zones(job_.files.add(files[5]));
    if (files.size() > 6) job_.files.add(files[6]);
    if (faces_.facets_inside > 0)
      job_.lost.push_back(counted(static_cast<std::int64_t>(faces_.facets_inside), "facet") +
                          " inside the domain");
  }

 private:
  static void header(OutputFile& out, bool ascii, std::string_view kind, std::string_view object,
                     std::string_view note = {}) {
    out.write(
        fmt::format("FoamFile\n{{\n    version     2.0;\n    format      {};\n", ascii ? "ascii" : "binary"));
    if (!ascii) out.write("    arch        \"LSB;label=32;scalar=64\";\n");
    out.write(fmt::format("    class       {};\n", kind));
    if (!note.empty()) out.write(fmt::format("    note        \"{}\";\n", note));
    out.write(fmt::format("    location    \"constant/polyMesh\";\n    object      {};\n}}\n\n", object));
  }
  void begin(OutputFile& out, std::size_t n) const {
    out.write(fmt::format("{}\n({}", n, ascii_ ? "\n" : ""));
  }
  static void end(OutputFile& out) { out.write(")\n"); }

  void points(OutputFile& out) {
    header(out, ascii_, "vectorField", "points");
    begin(out, points_);
    write_records(out, points_, [&](std::size_t i, Records& to) {
      const Vec3 x = point(i);
      for (int k = 0; k < 3; ++k) {
        if (!ascii_) {
          to.raw(x[k]);
          continue;
        }
        to.character(k == 0 ? '(' : ' ');
        to.real(x[k]);
      }
      if (ascii_) to.text(")\n");
    });
    end(out);
  }

  void faces(OutputFile& out) {
    header(out, ascii_, ascii_ ? "faceList" : "faceCompactList", "faces");
    if (!ascii_) {
      begin(out, total_ + 1);
      write_records(out, total_ + 1, [&](std::size_t i, Records& to) {
        to.raw(static_cast<std::int32_t>(corners_before(i)));
      });
      end(out);
      begin(out, corners_before(total_));
    } else {
      begin(out, total_);
    }
    write_records(out, total_, [&](std::size_t i, Records& to) {
      const std::size_t n = corners_before(i + 1) - corners_before(i);
      const std::array<Index, 4> corners = face(i);
      if (ascii_) {
        to.integer(static_cast<Index>(n));
        to.character('(');
      }
      for (std::size_t k = 0; k < n; ++k) {
        if (!ascii_) {
          to.raw(corners[k]);
          continue;
        }
        if (k > 0) to.character(' ');
        to.integer(corners[k]);
      }
      if (ascii_) to.text(")\n");
    });
    end(out);
  }

  [[nodiscard]] Vec3 point(std::size_t i) const {
    const std::size_t n = mesh_.points.size();
    if constexpr (D == 3)
      return mesh_.points[i];
    else
      return {mesh_.points[i % n][0], mesh_.points[i % n][1], i < n ? 0.0 : height_};
  }

  /// Corners of all faces before face i.
  [[nodiscard]] std::size_t corners_before(std::size_t i) const {
    const std::size_t sides = std::min(i, faces_.list.size());
    return (D == 2 ? 4 : 3) * sides + 3 * (i - sides);
  }

  /// Corners of face i, outward of its owner; the last one counts in quadrilaterals only.
  [[nodiscard]] std::array<Index, 4> face(std::size_t i) const {
    if constexpr (D == 3) {
      const auto& [a, b, c] = faces_.list[i].corners;
      return {a, b, c, kNone};
    } else {
      const auto n = static_cast<Index>(mesh_.points.size());
      if (i < faces_.list.size()) {
        const auto& [a, b] = faces_.list[i].corners;
        return {a, b, b + n, a + n};
      }
      const std::size_t k = i - faces_.list.size();
      const auto& [a, b, c] = mesh_.cells[k / 2];
      if (k % 2 == 0) return {a, c, b, kNone};
      return {a + n, b + n, c + n, kNone};
    }
  }

  template <class Label>
  void labels(OutputFile& out, std::string_view object, std::size_t n, Label&& label) {
    header(out, ascii_, "labelList", object, note_);
    begin(out, n);
    write_records(out, n, [&](std::size_t i, Records& to) {
      if (!ascii_) return to.raw(label(i));
      to.integer(label(i));
      to.character('\n');
    });
    end(out);
  }

  void boundary(OutputFile& out) {
    header(out, true, "polyBoundaryMesh", "boundary");
    const std::vector<std::string> names = plain_names(groups_.tags, mesh_.facet_names, "facet", job_.lost);
    const std::size_t patches = names.size(),
                      unnamed = faces_.patch_start[patches + 1] - faces_.patch_start[patches];
    out.write(fmt::format("{}\n(\n", patches + (unnamed > 0) + (D == 2)));
    const auto patch = [&](const std::string& name, std::string_view type, std::string_view tag,
                           std::size_t start, std::size_t n) {
      out.write(
          fmt::format("    {}\n    {{\n        type            {};\n{}        nFaces          {};\n        "
                      "startFace       {};\n    }}\n",
                      name, type, tag, n, start));
    };
    for (std::size_t k = 0; k < patches + (unnamed > 0); ++k) {
      const std::string name = k < patches ? names[k] : "defaultFaces";
      const std::string tag =
          k < patches ? fmt::format("        tag             {};\n", groups_.tags[k]) : "";
      patch(name, name.find("wall") != std::string::npos ? "wall" : "patch", tag, faces_.patch_start[k],
            faces_.patch_start[k + 1] - faces_.patch_start[k]);
    }
    if (D == 2) patch("frontAndBack", "empty", "", faces_.list.size(), total_ - faces_.list.size());
    end(out);
  }

  void zones(OutputFile& out) {
    header(out, true, "regIOobject", "cellZones");
    const TagGroups zones =
        mesh_.cell_tags.empty() ? TagGroups{} : group_by_tag(mesh_.cell_tags, mesh_.cells.size());
    const std::vector<std::string> names = plain_names(zones.tags, mesh_.cell_names, "zone", job_.lost);
    out.write(fmt::format("{}\n(\n", names.size()));
    for (std::size_t k = 0; k < names.size(); ++k) {
      const std::size_t begin = zones.start[k], n = zones.start[k + 1] - begin;
      out.write(fmt::format(
          "    {}\n    {{\n        type cellZone;\n        tag {};\n        cellLabels List<label> {}\n(\n",
          names[k], zones.tags[k], n));
      write_records(out, n, [&](std::size_t i, Records& to) {
        to.integer(zones.order[begin + i]);
        to.character('\n');
      });
      out.write(");\n    }\n");
    }
    end(out);
  }

  WriteJob& job_;
  const Mesh<D>& mesh_;
  double height_;
  std::size_t points_;
  bool ascii_;
  TagGroups groups_;
  Faces<D> faces_;
  std::size_t total_;  ///< faces
  std::string note_;
};

}  // namespace

void write_foam(WriteJob& job, const Mesh<3>& mesh) { FoamWriter<3>(job, mesh, 0.0).write(); }

void write_foam_prisms(WriteJob& job, const Mesh<2>& mesh) {
  if (!job.options.height)
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: OpenFOAM knows cells in space only: give plane meshes a height (lamina mesh "
                            "--extrude)",
                            job.path.string()));
  FoamWriter<2>(job, mesh, *job.options.height).write();
}

}  // namespace lamina::io
