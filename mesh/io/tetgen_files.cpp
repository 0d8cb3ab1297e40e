#include "mesh/io/tetgen_files.h"

#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "mesh/io/records.h"
#include "mesh/io/text.h"

namespace lamina::io {
namespace {

namespace fs = std::filesystem;

fs::path with_extension(fs::path path, const char* extension) { return path.replace_extension(extension); }

/// Reads the numbers that count the records: from `first` on, without gaps.
void expect_number(TextSource& in, std::int64_t expected) {
  const std::int64_t number = in.integer();
  if (number != expected)
    in.fail(fmt::format("number {}, expected {}: records must be counted without gaps", number, expected));
}

/// Reads .node; returns the number of the first point.
std::int64_t read_nodes(TextSource in, RawMesh& raw) {
  const std::int64_t n = in.integer();
  raw.dimension = static_cast<int>(in.integer(2, 3));
  const auto attributes = static_cast<int>(in.integer(0, 1000));
  const bool marked = in.integer(0, 1) == 1;
  in.expect(n, 1 + raw.dimension + attributes + marked);
  raw.points.assign(static_cast<std::size_t>(n), Vec3::Zero());
  if (marked) raw.point_tags.resize(n);
  MeshField field{"attributes", std::max(attributes, 1), {}};
  field.values.reserve(n * attributes);
  std::int64_t first = 0;
  for (std::int64_t i = 0; i < n; ++i) {
    if (i == 0) {
      first = in.integer(0, 1);
    } else {
      expect_number(in, first + i);
    }
    for (int k = 0; k < raw.dimension; ++k) raw.points[i][k] = in.real();
    for (int k = 0; k < attributes; ++k) field.values.push_back(in.real());
    if (marked) raw.point_tags[i] = in.index();
  }
  if (attributes > 0) raw.point_fields.push_back(std::move(field));
  return first;
}

template <int N>
std::array<Index, N> read_corners(TextSource& in, std::int64_t first) {
  std::array<Index, N> cell;
  for (Index& v : cell) v = static_cast<Index>(in.integer(first, std::numeric_limits<Index>::max()) - first);
  return cell;
}

template <int N>
void read_cells(TextSource in, std::int64_t first, RawCells<N>& to, std::vector<MeshField>& fields) {
  to.place = ".ele";
  const std::int64_t n = in.integer(), corners = in.integer();
  if (corners != N)
    fail_unsupported(in.source(),
                     fmt::format("cells of {} nodes; {} are read in this dimension", corners, N));
  const auto attributes = static_cast<int>(in.integer(0, 1000));
  in.expect(n, 1 + N + attributes);
  MeshField field{"attributes", std::max(attributes, 1), {}};
  field.values.reserve(n * attributes);
  to.cells.reserve(n);
  bool whole = attributes == 1;
  for (std::int64_t i = 0; i < n; ++i) {
    expect_number(in, first + i);
    to.cells.push_back(read_corners<N>(in, first));
    for (int k = 0; k < attributes; ++k) {
      const double v = in.real();
      field.values.push_back(v);
      whole = whole && v == std::floor(v) && std::abs(v) <= std::numeric_limits<Index>::max();
    }
  }
  if (whole) {
    for (const double v : field.values) to.tags.push_back(static_cast<Index>(v));
  } else if (attributes > 0) {
    fields.push_back(std::move(field));
  }
}

template <int N>
void read_facets(TextSource in, std::int64_t first, RawCells<N>& to) {
  to.place = N == 3 ? ".face" : ".edge";
  const std::int64_t n = in.integer();
  const bool marked = in.integer(0, 1) == 1;
  in.expect(n, 1 + N + marked);
  to.cells.reserve(n);
  for (std::int64_t i = 0; i < n; ++i) {
    expect_number(in, first + i);
    to.cells.push_back(read_corners<N>(in, first));
    if (marked) to.tags.push_back(in.index());
  }
}

template <std::size_t N>
void write_cells(OutputFile& out, const std::vector<std::array<Index, N>>& cells,
                 const std::vector<Index>& tags) {
  write_records(out, cells.size(), [&](std::size_t i, Records& to) {
    to.integer(static_cast<std::int64_t>(i + 1));
    for (const Index v : cells[i]) {
      to.character(' ');
      to.integer(v + 1);
    }
    if (!tags.empty()) {
      to.character(' ');
      to.integer(tags[i]);
    }
    to.character('\n');
  });
}

}  // namespace

AnyMesh parse_tetgen(const TetgenTexts& texts) {
  RawMesh raw;
  const std::int64_t first = read_nodes(TextSource(texts.nodes, '#'), raw);
  const TextSource cells(texts.cells, '#'), facets(texts.facets, '#');
  if (raw.dimension == 3) {
    read_cells(cells, first, raw.tets, raw.cell_fields);
    if (!texts.facets.bytes.empty()) read_facets(facets, first, raw.triangles);
  } else {
    read_cells(cells, first, raw.triangles, raw.cell_fields);
    if (!texts.facets.bytes.empty()) read_facets(facets, first, raw.edges);
  }
  return assemble(std::move(raw), texts.cells);
}

AnyMesh read_tetgen_files(const fs::path& path) {
  const fs::path node = with_extension(path, ".node"), ele = with_extension(path, ".ele");
  const MappedFile nodes(node), cells(ele);
  // The dimension stands behind the number of points.
  const Source source{nodes.bytes(), node.string()};
  TextSource head(source, '#');
  head.integer();
  const fs::path face = with_extension(path, head.integer() == 2 ? ".edge" : ".face");
  std::error_code ec;
  const std::unique_ptr<MappedFile> facets =
      fs::exists(face, ec) ? std::make_unique<MappedFile>(face) : nullptr;
  return parse_tetgen({source,
                       {cells.bytes(), ele.string()},
                       {facets ? facets->bytes() : std::string_view(), face.string()}});
}

template <int D>
void write_tetgen_files(WriteJob& job, const Mesh<D>& mesh) {
  OutputFile& nodes = job.files.add(with_extension(job.path, ".node"));
  nodes.write(fmt::format("{} {} 0 {}\n", mesh.points.size(), D, mesh.point_tags.empty() ? 0 : 1));
  write_records(nodes, mesh.points.size(), [&](std::size_t i, Records& to) {
    to.integer(static_cast<std::int64_t>(i + 1));
    for (int k = 0; k < D; ++k) {
      to.character(' ');
      to.real(mesh.points[i][k]);
    }
    if (!mesh.point_tags.empty()) {
      to.character(' ');
      to.integer(mesh.point_tags[i]);
    }
    to.character('\n');
  });
  OutputFile& cells = job.files.add(with_extension(job.path, ".ele"));
  cells.write(fmt::format("{} {} {}\n", mesh.cells.size(), D + 1, mesh.cell_tags.empty() ? 0 : 1));
  write_cells(cells, mesh.cells, mesh.cell_tags);
  OutputFile& facets = job.files.add(with_extension(job.path, D == 3 ? ".face" : ".edge"));
  facets.write(fmt::format("{} {}\n", mesh.facets.size(), mesh.facet_tags.empty() ? 0 : 1));
  write_cells(facets, mesh.facets, mesh.facet_tags);
}

std::vector<fs::path> tetgen_files(const fs::path& path) {
  return {with_extension(path, ".node"), with_extension(path, ".ele"), with_extension(path, ".face"),
          with_extension(path, ".edge")};
}

template void write_tetgen_files<2>(WriteJob&, const Mesh<2>&);
template void write_tetgen_files<3>(WriteJob&, const Mesh<3>&);

}  // namespace lamina::io
