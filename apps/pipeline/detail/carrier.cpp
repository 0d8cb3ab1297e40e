#include "apps/pipeline/detail/carrier.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "apps/pipeline/text.h"
#include "core/error.h"
#include "core/file.h"
#include "core/words.h"
#include "mesh/solution.h"

namespace lamina {
namespace {

/// The number behind the last colon, and the name before it.
std::optional<std::pair<std::string, int>> split_component(const std::string& spec) {
  const std::size_t at = spec.rfind(':');
  if (at == std::string::npos) return std::nullopt;
  const auto number = parse_number(std::string_view(spec).substr(at + 1));
  if (!number || *number < 1.0 || *number > 1e6 || *number != std::floor(*number)) return std::nullopt;
  return std::pair(spec.substr(0, at), static_cast<int>(*number));
}

std::vector<double> component_of(const MeshField& field, int number) {
  const auto width = static_cast<std::size_t>(field.components);
  std::vector<double> values(field.values.size() / width);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = field.values[i * width + static_cast<std::size_t>(number - 1)];
  return values;
}

template <int D>
std::vector<double> scalar_of_file(const Mesh<D>& mesh, const std::string& file,
                                   const std::string& mesh_name) {
  std::vector<MeshField> fields = read_fields<D>(file);
  if (fields.size() != 1 || fields[0].components != 1)
    throw Error(
        ErrorCode::kParameter,
        fmt::format("{}: holds {} of {} components; one scalar is needed", file,
                    counted(static_cast<std::int64_t>(fields.size()), "field"), fields[0].components));
  if (fields[0].values.size() != mesh.points.size())
    throw Error(ErrorCode::kParameter, fmt::format("{}: holds {} values, but {} has {} points", file,
                                                   fields[0].values.size(), mesh_name, mesh.points.size()));
  return std::move(fields[0].values);
}

}  // namespace

bool is_solution(const std::filesystem::path& file) {
  const std::string extension = lower_extension(file);
  return extension == ".sol" || extension == ".solb";
}

template <int D>
std::vector<double> scalar_field(const Mesh<D>& mesh, const std::string& spec, const char* option,
                                 const std::string& mesh_name) {
  const MeshField* field = mesh.point_field(spec);
  if (field != nullptr && field->components == 1) return field->values;
  if (field != nullptr)
    throw Error(ErrorCode::kUsage, fmt::format("{} {}: has {} components; name one of them, as {}:1", option,
                                               spec, field->components, spec));
  if (is_solution(spec)) return scalar_of_file<D>(mesh, spec, mesh_name);
  if (const auto part = split_component(spec)) {
    field = mesh.point_field(part->first);
    if (field != nullptr && part->second <= field->components) return component_of(*field, part->second);
    if (field != nullptr)
      throw Error(ErrorCode::kUsage, fmt::format("{} {}: {} has {}", option, spec, part->first,
                                                 counted(field->components, "component")));
  }
  std::vector<std::string> names;
  for (const MeshField& f : mesh.point_fields) names.push_back(f.name);
  throw Error(ErrorCode::kUsage,
              fmt::format("{} {}: {} has no such point field{}; {}", option, spec, mesh_name,
                          did_you_mean(spec, names),
                          names.empty() ? "it has none" : fmt::format("it has {}", join(names))));
}

template std::vector<double> scalar_field(const Mesh<2>&, const std::string&, const char*,
                                          const std::string&);
template std::vector<double> scalar_field(const Mesh<3>&, const std::string&, const char*,
                                          const std::string&);

}  // namespace lamina
