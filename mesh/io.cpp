// Chooses the format by the extension; the formats themselves are in mesh/io.
#include "mesh/io.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "core/error.h"
#include "core/file.h"
#include "core/parallel.h"
#include "mesh/io/gmf.h"
#include "mesh/io/vtu.h"

namespace lamina {
namespace {

bool is_mesh_extension(const std::string& extension) {
  return extension == ".vtu" || extension == ".mesh" || extension == ".meshb";
}

io::GmfForm form_of(const std::string& extension) {
  return extension == ".meshb" || extension == ".solb" ? io::GmfForm::kBinary : io::GmfForm::kAscii;
}

[[noreturn]] void fail_extension(const std::filesystem::path& path, const char* known) {
  throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: unknown extension \"{}\"; known are {}",
                                                       path.string(), path.extension().string(), known));
}

template <int D>
void check_sizes(const std::filesystem::path& path, const Mesh<D>& mesh) {
  const auto fits = [](std::size_t tags, std::size_t items) { return tags == 0 || tags == items; };
  if (!fits(mesh.cell_tags.size(), mesh.cells.size()) || !fits(mesh.facet_tags.size(), mesh.facets.size()) ||
      !fits(mesh.point_tags.size(), mesh.points.size()))
    throw Error(ErrorCode::kParameter,
                fmt::format("{}: a mesh with another number of tags than of cells, facets or "
                            "points cannot be written",
                            path.string()));
}

template <int D>
Metric<D> metric_of(const io::GmfSolution& solution, std::size_t i, const std::filesystem::path& path) {
  const double* v = solution.values.data() + i * static_cast<std::size_t>(solution.components);
  if (solution.components == 1) {
    if (v[0] > 0.0 && std::isfinite(v[0])) return Metric<D>::isotropic(v[0]);
    throw Error(ErrorCode::kParameter,
                fmt::format("{}: the size of vertex {} (counted from 0) is {}, it must be positive",
                            path.string(), i, v[0]));
  }
  Sym<D> tensor;
  std::copy(v, v + kSymSize<D>, tensor.begin());
  const bool finite = std::all_of(tensor.begin(), tensor.end(), [](double t) { return std::isfinite(t); });
  if (const auto metric = finite ? Metric<D>::from_tensor(tensor) : std::nullopt) return *metric;
  throw Error(ErrorCode::kParameter,
              fmt::format("{}: the tensor of vertex {} (counted from 0), {}, is not positive definite",
                          path.string(), i, fmt::join(tensor, " ")));
}

}  // namespace

bool is_readable_mesh(const std::filesystem::path& path) { return is_mesh_extension(lower_extension(path)); }

bool is_writable_mesh(const std::filesystem::path& path) { return is_mesh_extension(lower_extension(path)); }

AnyMesh read_mesh(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (!is_mesh_extension(extension)) fail_extension(path, ".vtu, .mesh and .meshb");
  const MappedFile file(path);
  try {
    return extension == ".vtu" ? io::parse_vtu(file.bytes(), path.string())
                               : io::parse_gmf(file.bytes(), path.string());
  } catch (const std::bad_alloc&) {  // zlib can pack a thousand times the size of the file into it
    throw Error(ErrorCode::kFileUnreadable,
                fmt::format("{}: the mesh does not fit in memory", path.string()));
  }
}

template <int D>
void write_mesh(const std::filesystem::path& path, const Mesh<D>& mesh) {
  const std::string extension = lower_extension(path);
  if (!is_mesh_extension(extension)) fail_extension(path, ".vtu, .mesh and .meshb");
  check_sizes(path, mesh);
  OutputFile out(path);
  if (extension == ".vtu") {
    io::write_vtu(out, mesh);
  } else {
    io::write_gmf(out, mesh, form_of(extension));
  }
  out.commit();
}

template <int D>
std::vector<Metric<D>> read_metric(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  if (extension != ".sol" && extension != ".solb") fail_extension(path, ".sol and .solb");
  const MappedFile file(path);
  const io::GmfSolution solution = io::parse_gmf_solution(file.bytes(), path.string());
  if (solution.dimension != D)
    throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: a solution of dimension {} where {} is needed",
                                                         path.string(), solution.dimension, D));
  std::vector<Metric<D>> metric(solution.values.size() / static_cast<std::size_t>(solution.components));
  // Serial, so that the first bad vertex is the one named.
  for (std::size_t i = 0; i < metric.size(); ++i) metric[i] = metric_of<D>(solution, i, path);
  return metric;
}

template <int D>
void write_metric(const std::filesystem::path& path, const std::vector<Metric<D>>& metric) {
  const std::string extension = lower_extension(path);
  if (extension != ".sol" && extension != ".solb") fail_extension(path, ".sol and .solb");
  constexpr auto width = static_cast<std::size_t>(kSymSize<D>);
  io::GmfSolution solution{D, kSymSize<D>, std::vector<double>(metric.size() * width)};
  for_each_index(metric.size(), [&](std::size_t i) {
    const Sym<D> tensor = metric[i].tensor();
    std::copy(tensor.begin(), tensor.end(), solution.values.begin() + static_cast<std::ptrdiff_t>(i * width));
  });
  OutputFile out(path);
  io::write_gmf_solution(out, solution, form_of(extension));
  out.commit();
}

template void write_mesh<2>(const std::filesystem::path&, const Mesh<2>&);
template void write_mesh<3>(const std::filesystem::path&, const Mesh<3>&);
template std::vector<Metric<2>> read_metric<2>(const std::filesystem::path&);
template std::vector<Metric<3>> read_metric<3>(const std::filesystem::path&);
template void write_metric<2>(const std::filesystem::path&, const std::vector<Metric<2>>&);
template void write_metric<3>(const std::filesystem::path&, const std::vector<Metric<3>>&);

}  // namespace lamina
