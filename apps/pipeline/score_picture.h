// Histograms of a mesh's edge lengths and qualities in its metric, of one mesh or of two.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mesh/score.h"

namespace lamina {

struct ScoredMesh {
  std::string name;
  bool has_metric = true;  ///< without one lengths mean nothing and are left out
  Score score = {};
};

/// Draws to .png, .svg or .pdf, atomically, from the bins of the scores: on the left shares of edges by the
/// logarithm of their length, the unit band shaded, on the right shares of cells by quality. Areas are
/// shares. REQUIRES one or two meshes. Errors: kFileUnsupported (extension), kFileWrite.
void draw_scores(const std::filesystem::path& path, const std::vector<ScoredMesh>& meshes);

}  // namespace lamina
