#include "mesh/io/cgns.h"

#ifdef LAMINA_CGNS

#include <cgnslib.h>
#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "mesh/io/text.h"

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 32;
constexpr const char* kRegion = "region";
constexpr const char *kElements = "GridElements", *kPoints = "PointData", *kCells = "CellData";

template <int D>
constexpr std::array<const char*, D == 2 ? 3 : 6> kTensorSuffix = [] {
  if constexpr (D == 2) {
    return std::array<const char*, 3>{"XX", "XY", "YY"};
  } else {
    return std::array<const char*, 6>{"XX", "XY", "YY", "XZ", "YZ", "ZZ"};
  }
}();
constexpr std::array<const char*, 3> kVectorSuffix = {"X", "Y", "Z"};
constexpr std::array<const char*, 3> kCoordinate = {"CoordinateX", "CoordinateY", "CoordinateZ"};

/// An open file, and its errors.
class CgnsFile {
 public:
  CgnsFile(const fs::path& path, int mode, std::string name, ErrorCode code)
      : name_(std::move(name)), code_(code) {
    if (mode == CG_MODE_WRITE) cg_set_file_type(CG_FILE_HDF5);
    check(cg_open(path.c_str(), mode, &file_));
    open_ = true;
  }
  ~CgnsFile() {
    if (open_) cg_close(file_);
  }
  CgnsFile(const CgnsFile&) = delete;
  CgnsFile& operator=(const CgnsFile&) = delete;
  [[nodiscard]] int id() const { return file_; }
  void check(int status) const {
    if (status != CG_OK) throw Error(code_, fmt::format("{}: CGNS: {}", name_, cg_get_error()));
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(code_, fmt::format("{}: {}", name_, what));
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: {}", name_, what));
  }
  void close() {
    open_ = false;
    check(cg_close(file_));
  }

 private:
  int file_ = 0;
  std::string name_;
  ErrorCode code_;
  bool open_ = false;
};

/// Names of nodes are at most 32 characters without slashes.
bool fits(const std::string& name) {
  return name.size() <= kLongestName && name.find('/') == std::string::npos;
}

template <int D>
class CgnsWriter {
 public:
  CgnsWriter(const CgnsFile& file, const Mesh<D>& mesh, std::vector<std::string>& lost)
      : file_(file), mesh_(mesh), lost_(lost) {}

  void write() {
    const std::array<cgsize_t, 3> size = {static_cast<cgsize_t>(mesh_.points.size()),
                                          static_cast<cgsize_t>(mesh_.cells.size()), 0};
    file_.check(cg_base_write(file_.id(), "Base", D, D, &base_));
    file_.check(cg_zone_write(file_.id(), base_, "Zone1", size.data(), CGNS_ENUMV(Unstructured), &zone_));
    std::vector<double> x(mesh_.points.size());
    for (int k = 0; k < D; ++k) {
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = mesh_.points[i][k];
      int coordinate = 0;
      file_.check(cg_coord_write(file_.id(), base_, zone_, CGNS_ENUMV(RealDouble), kCoordinate[k], x.data(),
                                 &coordinate));
    }
    constexpr auto cell = D == 3 ? CGNS_ENUMV(TETRA_4) : CGNS_ENUMV(TRI_3);
    section(
        kElements, cell, mesh_.cells.size(), [&](std::size_t i) -> const auto& { return mesh_.cells[i]; });
    facets();
    solution(kPoints, CGNS_ENUMV(Vertex), mesh_.point_tags, mesh_.point_fields, mesh_.points.size());
    solution(kCells, CGNS_ENUMV(CellCenter), mesh_.cell_tags, mesh_.cell_fields, mesh_.cells.size());
  }

 private:
  template <class Corners>
  void section(const std::string& name, CGNS_ENUMT(ElementType_t) type, std::size_t n, Corners&& corners) {
    if (n == 0) return;
    std::vector<cgsize_t> nodes;
    nodes.reserve(n * 4);
    for (std::size_t i = 0; i < n; ++i)
      for (const Index v : corners(i)) nodes.push_back(v + 1);
    int number = 0;
    file_.check(cg_section_write(file_.id(), base_, zone_, name.c_str(), type, next_,
                                 next_ + static_cast<cgsize_t>(n) - 1, 0, nodes.data(), &number));
    next_ += static_cast<cgsize_t>(n);
  }

