// An output is written to a hidden sibling of its target (same folder, so that rename() is atomic) which
// O_EXCL makes ours alone. Device files and pipes (/dev/null, /dev/stdout) cannot be renamed onto without
// destroying them, so they are opened and written directly. fsync is left out: the promise is about failed
// runs, not about power cuts.
#include "core/file.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) { return std::error_code(error, std::generic_category()).message(); }

[[noreturn]] void fail_write(const fs::path& target, const std::string& why) {
  throw Error(ErrorCode::kFileWrite, fmt::format("{}: cannot be written: {}", target.string(), why));
}

/// Closes a descriptor at the end of a scope.
struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

/// The file that `target` stands for: where a chain of symbolic links ends, so that the link itself survives
/// the rename.
fs::path follow_links(fs::path target) {
  std::error_code ec;
  for (int hop = 0; hop < 40 && fs::is_symlink(target, ec); ++hop) {
    const fs::path next = fs::read_symlink(target, ec);
    if (ec) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

/// Throws when `target` can never be written, whatever its folder allows. Returns true for device files and
/// pipes.
bool is_special(const fs::path& target) {
  if (target.filename().empty()) fail_write(target, "the name of a file is missing");
  struct stat info {};
  if (::stat(target.c_str(), &info) != 0) {
    if (errno != ENOENT) fail_write(target, reason(errno));
    return false;
  }
  if (S_ISDIR(info.st_mode)) fail_write(target, "it is a folder; give the name of a file");
  if (::access(target.c_str(), W_OK) != 0) fail_write(target, reason(errno));
  return !S_ISREG(info.st_mode);
}

/// Creates a file of our own beside `target` with its extension and, if it exists, its permissions.
int create_sibling(const fs::path& target, fs::path& temporary) {
  static std::atomic<unsigned> counter{0};
  fs::path folder = target.parent_path();
  if (folder.empty()) folder = ".";
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary = folder /
                fmt::format(".lamina-{}-{}{}", ::getpid(), counter.fetch_add(1), target.extension().string());
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) {
      struct stat info {};
      if (::stat(target.c_str(), &info) == 0) static_cast<void>(::fchmod(fd, info.st_mode & 0777));
      return fd;
    }
    if (errno != EEXIST) break;
  }
  const int error = errno;
  temporary.clear();
  if (error == ENOENT)
    fail_write(target, fmt::format("the folder {} does not exist; create it first", folder.string()));
  fail_write(target, reason(error));
}

}  // namespace

MappedFile::MappedFile(const fs::path& path) {
  // O_NONBLOCK: opening a pipe without a writer would wait for ever.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0) {
    const int error = errno;
    if (error == ENOENT || error == ENOTDIR)
      throw Error(ErrorCode::kFileMissing, fmt::format("{}: no such file", path.string()));
    throw Error(ErrorCode::kFileUnreadable,
                fmt::format("{}: cannot be opened: {}", path.string(), reason(error)));
  }
  struct stat info {};
  if (::fstat(file.fd, &info) != 0)
    throw Error(ErrorCode::kFileUnreadable,
                fmt::format("{}: cannot be examined: {}", path.string(), reason(errno)));
  if (S_ISDIR(info.st_mode))
    throw Error(ErrorCode::kFileMissing, fmt::format("{}: is a folder; give a file", path.string()));
  if (!S_ISREG(info.st_mode))
    throw Error(ErrorCode::kFileMissing, fmt::format("{}: is not a regular file", path.string()));
  size_ = static_cast<std::size_t>(info.st_size);
  if (size_ == 0) return;  // mmap refuses empty ranges
  void* data = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file.fd, 0);
  if (data == MAP_FAILED)
    throw Error(ErrorCode::kFileUnreadable,
                fmt::format("{}: cannot be read: {}", path.string(), reason(errno)));
  data_ = static_cast<const char*>(data);
}

MappedFile::~MappedFile() {
  if (data_ != nullptr) ::munmap(const_cast<char*>(data_), size_);
}

OutputFile::OutputFile(fs::path target) : target_(std::move(target)) {
  const fs::path final_target = follow_links(target_);
  int fd = -1;
  if (is_special(final_target)) {
    temporary_ = final_target;
    fd = ::open(final_target.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) fail_write(target_, reason(errno));
  } else {
    fd = create_sibling(final_target, temporary_);
  }
  target_ = final_target;
  file_ = ::fdopen(fd, "wb");
  if (file_ == nullptr) {
    const int error = errno;
    ::close(fd);
    if (temporary_ != target_) ::unlink(temporary_.c_str());
    fail_write(target_, reason(error));
  }
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  if (!temporary_.empty() && temporary_ != target_) ::unlink(temporary_.c_str());
}

void OutputFile::write(const void* data, std::size_t size) {
  if (file_ == nullptr) throw Error(ErrorCode::kInternal, target_.string() + ": written after commit");
  if (size == 0) return;
  const std::size_t done = std::fwrite(data, 1, size, file_);
  written_ += done;
  if (done != size) fail_write(target_, fmt::format("{} (after {} bytes)", reason(errno), written_));
}

void OutputFile::finish() {
  if (file_ == nullptr) return;
  // A write that failed earlier must not pass because the flush of the rest succeeds.
  const bool failed_before = std::ferror(file_) != 0;
  const bool flushed = std::fflush(file_) == 0;
  const int flush_error = errno;
  const bool closed = std::fclose(file_) == 0;
  const int close_error = errno;
  file_ = nullptr;
  if (failed_before) fail_write(target_, "an earlier write failed");
  if (!flushed) fail_write(target_, reason(flush_error));
  if (!closed) fail_write(target_, reason(close_error));
}

void OutputFile::commit() {
  finish();
  if (temporary_.empty()) return;
  if (temporary_ != target_ && ::rename(temporary_.c_str(), target_.c_str()) != 0)
    fail_write(target_, reason(errno));
  temporary_.clear();
}

OutputFiles::~OutputFiles() {
  files_.clear();
  std::error_code ec;
  for (auto folder = folders_.rbegin(); folder != folders_.rend(); ++folder) fs::remove(*folder, ec);
}

OutputFile& OutputFiles::add(const fs::path& target) {
  files_.push_back(std::make_unique<OutputFile>(target));
  return *files_.back();
}

void OutputFiles::add_folder(const fs::path& folder) {
  std::vector<fs::path> missing;
  std::error_code ec;
  for (fs::path p = fs::absolute(folder, ec); !p.empty() && !fs::exists(p, ec); p = p.parent_path()) {
    missing.push_back(p);
    if (p == p.parent_path()) break;
  }
  for (auto p = missing.rbegin(); p != missing.rend(); ++p) {
    if (p->filename().empty()) continue;  // a trailing slash
    if (!fs::create_directory(*p, ec) && ec) fail_write(folder, ec.message());
    folders_.push_back(*p);
  }
  if (!fs::is_directory(folder, ec)) fail_write(folder, "it is a file; a folder is needed");
}

void OutputFiles::finish() {
  for (const auto& file : files_) file->finish();
}

void OutputFiles::commit() {
  finish();
  for (const auto& file : files_) file->commit();
  folders_.clear();
}

void check_writable(const fs::path& target) {
  const fs::path final_target = follow_links(target);
  if (is_special(final_target)) return;  // opening a pipe could block
  const OutputFile probe(final_target);
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

}  // namespace lamina
