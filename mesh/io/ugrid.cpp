#include "mesh/io/ugrid.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "mesh/io/records.h"
#include "mesh/io/text.h"

namespace lamina::io {
namespace {

/// Inner suffix of `mesh.lb8.ugrid`; none is ascii.
UgridForm form_of(const std::filesystem::path& path) {
  const std::string inner = lower_extension(path.stem());
  UgridForm form;
  form.big_endian = inner == ".b8" || inner == ".b8l";
  form.wide = inner == ".lb8l" || inner == ".b8l";
  form.ascii = !form.big_endian && !form.wide && inner != ".lb8";
  if (form.ascii && (inner == ".b4" || inner == ".lb4" || inner == ".r8" || inner == ".lr8" ||
                     inner == ".r4" || inner == ".lr4"))
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: UGRID in the form {}; known are lb8, b8, lb8l, b8l and ascii", path.string(),
                            inner));
  return form;
}

struct BinaryUgrid {
  ByteSource in;
  bool wide;
  std::int64_t integer() { return wide ? in.get<std::int64_t>() : in.get<std::int32_t>(); }
  double real() { return in.get<double>(); }
  void expect(std::int64_t n, int integers, int reals) {
    in.expect(n, static_cast<std::size_t>(integers) * (wide ? 8 : 4) + 8 * static_cast<std::size_t>(reals));
    if (n > std::numeric_limits<Index>::max()) in.fail(fmt::format("a count of {} does not fit 31 bits", n));
  }
  [[nodiscard]] std::string place() const { return in.place(); }
};

struct AsciiUgrid {
  TextSource in;
  std::int64_t integer() { return in.integer(); }
  double real() { return in.real(); }
  void expect(std::int64_t n, int integers, int reals) { in.expect(n, integers + reals); }
  [[nodiscard]] std::string place() const { return in.place(); }
};

template <int N, class Numbers>
void read_corners(Numbers& in, std::int64_t n, const Source& source, RawCells<N>& to) {
  to.place = in.place();
  in.expect(n, N, 0);
  to.cells.resize(n);
  for (auto& cell : to.cells)
    for (Index& v : cell) v = std::max(to_index(in.integer(), "node", source, in), Index{0}) - 1;
}

template <class Numbers>
AnyMesh read_numbers(Numbers in, const Source& source) {
  constexpr std::array<const char*, 7> kinds = {"nodes",    "triangles", "quadrilaterals", "tetrahedra",
                                                "pyramids", "prisms",    "hexahedra"};
  std::array<std::int64_t, 7> n;
  in.expect(7, 1, 0);
  for (auto& count : n) count = in.integer();
  for (const int kind : {2, 4, 5, 6})
    if (n[kind] != 0)
      fail_unsupported(
          source, fmt::format("holds {} {}; only triangles and tetrahedra are read", n[kind], kinds[kind]));
  RawMesh raw;
  in.expect(n[0], 0, 3);
  raw.points.resize(n[0]);
  for (Vec3& x : raw.points)
    for (int k = 0; k < 3; ++k) x[k] = in.real();
  read_corners(in, n[1], source, raw.triangles);
  for (auto& t : raw.triangles.cells) std::swap(t[1], t[2]);
  in.expect(n[1], 1, 0);
  raw.triangles.tags.resize(n[1]);
  for (Index& t : raw.triangles.tags) t = to_index(in.integer(), "surface id", source, in);
  read_corners(in, n[3], source, raw.tets);
  if (raw.tets.cells.empty()) fail_unsupported(source, "holds no tetrahedra");
  return assemble(std::move(raw), source);
}

}  // namespace

AnyMesh parse_ugrid(std::string_view bytes, const std::string& name, UgridForm form) {
  const Source source{bytes, name};
  if (form.ascii) return read_numbers(AsciiUgrid{TextSource(source)}, source);
  return read_numbers(BinaryUgrid{ByteSource(source, 0, form.big_endian), form.wide}, source);
}

AnyMesh read_ugrid(const std::filesystem::path& path) {
  const UgridForm form = form_of(path);
  const MappedFile file(path);
  return parse_ugrid(file.bytes(), path.string(), form);
}

void write_ugrid(WriteJob& job, const Mesh<3>& mesh) {
  const UgridForm form = form_of(job.path);
  OutputFile& out = job.files.add(job.path);
  const auto integer = [form](std::int64_t v, Records& to, char end = '\n') {
    if (form.wide) return to.raw(v, form.big_endian);
    if (!form.ascii) return to.raw(static_cast<std::int32_t>(v), form.big_endian);
    to.integer(v);
    to.character(end);
  };
  const std::array<std::size_t, 7> counts = {
      mesh.points.size(), mesh.facets.size(), 0, mesh.cells.size(), 0, 0, 0};
  write_records(out, 7, [&](std::size_t i, Records& to) {
    integer(static_cast<std::int64_t>(counts[i]), to, i < 6 ? ' ' : '\n');
  });
  write_records(out, mesh.points.size(), [&](std::size_t i, Records& to) {
    for (int k = 0; k < 3; ++k) {
      const double x = mesh.points[i][k];
      if (!form.ascii) {
        to.raw(x, form.big_endian);
      } else {
        to.real(x);
        to.character(k < 2 ? ' ' : '\n');
      }
    }
  });
  write_records(out, mesh.facets.size(), [&](std::size_t i, Records& to) {
    const auto& f = mesh.facets[i];
    integer(f[0] + 1, to, ' ');
    integer(f[2] + 1, to, ' ');
    integer(f[1] + 1, to);
  });
  write_records(out, mesh.facets.size(), [&](std::size_t i, Records& to) {
    integer(mesh.facet_tags.empty() ? 0 : mesh.facet_tags[i], to);
  });
  write_records(out, mesh.cells.size(), [&](std::size_t i, Records& to) {
    for (int k = 0; k < 4; ++k) integer(mesh.cells[i][k] + 1, to, k < 3 ? ' ' : '\n');
  });
}

}  // namespace lamina::io
