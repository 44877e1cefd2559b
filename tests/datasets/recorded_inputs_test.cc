#include "datasets/recorded_inputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/run_record.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

// A rig of that text that was made from these files.
void make_result(const fs::path& folder, const std::string& rig, const std::vector<fs::path>& from) {
  fs::create_directories(folder);
  write_content(folder / "rig.yaml", rig);
  ASSERT_TRUE(write_run_record(
      folder, {"1.2.3", "calibrate", "2024-05-06", {{"k", "2"}}, {{"noise", 42}}, hashed_files(from).value()}));
}

class RecordedInputsOf : public testing::Test {
 protected:
  RecordedInputsOf() {
    for (const char* name : {"capture.yaml", "image_1", "image_2", "image_3"}) write_content(home_ / name, name);
  }

  TemporaryFolder home_;
};

TEST_F(RecordedInputsOf, AreWhatWentInAndNotWhatCameOut) {
  make_result(home_ / "a", "rig a", {home_ / "image_1"});
  const auto inputs = read_recorded_inputs(home_ / "a");
  ASSERT_TRUE(inputs && *inputs);
  EXPECT_THAT(**inputs, ElementsAre(Pair(sha256_of_text("image_1"), (home_ / "image_1").string())));
}

TEST_F(RecordedInputsOf, AreUnknownWithoutARecord) {
  const auto inputs = read_recorded_inputs(home_.path());
  ASSERT_TRUE(inputs);
  EXPECT_FALSE(*inputs);
}

TEST_F(RecordedInputsOf, WhatIsNoRunRecordIsNamed) {
  for (const char* text : {"", "{", "[]", "7", "{\"@graph\": 3}", "{\"@graph\": [4, {\"@id\": \"#run\"}]}"}) {
    write_content(home_ / run_record_name, text);
    const auto inputs = read_recorded_inputs(home_.path());
    ASSERT_FALSE(inputs) << text;
    EXPECT_THAT(inputs.error().message, HasSubstr(run_record_name)) << text;
  }
}

TEST_F(RecordedInputsOf, FilesThatWentIntoBothAreNamed) {
  make_result(home_ / "a", "rig a", {home_ / "capture.yaml", home_ / "image_1", home_ / "image_2"});
  make_result(home_ / "b", "rig b", {home_ / "capture.yaml", home_ / "image_2", home_ / "image_3"});
  make_result(home_ / "c", "rig c", {home_ / "capture.yaml", home_ / "image_3"});
  EXPECT_THAT(shared_inputs(home_ / "a", home_ / "b").value().common, ElementsAre((home_ / "image_2").string()));
  EXPECT_THAT(shared_inputs(home_ / "a", home_ / "c").value().common, IsEmpty());
}

TEST_F(RecordedInputsOf, OneThatWentOnFromTheOtherIsTold) {
  make_result(home_ / "a", "rig a", {home_ / "image_1"});
  make_result(home_ / "b", "rig b", {home_ / "image_2", home_ / "a"});
  const SharedInputs there = shared_inputs(home_ / "a", home_ / "b").value();
  EXPECT_TRUE(there.second_from_first && !there.first_from_second);
  const SharedInputs back = shared_inputs(home_ / "b", home_ / "a").value();
  EXPECT_TRUE(back.first_from_second && !back.second_from_first);
  // The rig there now is not the one that went in.
  write_content(home_ / "a/rig.yaml", "another rig");
  const SharedInputs now = shared_inputs(home_ / "a", home_ / "b").value();
  EXPECT_FALSE(now.second_from_first || now.first_from_second);
  EXPECT_THAT(now.common, IsEmpty());
}

}  // namespace
}  // namespace crumple
