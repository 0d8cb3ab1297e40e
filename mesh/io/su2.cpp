#include "mesh/io/su2.h"

#include <fmt/format.h>

#include <charconv>
#include <map>

#include "mesh/io/records.h"
#include "mesh/io/text.h"

namespace lamina::io {
namespace {

/// Element types, numbered as in VTK.
constexpr int kLine = 3, kTriangle = 5, kTetrahedron = 10;
constexpr std::string_view kKind = "marker";
constexpr std::string_view kTagComment = "% tag ", kTagIs = " is ";

class Su2Reader {
 public:
  explicit Su2Reader(const Source& source) : source_(source), text_(source, '%') {}

  AnyMesh read() {
    read_tag_comments();
    raw_.dimension = 0;
    while (!text_.at_end()) {
      const std::string_view line = text_.line();
      const std::size_t equals = line.find('=');
      if (equals == std::string_view::npos) continue;  // data of a key that is not read
      read_key(trim(line.substr(0, equals)), trim(line.substr(equals + 1)));
    }
    if (raw_.dimension == 0) fail_format(source_, "end", "has no NDIME");
    const std::vector<Index> tags = tags_of_names(names_, given_, kKind, names_of_tags_);
    for (auto* facets : {&raw_.edges.tags, &raw_.triangles.tags})
      for (Index& t : *facets) t = tags[t];
    (raw_.dimension == 2 ? raw_.edges.names : raw_.triangles.names) = names_of_tags_;
    if (raw_.dimension == 2) raw_.triangles.tags.clear();
    return assemble(std::move(raw_), source_);
  }

 private:
  static std::string_view trim(std::string_view s) {
    while (!s.empty() && (s.front() == ' ' || s.front() == '\t')) s.remove_prefix(1);
    while (!s.empty() && (s.back() == ' ' || s.back() == '\t')) s.remove_suffix(1);
    return s;
  }

  void read_tag_comments() {
    for (std::size_t at = 0; at < source_.bytes.size() && source_.bytes[at] == '%';) {
      const std::size_t end = std::min(source_.bytes.find('\n', at), source_.bytes.size());
      std::string_view line = source_.bytes.substr(at, end - at);
      at = end + 1;
      if (line.substr(0, kTagComment.size()) != kTagComment) continue;
      line.remove_prefix(kTagComment.size());
      Index tag = 0;
      const char* stop = std::from_chars(line.data(), line.data() + line.size(), tag).ptr;
      line.remove_prefix(static_cast<std::size_t>(stop - line.data()));
      if (line.substr(0, kTagIs.size()) == kTagIs)
        tags_in_comments_.emplace(trim(line.substr(kTagIs.size())), tag);
    }
  }

  std::int64_t number(std::string_view value, std::int64_t lowest, std::int64_t highest) const {
    std::int64_t n = 0;
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), n);
    if (error != std::errc() || n < lowest || n > highest)
      text_.fail(fmt::format("\"{}\" must be a number in {}..{}", shown(value), lowest, highest));
    return n;
  }
  std::int64_t count(std::string_view value, int numbers) {
    const std::int64_t n = number(value, 0, std::numeric_limits<Index>::max());
    text_.expect(n, numbers);
    return n;
  }

  void read_key(std::string_view key, std::string_view value) {
    if (key == "NDIME") {
      raw_.dimension = static_cast<int>(number(value, 2, 3));
    } else if (key == "NZONE") {
      if (number(value, 1, 1000) != 1) fail_unsupported(source_, "holds several zones; give one");
    } else if (key == "NELEM") {
      need_dimension();
      read_elements(count(value, raw_.dimension + 2), raw_.dimension, false);
    } else if (key == "NPOIN") {
      need_dimension();
      read_points(value);
    } else if (key == "MARKER_TAG") {
      names_.emplace_back(value.substr(0, 1000));
      const auto known = tags_in_comments_.find(names_.back());
      given_.push_back(known == tags_in_comments_.end() ? std::nullopt : std::optional<Index>(known->second));
    } else if (key == "MARKER_ELEMS") {
      need_dimension();
      if (names_.empty()) text_.fail("MARKER_ELEMS before MARKER_TAG");
      read_elements(count(value, 2), raw_.dimension - 1, true);
    }
  }

