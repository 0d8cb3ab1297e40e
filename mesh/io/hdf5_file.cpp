#include "mesh/io/hdf5_file.h"

#ifdef LAMINA_HDF5

#include <fmt/format.h>
#include <hdf5.h>

#include <array>

#include "core/error.h"
#include "core/file.h"

namespace lamina::io {
namespace {

// No deflate stream expands by more than 1032 : 1.
constexpr std::size_t kMaxExpansion = 1032;

/// An object of the library, closed at the end of its scope.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() { reset(); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  [[nodiscard]] hid_t get() const { return id_; }
  [[nodiscard]] bool valid() const { return id_ >= 0; }
  bool reset() {
    const bool closed = id_ < 0 || close_(id_) >= 0;
    id_ = -1;
    return closed;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Errors of the library are told by ours, not printed.
void be_silent() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

}  // namespace

struct Hdf5Writer::Impl {
  Handle file;
  std::filesystem::path target;

  [[noreturn]] void fail() const {
    throw Error(ErrorCode::kFileWrite,
                fmt::format("{}: cannot be written: HDF5 reports a failure", target.string()));
  }
  void write(const std::string& name, const void* values, hid_t type, std::size_t rows,
             std::size_t columns) const {
    const std::array<hsize_t, 2> shape = {rows, columns};
    const Handle space(H5Screate_simple(columns == 0 ? 1 : 2, shape.data(), nullptr), H5Sclose);
    const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose),
        creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_create_intermediate_group(links.get(), 1);
    H5Pset_obj_track_times(creation.get(), false);  // the same bytes in every run
    const Handle set(
        H5Dcreate2(file.get(), name.c_str(), type, space.get(), links.get(), creation.get(), H5P_DEFAULT),
        H5Dclose);
    if (!set.valid()) fail();
    if (rows > 0 && H5Dwrite(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) < 0) fail();
  }
};

Hdf5Writer::Hdf5Writer(const std::filesystem::path& path, std::filesystem::path target) {
  be_silent();
  impl_.reset(new Impl{{H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose},
                       std::move(target)});
  if (!impl_->file.valid()) impl_->fail();
}

Hdf5Writer::~Hdf5Writer() = default;

void Hdf5Writer::write(const std::string& name, const double* values, std::size_t rows, std::size_t columns) {
  impl_->write(name, values, H5T_NATIVE_DOUBLE, rows, columns);
}

void Hdf5Writer::write(const std::string& name, const std::int32_t* values, std::size_t rows,
                       std::size_t columns) {
  impl_->write(name, values, H5T_NATIVE_INT32, rows, columns);
}

void Hdf5Writer::close() {
  if (!impl_->file.reset()) impl_->fail();
}

struct Hdf5Reader::Impl {
  Handle file;
  std::string path;
  std::size_t file_size;

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kFileFormat, fmt::format("{}: {}", path, what));
  }
  template <class T>
  std::vector<T> read(const std::string& name, std::size_t expected, hid_t type) const {
    const Handle set(H5Dopen2(file.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set.valid()) fail(fmt::format("has no array {}", name));
    const Handle space(H5Dget_space(set.get()), H5Sclose), stored(H5Dget_type(set.get()), H5Tclose);
    const H5T_class_t kind = H5Tget_class(stored.get());
    if (kind != H5T_INTEGER && kind != H5T_FLOAT) fail(fmt::format("the array {} holds no numbers", name));
    if (std::is_integral_v<T> && kind != H5T_INTEGER)
      fail(fmt::format("the array {} must hold integers", name));
    const hssize_t n = H5Sget_simple_extent_npoints(space.get());
    if (n < 0 || static_cast<std::size_t>(n) != expected)
      fail(fmt::format("the array {} holds {} values, expected {}", name, n, expected));
    const hsize_t bytes = H5Dget_storage_size(set.get());
    if (bytes > file_size || expected * H5Tget_size(stored.get()) > bytes * kMaxExpansion)
      fail(fmt::format("the array {} claims {} values in {} bytes", name, expected, bytes));
    std::vector<T> values(expected);
    if (expected > 0 && H5Dread(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
      fail(fmt::format("the array {} cannot be read: it is damaged or in an unknown form", name));
    return values;
  }
};

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path) {
  const std::size_t size =
      MappedFile(path).bytes().size();  // missing files and folders are told as elsewhere
  be_silent();
  impl_.reset(new Impl{{H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose}, path.string(), size});
  if (!impl_->file.valid()) impl_->fail("is not an HDF5 file, or a damaged one");
}

Hdf5Reader::~Hdf5Reader() = default;

std::vector<double> Hdf5Reader::reals(const std::string& name, std::size_t expected) {
  return impl_->read<double>(name, expected, H5T_NATIVE_DOUBLE);
}

std::vector<std::int64_t> Hdf5Reader::integers(const std::string& name, std::size_t expected) {
  return impl_->read<std::int64_t>(name, expected, H5T_NATIVE_INT64);
}

}  // namespace lamina::io

#endif
