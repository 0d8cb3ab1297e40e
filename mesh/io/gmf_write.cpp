// The writing half of mesh/io/gmf.h: sections are formed in a buffer that is handed on whenever it is full.
#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cstring>
#include <limits>

#include "mesh/io/gmf.h"
#include "mesh/io/gmf_source.h"

namespace lamina::io {
namespace {

static_assert(std::endian::native == std::endian::little, "binary files are written in host order");

constexpr std::size_t kBuffer = std::size_t{4} << 20;
constexpr std::size_t kLongestNumber = 32;

/// Buffered output of numbers, binary (little-endian) or ascii.
class Numbers {
 public:
  Numbers(OutputFile& out, bool ascii, bool wide_positions)
      : out_(&out), ascii_(ascii), wide_(wide_positions) {
    buffer_.resize(kBuffer);
  }

  void real(double value) { ascii_ ? print(value) : put(value); }
  void integer(Index value) { ascii_ ? print(value) : put(value); }
  /// Ends a record.
  void end_record() {
    if (ascii_) buffer_[used_ - 1] = '\n';
    if (used_ > kBuffer - 16 * kLongestNumber) flush();
  }
  void text(std::string_view s) {
    flush();
    out_->write(s);
  }
  void position(std::int64_t value) { wide_ ? put(value) : put(static_cast<std::int32_t>(value)); }
  [[nodiscard]] std::int64_t position_size() const { return wide_ ? 8 : 4; }
  [[nodiscard]] std::int64_t written() const { return static_cast<std::int64_t>(out_->written() + used_); }
  [[nodiscard]] bool ascii() const { return ascii_; }
  void flush() {
    if (used_ > 0) out_->write(buffer_.data(), used_);
    used_ = 0;
  }

 private:
  template <class T>
  void put(T value) {
    std::memcpy(buffer_.data() + used_, &value, sizeof(T));
    used_ += sizeof(T);
  }
  template <class T>
  void print(T value) {
    char* at = buffer_.data() + used_;
    char* end = std::to_chars(at, at + kLongestNumber, value).ptr;
    *end++ = ' ';
    used_ += static_cast<std::size_t>(end - at);
  }

  OutputFile* out_;
  bool ascii_, wide_;
  std::vector<char> buffer_;
  std::size_t used_ = 0;
};

/// Keyword, position of the next one, count.
void begin_section(Numbers& to, Gmf keyword, std::string_view name, std::size_t count,
                   std::size_t record_bytes, std::size_t header_bytes = 4) {
  if (to.ascii()) {
    to.text(fmt::format("\n{}\n{}\n", name, count));
    return;
  }
  const std::int64_t next =
      to.written() + 4 + to.position_size() + static_cast<std::int64_t>(header_bytes + count * record_bytes);
  to.integer(static_cast<Index>(keyword));
  to.position(next);
  to.integer(static_cast<Index>(count));
}

void begin_file(Numbers& to, int dimension) {
  if (to.ascii()) {
    to.text(fmt::format("MeshVersionFormatted 2\n\nDimension {}\n", dimension));
    return;
  }
  to.integer(1);
  to.integer(to.position_size() == 8 ? 3 : 2);
  const std::int64_t next = to.written() + 4 + to.position_size() + 4;
  to.integer(static_cast<Index>(Gmf::kDimension));
  to.position(next);
  to.integer(dimension);
}

void end_file(Numbers& to) {
  if (to.ascii()) {
    to.text("\nEnd\n");
  } else {
    to.integer(static_cast<Index>(Gmf::kEnd));
    to.position(0);
  }
  to.flush();
}

template <std::size_t N>
void write_cells(Numbers& to, Gmf keyword, std::string_view name,
                 const std::vector<std::array<Index, N>>& cells, const std::vector<Index>& tags) {
  if (cells.empty()) return;
  begin_section(to, keyword, name, cells.size(), 4 * (N + 1));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    for (const Index v : cells[i]) to.integer(v + 1);
    to.integer(tags.empty() ? 0 : tags[i]);
    to.end_record();
  }
}

bool wide_positions(GmfForm form, std::size_t payload_bytes) {
  constexpr std::size_t kHeaders = 4096;
  return form == GmfForm::kBinaryWide ||
         payload_bytes + kHeaders > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
}

}  // namespace

template <int D>
void write_gmf(OutputFile& out, const Mesh<D>& mesh, GmfForm form) {
  const std::size_t point_bytes = 8 * D + 4;
  const std::size_t bytes =
      mesh.points.size() * point_bytes + 4 * (mesh.cells.size() * (D + 2) + mesh.facets.size() * (D + 1));
  Numbers to(out, form == GmfForm::kAscii, wide_positions(form, bytes));
  begin_file(to, D);
  begin_section(to, Gmf::kVertices, "Vertices", mesh.points.size(), point_bytes);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    for (int k = 0; k < D; ++k) to.real(mesh.points[i][k]);
    to.integer(mesh.point_tags.empty() ? 0 : mesh.point_tags[i]);
    to.end_record();
  }
  if constexpr (D == 2) {
    write_cells(to, Gmf::kEdges, "Edges", mesh.facets, mesh.facet_tags);
    write_cells(to, Gmf::kTriangles, "Triangles", mesh.cells, mesh.cell_tags);
  } else {
    write_cells(to, Gmf::kTriangles, "Triangles", mesh.facets, mesh.facet_tags);
    write_cells(to, Gmf::kTetrahedra, "Tetrahedra", mesh.cells, mesh.cell_tags);
  }
  end_file(to);
}

void write_gmf_solution(OutputFile& out, const GmfSolution& solution, GmfForm form) {
  const auto width = static_cast<std::size_t>(solution.components);
  const std::size_t count = solution.values.size() / width;
  Numbers to(out, form == GmfForm::kAscii, wide_positions(form, 8 * solution.values.size()));
  begin_file(to, solution.dimension);
  begin_section(to, Gmf::kSolAtVertices, "SolAtVertices", count, 8 * width, 12);
  to.integer(1);
  to.integer(solution.components == 1 ? 1 : 3);
  to.end_record();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < width; ++k) to.real(solution.values[i * width + k]);
    to.end_record();
  }
  end_file(to);
}

template void write_gmf<2>(OutputFile&, const Mesh<2>&, GmfForm);
template void write_gmf<3>(OutputFile&, const Mesh<3>&, GmfForm);

}  // namespace lamina::io
