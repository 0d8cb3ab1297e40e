// The writing half of mesh/io/gmf.h.
#include <fmt/format.h>

#include <bit>
#include <limits>

#include "mesh/io/gmf.h"
#include "mesh/io/gmf_source.h"
#include "mesh/io/records.h"

namespace lamina::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are written in host order");

/// Sections of one file.
class GmfWriter {
 public:
  GmfWriter(OutputFile& out, int dimension, GmfForm form, std::size_t payload_bytes)
      : out_(&out), ascii_(form.ascii), version_(form.version) {
    constexpr std::size_t kHeaders = 4096;
    constexpr std::size_t kNarrow = std::numeric_limits<std::int32_t>::max();
    if (version_ == 0) version_ = ascii_ || payload_bytes + kHeaders <= kNarrow ? 2 : 3;
    if (!ascii_ && version_ == 2 && payload_bytes + kHeaders > kNarrow)
      throw Error(
          ErrorCode::kParameter,
          fmt::format("GMF version 2 has 31-bit positions and this mesh takes {} bytes; use version 3",
                      payload_bytes));
    if (ascii_) {
      out.write(fmt::format("MeshVersionFormatted {}\n\nDimension {}\n", version_, dimension));
      return;
    }
    word(1);
    word(version_);
    word(static_cast<std::int32_t>(Gmf::kDimension));
    position(8 + 4 + position_size() + 4);
    word(dimension);
  }
  [[nodiscard]] bool ascii() const { return ascii_; }
  [[nodiscard]] std::size_t integer_size() const { return version_ > 3 ? 8 : 4; }

  /// Keyword, position of the next one, count; `header` words follow the count.
  void begin(Gmf keyword, std::string_view name, std::size_t count, std::size_t reals, std::size_t integers,
             std::size_t header = 0) {
    if (ascii_) {
      out_->write(fmt::format("\n{}\n{}\n", name, count));
      return;
    }
    word(static_cast<std::int32_t>(keyword));
    position(out_->written() + position_size() + integer_size() + 4 * header +
             count * (8 * reals + integer_size() * integers));
    if (version_ > 3) {
      raw(static_cast<std::int64_t>(count));
    } else {
      word(static_cast<std::int32_t>(count));
    }
  }
  void word(std::int32_t value) { raw(value); }
  void end() {
    if (ascii_) {
      out_->write("\nEnd\n");
    } else {
      word(static_cast<std::int32_t>(Gmf::kEnd));
      position(0);
    }
  }

  void real(double value, Records& to) const {
    if (!ascii_) return to.raw(value);
    to.real(value);
    to.character(' ');
  }
  void integer(Index value, Records& to, char end = ' ') const {
    if (!ascii_) return version_ > 3 ? to.raw<std::int64_t>(value) : to.raw<std::int32_t>(value);
    to.integer(value);
    to.character(end);
  }
  OutputFile& out() { return *out_; }

 private:
  template <class T>
  void raw(T value) {
    out_->write(&value, sizeof(T));
  }
  [[nodiscard]] std::size_t position_size() const { return version_ > 2 ? 8 : 4; }
  void position(std::size_t value) {
    if (version_ > 2) {
      raw(static_cast<std::int64_t>(value));
    } else {
      raw(static_cast<std::int32_t>(value));
    }
  }

  OutputFile* out_;
  bool ascii_;
  int version_;
};

template <std::size_t N>
void write_cells(GmfWriter& to, Gmf keyword, std::string_view name,
                 const std::vector<std::array<Index, N>>& cells, const std::vector<Index>& tags) {
  if (cells.empty()) return;
  to.begin(keyword, name, cells.size(), 0, N + 1);
  write_records(to.out(), cells.size(), [&](std::size_t i, Records& r) {
    for (const Index v : cells[i]) to.integer(v + 1, r);
    to.integer(tags.empty() ? 0 : tags[i], r, '\n');
  });
}

void write_list(GmfWriter& to, Gmf keyword, std::string_view name, const std::vector<Index>& list) {
  if (list.empty()) return;
  to.begin(keyword, name, list.size(), 0, 1);
  write_records(to.out(), list.size(), [&](std::size_t i, Records& r) { to.integer(list[i] + 1, r, '\n'); });
}

}  // namespace

template <int D>
void write_gmf(OutputFile& out, const Mesh<D>& mesh, GmfForm form) {
  const std::size_t integer = form.version > 3 ? 8 : 4;
  const RequiredParts& required = mesh.required;
  const std::size_t listed = mesh.corners.size() + mesh.ridges.size() + required.points.size() +
                             required.edges.size() + required.facets.size() + required.cells.size();
  GmfWriter to(out, D, form,
               mesh.points.size() * (8 * D + integer) +
                   integer * (mesh.cells.size() * (D + 2) + mesh.facets.size() * (D + 1) +
                              mesh.edges.size() * 3 + listed));
  to.begin(Gmf::kVertices, "Vertices", mesh.points.size(), D, 1);
  write_records(out, mesh.points.size(), [&](std::size_t i, Records& r) {
    for (int k = 0; k < D; ++k) to.real(mesh.points[i][k], r);
    to.integer(mesh.point_tags.empty() ? 0 : mesh.point_tags[i], r, '\n');
  });
  if constexpr (D == 2) {
    write_cells(to, Gmf::kEdges, "Edges", mesh.facets, mesh.facet_tags);
    write_cells(to, Gmf::kTriangles, "Triangles", mesh.cells, mesh.cell_tags);
  } else {
    write_cells(to, Gmf::kEdges, "Edges", mesh.edges, mesh.edge_tags);
    write_cells(to, Gmf::kTriangles, "Triangles", mesh.facets, mesh.facet_tags);
    write_cells(to, Gmf::kTetrahedra, "Tetrahedra", mesh.cells, mesh.cell_tags);
  }
  write_list(to, Gmf::kCorners, "Corners", mesh.corners);
  write_list(to, Gmf::kRequiredVertices, "RequiredVertices", required.points);
  if constexpr (D == 3) write_list(to, Gmf::kRidges, "Ridges", mesh.ridges);
  write_list(to, Gmf::kRequiredEdges, "RequiredEdges", D == 3 ? required.edges : required.facets);
  write_list(to, Gmf::kRequiredTriangles, "RequiredTriangles", D == 3 ? required.facets : required.cells);
  to.end();
}

void write_gmf_solution(OutputFile& out, const GmfSolution& solution, GmfForm form) {
  const std::size_t width = solution.width();
  const std::size_t count = solution.values.size() / width;
  GmfWriter to(out, solution.dimension, form, 8 * solution.values.size());
  to.begin(Gmf::kSolAtVertices, "SolAtVertices", count, width, 0, 1 + solution.components.size());
  std::vector<int> words = {static_cast<int>(solution.components.size())};
  for (const int n : solution.components) words.push_back(n == 1 ? 1 : n == solution.dimension ? 2 : 3);
  if (to.ascii()) {
    out.write(fmt::format("{}\n", fmt::join(words, " ")));
  } else {
    for (const int word : words) to.word(word);
  }
  write_records(out, count, [&](std::size_t i, Records& r) {
    for (std::size_t k = 0; k < width; ++k) to.real(solution.values[i * width + k], r);
    if (to.ascii()) r.character('\n');
  });
  to.end();
}

template void write_gmf<2>(OutputFile&, const Mesh<2>&, GmfForm);
template void write_gmf<3>(OutputFile&, const Mesh<3>&, GmfForm);

}  // namespace lamina::io
