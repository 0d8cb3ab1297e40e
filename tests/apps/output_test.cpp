#include "apps/pipeline/output.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "core/error.h"
#include "core/file.h"

namespace lamina {
namespace {

namespace fs = std::filesystem;

class OutputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        ("lamina_output_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  static std::string content(const fs::path& path) {
    std::ifstream in(path);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }

  fs::path folder_;
};

TEST_F(OutputTest, AppearTogetherOnCommit) {
  OutputSet outputs;
  outputs.expect(folder_ / "a.txt", {});
  outputs.expect(folder_ / "b.txt", {});
  outputs.write_text(folder_ / "a.txt", "one");
  EXPECT_FALSE(fs::exists(folder_ / "a.txt"));
  outputs.write_text(folder_ / "b.txt", "two");
  outputs.commit();
  EXPECT_EQ(content(folder_ / "a.txt"), "one");
  EXPECT_EQ(content(folder_ / "b.txt"), "two");
  EXPECT_EQ(files(), 2U);
}

TEST_F(OutputTest, NothingIsLeftWithoutCommit) {
  std::ofstream(folder_ / "a.txt") << "old";
  {
    OutputSet outputs;
    outputs.expect(folder_ / "a.txt", {});
    outputs.expect(folder_ / "b.txt", {});
    outputs.write_text(folder_ / "a.txt", "new");
  }
  EXPECT_EQ(content(folder_ / "a.txt"), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputTest, AFailedWriterIsReportedUnderTheTargetsName) {
  OutputSet outputs;
  const fs::path target = folder_ / "a.txt";
  outputs.expect(target, {});
  try {
    outputs.write(target, [](const fs::path& path) {
      std::ofstream(path) << "half";
      throw Error(ErrorCode::kFileWrite, path.string() + ": disk full");
    });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()), target.string() + ": disk full");
  }
}

TEST_F(OutputTest, WritersSeeTheExtension) {
  OutputSet outputs;
  outputs.expect(folder_ / "a.vtu", {});
  fs::path seen;
  outputs.write(folder_ / "a.vtu", [&](const fs::path& path) {
    seen = path;
    std::ofstream(path) << "x";
  });
  EXPECT_EQ(seen.extension(), ".vtu");
  EXPECT_EQ(seen.parent_path(), folder_);
}

TEST_F(OutputTest, TwiceTheSameFileIsRefused) {
  OutputSet outputs;
  outputs.expect(folder_ / "a.txt", {});
  EXPECT_THROW(outputs.expect(folder_ / "." / "a.txt", {}), Error);
}

TEST_F(OutputTest, TheInputIsNeverOverwritten) {
  std::ofstream(folder_ / "body.vdb") << "precious";
  fs::create_symlink(folder_ / "body.vdb", folder_ / "link.vdb");
  OutputSet outputs;
  EXPECT_THROW(outputs.expect(folder_ / "body.vdb", folder_ / "body.vdb"), Error);
  EXPECT_THROW(outputs.expect(folder_ / "link.vdb", folder_ / "body.vdb"), Error);
}

TEST_F(OutputTest, UnwritablePlacesAreFoundBeforeTheRun) {
  OutputSet outputs;
  EXPECT_THROW(outputs.expect(folder_ / "missing" / "a.txt", {}), Error);
  EXPECT_THROW(outputs.expect(folder_, {}), Error);
  EXPECT_EQ(files(), 0U);
}

TEST_F(OutputTest, LinksSurvive) {
  std::ofstream(folder_ / "real.txt") << "old";
  fs::create_symlink("real.txt", folder_ / "link.txt");
  OutputSet outputs;
  outputs.expect(folder_ / "link.txt", {});
  outputs.write_text(folder_ / "link.txt", "new");
  outputs.commit();
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.txt"));
  EXPECT_EQ(content(folder_ / "real.txt"), "new");
}

TEST_F(OutputTest, DevicesAreWrittenThrough) {
  OutputSet outputs;
  outputs.expect("/dev/null", {});
  outputs.write_text("/dev/null", "gone");
  outputs.commit();
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace lamina
