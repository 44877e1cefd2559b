#include "datasets/bag.h"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// As `sha512sum` prints them of the files below.
constexpr const char* kSha512 =
    "05f7eba0e98b7ad4632ca1eee009da4332fa72142f4d962f89cb16c285bd55de"
    "bed698cc95f0e1cc009c7164240e71fe85dd25ce639f3f6493f9e2443c21d483  data/capture.yaml\n"
    "206c6dd73788f8de0a06f62347ddb43fd7bc8b59e5c089a6f39e1c3987dfb0f9"
    "db4ea965cea80fdecb9b366705063fa831f4762d368945f0ea8c9a7d28c24741  data/left/100%25%0A.png\n"
    "b85976b97f57a4f68329fe92a726e14ea6499f733f9e7f775ef5b1eba5945818"
    "a0b8ac03126af61c1a3c7c96fc5b4380a77674149c781f203cf8f64713c622cf  data/left/1.png\n";

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
  EXPECT_TRUE(bag_of(folder() / "data"));
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

TEST_F(Bag, ATitleIsNoCountOfThePayload) {
  ASSERT_TRUE(write_bag_tags(folder(), {"Payload-Oxum: 1.1", "2026-01-02"}));
  EXPECT_THAT(check_bag(folder()), IsEmpty());
}

TEST_F(Bag, IsVerifiedBySha512Alone) {
  std::filesystem::remove(folder() / "manifest-sha256.txt");
  std::filesystem::remove(folder() / "tagmanifest-sha256.txt");
  expect_finding("manifest-sha256.txt", "is missing, and so is manifest-sha512.txt");
  write_content(folder() / "manifest-sha512.txt", kSha512);
  EXPECT_THAT(check_bag(folder()), IsEmpty());
  write_content(folder() / "data/left/1.png", "an imagE");
  expect_finding("data/left/1.png", "its SHA-512 is not the one in manifest-sha512.txt");
}

TEST_F(Bag, EveryManifestHasToHold) {
  const std::string sha512 = kSha512;
  write_content(folder() / "manifest-sha512.txt", sha512);
  EXPECT_THAT(check_bag(folder()), IsEmpty());
  write_content(folder() / "manifest-sha512.txt", "15" + sha512.substr(2));
  expect_finding("data/capture.yaml", "its SHA-512 is not the one in manifest-sha512.txt");
  write_content(folder() / "manifest-sha512.txt", sha512.substr(sha512.find('\n') + 1));
  expect_finding("data/capture.yaml", "is not listed in manifest-sha512.txt");
  write_content(folder() / "manifest-sha512.txt", sha512 + std::string(64, 'a') + "  data/left/1.png\n");
  expect_finding("manifest-sha512.txt", "line 4 is not a digest of 128");
  write_content(folder() / "manifest-sha512.txt", sha512);
  write_content(folder() / "tagmanifest-sha512.txt", std::string(128, 'a') + "  bag-info.txt\n");
  expect_finding("bag-info.txt", "its SHA-512 is not the one in tagmanifest-sha512.txt");
}

// Manifests that would not hold any more give way as well.
TEST_F(Bag, TagsAreWrittenAnew) {
  write_content(folder() / "manifest-sha512.txt", kSha512);
  write_content(folder() / "manifest-md5.txt", "");
  write_content(folder() / "data/left/1.png", "another image");
  const auto written = write_bag_tags(folder(), {"A test", "2026-01-03", "A. N.\tOther", "2026-01-01"});
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_THAT(*written, ElementsAre("bag-info.txt", "bagit.txt", "manifest-sha256.txt", "tagmanifest-sha256.txt"));
  EXPECT_THAT(bag_tags_in(folder()).value(), testing::ElementsAreArray(*written));
  EXPECT_THAT(check_bag(folder()), IsEmpty());
  EXPECT_THAT(content_of(folder() / "bag-info.txt"),
              HasSubstr("Capture-Operator: A. N. Other\nCapture-Date: 2026-01-01\n"));
}

TEST_F(Bag, WhatCannotBeOneKeepsItsTags) {
  const std::string info = content_of(folder() / "bag-info.txt");
  const auto refusal = [&] {
    const auto written = write_bag_tags(folder(), {"Another", "2026-01-03"});
    EXPECT_EQ(content_of(folder() / "bag-info.txt"), info);
    return written ? std::string("none") : written.error().message;
  };
  write_content(folder() / "fetch.txt", "http://example.org/a 2 data/a\n");
  EXPECT_THAT(refusal(), HasSubstr("fetch.txt lists files that are elsewhere"));
  std::filesystem::remove(folder() / "fetch.txt");
  std::filesystem::rename(folder() / "data/left", home_ / "left");
  std::filesystem::create_directory_symlink(home_ / "left", folder() / "data/left");
  EXPECT_THAT(refusal(), HasSubstr("data/left is no plain file"));
  std::filesystem::remove(folder() / "data/left");
  std::filesystem::rename(home_ / "left", folder() / "data/left");
  std::filesystem::rename(folder() / "data", home_ / "data");
  std::filesystem::create_directory_symlink(home_ / "data", folder() / "data");
  EXPECT_THAT(refusal(), HasSubstr("data is a link"));
  expect_finding("data", "is a link");
}

TEST_F(Bag, LiesAroundItsPayload) {
  EXPECT_EQ(bag_around(folder() / "data/other.yaml").value().string(), folder().string());
  EXPECT_FALSE(bag_around(folder() / "capture.yaml"));
  EXPECT_FALSE(bag_around(folder() / "data/left/capture.yaml"));
}

}  // namespace
}  // namespace crumple
