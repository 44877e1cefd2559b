// Bad input, end to end: a sentence that names what is wrong, exit code 3, and nothing half-written.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>
#include <sys/mount.h>
#include <unistd.h>

#include "tests/cli/bad_capture.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

class BadInput : public DamagedCapture {
 protected:
  BadInput() { make(SmallCapture::sound); }

  void expect_both_refuse(const std::vector<std::string>& said) {
    expect_refused("check", said);
    expect_refused("calibrate", said);
  }
};

using NoPlacementsToTellFrom = DamagedCapture;

TEST_F(BadInput, NoneInASoundCapture) {
  const ProgramRun checked = run_program("check '" + description().string() + "'");
  EXPECT_EQ(checked.exit_code, 0) << checked.out;
  const ProgramRun run =
      run_program("calibrate '" + description().string() + "' --out='" + (home_ / "results/rig").string() + "'");
  // Four small views are too few to be trusted, which is another matter.
  EXPECT_THAT(run.exit_code, testing::AnyOf(0, 4)) << run.err;
  EXPECT_TRUE(fs::exists(home_ / "results/rig/rig.yaml"));
}

TEST_F(BadInput, AMissingImage) {
  fs::remove(image(2, 5));
  expect_both_refuse({"board_2/cam0/005.png does not exist."});
}

TEST_F(BadInput, AMissingBoardImage) {
  fs::remove(image(2, 0));
  expect_both_refuse({"board_2/cam0/000.png does not exist."});
}

TEST_F(BadInput, ATruncatedImage) {
  fs::resize_file(image(3, 7), fs::file_size(image(3, 7)) / 2);
  expect_both_refuse({"board_3/cam0/007.png is truncated"});
}

TEST_F(BadInput, AnEmptyImage) {
  fs::resize_file(image(3, 0), 0);
  expect_both_refuse({"board_3/cam0/000.png is empty."});
}

TEST_F(BadInput, AnImageOfAnotherSize) {
  cv::imwrite(image(1, 4).string(), cv::Mat(200, 320, CV_8UC1, cv::Scalar(90)));
  expect_both_refuse({"board_1/cam0/004.png is 320 x 200 px, but camera cam0 has 320 x 240"});
}

TEST_F(BadInput, MixedDepths) {
  cv::Mat deep;
  cv::imread(image(1, 4).string(), cv::IMREAD_UNCHANGED).convertTo(deep, CV_16U, 257);
  cv::imwrite(image(1, 4).string(), deep);
  expect_both_refuse({"station board_1, camera cam0: 004.png has 16 bit values"});
}

TEST_F(BadInput, SwappedFrames) {
  fs::rename(image(4, 4), home_ / "spare");
  fs::rename(image(4, 8), image(4, 4));
  fs::rename(home_ / "spare", image(4, 8));
  expect_both_refuse({"station board_4, camera cam0", "004.png", "008.png"});
}

TEST_F(BadInput, ADroppedFrame) {
  for (int frame = 10; frame < 27; ++frame) fs::rename(image(4, frame + 1), image(4, frame));
  expect_both_refuse({"station board_4, camera cam0", "027.png does not exist", "a frame was dropped"});
}

TEST_F(BadInput, ADarkFrame) {
  cv::imwrite(image(2, 0).string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(2)));
  expect_both_refuse({"station board_2, camera cam0", "000.png (white) is dark"});
}

TEST_F(BadInput, ASaturatedFrame) {
  cv::imwrite(image(2, 0).string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(255)));
  expect_both_refuse({"station board_2, camera cam0", "000.png (white) is saturated in 100.0 %"});
}

// What the projector lights lies beside the board: there, all is in order.
TEST_F(BadInput, ABoardThatIsNotLit) {
  const cv::Mat dark = cv::imread(image(1, 1).string(), cv::IMREAD_UNCHANGED);
  for (int frame = 0; frame < 28; ++frame) {
    const cv::Mat shown = cv::imread(image(1, frame).string(), cv::IMREAD_UNCHANGED);
    cv::Mat beside = dark.clone();
    shown(cv::Rect(130, 90, 60, 60)).copyTo(beside(cv::Rect(0, 0, 60, 60)));
    cv::imwrite(image(1, frame).string(), beside);
  }
  expect_refused("check", {"station board_1, camera cam0", "the projector lights none of the board: 000.png"});
  expect_refused("calibrate", {"station board_1", "lights none of the board"});
}

TEST_F(BadInput, FewerThanThreePlacements) {
  for (const int station : {1, 4}) {
    cv::imwrite(image(station, 0).string(), cv::Mat(240, 320, CV_8UC1, cv::Scalar(120)));
  }
  expect_refused("calibrate",
                 {"cam0 sees the board in 2 placements: a calibration needs at least 3", "board_1", "board_4"});
}

