#include "datasets/scene_file.h"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/simulate_yaml.h"
#include "tests/datasets/render_scenes.h"
#include "tests/datasets/tracked_scene.h"

namespace crumple {
namespace {

using testing::HasSubstr;

std::string small_text() {
  std::ifstream file(std::string(CRUMPLE_SOURCE_DIR) + "/datasets/scenes/small.yaml");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string scene_error_with(const std::string& from, const std::string& to) {
  std::string text = small_text();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto scene = parse_scene(text, "s.yaml");
  return scene ? "no error" : scene.error().message;
}

TEST(SceneFile, reads_the_scenes_that_come_with_the_program) {
  const Scene small = scene_from_file("small.yaml");
  ASSERT_EQ(small.cameras.size(), 1U);
  EXPECT_EQ(small.cameras[0].sensor.lens.parameters(),
            (std::vector<double>{441.2, 440.7, 163.1, 117.4, -0.09, 0.05, 0.0005, -0.0004, 0}));
  EXPECT_EQ(small.frames.size(), 36U);
  EXPECT_EQ(small.stations.size(), 5U);
  EXPECT_FALSE(small.stations[4].board);
  // Stations state where the middle of the plate is.
  const Eigen::Vector3d middle = small.stations[0].probe_from_surface * Eigen::Vector3d(96, 60, 0);
  EXPECT_LT((middle - Eigen::Vector3d(0, 0, 500)).norm(), 1e-9);
  // The projector's place is where it stands, not where it sees the probe.
  const Eigen::Vector3d stands = small.projector->sensor.sensor_from_mount.inverse().translation;
  EXPECT_LT((stands - Eigen::Vector3d(180, 0, 0)).norm(), 1e-9);

  const Scene door = scene_from_file("door.yaml");
  EXPECT_EQ(door.orientations.size(), 4U);
  EXPECT_EQ(door.stations.size(), 12U);

  // The car is scanned with what the tracked door calibrates.
  const Scene tracked = scene_from_file("tracked_door.yaml"), car = scene_from_file("car_crash.yaml");
  ASSERT_EQ(car.cameras.size(), tracked.cameras.size());
  for (std::size_t c = 0; c < car.cameras.size(); ++c) {
    EXPECT_EQ(car.cameras[c].sensor.name, tracked.cameras[c].sensor.name);
    EXPECT_EQ(car.cameras[c].sensor.lens.parameters(), tracked.cameras[c].sensor.lens.parameters());
  }
  ASSERT_EQ(car.tracking.leds.size(), tracked.tracking.leds.size());
  for (std::size_t l = 0; l < car.tracking.leds.size(); ++l) {
    EXPECT_EQ(car.tracking.leds[l].led.position_mm, tracked.tracking.leds[l].led.position_mm);
  }
  EXPECT_FALSE(scene_from_file("projected_board.yaml").stations.empty());
}

TEST(SceneFile, names_line_column_and_field_of_a_mistake) {
  EXPECT_THAT(scene_error_with("blur_px: 0.4", "blur_mm: 0.4"), HasSubstr("s.yaml:12:5: sensors.cam0"));
  EXPECT_THAT(scene_error_with("blur_px: 0.4", "blur_mm: 0.4"), HasSubstr("blur_px"));
  EXPECT_THAT(scene_error_with("pitch_mm: 24", "pitch_mm: twenty"), HasSubstr("board.pitch_mm"));
  EXPECT_THAT(scene_error_with("bits: 8", "bits: 7"), HasSubstr("8 to 16"));
  EXPECT_THAT(scene_error_with("exposure: 0.8", "gamma: 2"), HasSubstr("gamma"));
  EXPECT_THAT(scene_error_with("seed: 7", "seed: \"7\""), HasSubstr("seed"));
  EXPECT_THAT(scene_error_with("bits: 9}", "bits: 4}"), HasSubstr("patterns.orientations[0]"));
  EXPECT_THAT(scene_error_with("0.05, 0.0005,", "0.05, 0.0005, 0, 0, 0,"), HasSubstr("at most 5 distortion terms"));
  EXPECT_THAT(scene_error_with("position_mm: [180, 0, 0]", "position_mm: [180, 0]"), HasSubstr("must hold 3 numbers"));
  EXPECT_THAT(scene_error_with("id: board_2", "id: board_1"), HasSubstr("listed twice"));
  EXPECT_THAT(scene_error_with("id: board_2", "id: .."), HasSubstr("not . or .."));
  EXPECT_THAT(scene_error_with("focal_px: [441.2", "model: LENSMODEL_NONE, focal_px: [441.2"),
              HasSubstr("LENSMODEL_NONE"));
  EXPECT_THAT(scene_error_with("board: {position_mm: [0, 0, 500]", "plate: {position_mm: [0, 0, 500]"),
              HasSubstr("either `board` or `panel`"));
  EXPECT_THAT(scene_error_with("kind: projector", "kind: camera"), HasSubstr("projector"));
  EXPECT_THAT(scene_error_with("bulge_radius_mm: [1500, 700]", "bulge_radius_mm: [1500, 0]"),
              HasSubstr("50 mm or more"));
}

TEST(SceneFile, its_capture_can_be_read_whatever_its_names_are) {
  std::string text = small_text();
  text.replace(text.find("cam0:"), 5, "\"null\":");
  text.replace(text.find("A small board"), 13, "\"Two\\nlines\" # ");
  text.replace(text.find("id: board_1"), 11, "id: \"a: \\\"b\\\"\"");
  const auto scene = parse_scene(text, "s.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  const auto capture = parse_capture(capture_yaml(*scene), "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->title, "Two\nlines");
  EXPECT_NE(capture->sensor("null"), nullptr);
  EXPECT_NE(capture->station("a: \"b\""), nullptr);
}

std::string tracked_error_with(const std::string& from, const std::string& to) {
  std::string text = tracked_scene_text();
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const auto scene = parse_scene(text, "s.yaml");
  return scene ? "no error" : scene.error().message;
}

TEST(SceneFile, places_a_tracked_probe_in_the_world) {
  const Scene scene = tracked_scene();
  ASSERT_EQ(scene.tracking.trackers.size(), 2U);
  EXPECT_EQ(scene.tracking.trackers[1].sensor.mount, Mount::world);
  ASSERT_EQ(scene.tracking.leds.size(), 4U);
  EXPECT_EQ(scene.tracking.frames.size(), 9U);
  const Rig rig = true_rig(scene);
  EXPECT_EQ(rig.sensors[3].name, "tracker1");
  EXPECT_EQ(rig.leds[3].mount, Mount::world);
  // The board's middle, from two stations of one placement.
  for (std::size_t station : {0U, 1U}) {
    EXPECT_LT(
        (world_from_surface(scene.stations[station]) * Eigen::Vector3d(96, 60, 0) - Eigen::Vector3d(0, 0, 1500)).norm(),
        1e-9);
  }
  EXPECT_EQ(scene.stations[1].placement, "bench");
  EXPECT_FALSE(scene.stations[2].in_view);
  EXPECT_FALSE(scene.stations[3].board);
}

TEST(SceneFile, tracked_scenes_are_checked) {
  EXPECT_THAT(tracked_error_with("crumple-scene/2", "crumple-scene/1"),
              AllOf(HasSubstr("sensors.tracker0.mount: is new in crumple-scene/2"), HasSubstr("leds: is new"),
                    HasSubstr("placements: is new")));
  EXPECT_THAT(tracked_error_with("id: wand, scan: false", "id: wand"), HasSubstr("say `scan: false`"));
  EXPECT_THAT(tracked_error_with("placement: door, trackers", "placement: gate, trackers"),
              HasSubstr("there is no placement `gate`"));
  EXPECT_THAT(tracked_error_with(", probe: {position_mm: [0, 40, 1000], rotation_deg: [10, 0, 0]}", ""),
              HasSubstr("`probe` is missing"));
  EXPECT_THAT(tracked_error_with("led_exposure:", "probe_body: {size_mm: [200, 200, 200]}\nled_exposure:"),
              HasSubstr("leds.a: lies inside `probe_body`"));
  EXPECT_THAT(tracked_error_with("tracker_frames:", "#"), HasSubstr("`tracker_frames` is missing"));
  EXPECT_THAT(tracked_error_with("led_exposure:", "false_spots: [{lamp: {position_mm: [0, 0, 1]}, mirror: {}}]\n#"),
              HasSubstr("either a `lamp` or a `mirror`"));
  EXPECT_THAT(scene_error_with("frames: [white", "leds: {a: {position_mm: [0, 0, 0], word: \"01\"}}\nframes: [white"),
              HasSubstr("leds: needs a camera with `mount: world`"));
}

TEST(SceneFile, the_capture_of_a_tracked_scene_can_be_read) {
  const auto capture = parse_capture(capture_yaml(tracked_scene()), "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(capture->schema, 3);
  EXPECT_EQ(capture->sensor("tracker1")->mount, Mount::world);
  EXPECT_EQ(capture->tracker_frames.size(), 9U);
  EXPECT_EQ(capture->leds[1].word, "11001001");
  EXPECT_EQ(*capture->leds[1].nominal_mm, Eigen::Vector3d(60, -50, -41));
  EXPECT_EQ(capture->leds[3].mount, Mount::world);
  EXPECT_EQ(capture->stations[1].placement, "bench");
  EXPECT_FALSE(capture->stations[2].scan);
  EXPECT_TRUE(capture->stations[2].boards.empty());
  EXPECT_FALSE(capture->stations[3].trackers);
}

std::string small_with(const std::string& keys) {
  std::string text = small_text();
  text.replace(text.find("crumple-scene/1"), 15, "crumple-scene/2");
  return text.insert(text.find("patterns:"), keys);
}

TEST(SceneFile, describes_objects) {
  std::string text = small_with(
      "objects:\n"
      "  before: {kind: car_side, dents: [{radius_mm: 30, depth_mm: 1}]}\n"
      "  after: {like: before, presses: [{half_length_mm: 300, half_width_mm: 50, depth_mm: 20, direction_deg: 90}]}\n"
      "  bar: {kind: balls, radius_mm: 20, centres_mm: [[-100, 0], [100, 0]]}\n"
      "  table: {kind: plate, size_mm: [300, 200]}\n\n");
  text += "  - {id: hit, object: {name: after, position_mm: [0, 0, 700]}}\n";
  const auto scene = parse_scene(text, "s.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->objects.size(), 4U);
  const SceneStation& hit = scene->stations.back();
  ASSERT_EQ(hit.object, 1U);
  const Surface& after = surface_at(*scene, hit);
  EXPECT_NEAR(after.height_mm(0, 0) - scene->objects[0].surface->height_mm(0, 0), 20, 1e-9);
  const auto capture = parse_capture(capture_yaml(*scene), "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_TRUE(capture->stations.back().boards.empty());
  EXPECT_THAT(true_stations_yaml(*scene), HasSubstr("object: \"after\""));
}

std::string object_error(const std::string& object) {
  const auto scene = parse_scene(small_with("objects:\n  x: " + object + "\n\n"), "s.yaml");
  return scene ? "no error" : scene.error().message;
}

TEST(SceneFile, objects_are_checked) {
  EXPECT_THAT(object_error("{like: y}"), HasSubstr("no panel or car side `y`"));
  EXPECT_THAT(object_error("{kind: cube}"), HasSubstr("must be panel or car_side or plate or balls"));
  EXPECT_THAT(object_error("{kind: balls, radius_mm: 9, centres_mm: [[0, 0], [10, 0]]}"), HasSubstr("overlaps"));
  EXPECT_THAT(object_error("{kind: plate, size_mm: [9, 9], pitch_mm: 3}"), HasSubstr("unknown key `pitch_mm`"));
}

TEST(SceneFile, one_of_several_projectors_shows_the_patterns) {
  std::string text = small_with("");
  text.insert(text.find("\nlighting:"),
              "\n  proj1: {kind: projector, size_px: [320, 240], position_mm: [-180, 0, 0], rotation_deg: [0, 19, 0],\n"
              "          lens: {focal_px: [470, 470], centre_px: [160, 270]}}\n");
  const auto first = parse_scene(text, "s.yaml");
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->projector->sensor.name, "proj0");
  EXPECT_EQ(true_rig(*first).sensors.back().name, "proj1");
  text.insert(text.find("  orientations:"), "  projector: proj1\n");
  const auto second = parse_scene(text, "s.yaml");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->projector->sensor.name, "proj1");
  const auto capture = parse_capture(capture_yaml(*second), "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_EQ(*capture->projector, "proj1");
  EXPECT_NE(capture->sensor("proj0"), nullptr);
  text.replace(text.find("projector: proj1"), 16, "projector: proj2");
  EXPECT_FALSE(parse_scene(text, "s.yaml"));
}

TEST(SceneFile, a_thermal_camera_takes_one_image) {
  std::string text = small_with("");
  text.insert(text.find("  proj0:"),
              "  thermal: {kind: camera, sees: thermal, size_px: [320, 240], position_mm: [-60, 0, 0],\n"
              "            lens: {focal_px: [400, 400], centre_px: [160, 120]}}\n");
  const auto scene = parse_scene(text, "s.yaml");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(frames_of(*scene, scene->cameras[1]).size(), 1U);
  EXPECT_NE(scene->board->material(1, 1).thermal, scene->board->material(-1, 1).thermal);
  const auto capture = parse_capture(capture_yaml(*scene), "capture.yaml");
  ASSERT_TRUE(capture) << capture.error().message;
  EXPECT_TRUE(capture->sensor("thermal")->ambient_only);
  EXPECT_EQ(capture->frames_of("thermal").size(), 1U);
}

TEST(SceneFile, a_missing_file_is_named) {
  const auto scene = read_scene("/no/such/scene.yaml");
  ASSERT_FALSE(scene);
  EXPECT_THAT(scene.error().message, HasSubstr("/no/such/scene.yaml"));
}

}  // namespace
}  // namespace crumple
