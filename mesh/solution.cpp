#include "mesh/solution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "mesh/io/format.h"
#include "mesh/io/gmf.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

void require_solution(const std::string& extension, const fs::path& path) {
  if (extension != ".sol" && extension != ".solb")
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: unknown extension \"{}\"; known are .sol and .solb", path.string(),
                            path.extension().string()));
}

template <int D>
io::GmfSolution read_file(const fs::path& path) {
  require_solution(lower_extension(path), path);
  const MappedFile file(path);
  io::GmfSolution solution = io::parse_gmf_solution(file.bytes(), path.string());
  if (solution.dimension != D)
    throw Error(ErrorCode::kFileUnsupported, fmt::format("{}: a solution of dimension {} where {} is needed",
                                                         path.string(), solution.dimension, D));
  return solution;
}

template <int D>
Metric<D> metric_of(const double* v, int components, std::size_t i, const fs::path& path) {
  if (components == 1) {
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

void write_file(OutputFile& out, const fs::path& path, const io::GmfSolution& solution) {
  io::write_gmf_solution(out, solution, {.ascii = lower_extension(path) == ".sol"});
}

template <int D>
void add_fields(const fs::path& solution, Mesh<D>& mesh) {
  std::vector<MeshField> fields = read_fields<D>(solution);
  const std::size_t n = fields.front().values.size() / static_cast<std::size_t>(fields.front().components);
  if (n != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{}: holds values of {} points, the mesh beside it has {}",
                                                   solution.string(), n, mesh.points.size()));
  mesh.point_fields = std::move(fields);
}

}  // namespace

fs::path solution_path(const fs::path& mesh) {
  fs::path path = mesh;
  return path.replace_extension(lower_extension(mesh) == ".mesh" ? ".sol" : ".solb");
}

std::optional<fs::path> find_solution(const fs::path& mesh) {
  std::error_code ec;
  for (const char* extension : {".solb", ".sol"}) {
    fs::path beside = mesh;
    if (fs::exists(beside.replace_extension(extension), ec)) return beside;
  }
  return std::nullopt;
}

AnyMesh read_mesh_and_fields(const fs::path& path, std::string& ignored) {
  AnyMesh any = read_mesh(path);
  ignored.clear();
  const MeshFormat* format = mesh_format(path);
  const auto solution = format->solution ? find_solution(path) : std::nullopt;
  if (!solution) return any;
  try {
    std::visit([&](auto& mesh) { add_fields(*solution, mesh); }, any);
  } catch (const Error& e) {
    ignored = e.what();
  }
  return any;
}

template <int D>
std::vector<MeshField> read_fields(const fs::path& path) {
  const io::GmfSolution solution = read_file<D>(path);
  const std::size_t width = solution.width(), n = solution.values.size() / width;
  std::vector<MeshField> fields;
  std::size_t first = 0;
  for (const int components : solution.components) {
    const auto count = static_cast<std::size_t>(components);
    const bool metric = solution.components.size() == 1 && components == kSymSize<D>;
    MeshField field{metric ? "metric" : fmt::format("{}{}", kSolutionName, fields.size() + 1), components,
                    std::vector<double>(n * count)};
    for_each_index(n, [&](std::size_t i) {
      for (std::size_t k = 0; k < count; ++k)
        field.values[i * count + k] = solution.values[i * width + first + k];
    });
    fields.push_back(std::move(field));
    first += count;
  }
  return fields;
}

template <int D>
void write_fields(OutputFile& out, const fs::path& path, const std::vector<MeshField>& fields) {
  io::GmfSolution solution{D, {}, {}};
  for (const MeshField& f : fields) solution.components.push_back(f.components);
  const std::size_t width = solution.width();
  const std::size_t n = fields.front().values.size() / static_cast<std::size_t>(fields.front().components);
  solution.values.resize(n * width);
  std::size_t first = 0;
  for (const MeshField& f : fields) {
    const auto count = static_cast<std::size_t>(f.components);
    for_each_index(n, [&](std::size_t i) {
      for (std::size_t k = 0; k < count; ++k)
        solution.values[i * width + first + k] = f.values[i * count + k];
    });
    first += count;
  }
  write_file(out, path, solution);
}

template <int D>
std::vector<Metric<D>> read_metric(const fs::path& path) {
  const io::GmfSolution solution = read_file<D>(path);
  const int components = solution.components.front();
  if (solution.components.size() != 1 || (components != 1 && components != kSymSize<D>))
    throw Error(ErrorCode::kFileUnsupported,
                fmt::format("{}: {} a vertex; a metric is one scalar or one symmetric tensor", path.string(),
                            solution.components.size() == 1
                                ? std::string("a vector")
                                : fmt::format("{} solutions", solution.components.size())));
  const std::size_t width = solution.width();
  std::vector<Metric<D>> metric(solution.values.size() / width);
  // Serial, so that the first bad vertex is the one named.
  for (std::size_t i = 0; i < metric.size(); ++i)
    metric[i] = metric_of<D>(solution.values.data() + i * width, components, i, path);
  return metric;
}

template <int D>
void write_metric(const fs::path& path, const std::vector<Metric<D>>& metric) {
  require_solution(lower_extension(path), path);
  constexpr auto width = static_cast<std::size_t>(kSymSize<D>);
  io::GmfSolution solution{D, {kSymSize<D>}, std::vector<double>(metric.size() * width)};
  for_each_index(metric.size(), [&](std::size_t i) {
    const Sym<D> tensor = metric[i].tensor();
    std::copy(tensor.begin(), tensor.end(), solution.values.begin() + static_cast<std::ptrdiff_t>(i * width));
  });
  OutputFile out(path);
  write_file(out, path, solution);
  out.commit();
}

template std::vector<MeshField> read_fields<2>(const fs::path&);
template std::vector<MeshField> read_fields<3>(const fs::path&);
template void write_fields<2>(OutputFile&, const fs::path&, const std::vector<MeshField>&);
template void write_fields<3>(OutputFile&, const fs::path&, const std::vector<MeshField>&);
template std::vector<Metric<2>> read_metric<2>(const fs::path&);
template std::vector<Metric<3>> read_metric<3>(const fs::path&);
template void write_metric<2>(const fs::path&, const std::vector<Metric<2>>&);
template void write_metric<3>(const fs::path&, const std::vector<Metric<3>>&);

}  // namespace lamina
