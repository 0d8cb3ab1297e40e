// The little of HDF5 that mesh files need: two-dimensional arrays by their paths. The library stays in the
// source.
#pragma once

#ifdef LAMINA_HDF5

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace lamina::io {

class Hdf5Writer {
 public:
  /// Writes over the file `path`; messages name `target`.
  Hdf5Writer(const std::filesystem::path& path, std::filesystem::path target);
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// rows x columns values, one after another; columns = 0: one-dimensional. Errors: kFileWrite.
  void write(const std::string& name, const double* values, std::size_t rows, std::size_t columns);
  void write(const std::string& name, const std::int32_t* values, std::size_t rows, std::size_t columns);
  /// Errors: kFileWrite.
  void close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class Hdf5Reader {
 public:
  /// Errors: kFileMissing, kFileFormat.
  explicit Hdf5Reader(const std::filesystem::path& path);
  ~Hdf5Reader();
  Hdf5Reader(const Hdf5Reader&) = delete;
  Hdf5Reader& operator=(const Hdf5Reader&) = delete;

  /// All values of an array that must hold `expected`. Errors: kFileFormat. Never allocates more than the
  /// stored bytes can describe.
  std::vector<double> reals(const std::string& name, std::size_t expected);
  std::vector<std::int64_t> integers(const std::string& name, std::size_t expected);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lamina::io

#endif
