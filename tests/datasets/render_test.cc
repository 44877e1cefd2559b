#include "datasets/render/render.h"

#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "tests/datasets/render_scenes.h"

namespace crumple {
namespace {

const FrameContent ambient_frame{FrameContent::Kind::ambient, 0, 0, false};
const FrameContent white_frame{FrameContent::Kind::white, 0, 0, false};
const FrameContent finest_columns{FrameContent::Kind::stripes, 0, 5, false};

double cosine_to_the_fourth(const Scene& scene, int x, int y) {
  return 1 / std::pow(scene.cameras[0].sensor.lens.ray(Eigen::Vector2d(x, y))->squaredNorm(), 2);
}

TEST(Render, white_wall_has_the_analytic_radiance) {
  for (const double distance : {500.0, 800.0, 1100.0}) {
    Scene scene = wall_scene(distance);
    scene.lighting = {800, 0.07, 0};
    const Renderer renderer(scene, 2);
    const cv::Mat1f dark = renderer.radiance(0, 0, ambient_frame);
    const cv::Mat1f lit = renderer.radiance(0, 0, white_frame);
    for (const auto& [x, y] : {std::pair(32, 24), std::pair(5, 40), std::pair(60, 3)}) {
      const double falloff = cosine_to_the_fourth(scene, x, y);
      EXPECT_NEAR(dark(y, x) / falloff, 0.8 * 0.07, 1e-4);
      EXPECT_NEAR(lit(y, x) / falloff, 0.8 * (0.07 + std::pow(800 / distance, 2)), 1e-3);
    }
  }
}

// The profile of lit columns two pixels wide in every four, seen through the camera's square pixels: two boxes and two
// Gaussians convolved, in closed form.
TEST(Render, stripes_are_blurred_by_both_pixels_and_both_lenses) {
  Scene scene = wall_scene(800);
  scene.samples = 64;
  scene.cameras[0].optics.blur_px = 0.4;
  scene.projector->optics.blur_px = 0.3;
  const double sigma = std::hypot(0.4, 0.3);
  // The second antiderivative of the Gaussian; its second difference is a unit box blurred twice by it and a pixel.
  const auto ramp = [&](double t) {
    const double u = t / sigma;
    return sigma *
           (u * 0.5 * std::erfc(-u / std::numbers::sqrt2) + std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi));
  };
  const cv::Mat shown = projector_image(scene, finest_columns);
  const Renderer renderer(scene, 2);
  const cv::Mat1f seen = renderer.radiance(0, 0, finest_columns);
  double squares = 0;
  int count = 0;
  for (int y = 8; y < 40; ++y) {
    for (int x = 8; x < 56; ++x) {
      double expected = 0;
      for (int lit = 0; lit < shown.cols; ++lit) {
        if (shown.at<std::uint8_t>(0, lit) == 0) continue;
        const double offset = x - lit;
        expected += ramp(offset + 1) - 2 * ramp(offset) + ramp(offset - 1);
      }
      const double error = seen(y, x) / cosine_to_the_fourth(scene, x, y) / 0.8 - expected;
      squares += error * error;
      ++count;
      EXPECT_NEAR(error, 0, 0.03);
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.006);
}

// A thin lens out of focus: the second moment of a narrow line of light is that of the two pixels and of the disc of
// confusion, whose diameter is aperture * focal length * |1 / distance - 1 / focus| and variance diameter^2 / 16.
TEST(Render, defocus_is_that_of_a_thin_lens) {
  for (const bool of_camera : {true, false}) {
    Scene scene = wall_scene(1000);
    scene.samples = 256;
    Optics& optics = of_camera ? scene.cameras[0].optics : scene.projector->optics;
    optics.aperture_mm = 40;
    optics.focus_distance_mm = 500;
    const double diameter_px = 40 * 100 * std::abs(1 / 1000.0 - 1 / 500.0);
    scene.orientations = {{0, 32, 1, 0, true}};
    const cv::Mat1f edge = Renderer(scene, 2).radiance(0, 0, {FrameContent::Kind::stripes, 0, 0, false});
    double moments[3] = {0, 0, 0};
    for (int x = 20; x < 44; ++x) {
      double line = 0;  // the derivative of the edge is a line
      for (int y = 10; y < 38; ++y) {
        line += edge(y, x + 1) / cosine_to_the_fourth(scene, x + 1, y) - edge(y, x) / cosine_to_the_fourth(scene, x, y);
      }
      for (int power = 0; power < 3; ++power) moments[power] += line * std::pow(x + 0.5 - 31.5, power);
    }
    EXPECT_NEAR(moments[1] / moments[0], 0, 0.02);
    EXPECT_NEAR(moments[2] / moments[0], 2 / 12.0 + diameter_px * diameter_px / 16, 0.05) << of_camera;
  }
}

TEST(Render, depth_leads_to_the_projector_pixel_and_the_ideal_stripes) {
  const Scene scene = scene_from_file("small.yaml");
  const Renderer renderer(scene, 2);
  const Sensor& camera = scene.cameras[0].sensor;
  const Sensor& projector = scene.projector->sensor;
  for (std::size_t station = 0; station < scene.stations.size(); ++station) {
    const TrueGeometry truth = renderer.true_geometry(station, 0);
    int checked = 0;
    for (int y = 0; y < 240; y += 7) {
      for (int x = 0; x < 320; x += 7) {
        if (std::isnan(truth.projector_px(y, x)[0])) continue;
        const Eigen::Vector3d in_camera = truth.depth_mm(y, x) * *camera.lens.ray(Eigen::Vector2d(x, y));
        const Eigen::Vector2d pixel = *projector.lens.project(projector.sensor_from_mount * in_camera);
        EXPECT_NEAR(pixel.x(), truth.projector_px(y, x)[0], 1e-6);
        EXPECT_NEAR(pixel.y(), truth.projector_px(y, x)[1], 1e-6);
        const Pose probe_from_surface = scene.stations[station].probe_from_surface;
        EXPECT_NEAR(surface_at(scene, scene.stations[station]).distance_mm(probe_from_surface.inverse() * in_camera), 0,
                    1e-6);
        ++checked;
      }
    }
    EXPECT_GT(checked, 300) << station;
  }
}

TEST(Render, ideal_observations_agree_with_the_true_geometry) {
  Scene scene = scene_from_file("small.yaml");
  scene.projected_chessboard = ProjectedChessboard{9, 6, {99.5, 69.5}, 16};
  const Observations observations = ideal_observations(scene, 9);
  EXPECT_EQ(observations.placement_count, 4U);
  ASSERT_EQ(observations.corners.size(), 4U);
  ASSERT_EQ(observations.stripes.size(), 8U);
  const Renderer renderer(scene, 2);
  for (const StripeView& view : observations.stripes) {
    const TrueGeometry truth = renderer.true_geometry(view.placement, 0);
    EXPECT_GT(view.camera_pixels.size(), 100U);
    for (std::size_t i = 0; i < view.camera_pixels.size(); ++i) {
      const cv::Vec2d lit_by =
          truth.projector_px(static_cast<int>(view.camera_pixels[i].y()), static_cast<int>(view.camera_pixels[i].x()));
      EXPECT_NEAR(view.coordinates_px[i], view.normal.dot(Eigen::Vector2d(lit_by[0], lit_by[1])), 1e-6);
    }
  }
  for (const FeatureView& view : observations.features) EXPECT_GT(view.camera_pixels.size(), 20U);
}

// Under even light and on an image twice as fine: OpenCV's sector detector is off by 0.1 px and more where squares are
// only 20 px wide or the light falls off across the board, whatever the noise and the number of samples.
TEST(Render, corners_lie_where_the_measurement_model_says) {
  Scene scene = scene_from_file("small.yaml");
  scene.frames = {ambient_frame};
  scene.lighting.ambient = 0.8;
  scene.samples = 8;
  Lens& lens = scene.cameras[0].sensor.lens;
  std::vector<double> parameters = lens.parameters();
  for (const std::size_t focal : {0U, 1U}) parameters[focal] *= 2;
  for (const std::size_t centre : {2U, 3U}) parameters[centre] = 2 * parameters[centre] + 0.5;
  lens = *Lens::create(lens.model(), {640, 480}, parameters);
  const Observations ideal = ideal_observations(scene, 50);
  const Renderer renderer(scene, 2);
  const Target& board = scene.board->target();
  for (const std::size_t station : {0U, 2U}) {
    cv::Mat image;
    ASSERT_TRUE(renderer.render_station(station, [&](const RenderedFrame& frame) -> Expected<void> {
      image = frame.image;
      return {};
    }));
    std::vector<cv::Point2f> found;
    ASSERT_TRUE(cv::findChessboardCornersSB(image, cv::Size(board.columns, board.rows), found,
                                            cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY))
        << station;
    const CornerView& truth = ideal.corners[station];
    ASSERT_EQ(truth.pixels.size(), found.size());
    const auto distance = [&](std::size_t i, std::size_t j) {
      return std::hypot(found[j].x - truth.pixels[i].x(), found[j].y - truth.pixels[i].y());
    };
    // The detector may begin at the other end.
    const bool reversed = distance(0, 0) > distance(0, found.size() - 1);
    double squares = 0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < found.size(); ++i) {
      const std::size_t j = reversed ? found.size() - 1 - i : i;
      squares += distance(i, j) * distance(i, j);
      mean += (Eigen::Vector2d(found[j].x, found[j].y) - truth.pixels[i]) / static_cast<double>(found.size());
    }
    EXPECT_LT(mean.norm(), 0.02) << station;
    EXPECT_LT(std::sqrt(squares / static_cast<double>(found.size())), 0.05) << station;
  }
}

TEST(Render, bits_do_not_depend_on_the_number_of_threads) {
  Scene scene = scene_from_file("small.yaml");
  scene.cameras[0].optics.aperture_mm = 6;
  scene.frames.resize(6);
  const std::size_t panel_station = 4;
  const auto rendered = [&](int threads) {
    std::map<std::size_t, cv::Mat> images;
    std::mutex mutex;
    const auto done = Renderer(scene, threads).render_station(panel_station, [&](const RenderedFrame& frame) {
      const std::lock_guard lock(mutex);
      images[frame.frame] = frame.image;
      return Expected<void>();
    });
    EXPECT_TRUE(done);
    return images;
  };
  const auto alone = rendered(1);
  const auto together = rendered(2);
  ASSERT_EQ(alone.size(), 6U);
  for (const auto& [frame, image] : alone) EXPECT_EQ(cv::norm(image, together.at(frame), cv::NORM_INF), 0) << frame;
}

TEST(Render, an_error_of_the_sink_ends_the_rendering) {
  Scene scene = wall_scene(800);
  scene.frames.assign(50, white_frame);
  std::atomic<int> calls = 0;
  const auto done = Renderer(scene, 2).render_station(0, [&](const RenderedFrame&) -> Expected<void> {
    ++calls;
    return fail("the disk is full");
  });
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "the disk is full");
  EXPECT_LE(calls, 2);
}

