#include "mesh/io/raw.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "core/parallel.h"

namespace lamina::io {
namespace {

constexpr std::size_t kNothing = static_cast<std::size_t>(-1);
constexpr std::size_t kGrain = 65536;

/// Smallest i < n for which bad(i) holds, or kNothing.
template <class Bad>
std::size_t first_bad(std::size_t n, Bad&& bad) {
  return reduce(
      n, kNothing,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          if (bad(i)) return i;
        return kNothing;
      },
      [](std::size_t a, std::size_t b) { return std::min(a, b); }, kGrain);
}

template <int N>
void check_indices(const RawCells<N>& raw, std::size_t points, const char* kind, const Source& source) {
  const auto limit = static_cast<Index>(points);
  const std::size_t bad = first_bad(raw.cells.size(), [&](std::size_t i) {
    return std::any_of(raw.cells[i].begin(), raw.cells[i].end(),
                       [limit](Index v) { return v < 0 || v >= limit; });
  });
  if (bad == kNothing) return;
  for (const Index v : raw.cells[bad]) {
    if (v >= 0 && v < limit) continue;
    fail_format(
        source, raw.place,
        fmt::format("{} {} (counted from 0) names point {} but there are {} points", kind, bad, v, points));
  }
}

void check_points(const RawMesh& raw, const Source& source) {
  const std::size_t bad =
      first_bad(raw.points.size(), [&](std::size_t i) { return !raw.points[i].allFinite(); });
  if (bad == kNothing) return;
  const Vec3& x = raw.points[bad];
  fail_format(source, fmt::format("point {} (counted from 0)", bad),
              fmt::format("coordinate not finite: {} {} {}", x[0], x[1], x[2]));
}

/// Tags that say nothing are dropped.
std::vector<Index> useful(std::vector<Index> tags) {
  if (std::all_of(tags.begin(), tags.end(), [](Index t) { return t == 0; })) tags.clear();
  return tags;
}

/// Checks numbers and puts them in order, each once.
std::vector<Index> in_order(std::vector<Index> list, std::size_t items, const char* kind,
                            const Source& source) {
  for (const Index i : list)
    if (i < 0 || static_cast<std::size_t>(i) >= items)
      fail_format(source, fmt::format("list of {}s", kind),
                  fmt::format("{} {} (counted from 0) is listed but there are {}", kind, i, items));
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  return list;
}

/// A vector field of a plane mesh is stored with a third component 0, a tensor field with zz = xz = yz = 0,
/// because viewers know only three dimensions: take those entries away again.
void flatten(MeshField& field) {
  const int n = field.components;
  if (n != 3 && n != 6) return;
  const std::size_t count = field.values.size() / static_cast<std::size_t>(n);
  const int kept = n == 3 ? 2 : 3;
  for (std::size_t i = 0; i < count; ++i)
    for (int k = kept; k < n; ++k)
      if (field.values[i * n + k] != 0.0) return;
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < kept; ++k) field.values[i * kept + k] = field.values[i * n + k];
  field.values.resize(count * kept);
  field.components = kept;
}

void check_lists(RawMesh& raw, const Source& source) {
  const auto check = [&](std::vector<Index>& list, std::size_t items, const char* kind) {
    list = in_order(std::move(list), items, kind, source);
  };
  check(raw.corners, raw.points.size(), "corner");
  check(raw.ridges, raw.edges.cells.size(), "ridge");
  check(raw.required.points, raw.points.size(), "required point");
  check(raw.required.edges, raw.edges.cells.size(), "required edge");
  check(raw.required.facets, raw.triangles.cells.size(), "required triangle");
}

/// What does not depend on the dimension.
template <int D>
void take_points(RawMesh& raw, Mesh<D>& mesh) {
  mesh.corners = std::move(raw.corners);
  mesh.point_tags = useful(std::move(raw.point_tags));
  mesh.point_names = std::move(raw.point_names);
  mesh.point_fields = std::move(raw.point_fields);
  mesh.cell_fields = std::move(raw.cell_fields);
}

Mesh<3> make_solid(RawMesh&& raw) {
  Mesh<3> mesh;
  mesh.points = std::move(raw.points);
  mesh.cells = std::move(raw.tets.cells);
  mesh.cell_tags = useful(std::move(raw.tets.tags));
  mesh.facets = std::move(raw.triangles.cells);
  mesh.facet_tags = useful(std::move(raw.triangles.tags));
  mesh.cell_names = std::move(raw.tets.names);
  mesh.facet_names = std::move(raw.triangles.names);
  mesh.edges = std::move(raw.edges.cells);
  mesh.edge_tags = useful(std::move(raw.edges.tags));
  mesh.edge_names = std::move(raw.edges.names);
  mesh.ridges = std::move(raw.ridges);
  mesh.required = std::move(raw.required);
  take_points(raw, mesh);
  return mesh;
}

Mesh<2> make_plane(RawMesh&& raw) {
  Mesh<2> mesh;
  mesh.points.resize(raw.points.size());
  for_each_index(
      raw.points.size(), [&](std::size_t i) { mesh.points[i] = raw.points[i].head<2>(); }, kGrain);
  mesh.cells = std::move(raw.triangles.cells);
  mesh.cell_tags = useful(std::move(raw.triangles.tags));
  mesh.facets = std::move(raw.edges.cells);
  mesh.facet_tags = useful(std::move(raw.edges.tags));
  mesh.cell_names = std::move(raw.triangles.names);
  mesh.facet_names = std::move(raw.edges.names);
  mesh.required.points = std::move(raw.required.points);
  mesh.required.facets = std::move(raw.required.edges);
  mesh.required.cells = std::move(raw.required.facets);
  take_points(raw, mesh);
  for (MeshField& f : mesh.point_fields) flatten(f);
  for (MeshField& f : mesh.cell_fields) flatten(f);
  return mesh;
}

}  // namespace