  /// A name that none of the other children of a zone has.
  static std::string beside(const std::string& name) {
    for (const char* taken : {kElements, kPoints, kCells, "ZoneBC", "GridCoordinates", "ZoneType"})
      if (name == taken) return name + "_";
    return name;
  }

  void facets() {
    const TagGroups groups = group_by_tag(mesh_.facet_tags, mesh_.facets.size());
    std::vector<std::string> names = plain_names(groups.tags, mesh_.facet_names, "facet", lost_);
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!fits(names[k])) {
        lost_.push_back(fmt::format("the name \"{}\"", names[k]));
        names[k] = fmt::format("facet_{}", groups.tags[k]);
      }
      const std::size_t begin = groups.start[k];
      const std::array<cgsize_t, 2> range = {next_,
                                             next_ + static_cast<cgsize_t>(groups.start[k + 1] - begin) - 1};
      constexpr auto facet = D == 3 ? CGNS_ENUMV(TRI_3) : CGNS_ENUMV(BAR_2);
      section(
          beside(names[k]), facet, groups.start[k + 1] - begin, [&](std::size_t i) -> const auto& {
            return mesh_.facets[groups.order[begin + i]];
          });
      int condition = 0;
      file_.check(cg_boco_write(file_.id(), base_, zone_, names[k].c_str(), CGNS_ENUMV(BCTypeUserDefined),
                                CGNS_ENUMV(PointRange), 2, range.data(), &condition));
      constexpr auto location = D == 3 ? CGNS_ENUMV(FaceCenter) : CGNS_ENUMV(EdgeCenter);
      file_.check(cg_boco_gridlocation_write(file_.id(), base_, zone_, condition, location));
      file_.check(cg_goto(file_.id(), base_, "Zone_t", zone_, "ZoneBC_t", 1, "BC_t", condition, "end"));
      file_.check(cg_ordinal_write(groups.tags[k]));
    }
  }

  void solution(const char* name, CGNS_ENUMT(GridLocation_t) location, const std::vector<Index>& tags,
                const std::vector<MeshField>& fields, std::size_t count) {
    if (tags.empty() && fields.empty()) return;
    int number = 0, array = 0;
    file_.check(cg_sol_write(file_.id(), base_, zone_, name, location, &number));
    if (!tags.empty())
      file_.check(cg_field_write(file_.id(), base_, zone_, number, CGNS_ENUMV(Integer), kRegion, tags.data(),
                                 &array));
    for (const MeshField& f : fields) {
      if (f.components != 1 && f.components != D && f.components != kSymSize<D>) continue;
      if (!fits(f.name + "XX")) {
        lost_.push_back(
            fmt::format("the field \"{}\" (its name is longer than 30 characters or has a slash)", f.name));
        continue;
      }
      const auto n = static_cast<std::size_t>(f.components);
      std::vector<double> values(count);
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t i = 0; i < count; ++i) values[i] = f.values[i * n + k];
        const char* suffix = n == 1 ? "" : (f.components == D ? kVectorSuffix[k] : kTensorSuffix<D>[k]);
        file_.check(cg_field_write(file_.id(), base_, zone_, number, CGNS_ENUMV(RealDouble),
                                   (f.name + suffix).c_str(), values.data(), &array));
      }
    }
  }

  const CgnsFile& file_;
  const Mesh<D>& mesh_;
  std::vector<std::string>& lost_;
  int base_ = 0, zone_ = 0;
  cgsize_t next_ = 1;
};

class CgnsReader {
 public:
  CgnsReader(const fs::path& path, std::size_t file_size)
      : file_(path, CG_MODE_READ, path.string(), ErrorCode::kFileFormat),
        source_{{}, path.string()},
        // The library stores compressed arrays at most so much smaller.
        most_(file_size) {}