// The recess' wall shades part of the panel from the projector, not from the room's light.
TEST(Render, surfaces_cast_shadows_on_themselves) {
  Scene scene = wall_scene(800);
  PanelShape shape;
  shape.size_mm = {1000, 1000};
  shape.recesses = {{{0, 0}, {60, 60}, 120}};
  scene.panel.emplace(shape, Material{0.8, 0, 0.3});
  scene.projector->sensor.sensor_from_mount.translation = {-700, 0, 0};
  scene.projector->sensor.lens =
      *Lens::undistorted("LENSMODEL_PINHOLE", scene.projector->sensor.lens.size(), 20, 20, Eigen::Vector2d(31.5, 23.5));
  const TrueGeometry truth = Renderer(scene, 2).true_geometry(0, 0);
  const auto lit = [&](int x, int y) { return !std::isnan(truth.projector_px(y, x)[0]); };
  EXPECT_TRUE(lit(5, 24));
  EXPECT_TRUE(lit(50, 24));
  int shaded = 0;
  for (int x = 24; x < 40; ++x) shaded += !lit(x, 24);
  EXPECT_GT(shaded, 2);
}

// Two planes that meet at a right angle, lit evenly: each sees the other in half of its hemisphere, weighted by the
// cosine, so half of the other's radiance times the albedo comes on top.
TEST(Render, one_bounce_lights_a_right_angle) {
  Scene scene = wall_scene(800);
  PanelShape valley;
  valley.size_mm = {500, 900};
  valley.creases = {{{0, 0}, std::numbers::pi / 2, -std::numbers::pi / 2, 0.5}};
  scene.panel.emplace(valley, Material{0.8, 0, 0.3});
  scene.stations[0].probe_from_surface.translation.z() = 800;
  const cv::Mat1f direct = Renderer(scene, 2).radiance(0, 0, white_frame);
  scene.lighting.bounce = true;
  const cv::Mat1f both = Renderer(scene, 2).radiance(0, 0, white_frame);
  double sum = 0;
  double extra = 0;
  for (int y = 19; y < 29; ++y) {
    for (const int x : {29, 30, 33, 34}) {
      sum += static_cast<double>(direct(y, x));
      extra += static_cast<double>(both(y, x) - direct(y, x));
    }
  }
  EXPECT_NEAR(extra / sum, 0.8 * 0.5, 0.04);
}

