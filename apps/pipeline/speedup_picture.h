// How much faster something is on 1, 2, ... threads, as lines in a diagram.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lamina {

struct Speedup {
  std::string name;
  std::vector<double> values = {};  ///< on 1, 2, ... threads, relative to one
};

/// Draws all lines and the ideal one to .png, .svg or .pdf. REQUIRES as many values of each. Errors:
/// kFileUnsupported (extension), kFileWrite.
void draw_speedups(const std::filesystem::path& path, const std::vector<Speedup>& lines);

}  // namespace lamina
