// Reference bodies from formulas.
#pragma once

#include <string>
#include <vector>

#include "vdb/surface.h"

namespace lamina {

struct ShapeOptions {
  double facet = 0.0;  ///< largest facet edge on curved parts, world units; 0: a default for the shape
  double slant_degrees = 25.0;  ///< Ahmed body only, in [0, 40]
  bool stilts = false;          ///< Ahmed body only
};

/// ahmed, naca0012, sphere, cylinder, torus, cube, plate, step: name and one line of description (with
/// dimensions).
std::vector<std::pair<std::string, std::string>> shape_list();

/// Watertight, outward oriented. The dimensions (metres) and source of each are at its function in
/// shapes.cpp. Errors: kParameter (unknown name: lists the known ones; facet out of range).
Surface make_shape(const std::string& name, const ShapeOptions& options);

}  // namespace lamina
