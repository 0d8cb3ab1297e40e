#include "apps/pipeline/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "apps/pipeline/report.h"
#include "core/error.h"
#include "core/file.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "lamina checkpoint 1\n";
constexpr const char* kExtension = ".checkpoint";

/// 64-bit FNV-1a, eight bytes at a time.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t h = 1469598103934665603ull) {
  while (!bytes.empty()) {
    std::uint64_t word = bytes.size();
    std::memcpy(&word, bytes.data(), std::min<std::size_t>(bytes.size(), sizeof word));
    h = ((h ^ word) * 1099511628211ull) ^ (h >> 29);
    bytes.remove_prefix(std::min<std::size_t>(bytes.size(), sizeof word));
  }
  return h;
}

struct Head {
  std::uint64_t fingerprint = 0, size = 0, hash = 0;
};

std::vector<fs::path> checkpoints_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(folder, ec))
    if (entry.path().extension() == kExtension) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

std::uint64_t case_fingerprint(const Case& c) {
  Case wanted = c;
  wanted.threads = 0;
  wanted.outputs.clear();
  for (auto* path :
       {&wanted.metric_out, &wanted.levelset_out, &wanted.report, &wanted.picture, &wanted.checkpoint})
    path->reset();
  wanted.picture_plane = {};
  wanted.picture_window.reset();
  std::uint64_t h = hash_of(case_text(wanted), hash_of(version()));
  h = hash_of(MappedFile(c.body).bytes(), h);
  if (c.metric) h = hash_of(MappedFile(*c.metric).bytes(), h);
  for (const std::string& grid : c.size_grids)
    if (const std::size_t colon = grid.rfind(".vdb:"); colon != std::string::npos)
      h = hash_of(MappedFile(grid.substr(0, colon + 4)).bytes(), h);
  return h;
}

fs::path checkpoint_case_path(const fs::path& folder) { return folder / "case.toml"; }

void begin_checkpoints(const fs::path& folder, const Case& c) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec)
    throw Error(ErrorCode::kFileWrite,
                fmt::format("--checkpoint {}: cannot be created: {}", folder.string(), ec.message()));
  if (!checkpoints_in(folder).empty())
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--checkpoint {}: holds the checkpoints of another run: go on with --resume {}, or "
                    "remove them",
                    folder.string(), folder.string()));
  OutputFile file(checkpoint_case_path(folder));
  file.write(case_text(c));
  file.commit();
}

void write_checkpoint(const fs::path& folder, std::int64_t step, std::uint64_t fingerprint,
                      const std::string& snapshot) {
  const Head head{fingerprint, snapshot.size(), hash_of(snapshot)};
  OutputFile file(folder / fmt::format("step-{:02}{}", step, kExtension));
  file.write(kMagic);
  file.write(&head, sizeof head);
  file.write(snapshot);
  file.commit();
}

std::string read_last_checkpoint(const fs::path& folder, std::uint64_t fingerprint) {
  const std::vector<fs::path> files = checkpoints_in(folder);
  if (files.empty()) return {};
  const MappedFile mapped(files.back());
  std::string_view bytes = mapped.bytes();
  const auto damaged = [&] {
    return Error(ErrorCode::kFileFormat,
                 fmt::format("{}: is damaged: remove it, and the run goes on from the step before",
                             files.back().string()));
  };
  Head head;
  if (bytes.size() < kMagic.size() + sizeof head || bytes.substr(0, kMagic.size()) != kMagic) throw damaged();
  bytes.remove_prefix(kMagic.size());
  std::memcpy(&head, bytes.data(), sizeof head);
  bytes.remove_prefix(sizeof head);
  if (bytes.size() != head.size || hash_of(bytes) != head.hash) throw damaged();
  if (head.fingerprint != fingerprint)
    throw Error(
        ErrorCode::kUsage,
        fmt::format("--resume {}: its checkpoints are of another case: an option, an input file or the "
                    "version of the program is not the same",
                    folder.string()));
  return std::string(bytes);
}

}  // namespace lamina