  void need_dimension() const {
    if (raw_.dimension == 0) text_.fail("NDIME must come first");
  }

  void read_points(std::string_view value) {
    if (!raw_.points.empty()) text_.fail("a second NPOIN");
    raw_.points.assign(static_cast<std::size_t>(count(value, raw_.dimension)), Vec3::Zero());
    for (Vec3& x : raw_.points) {
      for (int k = 0; k < raw_.dimension; ++k) x[k] = text_.real();
      static_cast<void>(text_.line());
    }
  }

  template <int N>
  void read_corners(RawCells<N>& to, bool facet) {
    std::array<Index, N> cell;
    for (Index& v : cell) v = text_.index();
    to.cells.push_back(cell);
    if (facet) to.tags.push_back(static_cast<Index>(names_.size() - 1));
  }

  void read_elements(std::int64_t n, int dimension, bool facets) {
    for (std::int64_t i = 0; i < n; ++i) {
      const std::int64_t type = text_.integer();
      if (type == kTetrahedron && dimension == 3) {
        read_corners(raw_.tets, facets);
      } else if (type == kTriangle && dimension == 2) {
        read_corners(raw_.triangles, facets);
      } else if (type == kLine && dimension == 1) {
        read_corners(raw_.edges, facets);
      } else if (!facets || type != 1) {
        fail_unsupported(source_,
                         fmt::format("{}: element type {}; lines (3), triangles (5) and tetrahedra (10) "
                                     "are read, as facets and cells of the dimension",
                                     text_.place(), type));
      }
      static_cast<void>(text_.line());  // the number of the element
    }
    raw_.tets.place = raw_.triangles.place = raw_.edges.place = "NELEM or MARKER_ELEMS";
  }

  const Source& source_;
  TextSource text_;
  RawMesh raw_;
  std::vector<std::string> names_;
  std::vector<std::optional<Index>> given_;
  std::map<std::string, Index, std::less<>> tags_in_comments_;
  TagNames names_of_tags_;
};

template <class Cells>
void write_elements(OutputFile& out, int type, std::size_t n, const Cells& cell) {
  write_records(out, n, [&](std::size_t i, Records& to) {
    to.integer(type);
    for (const Index v : cell(i)) {
      to.character(' ');
      to.integer(v);
    }
    to.character('\n');
  });
}

}  // namespace

AnyMesh parse_su2(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  return Su2Reader(source).read();
}

template <int D>
void write_su2(WriteJob& job, const Mesh<D>& mesh) {
  OutputFile& out = job.files.add(job.path);
  const TagGroups groups = group_by_tag(mesh.facet_tags, mesh.facets.size());
  const std::vector<Index>& tags = groups.tags;
  const std::vector<std::string> names = plain_names(tags, mesh.facet_names, kKind, job.lost);
  for (std::size_t k = 0; k < tags.size(); ++k)
    if (names[k] != name_of_tag({}, tags[k], kKind))
      out.write(fmt::format("{}{}{}{}\n", kTagComment, tags[k], kTagIs, names[k]));
  out.write(fmt::format("NDIME= {}\nNELEM= {}\n", D, mesh.cells.size()));
  write_elements(
      out, D == 3 ? kTetrahedron : kTriangle,
      mesh.cells.size(), [&](std::size_t i) -> const auto& { return mesh.cells[i]; });
  out.write(fmt::format("NPOIN= {}\n", mesh.points.size()));
  write_records(out, mesh.points.size(), [&](std::size_t i, Records& to) {
    for (int k = 0; k < D; ++k) {
      to.real(mesh.points[i][k]);
      to.character(k + 1 < D ? ' ' : '\n');
    }
  });
  out.write(fmt::format("NMARK= {}\n", tags.size()));
  for (std::size_t k = 0; k < tags.size(); ++k) {
    const std::size_t begin = groups.start[k], n = groups.start[k + 1] - begin;
    out.write(fmt::format("MARKER_TAG= {}\nMARKER_ELEMS= {}\n", names[k], n));
    write_elements(
        out, D == 3 ? kTriangle : kLine,
        n, [&](std::size_t i) -> const auto& { return mesh.facets[groups.order[begin + i]]; });
  }
}

template void write_su2<2>(WriteJob&, const Mesh<2>&);
template void write_su2<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io