TEST(Render, a_flat_wall_gets_nothing_by_a_bounce) {
  Scene scene = wall_scene(800);
  const cv::Mat1f direct = Renderer(scene, 2).radiance(0, 0, white_frame);
  scene.lighting.bounce = true;
  EXPECT_EQ(cv::norm(Renderer(scene, 2).radiance(0, 0, white_frame), direct, cv::NORM_INF), 0);
}

TEST(Render, a_thermal_camera_sees_what_materials_send_out) {
  Scene scene = wall_scene(800);
  scene.panel.emplace(scene.panel->shape(), Material{0.8, 0, 0.3, 0.37});
  scene.cameras[0].thermal = true;
  const cv::Mat1f seen = Renderer(scene, 2).radiance(0, 0, white_frame);
  EXPECT_NEAR(seen(5, 40) / cosine_to_the_fourth(scene, 40, 5), 0.37, 1e-4);
  EXPECT_EQ(Renderer(scene, 1).radiances(0, 0).size(), 1U);
}

TEST(Render, objects_are_met_where_they_are) {
  Scene scene = wall_scene(600);
  scene.objects = {{"bar", std::make_shared<Balls>(40, std::vector<Eigen::Vector2d>{{-60, 0}, {60, 0}}, Material{})}};
  scene.stations[0].object = 0;
  const TrueGeometry truth = Renderer(scene, 2).true_geometry(0, 0);
  int met = 0;
  for (int y = 0; y < truth.depth_mm.rows; ++y) {
    for (int x = 0; x < truth.depth_mm.cols; ++x) {
      const double depth = truth.depth_mm(y, x);
      if (std::isnan(depth)) continue;
      const Eigen::Vector3d point = depth * *scene.cameras[0].sensor.lens.ray(Eigen::Vector2d(x, y));
      const Eigen::Vector3d centre(point.x() < 0 ? -60 : 60, 0, 600);
      EXPECT_NEAR((point - centre).norm(), 40, 1e-5);
      ++met;
    }
  }
  EXPECT_NEAR(met, 2 * M_PI * std::pow(100 * 40 / 600.0 * 0.97, 2), 30);
}

}  // namespace
}  // namespace crumple
