#include "core/file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "core/error.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

class FileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "lamina-file-XXXXXX").string();
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    std::error_code ec;
    fs::remove_all(folder_, ec);
  }
  static void put(const fs::path& path, std::string_view text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  static std::string get(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(folder_), {}); }

  fs::path folder_;
};

/// Runs `action`, which must throw Error with `code`; returns the message.
template <class Action>
std::string message_of(ErrorCode code, Action&& action) {
  try {
    action();
  } catch (const Error& e) {
    EXPECT_EQ(static_cast<int>(e.code()), static_cast<int>(code)) << e.what();
    const std::string text = e.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << "a message is one line";
    return text;
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST_F(FileTest, MapsBytesExactly) {
  const std::string bytes("a\0b\r\n\xff", 6);
  put(folder_ / "a.bin", bytes);
  const MappedFile file(folder_ / "a.bin");
  EXPECT_EQ(file.bytes(), bytes);
}

TEST_F(FileTest, MapsEmptyFile) {
  put(folder_ / "empty", "");
  EXPECT_TRUE(MappedFile(folder_ / "empty").bytes().empty());
}

TEST_F(FileTest, MissingInputIsNamed) {
  const fs::path path = folder_ / "absent.stl";
  EXPECT_NE(message_of(ErrorCode::kFileMissing, [&] { MappedFile file(path); }).find("absent.stl"),
            std::string::npos);
  // A path through a regular file does not exist either.
  put(folder_ / "plain", "x");
  message_of(ErrorCode::kFileMissing, [&] { MappedFile file(folder_ / "plain" / "below"); });
}

TEST_F(FileTest, FolderAsInputIsNamedAsSuch) {
  EXPECT_NE(message_of(ErrorCode::kFileMissing, [&] { MappedFile file(folder_); }).find("folder"),
            std::string::npos);
}

TEST_F(FileTest, PipeAsInputDoesNotBlock) {
  const fs::path path = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  message_of(ErrorCode::kFileMissing, [&] { MappedFile file(path); });
}

TEST_F(FileTest, UnreadableInput) {
  if (::geteuid() == 0) GTEST_SKIP() << "root reads everything";
  const fs::path path = folder_ / "locked";
  put(path, "x");
  fs::permissions(path, fs::perms::none);
  message_of(ErrorCode::kFileUnreadable, [&] { MappedFile file(path); });
}

TEST_F(FileTest, CommitMakesTheFileAppear) {
  const fs::path target = folder_ / "out.vtu";
  OutputFile file(target);
  EXPECT_EQ(file.temporary_path().extension(), ".vtu");
  EXPECT_EQ(file.temporary_path().parent_path(), folder_);
  file.write("head ");
  file.write(std::string(3 << 20, 'x'));
  EXPECT_EQ(file.written(), 5u + (3u << 20));
  EXPECT_FALSE(fs::exists(target));
  file.commit();
  EXPECT_EQ(get(target), "head " + std::string(3 << 20, 'x'));
  EXPECT_EQ(entries(), 1);
  file.commit();  // a second commit changes nothing
  EXPECT_EQ(entries(), 1);
  message_of(ErrorCode::kInternal, [&] { file.write("late"); });
}

TEST_F(FileTest, WithoutCommitTheTargetIsUntouched) {
  const fs::path target = folder_ / "out.txt";
  put(target, "old");
  {
    OutputFile file(target);
    file.write("new");
  }
  EXPECT_EQ(get(target), "old");
  EXPECT_EQ(entries(), 1);
}

TEST_F(FileTest, CommitReplacesAndKeepsPermissions) {
  const fs::path target = folder_ / "out.txt";
  put(target, "old and longer");
  fs::permissions(target, fs::perms::owner_read | fs::perms::owner_write);
  OutputFile file(target);
  file.write("new");
  file.commit();
  EXPECT_EQ(get(target), "new");
  EXPECT_EQ(fs::status(target).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(FileTest, CommitWritesThroughASymbolicLink) {
  put(folder_ / "real.txt", "old");
  fs::create_symlink("real.txt", folder_ / "link.txt");
  OutputFile file(folder_ / "link.txt");
  file.write("new");
  file.commit();
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.txt"));
  EXPECT_EQ(get(folder_ / "real.txt"), "new");
}

TEST_F(FileTest, TemporaryNameServesForeignWriters) {
  OutputFile file(folder_ / "grid.vdb");
  put(file.temporary_path(), "written by a library");
  file.commit();
  EXPECT_EQ(get(folder_ / "grid.vdb"), "written by a library");
}

TEST_F(FileTest, TwoWritersOfOneTargetDoNotMeet) {
  OutputFile a(folder_ / "out"), b(folder_ / "out");
  EXPECT_NE(a.temporary_path(), b.temporary_path());
  a.write("a");
  b.write("b");
  b.commit();
  a.commit();
  EXPECT_EQ(get(folder_ / "out"), "a");
}

TEST_F(FileTest, OutputErrorsNameTheTarget) {
  const fs::path lost = folder_ / "no" / "such" / "out.stl";
  EXPECT_NE(message_of(ErrorCode::kFileWrite, [&] { OutputFile file(lost); }).find("does not exist"),
            std::string::npos);
  EXPECT_NE(message_of(ErrorCode::kFileWrite, [&] { OutputFile file(folder_); }).find("folder"),
            std::string::npos);
  message_of(ErrorCode::kFileWrite, [&] { OutputFile file(folder_ / ""); });
  message_of(ErrorCode::kFileWrite, [&] { OutputFile file(""); });
  // Not even root creates files there.
  EXPECT_NE(
      message_of(ErrorCode::kFileWrite, [&] { OutputFile file("/proc/out.stl"); }).find("/proc/out.stl"),
      std::string::npos);
}

TEST_F(FileTest, CheckWritable) {
  check_writable(folder_ / "new.stl");
  EXPECT_EQ(entries(), 0) << "the check leaves nothing behind";
  put(folder_ / "old.stl", "old");
  check_writable(folder_ / "old.stl");
  EXPECT_EQ(get(folder_ / "old.stl"), "old");
  message_of(ErrorCode::kFileWrite, [&] { check_writable(folder_ / "no" / "x"); });
  message_of(ErrorCode::kFileWrite, [&] { check_writable(folder_); });
  message_of(ErrorCode::kFileWrite, [&] { check_writable("/proc/x"); });
}

TEST_F(FileTest, CheckWritableRespectsPermissions) {
  if (::geteuid() == 0) GTEST_SKIP() << "root writes everywhere";
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  message_of(ErrorCode::kFileWrite, [&] { check_writable(folder_ / "x"); });
  fs::permissions(folder_, fs::perms::owner_all);
}

TEST_F(FileTest, DeviceFullIsReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  {  // Small enough for the buffer: only the flush in commit() meets the full device.
    OutputFile file("/dev/full");
    file.write("x");
    EXPECT_NE(message_of(ErrorCode::kFileWrite, [&] { file.commit(); }).find("/dev/full"), std::string::npos);
  }
  OutputFile file("/dev/full");
  message_of(ErrorCode::kFileWrite, [&] { file.write(std::string(1 << 20, 'x')); });
  message_of(ErrorCode::kFileWrite, [&] { file.commit(); });
  EXPECT_TRUE(fs::exists("/dev/full"));
}

TEST_F(FileTest, DeviceIsWrittenNotReplaced) {
  OutputFile file("/dev/null");
  file.write("gone");
  file.commit();
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(FileTest, FileThatCannotGrowLeavesNothing) {
  const fs::path target = folder_ / "big.bin";
  put(target, "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{64 * 1024, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  {
    OutputFile file(target);
    message_of(ErrorCode::kFileWrite, [&] { file.write(std::string(1 << 20, 'x')); });
    message_of(ErrorCode::kFileWrite, [&] { file.commit(); });
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(get(target), "old");
  EXPECT_EQ(entries(), 1);
}

TEST(LowerExtension, Cases) {
  EXPECT_EQ(lower_extension("a/b.STL"), ".stl");
  EXPECT_EQ(lower_extension("a.b/c"), "");
  EXPECT_EQ(lower_extension("x.tar.Gz"), ".gz");
  EXPECT_EQ(lower_extension(".hidden"), "");
}

}  // namespace
}  // namespace lamina