std::string line_of(const Source& source, std::size_t offset) {
  const std::size_t end = std::min(offset, source.bytes.size());
  return fmt::format("line {}", 1 + std::count(source.bytes.begin(), source.bytes.begin() + end, '\n'));
}

std::string byte_of(std::size_t offset) { return fmt::format("byte {}", offset); }

void fail_format(const Source& source, const std::string& place, const std::string& what) {
  throw Error(ErrorCode::kFileFormat, fmt::format("{}: {}: {}", source.name, place, what));
}

void fail_unsupported(const Source& source, const std::string& what) {
  throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: {}", source.name, what));
}

void add_corners(const RawCells<1>& corners, RawMesh& raw) {
  const bool tag_points = raw.point_tags.empty() && !corners.tags.empty();
  if (tag_points) raw.point_tags.resize(raw.points.size());
  for (std::size_t i = 0; i < corners.cells.size(); ++i) {
    const Index v = corners.cells[i][0];
    raw.corners.push_back(v);
    if (tag_points && v >= 0 && static_cast<std::size_t>(v) < raw.points.size())
      raw.point_tags[static_cast<std::size_t>(v)] = corners.tags[i];
  }
}

std::string name_of_tag(const TagNames& names, Index tag, std::string_view kind) {
  const auto found = names.find(tag);
  return found != names.end() && !found->second.empty() ? found->second : fmt::format("{}_{}", kind, tag);
}

std::vector<Index> tags_of_names(const std::vector<std::string>& names_in_file,
                                 const std::vector<std::optional<Index>>& given, std::string_view kind,
                                 TagNames& names) {
  const std::string prefix = fmt::format("{}_", kind);
  const auto number_in = [&](std::string_view name) -> std::optional<Index> {
    if (name.substr(0, prefix.size()) == prefix) name.remove_prefix(prefix.size());
    Index value = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), value);
    if (error != std::errc() || end != name.data() + name.size()) return std::nullopt;
    return value;
  };
  std::vector<std::optional<Index>> tags(names_in_file.size());
  std::set<Index> used;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const auto tag = given[i] ? given[i] : number_in(names_in_file[i]);
    if (tag && used.insert(*tag).second) tags[i] = tag;
  }
  Index next = 1;
  std::vector<Index> found;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    while (!tags[i] && used.count(next) > 0) ++next;
    if (!tags[i]) used.insert(next);
    found.push_back(tags[i].value_or(next));
    if (number_in(names_in_file[i]) != found.back()) names[found.back()] = names_in_file[i];
  }
  return found;
}

std::vector<std::string> plain_names(const std::vector<Index>& tags, const TagNames& names,
                                     std::string_view kind, std::vector<std::string>& lost) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '.' || c == '-';
  };
  std::set<std::string> used;
  std::vector<std::string> plain;
  for (const Index tag : tags) {
    const std::string name = name_of_tag(names, tag, kind);
    std::string word = name;
    std::replace_if(
        word.begin(), word.end(), [&](char c) { return !is_plain(c); }, '_');
    while (!used.insert(word).second) word += fmt::format("_{}", tag);
    if (word != name) lost.push_back(fmt::format("the name \"{}\" (now {})", name, word));
    plain.push_back(word);
  }
  return plain;
}

std::vector<Index> distinct_tags(const std::vector<Index>& tags, std::size_t items) {
  if (tags.empty()) return items == 0 ? std::vector<Index>{} : std::vector<Index>{0};
  std::vector<Index> found;
  for (const Index t : tags) {
    if (!found.empty() && found.back() == t) continue;
    found.push_back(t);
    if (found.size() < 4096) continue;
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

TagGroups group_by_tag(const std::vector<Index>& tags, std::size_t items) {
  TagGroups g;
  g.tags = distinct_tags(tags, items);
  g.start.assign(g.tags.size() + 1, 0);
  const auto place = [&](std::size_t i) {
    if (tags.empty()) return std::ptrdiff_t{0};
    return std::lower_bound(g.tags.begin(), g.tags.end(), tags[i]) - g.tags.begin();
  };
  for (std::size_t i = 0; i < items; ++i) ++g.start[place(i) + 1];
  for (std::size_t k = 1; k < g.start.size(); ++k) g.start[k] += g.start[k - 1];
  std::vector<std::size_t> next = g.start;
  g.order.resize(items);
  for (std::size_t i = 0; i < items; ++i) g.order[next[place(i)]++] = static_cast<Index>(i);
  return g;
}

AnyMesh assemble(RawMesh raw, const Source& source) {
  check_points(raw, source);
  check_indices(raw.tets, raw.points.size(), "tetrahedron", source);
  check_indices(raw.triangles, raw.points.size(), "triangle", source);
  check_indices(raw.edges, raw.points.size(), "edge", source);
  check_lists(raw, source);
  if (!raw.tets.cells.empty()) {
    if (raw.dimension != 3) fail_format(source, raw.tets.place, "tetrahedra in a file of dimension 2");
    return make_solid(std::move(raw));
  }
  if (raw.triangles.cells.empty()) fail_unsupported(source, "holds neither tetrahedra nor triangles");
  const std::size_t off_plane =
      first_bad(raw.points.size(), [&](std::size_t i) { return raw.points[i][2] != 0.0; });
  if (off_plane != kNothing)
    fail_unsupported(
        source, fmt::format("holds triangles but no tetrahedra, and point {} (counted from 0) has z = {}: a "
                            "surface in space is not a mesh of a domain; 2D meshes need z = 0",
                            off_plane, raw.points[off_plane][2]));
  return make_plane(std::move(raw));
}

}  // namespace lamina::io
