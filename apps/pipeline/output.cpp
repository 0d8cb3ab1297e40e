#include "apps/pipeline/output.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "core/error.h"
#include "core/file.h"
#include "mesh/io.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

/// Where a chain of symbolic links ends, so that the link survives the rename.
fs::path follow_links(fs::path target) {
  std::error_code ec;
  for (int hop = 0; hop < 40 && fs::is_symlink(target, ec); ++hop) {
    const fs::path next = fs::read_symlink(target, ec);
    if (ec) break;
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target;
}

bool is_special(const fs::path& target) {
  std::error_code ec;
  const fs::file_status status = fs::status(target, ec);
  return fs::exists(status) && !fs::is_regular_file(status);
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code ec;
  if (fs::equivalent(a, b, ec) && !ec) return true;
  return fs::absolute(a, ec).lexically_normal() == fs::absolute(b, ec).lexically_normal();
}

/// A name nobody else uses, in the folder of the target (or the system's for devices).
fs::path staged_name(const fs::path& resolved, bool special, std::size_t number) {
  std::error_code ec;
  fs::path folder = special ? fs::temp_directory_path(ec) : resolved.parent_path();
  if (folder.empty()) folder = ".";
  return folder / fmt::format(".lamina-{}-out{}{}", ::getpid(), number, resolved.extension().string());
}

/// The message of a writer with the target's name in place of the temporary one.
Error renamed(const Error& e, const fs::path& staged, const fs::path& target) {
  std::string message = e.what();
  const std::string from = staged.string(), to = target.string();
  for (std::size_t at = 0; (at = message.find(from, at)) != std::string::npos; at += to.size())
    message.replace(at, from.size(), to);
  return Error(e.code(), message);
}

}  // namespace

void require_extension(const fs::path& path, const char* what, const std::vector<std::string>& known) {
  const std::string extension = lower_extension(path);
  if (std::find(known.begin(), known.end(), extension) != known.end()) return;
  std::string list;
  for (const std::string& e : known) list += (list.empty() ? "" : ", ") + e;
  throw Error(ErrorCode::kUsage, fmt::format("{}: {} is written as {}", path.string(), what, list));
}

OutputSet::~OutputSet() {
  std::error_code ec;
  for (const Entry& entry : entries_)
    if (!entry.staged.empty()) fs::remove(entry.staged, ec);
}

void OutputSet::expect(const fs::path& target, const fs::path& input) {
  check_writable(target);
  enter(target, input);
}

void OutputSet::expect_mesh(const fs::path& target, const fs::path& input) {
  check_writable_mesh(target);
  for (const fs::path& file : mesh_files(target)) enter(file, input);
}

/// Takes down a target that can be written.
void OutputSet::enter(const fs::path& target, const fs::path& input) {
  const fs::path resolved = follow_links(target);
  const bool special = is_special(resolved);
  const auto is_input = [&](const fs::path& file) { return !file.empty() && same_file(resolved, file); };
  if (!special && (is_input(input) || std::any_of(inputs_.begin(), inputs_.end(), is_input)))
    throw Error(ErrorCode::kUsage,
                fmt::format("{}: would overwrite the input; give another name", target.string()));
  for (const Entry& other : entries_)
    if (!special && same_file(other.resolved, resolved))
      throw Error(ErrorCode::kUsage, fmt::format("{}: is named as output twice", target.string()));
  entries_.push_back({.target = target, .resolved = resolved, .staged = {}, .special = special});
}

void OutputSet::write(const fs::path& target, FunctionRef<void(const fs::path&)> writer) {
  const auto entry =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.target == target; });
  if (entry == entries_.end())
    throw Error(ErrorCode::kInternal, fmt::format("{}: written but not expected", target.string()));
  entry->staged =
      staged_name(entry->resolved, entry->special, static_cast<std::size_t>(entry - entries_.begin()));
  try {
    writer(entry->staged);
  } catch (const Error& e) {
    throw renamed(e, entry->staged, target);
  }
}

void OutputSet::write_text(const fs::path& target, const std::string& text) {
  write(target, [&](const fs::path& path) {
    OutputFile file(path);
    file.write(text);
    file.commit();
  });
}

void OutputSet::commit() {
  files_.finish();
  for (Entry& entry : entries_) {
    if (entry.staged.empty()) continue;
    if (entry.special) {
      const MappedFile content(entry.staged);
      OutputFile file(entry.resolved);
      file.write(content.bytes());
      file.commit();
      continue;  // the destructor removes the staged copy
    }
    std::error_code ec;
    fs::rename(entry.staged, entry.resolved, ec);
    if (ec)
      throw Error(ErrorCode::kFileWrite,
                  fmt::format("{}: cannot be written: {}", entry.target.string(), ec.message()));
    entry.staged.clear();
  }
  files_.commit();
}

std::vector<fs::path> OutputSet::targets() const {
  std::vector<fs::path> out;
  for (const Entry& entry : entries_) out.push_back(entry.target);
  return out;
}

}  // namespace lamina
