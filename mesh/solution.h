// Fields of the points of a mesh in a file of their own: GMF .sol (ascii) and .solb (binary), which hold
// scalars, vectors and symmetric tensors without names. A .mesh or .meshb has its fields in the .solb or .sol
// of the same name.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/file.h"
#include "core/metric.h"
#include "mesh/mesh.h"

namespace lamina {

/// Fields without a name are called by their number, "sol_1", "sol_2", ...
inline constexpr std::string_view kSolutionName = "sol_";

/// Where the fields of a .mesh or .meshb are written: the .sol or .solb beside it.
std::filesystem::path solution_path(const std::filesystem::path& mesh);
/// The .solb or else the .sol of the same name, when there is one.
std::optional<std::filesystem::path> find_solution(const std::filesystem::path& mesh);

/// read_mesh, and of a .mesh or .meshb the fields of the solution beside it. `ignored` says why a solution
/// was left out (it is of another mesh, or broken), "" where none was.
AnyMesh read_mesh_and_fields(const std::filesystem::path& path, std::string& ignored);

/// The fields of a .sol or .solb in their order. One that is a symmetric tensor and the only one is called
/// "metric". Errors: those of reading files, kFileUnsupported (another dimension, a full matrix).
template <int D>
std::vector<MeshField> read_fields(const std::filesystem::path& path);

/// Writes fields as the solution `path`. REQUIRES at least one field, values of as many points each, and 1, D
/// or kSymSize<D> components.
template <int D>
void write_fields(OutputFile& out, const std::filesystem::path& path, const std::vector<MeshField>& fields);

/// Reads a solution of one tensor (or scalar size, turned into an isotropic metric) per vertex. Errors: those
/// of read_fields, kParameter naming the first vertex whose tensor is not positive definite.
template <int D>
std::vector<Metric<D>> read_metric(const std::filesystem::path& path);

/// Writes one tensor per vertex.
template <int D>
void write_metric(const std::filesystem::path& path, const std::vector<Metric<D>>& metric);

}  // namespace lamina
