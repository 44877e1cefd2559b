#include "datasets/bag.h"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::HasSubstr;

class Bag : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(folder() / "data/left");
    write_content(folder() / "data/capture.yaml", "schema: crumple-capture/1\n");
    write_content(folder() / "data/left/100%\n.png", "an odd name");
    write_content(folder() / "data/left/1.png", "an image");
    ASSERT_TRUE(write_bag_tags(folder(), {"A\ntest", "2026-01-02"}));
  }

  std::filesystem::path folder() const { return home_ / "bag"; }

  // The only finding.
  void expect_finding(const std::string& where, const std::string& sentence) const {
    const auto findings = check_bag(folder());
    ASSERT_EQ(findings.size(), 1U) << (findings.empty() ? "" : findings[1].sentence);
    EXPECT_EQ(findings[0].severity, Severity::error);
    EXPECT_EQ(findings[0].where, (folder() / where).string());
    EXPECT_THAT(findings[0].sentence, HasSubstr(sentence));
  }

  TemporaryFolder home_;
};

TEST_F(Bag, IsWrittenAsTheStandardSays) {
  EXPECT_EQ(content_of(folder() / "bagit.txt"), "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n");
  EXPECT_EQ(content_of(folder() / "bag-info.txt"),
            "Bagging-Date: 2026-01-02\nExternal-Description: A test\nPayload-Oxum: 45.3\n");
  // The digest as `printf 'an image' | sha256sum` prints it.
  EXPECT_THAT(content_of(folder() / "manifest-sha256.txt"),
              HasSubstr("a5df3fde7b200c3fa2791144c7e05c5c2bced4c6ad863d3a4cf76c972c1712f9  data/left/1.png\n"));
  EXPECT_THAT(content_of(folder() / "manifest-sha256.txt"), HasSubstr("  data/left/100%25%0A.png\n"));
  EXPECT_TRUE(check_bag(folder()).empty());
}

TEST_F(Bag, IsRecognised) {
  EXPECT_TRUE(bag_of(folder()));
  EXPECT_TRUE(bag_of(folder() / "data/capture.yaml"));
  EXPECT_FALSE(bag_of(folder() / "data/left/1.png"));
  EXPECT_FALSE(bag_of(home_ / "elsewhere.yaml"));
}

TEST_F(Bag, NamesAFileThatIsMissing) {
  std::filesystem::remove(folder() / "bag-info.txt");  // so that its count cannot tell as well
  std::filesystem::remove(folder() / "tagmanifest-sha256.txt");
  std::filesystem::remove(folder() / "data/left/1.png");
  expect_finding("data/left/1.png", "is missing");
}

TEST_F(Bag, NamesAFileThatWasChanged) {
  write_content(folder() / "data/left/1.png", "an imagE");
  expect_finding("data/left/1.png", "was changed");
}

TEST_F(Bag, NamesAFileThatWasAdded) {
  std::filesystem::remove(folder() / "bag-info.txt");
  std::filesystem::remove(folder() / "tagmanifest-sha256.txt");
  write_content(folder() / "data/left/2.png", "one more");
  expect_finding("data/left/2.png", "is not listed");
}

TEST_F(Bag, NamesALinkThatLeavesTheBag) {
  std::filesystem::rename(folder() / "data/left/1.png", home_ / "1.png");
  std::filesystem::create_symlink(home_ / "1.png", folder() / "data/left/1.png");
  expect_finding("data/left/1.png", "is no plain file");
}

TEST_F(Bag, NamesDamagedTagFiles) {
  std::filesystem::remove(folder() / "tagmanifest-sha256.txt");
  const std::string manifest = content_of(folder() / "manifest-sha256.txt");
  write_content(folder() / "manifest-sha256.txt", manifest + "abc  data/left/1.png\n");
  expect_finding("manifest-sha256.txt", "line 4");
  write_content(folder() / "manifest-sha256.txt", manifest + std::string(64, 'a') + "  data/../../passwd\n");
  expect_finding("manifest-sha256.txt", "names data/../../passwd");
  write_content(folder() / "manifest-sha256.txt", manifest);
  write_content(folder() / "bagit.txt", "BagIt-Version: 3.0\nTag-File-Character-Encoding: UTF-8\n");
  expect_finding("bagit.txt", "BagIt-Version: 1.0");
  std::filesystem::remove(folder() / "bagit.txt");
  expect_finding("bagit.txt", "is missing");
}

TEST_F(Bag, CountsThePayload) {
  std::filesystem::remove(folder() / "tagmanifest-sha256.txt");
  replace_in(folder() / "bag-info.txt", "45.3", "45.4");
  expect_finding("bag-info.txt", "45.4");
}

TEST_F(Bag, NamesATagFileThatWasChanged) {
  replace_in(folder() / "bag-info.txt", "A test", "A jest");
  expect_finding("bag-info.txt", "was changed");
}

}  // namespace
}  // namespace crumple