  AnyMesh read() {
    open_zone();
    read_points();
    read_sections();
    read_conditions();
    int solutions = 0;
    file_.check(cg_nsols(file_.id(), 1, 1, &solutions));
    for (int s = 1; s <= solutions; ++s) read_solution(s);
    return assemble(std::move(raw_), source_);
  }

 private:
  /// The elements of one section.
  struct Section {
    std::string name;
    cgsize_t first = 0;
    int corners = 0;
    std::size_t begin = 0, count = 0;  ///< in the list of its kind
  };

  void open_zone() {
    int bases = 0, zones = 0, cell = 0;
    std::array<char, 64> name{};
    file_.check(cg_nbases(file_.id(), &bases));
    if (bases != 1) file_.refuse(fmt::format("holds {} bases; one is read", bases));
    file_.check(cg_base_read(file_.id(), 1, name.data(), &cell, &raw_.dimension));
    file_.check(cg_nzones(file_.id(), 1, &zones));
    if (zones != 1) file_.refuse(fmt::format("holds {} zones; one is read", zones));
    CGNS_ENUMT(ZoneType_t) type{};
    file_.check(cg_zone_type(file_.id(), 1, 1, &type));
    if (type != CGNS_ENUMV(Unstructured)) file_.refuse("its zone is not unstructured");
    std::array<cgsize_t, 9> size{};
    file_.check(cg_zone_read(file_.id(), 1, 1, name.data(), size.data()));
    points_ = bounded(size[0], 8, "points");
    cells_ = bounded(size[1], 8, "cells");
    if (raw_.dimension != 2 && raw_.dimension != 3)
      file_.refuse(fmt::format("its points have {} coordinates", raw_.dimension));
  }

  std::size_t bounded(cgsize_t n, std::size_t bytes, const char* what) const {
    if (n < 0 || static_cast<std::size_t>(n) > most_ / bytes || n > std::numeric_limits<Index>::max())
      file_.fail(fmt::format("claims {} {}, more than the file holds", n, what));
    return static_cast<std::size_t>(n);
  }

  void read_points() {
    raw_.points.assign(points_, Vec3::Zero());
    std::vector<double> x(points_);
    cgsize_t first = 1;
    auto last = static_cast<cgsize_t>(points_);
    for (int k = 0; k < raw_.dimension && points_ > 0; ++k) {
      file_.check(
          cg_coord_read(file_.id(), 1, 1, kCoordinate[k], CGNS_ENUMV(RealDouble), &first, &last, x.data()));
      for (std::size_t i = 0; i < points_; ++i) raw_.points[i][k] = x[i];
    }
  }

  template <int N>
  void append(const std::vector<cgsize_t>& nodes, RawCells<N>& to) {
    to.place = "Elements_t";
    for (std::size_t i = 0; i + N <= nodes.size(); i += N) {
      std::array<Index, N> cell;
      for (int k = 0; k < N; ++k)
        cell[k] = std::max(to_index(nodes[i + k], "node", source_, to.place), Index{0}) - 1;
      to.cells.push_back(cell);
    }
    to.tags.resize(to.cells.size(), 0);
  }

