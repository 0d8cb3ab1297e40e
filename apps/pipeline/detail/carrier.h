// A mesh that metrics and fields are given on.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mesh/cell_finder.h"
#include "mesh/mesh.h"

namespace lamina {

/// A .sol or .solb.
bool is_solution(const std::filesystem::path& file);

/// A mesh as it was read, that metrics and fields are interpolated on.
template <int D>
struct Carrier {
  explicit Carrier(Mesh<D> m) : mesh(std::move(m)), places(std::make_shared<const CellFinder<D>>(mesh)) {}
  Mesh<D> mesh;
  std::shared_ptr<const CellFinder<D>> places;
};

/// The values of a scalar point field. `spec` names it, as "NAME:K" its K-th component (from 1), or is a .sol
/// or .solb of the mesh's points that holds one scalar. `option` and `mesh_name` are used in messages.
/// Errors: kUsage listing the fields, those of reading files.
template <int D>
std::vector<double> scalar_field(const Mesh<D>& mesh, const std::string& spec, const char* option,
                                 const std::string& mesh_name);

}  // namespace lamina
