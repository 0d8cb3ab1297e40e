// The folder that a long run leaves behind after every step of the optimizer, to be resumed from: case.toml,
// the case as it was given, and step-NN.checkpoint.
#pragma once

#include <filesystem>
#include <string>

#include "apps/pipeline/case.h"

namespace lamina {

/// Of everything that the mesh depends on: version, options, bytes of the input files. Errors: those of
/// reading them.
std::uint64_t case_fingerprint(const Case& c);

std::filesystem::path checkpoint_case_path(const std::filesystem::path& folder);

/// Makes the folder where there is none and writes the case. Errors: kUsage when it holds checkpoints,
/// kFileWrite.
void begin_checkpoints(const std::filesystem::path& folder, const Case& c);

/// Errors: kFileWrite.
void write_checkpoint(const std::filesystem::path& folder, std::int64_t step, std::uint64_t fingerprint,
                      const std::string& snapshot);

/// The snapshot of the last step; empty when no step was done. Errors: kFileFormat when the file is damaged,
/// kUsage when it belongs to another case.
std::string read_last_checkpoint(const std::filesystem::path& folder, std::uint64_t fingerprint);

}  // namespace lamina
