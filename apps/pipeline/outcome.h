// What every run that makes a mesh has to tell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/pipeline/stages.h"
#include "mesh/adapt.h"

namespace lamina {

struct RunOutcome {
  AdaptSummary adapt;
  std::vector<StageCost> stages;
  int threads = 0;  ///< worker threads that were allowed
  std::vector<std::string> warnings;
  std::vector<std::string> missed;  ///< properties asked for and not reached, one line each
  std::vector<std::filesystem::path> files;
};

}  // namespace lamina
