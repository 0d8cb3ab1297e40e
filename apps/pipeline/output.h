// A set of output files that appear together, or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/file.h"
#include "core/parallel.h"

namespace lamina {

/// Collects the outputs of a run. Each is written under a temporary name in the folder of its target;
/// commit() gives all of them their names once all are complete. GUARANTEES: (1) without commit() every
/// target is as it was and nothing is left behind; (2) messages of writers name the target, not the temporary
/// file. Not thread safe.
class OutputSet {
 public:
  OutputSet() = default;
  ~OutputSet();
  OutputSet(const OutputSet&) = delete;
  OutputSet& operator=(const OutputSet&) = delete;

  /// A file that no target may take the place of, beside the input that is named with each.
  void protect(const std::filesystem::path& input) { inputs_.push_back(input); }

  /// Names a target, before the run. Errors: kFileWrite when it could not be created, kUsage when it is named
  /// twice or is the same file as an input.
  void expect(const std::filesystem::path& target, const std::filesystem::path& input);

  /// The same for all files of a mesh (mesh/io.h). Errors also: kUsage for a format that is not written.
  void expect_mesh(const std::filesystem::path& target, const std::filesystem::path& input);

  /// Files that their writer fills itself; named together with the others by commit().
  OutputFiles& files() { return files_; }

  /// Calls writer(path) with the temporary name, which has the target's extension. Targets that are devices
  /// or pipes are written through a file in the system's temporary folder.
  void write(const std::filesystem::path& target, FunctionRef<void(const std::filesystem::path&)> writer);
  void write_text(const std::filesystem::path& target, const std::string& text);

  /// Renames all. Errors: kFileWrite.
  void commit();

  [[nodiscard]] std::vector<std::filesystem::path> targets() const;

 private:
  struct Entry {
    std::filesystem::path target, resolved, staged;
    bool special = false;
  };
  void enter(const std::filesystem::path& target, const std::filesystem::path& input);

  std::vector<std::filesystem::path> inputs_;
  std::vector<Entry> entries_;
  OutputFiles files_;
};

/// Errors: kUsage unless the lower-case extension of `path` is one of `known`; `what` such as "a mesh".
void require_extension(const std::filesystem::path& path, const char* what,
                       const std::vector<std::string>& known);

}  // namespace lamina
