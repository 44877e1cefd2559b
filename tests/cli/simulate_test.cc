#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/simulated_capture.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(SimulateVerb, WritesTheChosenStationsAndStatesTheSeed) {
  const SimulatedCapture& capture = SimulatedCapture::get();
  ASSERT_EQ(capture.run().exit_code, 0) << capture.run().err;
  const json document = json::parse(capture.run().out);
  EXPECT_EQ(document["stations"], json({"board_1", "panel_1"}));
  EXPECT_EQ(document["images"], 2 * 36);
  EXPECT_EQ(document["seed"], 11);
  EXPECT_TRUE(std::filesystem::exists(capture.folder() / "panel_1/cam0/035.png"));
  EXPECT_TRUE(std::filesystem::exists(capture.folder() / "truth/panel_1/cam0_depth.tiff"));
  EXPECT_FALSE(std::filesystem::exists(capture.folder() / "board_2"));
  const std::string scene = content_of(capture.folder() / "truth/scene.yaml");
  EXPECT_THAT(scene, HasSubstr("\nseed: 11\n"));
  EXPECT_THAT(scene, testing::Not(HasSubstr("seed: 7")));
  EXPECT_THAT(content_of(capture.folder() / "ro-crate-metadata.json"), HasSubstr("#seed-scene"));
}

TEST(SimulateVerb, TheSceneThatItWroteGivesTheSameImages) {
  const SimulatedCapture& capture = SimulatedCapture::get();
  const TemporaryFolder home;
  const ProgramRun run =
      run_program("simulate '" + (capture.folder() / "truth/scene.yaml").string() +
                  "' --stations=board_1,panel_1 --threads=1 --out='" + (home / "again").string() + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("72 images at 2 stations, seed 11"));
  for (const char* const image : {"board_1/cam0/000.png", "panel_1/cam0/020.png"}) {
    EXPECT_EQ(content_of(capture.folder() / image), content_of(home.path() / "again" / image)) << image;
  }
}

TEST(SimulateVerb, ABagProvesThatNothingWasChanged) {
  const TemporaryFolder home;
  const std::string bag = (home / "bag").string();
  const ProgramRun run =
      run_program("simulate '" + small_scene + "' --stations=panel_1 --nodepth_maps --bag --out='" + bag + "'",
                  "SOURCE_DATE_EPOCH=86400");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(content_of(home / "bag/bag-info.txt"), HasSubstr("Bagging-Date: 1970-01-02"));
  const ProgramRun sound = run_program("check '" + bag + "' --json");
  EXPECT_EQ(sound.exit_code, 0) << sound.out;
  EXPECT_TRUE(json::parse(sound.out)["bag"]);

  std::filesystem::remove(home / "bag/data/panel_1/cam0/003.png");
  replace_in(home / "bag/data/capture.yaml", "title", "# title");
  const ProgramRun damaged = run_program("check '" + bag + "/data/capture.yaml'");
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.out, HasSubstr("data/panel_1/cam0/003.png: is missing"));
  EXPECT_THAT(damaged.out, HasSubstr("data/capture.yaml: was changed"));
  EXPECT_THAT(damaged.out, HasSubstr("`title` is missing"));
}

TEST(SimulateVerb, Mistakes) {
  const TemporaryFolder home;
  const std::string out = " --out='" + (home / "out").string() + "'";
  const auto simulate = [&](const std::string& rest) { return run_program("simulate " + rest + out); };
  EXPECT_EQ(simulate("'" + (home / "none.yaml").string() + "'").exit_code, 3);
  EXPECT_EQ(simulate("'" + small_scene + "' --seed=-2").exit_code, 2);
  const ProgramRun unknown = simulate("'" + small_scene + "' --stations=panel_9");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("panel_9"));
  EXPECT_EQ(home.entries(), 0);
  write_content(home / "scene.yaml", "schema: crumple-scene/1\ntitel: x\n");
  const ProgramRun bad = simulate("'" + (home / "scene.yaml").string() + "'");
  EXPECT_EQ(bad.exit_code, 3);
  EXPECT_THAT(bad.err, HasSubstr("scene.yaml:2:1"));
  EXPECT_EQ(home.entries(), 1);
}

}  // namespace
}  // namespace crumple
