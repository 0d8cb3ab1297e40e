// Reading whole files and writing files that appear complete or not at all.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lamina {

/// Read-only bytes of a file, memory mapped.
/// Errors: kFileMissing (absent, or not a regular file: a directory is named as such), kFileUnreadable.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  [[nodiscard]] std::string_view bytes() const { return {data_, size_}; }

 private:
  const char* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A file that is written under a temporary name beside its target and renamed by commit().
/// GUARANTEES: (1) without a successful commit() the target is untouched and nothing is left behind;
/// (2) a failed write, flush or close (full disk) throws kFileWrite naming the target.
class OutputFile {
 public:
  /// Creates the temporary file. Errors: kFileWrite when the folder is missing or not writable.
  explicit OutputFile(std::filesystem::path target);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, std::size_t size);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// For writers that need a name of their own (OpenVDB, cairo): the temporary path, which keeps the
  /// extension.
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Flushes and closes; the file keeps its temporary name.
  void finish();
  /// Finishes and renames.
  void commit();
  [[nodiscard]] std::size_t written() const { return written_; }

 private:
  std::filesystem::path target_, temporary_;
  std::FILE* file_ = nullptr;
  std::size_t written_ = 0;
};

/// Files that belong together. GUARANTEE: none is renamed before all are complete.
class OutputFiles {
 public:
  OutputFiles() = default;
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// Errors: those of OutputFile. The reference lives as long as this object.
  OutputFile& add(const std::filesystem::path& target);
  /// Creates a folder and those above it that are missing; without commit() they are taken away again.
  /// Errors: kFileWrite.
  void add_folder(const std::filesystem::path& folder);
  /// Finishes all files, without renaming any.
  void finish();
  void commit();

 private:
  std::vector<std::unique_ptr<OutputFile>> files_;
  std::vector<std::filesystem::path> folders_;
};

/// Throws kFileWrite at once when `target` could not be created (missing folder, no permission, is a folder),
/// so that a long run does not fail at its end.
void check_writable(const std::filesystem::path& target);

/// Lower-case extension with the dot, "" if none.
std::string lower_extension(const std::filesystem::path& path);

}  // namespace lamina
