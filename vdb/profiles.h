// Reference profiles from formulas.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vdb/outline.h"

namespace lamina {

/// plate, circle, square, naca0012, highlift: name and one line of description (with dimensions).
std::vector<std::pair<std::string, std::string>> profile_list();

/// Dimensions (metres) and source of each are at its function in profiles.cpp. `spacing`: largest distance of
/// points on curved parts; 0: a default for the shape. Errors: kParameter (unknown name; spacing out of
/// range).
Outline make_profile(const std::string& name, double spacing = 0.0);

}  // namespace lamina
