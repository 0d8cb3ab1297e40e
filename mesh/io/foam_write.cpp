// The writing half of mesh/io/foam.h.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/words.h"
#include "mesh/io/foam.h"
#include "mesh/io/records.h"
#include "mesh/topology/incidence.h"

namespace lamina::io {
namespace {

using Triangle = std::array<Index, 3>;

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

struct Face {
  Triangle corners;
  Index owner, neighbour;  ///< kNone: boundary
};

/// Faces in the order of OpenFOAM; boundary faces behind the inner ones, by patch.
struct Faces {
  std::vector<Face> list;
  std::size_t inner = 0;
  std::vector<std::size_t> patch_start;  ///< one more than patches; the last patch holds unnamed faces
  std::size_t facets_inside = 0;         ///< facets that are no boundary faces
};

/// The cell on the other side of facet k of cell c, or kNone.
Index other_cell(const Mesh<3>& mesh, const Incidence& cells, std::size_t c, const Triangle& facet) {
  for (const Index other : cells.of(facet[0])) {
    if (static_cast<std::size_t>(other) == c) continue;
    const auto& v = mesh.cells[other];
    const auto has = [&](Index p) { return v[0] == p || v[1] == p || v[2] == p || v[3] == p; };
    if (has(facet[1]) && has(facet[2])) return other;
  }
  return kNone;
}

/// Facet k of cell c, outward whatever the cell's orientation.
Triangle facet_of(const Mesh<3>& mesh, std::size_t c, int k) {
  const auto& cell = mesh.cells[c];
  const auto& local = kCellFacets<3>[k];
  Triangle t = {cell[local[0]], cell[local[1]], cell[local[2]]};
  const Vec3 &a = mesh.points[cell[0]], &b = mesh.points[cell[1]], &p = mesh.points[cell[2]],
             &q = mesh.points[cell[3]];
  if ((b - a).cross(p - a).dot(q - a) < 0.0) std::swap(t[1], t[2]);
  return t;
}

/// Patch of every boundary face by its sorted corners.
class PatchOfFacet {
 public:
  explicit PatchOfFacet(const Mesh<3>& mesh, const TagGroups& groups) {
    for (std::size_t k = 0; k < groups.tags.size(); ++k)
      for (std::size_t i = groups.start[k]; i < groups.start[k + 1]; ++i)
        known_.emplace_back(sorted(mesh.facets[groups.order[i]]), k);
    std::sort(known_.begin(), known_.end());
  }
  [[nodiscard]] std::size_t find(const Triangle& facet, std::size_t none) const {
    const Triangle key = sorted(facet);
    const auto at = std::lower_bound(known_.begin(), known_.end(), std::pair(key, std::size_t{0}));
    return at != known_.end() && at->first == key ? at->second : none;
  }

 private:
  std::vector<std::pair<Triangle, std::size_t>> known_;
};

Faces list_faces(const Mesh<3>& mesh, const TagGroups& groups) {
  const std::size_t n = mesh.cells.size();
  const Incidence cells = incidence(mesh.points.size(), mesh.cells);
  std::vector<std::array<Index, 4>> neighbours(n);
  for_each_index(
      n,
      [&](std::size_t c) {
        for (int k = 0; k < 4; ++k) neighbours[c][k] = other_cell(mesh, cells, c, facet_of(mesh, c, k));
      },
      8192);
  Faces faces;
  for (std::size_t c = 0; c < n; ++c) {
    std::array<int, 4> order = {0, 1, 2, 3};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return neighbours[c][a] < neighbours[c][b]; });
    for (const int k : order)
      if (neighbours[c][k] > static_cast<Index>(c))
        faces.list.push_back({facet_of(mesh, c, k), static_cast<Index>(c), neighbours[c][k]});
  }
  faces.inner = faces.list.size();
  const PatchOfFacet patch_of(mesh, groups);
  const std::size_t patches = groups.tags.size();
  std::vector<std::vector<Face>> by_patch(patches + 1);
  for (std::size_t c = 0; c < n; ++c) {
    for (int k = 0; k < 4; ++k) {
      if (neighbours[c][k] != kNone) continue;
      const Triangle facet = facet_of(mesh, c, k);
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

class FoamWriter {
 public:
  FoamWriter(WriteJob& job, const Mesh<3>& mesh)
      : job_(job),
        mesh_(mesh),
        ascii_(job.ascii()),
        groups_(group_by_tag(mesh.facet_tags, mesh.facets.size())),
        faces_(list_faces(mesh, groups_)),
        note_(fmt::format("nPoints:{}  nCells:{}  nFaces:{}  nInternalFaces:{}", mesh.points.size(),
                          mesh.cells.size(), faces_.list.size(), faces_.inner)) {}

  void write() {
    const std::vector<std::filesystem::path> files = foam_files(job_.path);
    job_.files.add_folder(files[0].parent_path());
    points(job_.files.add(files[0]));
    faces(job_.files.add(files[1]));
    labels(job_.files.add(files[2]), "owner", faces_.list.size(),
           [&](std::size_t i) { return faces_.list[i].owner; });
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
    begin(out, mesh_.points.size());
    write_records(out, mesh_.points.size(), [&](std::size_t i, Records& to) {
      for (int k = 0; k < 3; ++k) {
        if (!ascii_) {
          to.raw(mesh_.points[i][k]);
          continue;
        }
        to.character(k == 0 ? '(' : ' ');
        to.real(mesh_.points[i][k]);
      }
      if (ascii_) to.text(")\n");
    });
    end(out);
  }

  void faces(OutputFile& out) {
    header(out, ascii_, ascii_ ? "faceList" : "faceCompactList", "faces");
    const std::size_t n = faces_.list.size();
    if (!ascii_) {
      begin(out, n + 1);
      write_records(out, n + 1,
                    [&](std::size_t i, Records& to) { to.raw(static_cast<std::int32_t>(3 * i)); });
      end(out);
      begin(out, 3 * n);
    } else {
      begin(out, n);
    }
    write_records(out, n, [&](std::size_t i, Records& to) {
      const Triangle& t = faces_.list[i].corners;
      if (!ascii_) {
        for (const Index v : t) to.raw(v);
        return;
      }
      for (int k = 0; k < 3; ++k) {
        to.text(k == 0 ? "3(" : " ");
        to.integer(t[k]);
      }
      to.text(")\n");
    });
    end(out);
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
    out.write(fmt::format("{}\n(\n", patches + (unnamed > 0)));
    for (std::size_t k = 0; k < patches + (unnamed > 0); ++k) {
      const std::string name = k < patches ? names[k] : "defaultFaces";
      const bool wall = name.find("wall") != std::string::npos;
      out.write(fmt::format("    {}\n    {{\n        type            {};\n", name, wall ? "wall" : "patch"));
      if (k < patches) out.write(fmt::format("        tag             {};\n", groups_.tags[k]));
      out.write(fmt::format("        nFaces          {};\n        startFace       {};\n    }}\n",
                            faces_.patch_start[k + 1] - faces_.patch_start[k], faces_.patch_start[k]));
    }
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
  const Mesh<3>& mesh_;
  bool ascii_;
  TagGroups groups_;
  Faces faces_;
  std::string note_;
};

}  // namespace

void write_foam(WriteJob& job, const Mesh<3>& mesh) { FoamWriter(job, mesh).write(); }

}  // namespace lamina::io
