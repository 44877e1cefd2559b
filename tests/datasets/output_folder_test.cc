#include "datasets/output_folder.h"

#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

TEST(OutputFolder, AppearsOnlyWhenCommitted) {
  const TemporaryFolder home;
  auto folder = OutputFolder::create(home / "a/b/out/", false);
  ASSERT_TRUE(folder);
  ASSERT_TRUE(write_file(*folder / "x", "content"));
  EXPECT_FALSE(std::filesystem::exists(home / "a/b/out"));
  ASSERT_TRUE(folder->commit());
  EXPECT_EQ(content_of(home / "a/b/out/x"), "content");
  EXPECT_EQ(folder->final_path(), home / "a/b/out");
}

TEST(OutputFolder, LeavesNothingWhereItIsNotCommitted) {
  const TemporaryFolder home;
  {
    auto folder = OutputFolder::create(home / "out", false);
    ASSERT_TRUE(folder);
    ASSERT_TRUE(write_file(*folder / "x", "content"));
    const OutputFolder moved = std::move(*folder);
    EXPECT_EQ(home.entries(), 1);
  }
  EXPECT_EQ(home.entries(), 0);
}

TEST(OutputFolder, RefusesWhatExists) {
  const TemporaryFolder home;
  std::filesystem::create_directory(home / "out");
  const auto folder = OutputFolder::create(home / "out", false);
  ASSERT_FALSE(folder);
  EXPECT_THAT(folder.error().message, HasSubstr("--overwrite"));
}

TEST(OutputFolder, OverwritesOnlyItsOwnKind) {
  const TemporaryFolder home;
  std::filesystem::create_directory(home / "out");
  write_content(home / "out/thesis.tex", "years of work");
  EXPECT_FALSE(OutputFolder::create(home / "out", true));
  write_content(home / "out/ro-crate-metadata.json", "{}");
  auto folder = OutputFolder::create(home / "out", true);
  ASSERT_TRUE(folder);
  ASSERT_TRUE(write_file(*folder / "new", "content"));
  EXPECT_TRUE(std::filesystem::exists(home / "out/thesis.tex"));
  ASSERT_TRUE(folder->commit());
  EXPECT_FALSE(std::filesystem::exists(home / "out/thesis.tex"));
  EXPECT_TRUE(std::filesystem::exists(home / "out/new"));
  EXPECT_EQ(home.entries(), 1);
}

// `crumple check --bag` makes one of a folder that it did not write.
TEST(OutputFolder, ABagMayBeSomebodysOwn) {
  const TemporaryFolder home;
  std::filesystem::create_directories(home / "out/data");
  write_content(home / "out/bagit.txt", "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n");
  EXPECT_FALSE(OutputFolder::create(home / "out", true));
}

TEST(OutputFolder, RefusesWhatCameToExistMeanwhile) {
  const TemporaryFolder home;
  auto first = OutputFolder::create(home / "out", false);
  auto second = OutputFolder::create(home / "out", false);
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(first->commit());
  EXPECT_FALSE(second->commit());
}

TEST(OutputFolder, RefusesAFileInItsPlace) {
  const TemporaryFolder home;
  write_content(home / "file", "x");
  EXPECT_FALSE(OutputFolder::create(home / "file", true));
  EXPECT_FALSE(OutputFolder::create(home / "file/out", false));
  EXPECT_FALSE(OutputFolder::create("", false));
}

TEST(WriteFile, NamesTheFileAndLeavesNothingWhereTheDiskIsFull) {
  const TemporaryFolder home;
  // A limit on file size stands in for a full disk. The signal would end the program otherwise.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &tight);
  const auto written = write_file(home / "big", std::string(1000000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr((home / "big").string()));
  EXPECT_THAT(written.error().message, HasSubstr("too large"));
  EXPECT_EQ(home.entries(), 0);
}

TEST(WriteFile, ReplacesAWholeFile) {
  const TemporaryFolder home;
  ASSERT_TRUE(write_file(home / "x", "a long first content"));
  ASSERT_TRUE(write_file(home / "x", "second"));
  EXPECT_EQ(read_file(home / "x").value(), "second");
  EXPECT_EQ(home.entries(), 1);
}

TEST(ReadFile, NamesWhatIsMissing) {
  const TemporaryFolder home;
  EXPECT_THAT(read_file(home / "none").error().message, HasSubstr("none does not exist"));
  EXPECT_THAT(read_file(home.path()).error().message, HasSubstr("is not a file"));
  write_content(home / "empty", "");
  EXPECT_EQ(read_file(home / "empty").value(), "");
}

}  // namespace
}  // namespace crumple