  void read_sections() {
    int count = 0;
    file_.check(cg_nsections(file_.id(), 1, 1, &count));
    for (int s = 1; s <= count; ++s) {
      std::array<char, 64> name{};
      CGNS_ENUMT(ElementType_t) type{};
      cgsize_t first = 0, last = 0, size = 0;
      int edge = 0, parents = 0;
      file_.check(cg_section_read(file_.id(), 1, 1, s, name.data(), &type, &first, &last, &edge, &parents));
      if (type == CGNS_ENUMV(NODE)) continue;
      const int corners = type == CGNS_ENUMV(TETRA_4) ? 4 : (type == CGNS_ENUMV(TRI_3) ? 3 : 2);
      if (corners == 2 && type != CGNS_ENUMV(BAR_2))
        file_.refuse(fmt::format("section \"{}\" holds {}; TETRA_4, TRI_3 and BAR_2 are read", name.data(),
                                 cg_ElementTypeName(type)));
      file_.check(cg_ElementDataSize(file_.id(), 1, 1, s, &size));
      const std::size_t n = bounded(size, 4, "nodes of elements");
      if (first < 1 || last < first - 1 || static_cast<cgsize_t>(n) != (last - first + 1) * corners)
        file_.fail(
            fmt::format("section \"{}\": elements {} to {} with {} nodes", name.data(), first, last, n));
      std::vector<cgsize_t> nodes(n);
      if (n > 0) file_.check(cg_elements_read(file_.id(), 1, 1, s, nodes.data(), nullptr));
      const std::size_t begin = corners == 4
                                    ? raw_.tets.cells.size()
                                    : (corners == 3 ? raw_.triangles.cells.size() : raw_.edges.cells.size());
      sections_.push_back({name.data(), first, corners, begin, n / static_cast<std::size_t>(corners)});
      if (corners == 4) append(nodes, raw_.tets);
      if (corners == 3) append(nodes, raw_.triangles);
      if (corners == 2) append(nodes, raw_.edges);
    }
  }

  /// Gives the element its tag when it is a facet.
  void tag_element(cgsize_t element, int facet_corners, Index tag) {
    for (const Section& s : sections_) {
      if (s.corners != facet_corners || element < s.first ||
          element >= s.first + static_cast<cgsize_t>(s.count))
        continue;
      (facet_corners == 3 ? raw_.triangles.tags
                          : raw_.edges.tags)[s.begin + static_cast<std::size_t>(element - s.first)] = tag;
      return;
    }
  }

  void read_conditions() {
    const int corners = raw_.tets.cells.empty() ? 2 : 3;
    TagNames& names_of_tags = corners == 3 ? raw_.triangles.names : raw_.edges.names;
    int count = 0;
    file_.check(cg_nbocos(file_.id(), 1, 1, &count));
    std::vector<std::string> names;
    std::vector<std::optional<Index>> given;
    std::vector<std::vector<cgsize_t>> elements;
    for (int b = 1; b <= count; ++b) {
      std::array<char, 64> name{};
      CGNS_ENUMT(BCType_t) type{};
      CGNS_ENUMT(PointSetType_t) set{};
      CGNS_ENUMT(DataType_t) normals{};
      CGNS_ENUMT(GridLocation_t) location{};
      cgsize_t points = 0, normal_size = 0;
      int index = 0, sets = 0;
      file_.check(cg_boco_info(file_.id(), 1, 1, b, name.data(), &type, &set, &points, &index, &normal_size,
                               &normals, &sets));
      file_.check(cg_boco_gridlocation_read(file_.id(), 1, 1, b, &location));
      std::vector<cgsize_t> list(bounded(points, 1, "points of a boundary condition"));
      file_.check(cg_boco_read(file_.id(), 1, 1, b, list.data(), nullptr));
      if (location == CGNS_ENUMV(Vertex) && set != CGNS_ENUMV(ElementRange) && set != CGNS_ENUMV(ElementList))
        continue;
      names.emplace_back(name.data());
      int tag = 0;
      file_.check(cg_goto(file_.id(), 1, "Zone_t", 1, "ZoneBC_t", 1, "BC_t", b, "end"));
      given.push_back(cg_ordinal_read(&tag) == CG_OK ? std::optional<Index>(tag) : std::nullopt);
      if ((set == CGNS_ENUMV(PointRange) || set == CGNS_ENUMV(ElementRange)) && list.size() == 2) {
        const cgsize_t first = list[0], last = list[1];
        if (first < 1 || last - first > static_cast<cgsize_t>(most_))
          file_.fail(fmt::format("boundary condition \"{}\": elements {} to {}", name.data(), first, last));
        list.clear();
        for (cgsize_t e = first; e <= last; ++e) list.push_back(e);
      }
      elements.push_back(std::move(list));
    }
    const std::vector<Index> tags = tags_of_names(names, given, "facet", names_of_tags);
    for (std::size_t b = 0; b < names.size(); ++b)
      for (const cgsize_t e : elements[b]) tag_element(e, corners, tags[b]);
  }