// The camera's images of all stations once more, as those of a second camera at stations of its own.
TEST_F(BadInput, ABoardThatNoTwoCamerasSeeAtOnce) {
  for (int i = 1; i <= 4; ++i) {
    const fs::path other = home_ / fmt::format("capture/other_{}", i);
    fs::copy(home_ / fmt::format("capture/board_{}", i), other, fs::copy_options::recursive);
    fs::rename(other / "cam0", other / "cam1");
  }
  replace_in(description(), "crumple-capture/2", "crumple-capture/3");
  const std::string sound = content_of(description());
  const std::size_t begin = sound.find("  \"cam0\":"), end = sound.find("  \"proj0\":");
  ASSERT_TRUE(begin < end && end != std::string::npos) << sound;
  const std::string first = sound.substr(begin, end - begin);
  std::string second = first;
  second.replace(second.find("cam0"), 4, "cam1");
  const std::string stations = "board_1, board_2, board_3, board_4", others = "other_1, other_2, other_3, other_4";
  const std::string text = sound.substr(0, begin) + first + "    stations: [" + stations + "]\n" + second +
                           "    stations: [" + others + "]\n" + sound.substr(end);
  write_content(description(),
                text.substr(0, text.find("\nstations:")) + "\nstations: [" + stations + ", " + others + "]\n");
  expect_refused("calibrate",
                 {"cam1 shares no board placement with the other cameras: show the board to both at once"});
}

TEST_F(NoPlacementsToTellFrom, Parallel) {
  make(SmallCapture::parallel);
  expect_refused("calibrate",
                 {"cam0: all board placements are parallel, or nearly so, and the focal length cannot be told",
                  "nothing tells cam0.fx", "what stays determined: cam0 projects points at the depth of what it saw"});
}

TEST_F(NoPlacementsToTellFrom, ProjectorTurnedAway) {
  make(SmallCapture::turned_away);
  const std::vector<std::string> said = {"station board_1, camera cam0",
                                         "the projector lights none of what the camera sees"};
  expect_refused("check", said);
  expect_refused("calibrate", said);
}

struct Slip {
  const char* old_text;
  const char* new_text;
  const char* said;
};

class BadDescription : public DamagedCapture, public testing::WithParamInterface<Slip> {};

TEST_P(BadDescription, IsRefusedWithLineAndColumn) {
  make(SmallCapture::sound);
  const std::string before = content_of(description());
  replace_in(description(), GetParam().old_text, GetParam().new_text);
  ASSERT_NE(content_of(description()), before);
  expect_refused("calibrate", {"capture.yaml:", GetParam().said});
}

INSTANTIATE_TEST_SUITE_P(
    Slips, BadDescription,
    testing::Values(Slip{"pitch_mm: ", "pitch_mn: ", "board: unknown key `pitch_mn`; did you mean `pitch_mm`?"},
                    Slip{"pitch_mm: ", "pitch_m: ", "did you mean `pitch_mm`? (The unit is part of the key.)"},
                    Slip{"pitch_mm: 24", "pitch_mm: \"24\"", "board.pitch_mm: must be a number above zero"},
                    Slip{"pitch_mm: 24", "pitch_mm: 24 mm", "not `24 mm`."},
                    Slip{"kind: camera", "kind: kamera", "must be camera or projector, not `kamera`."},
                    Slip{"schema: crumple-capture/2", "schema: crumple-capture/9", "capture.yaml:1:9: schema"},
                    Slip{"title: ", "title: [", "not valid YAML"}));

TEST_F(BadInput, AnOutputFolderThatExists) {
  fs::create_directory(home_ / "rig");
  write_content(home_ / "rig/note", "mine");
  const ProgramRun run =
      run_program("calibrate '" + description().string() + "' --out='" + (home_ / "rig").string() + "'");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, testing::HasSubstr("rig exists already. Choose another --out, or give --overwrite."));
  EXPECT_EQ(content_of(home_ / "rig/note"), "mine");
}

// Files may not exceed 2 kB: what a full disk does to the program, without the rights to make one.
TEST_F(BadInput, NoRoomForAFile) {
  expect_refused("calibrate", {"covariance.npy could not be written: File too large."}, "trap '' XFSZ; ulimit -f 4;");
}

TEST_F(BadInput, AFullDisk) {
  const fs::path disk = home_ / "results";
  if (mount("none", disk.c_str(), "tmpfs", 0, "size=16k") != 0) {
    GTEST_SKIP() << "NOT TESTED: a full disk; only root may mount a small one";
  }
  expect_refused("calibrate", {"could not be written: No space left on device."});
  EXPECT_EQ(umount(disk.c_str()), 0);
}

}  // namespace
}  // namespace crumple
