#include "mesh/io/gmf.h"

#include <fmt/format.h>

#include <cstring>
#include <limits>

#include "mesh/io/gmf_source.h"
#include "mesh/io/raw.h"

namespace lamina::io {
namespace {

constexpr std::int64_t kIndexMax = std::numeric_limits<Index>::max();

template <class Tokens>
Index read_tag(Tokens& in, const Source& source) {
  const std::int64_t tag = in.integer();
  if (tag < std::numeric_limits<Index>::min() || tag > kIndexMax)
    fail_format(source, in.place(), fmt::format("the reference {} does not fit 32 bits", tag));
  return static_cast<Index>(tag);
}

template <class Tokens>
int read_dimension(Tokens& in, const Source& source) {
  const int dimension = in.word();
  if (dimension != 2 && dimension != 3)
    fail_format(source, in.place(), fmt::format("dimension {}, it must be 2 or 3", dimension));
  return dimension;
}

template <class Tokens>
void read_vertices(Tokens& in, const Source& source, RawMesh& raw) {
  if (!raw.points.empty()) fail_format(source, in.place(), "a second Vertices section");
  const std::int64_t n = in.count();
  in.expect(n, raw.dimension, 1);
  raw.points.assign(n, Vec3::Zero());
  raw.point_tags.resize(n);
  for (std::int64_t i = 0; i < n; ++i) {
    for (int k = 0; k < raw.dimension; ++k) raw.points[i][k] = in.real();
    raw.point_tags[i] = read_tag(in, source);
  }
}

template <int N, class Tokens>
void read_cells(Tokens& in, const Source& source, RawCells<N>& raw) {
  if (!raw.cells.empty()) fail_format(source, in.place(), "a second section of the same keyword");
  const std::int64_t n = in.count();
  raw.place = in.place();
  in.expect(n, 0, N + 1);
  raw.cells.resize(n);
  raw.tags.resize(n);
  for (std::int64_t i = 0; i < n; ++i) {
    for (Index& v : raw.cells[i]) {
      const std::int64_t vertex = in.integer();
      if (vertex < 1 || vertex > kIndexMax)
        fail_format(source, in.place(), fmt::format("vertex number {}; they are counted from 1", vertex));
      v = static_cast<Index>(vertex - 1);
    }
    raw.tags[i] = read_tag(in, source);
  }
}

/// Numbers of points, edges or triangles, which count from 1.
template <class Tokens>
void read_list(Tokens& in, const Source& source, std::vector<Index>& list) {
  if (!list.empty()) fail_format(source, in.place(), "a second section of the same keyword");
  const std::int64_t n = in.count();
  in.expect(n, 0, 1);
  list.resize(static_cast<std::size_t>(n));
  for (Index& i : list) {
    const std::int64_t number = in.integer();
    if (number < 1 || number > kIndexMax)
      fail_format(source, in.place(), fmt::format("number {} in a list; they are counted from 1", number));
    i = static_cast<Index>(number - 1);
  }
}

template <class Tokens>
AnyMesh read_mesh_sections(Tokens in, const Source& source) {
  RawMesh raw;
  bool has_dimension = false;
  for (Gmf keyword = in.next_keyword(); keyword != Gmf::kEnd; keyword = in.next_keyword()) {
    switch (keyword) {
      case Gmf::kDimension:
        if (has_dimension) fail_format(source, in.place(), "a second Dimension");
        raw.dimension = read_dimension(in, source);
        has_dimension = true;
        break;
      case Gmf::kVertices:
        if (!has_dimension) fail_format(source, in.place(), "Vertices before Dimension");
        read_vertices(in, source, raw);
        break;
      case Gmf::kEdges:
        read_cells(in, source, raw.edges);
        break;
      case Gmf::kTriangles:
        read_cells(in, source, raw.triangles);
        break;
      case Gmf::kTetrahedra:
        read_cells(in, source, raw.tets);
        break;
      case Gmf::kCorners:
        read_list(in, source, raw.corners);
        break;
      case Gmf::kRidges:
        read_list(in, source, raw.ridges);
        break;
      case Gmf::kRequiredVertices:
        read_list(in, source, raw.required.points);
        break;
      case Gmf::kRequiredEdges:
        read_list(in, source, raw.required.edges);
        break;
      case Gmf::kRequiredTriangles:
        read_list(in, source, raw.required.facets);
        break;
      default:
        break;
    }
  }
  return assemble(std::move(raw), source);
}

/// Reads a SolAtVertices section.
template <class Tokens>
void read_solution(Tokens& in, const Source& source, GmfSolution& solution) {
  const std::int64_t n = in.count();
  const int fields = in.word();
  constexpr int kMostFields = 10000;
  if (fields < 1 || fields > kMostFields)
    fail_format(source, in.place(),
                fmt::format("{} solutions a vertex; it must be 1 to {}", fields, kMostFields));
  for (int f = 0; f < fields; ++f) {
    const int type = in.word();
    if (type < 1 || type > 3)
      fail_unsupported(source, fmt::format("{}: solution type {}; 1 (scalar), 2 (vector) or 3 (symmetric "
                                           "tensor) is needed",
                                           in.place(), type));
    const int tensor = solution.dimension == 2 ? kSymSize<2> : kSymSize<3>;
    solution.components.push_back(type == 1 ? 1 : type == 2 ? solution.dimension : tensor);
  }
  const std::size_t width = solution.width();
  in.expect(n, static_cast<int>(width), 0);
  solution.values.resize(static_cast<std::size_t>(n) * width);
  for (double& v : solution.values) v = in.real();
}

template <class Tokens>
GmfSolution read_solution_sections(Tokens in, const Source& source) {
  GmfSolution solution;
  bool has_dimension = false;
  for (Gmf keyword = in.next_keyword(); keyword != Gmf::kEnd; keyword = in.next_keyword()) {
    if (keyword == Gmf::kDimension) {
      solution.dimension = read_dimension(in, source);
      has_dimension = true;
    } else if (keyword == Gmf::kSolAtVertices) {
      if (!has_dimension) fail_format(source, in.place(), "SolAtVertices before Dimension");
      read_solution(in, source, solution);
      return solution;
    }
  }
  fail_unsupported(source, "has no SolAtVertices");
}

}  // namespace

AnyMesh parse_gmf(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  if (is_binary_gmf(bytes)) return read_mesh_sections(BinaryGmf(source), source);
  return read_mesh_sections(AsciiGmf(source), source);
}

GmfSolution parse_gmf_solution(std::string_view bytes, const std::string& name) {
  const Source source{bytes, name};
  if (is_binary_gmf(bytes)) return read_solution_sections(BinaryGmf(source), source);
  return read_solution_sections(AsciiGmf(source), source);
}

}  // namespace lamina::io