  void read_solution(int number) {
    std::array<char, 64> name{};
    CGNS_ENUMT(GridLocation_t) location{};
    file_.check(cg_sol_info(file_.id(), 1, 1, number, name.data(), &location));
    const bool cells = location == CGNS_ENUMV(CellCenter);
    if (!cells && location != CGNS_ENUMV(Vertex)) return;
    const std::size_t count = cells ? cells_ : points_;
    cgsize_t first = 1;
    auto last = static_cast<cgsize_t>(count);
    int fields = 0;
    file_.check(cg_nfields(file_.id(), 1, 1, number, &fields));
    std::vector<MeshField> columns;
    for (int f = 1; f <= fields; ++f) {
      CGNS_ENUMT(DataType_t) type{};
      file_.check(cg_field_info(file_.id(), 1, 1, number, f, &type, name.data()));
      if (count == 0) continue;
      if (std::string_view(name.data()) == kRegion && type == CGNS_ENUMV(Integer)) {
        std::vector<Index> tags(count);
        file_.check(cg_field_read(file_.id(), 1, 1, number, name.data(), CGNS_ENUMV(Integer), &first, &last,
                                  tags.data()));
        (cells ? (raw_.tets.cells.empty() ? raw_.triangles.tags : raw_.tets.tags) : raw_.point_tags) =
            std::move(tags);
        continue;
      }
      columns.push_back({name.data(), 1, std::vector<double>(count)});
      file_.check(cg_field_read(file_.id(), 1, 1, number, name.data(), CGNS_ENUMV(RealDouble), &first, &last,
                                columns.back().values.data()));
    }
    join(columns, count, cells ? raw_.cell_fields : raw_.point_fields);
  }

  /// Columns aX, aY, aZ are the vector a; aXX, aXY, ... the tensor a.
  void join(std::vector<MeshField>& columns, std::size_t count, std::vector<MeshField>& to) const {
    const auto matches = [&](std::size_t at, std::span<const char* const> suffixes, const std::string& stem) {
      const std::size_t n = suffixes.size();
      if (at + n > columns.size()) return false;
      for (std::size_t k = 0; k < n; ++k)
        if (columns[at + k].name != stem + suffixes[k]) return false;
      return true;
    };
    for (std::size_t at = 0; at < columns.size();) {
      const std::string& name = columns[at].name;
      const std::string one = name.substr(0, name.size() - std::min<std::size_t>(1, name.size()));
      const std::string two = name.substr(0, name.size() - std::min<std::size_t>(2, name.size()));
      const auto d = static_cast<std::size_t>(raw_.dimension);
      std::size_t n = 1;
      std::string stem = name;
      if (matches(at, d == 3 ? std::span<const char* const>(kTensorSuffix<3>) : kTensorSuffix<2>, two)) {
        n = d == 3 ? 6 : 3;
        stem = two;
      } else if (matches(at, std::span(kVectorSuffix).first(d), one)) {
        n = d;
        stem = one;
      }
      MeshField joined{stem, static_cast<int>(n), std::vector<double>(count * n)};
      for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = 0; i < count; ++i) joined.values[i * n + k] = columns[at + k].values[i];
      to.push_back(std::move(joined));
      at += n;
    }
  }

  CgnsFile file_;
  Source source_;
  std::size_t most_;
  std::size_t points_ = 0, cells_ = 0;
  std::vector<Section> sections_;
  RawMesh raw_;
};

}  // namespace

AnyMesh read_cgns(const fs::path& path) {
  const std::size_t size =
      MappedFile(path).bytes().size();  // missing files and folders are told as elsewhere
  return CgnsReader(path, size).read();
}

template <int D>
void write_cgns(WriteJob& job, const Mesh<D>& mesh) {
  const OutputFile& out = job.files.add(job.path);
  CgnsFile file(out.temporary_path(), CG_MODE_WRITE, job.path.string(), ErrorCode::kFileWrite);
  CgnsWriter<D>(file, mesh, job.lost).write();
  file.close();
}

template void write_cgns<2>(WriteJob&, const Mesh<2>&);
template void write_cgns<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io

#endif
