// Two cameras, a thermal camera and two projectors on one probe, from images to one refinement and one cloud.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "datasets/cloud_file.h"
#include "datasets/truth.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

const std::string kScene = CRUMPLE_SOURCE_DIR "/datasets/scenes/several_sensors.yaml";

void simulate(const std::string& scene, const std::string& stations, const std::string& folder) {
  const ProgramRun run =
      run_program("simulate '" + scene + "' --stations=" + stations + " --nodepth_maps --out='" + folder + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err;
}

// One capture of two: at the stations of `b` it is the second projector that shows the patterns.
void join(const TemporaryFolder& home) {
  const std::string a = content_of(home / "a/capture.yaml");
  std::string joined = a.substr(0, a.find("stations:"));
  joined += "stations:\n  - {id: panel_1, name_in_files: a/panel_1, board: false}\n";
  for (const char* const n : {"1", "2", "3"}) {
    joined += std::string("  - {id: a") + n + ", name_in_files: a/board_" + n + "}\n";
  }
  for (const char* const n : {"1", "2"}) {
    joined += std::string("  - {id: b") + n + ", name_in_files: b/board_" + n + ", projector: proj1}\n";
  }
  write_content(home / "capture.yaml", joined);
}

// A slope that no mirrored, turned or shifted image has too, in levels per pixel.
constexpr double kDark = 20, kSlopeX = 0.4, kSlopeY = 0.3;

void draw_slope(const std::filesystem::path& file) {
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_8UC1) << file;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(kDark + kSlopeX * x + kSlopeY * y);
    }
  }
  ASSERT_TRUE(cv::imwrite(file.string(), image));
}

// A float property of every point of a cloud that Crumple wrote, of which read_cloud() leaves out columns.
std::vector<float> column_of(const std::string& ply, const std::string& name, std::size_t points) {
  std::istringstream header(ply.substr(0, ply.find("element share")));
  std::size_t stride = 0, offset = std::string::npos;
  for (std::string line; std::getline(header, line) && line != "end_header";) {
    std::istringstream fields(line);
    std::string property, type, called;
    fields >> property >> type >> called;
    if (property != "property") continue;
    if (called == name && type == "float") offset = stride;
    stride += type == "double" ? 8 : type == "float" ? 4 : 2;
  }
  const std::string end = "end_header\n";
  const std::size_t first = ply.find(end) + end.size();
  std::vector<float> values;
  if (offset == std::string::npos || first + points * stride > ply.size()) return values;
  for (std::size_t i = 0; i < points; ++i) {
    float value = 0;
    std::memcpy(&value, ply.data() + first + i * stride + offset, sizeof(value));
    values.push_back(value);
  }
  return values;
}

// Standard uncertainty of a thermal pixel, px, in the cell of the image where it lies.
double thermal_sigma_px(const json& calibration, const Eigen::Vector2d& pixel, const ImageSize& size) {
  const json& cells = calibration["image_cells"]["thermal0"];
  const auto columns = cells["columns"].get<std::size_t>(), rows = cells["rows"].get<std::size_t>();
  const auto column = static_cast<std::size_t>((pixel.x() + 0.5) / size.width_px * static_cast<double>(columns));
  const auto row = static_cast<std::size_t>((pixel.y() + 0.5) / size.height_px * static_cast<double>(rows));
  return calibration["projection_uncertainty"]["thermal0"]["sigma_px"].at(row * columns + column).get<double>();
}

// Every point is to show the level of where the true thermal camera sees it: but for the image's rounding to whole
// levels, and 4 sigmas (RMS over the points) of the thermal camera's pixels and of the points themselves.
void expect_slope_on_points(const TemporaryFolder& home, const json& calibration, const json& reconstruction) {
  const std::string ply = content_of(home / "cloud/cloud.ply");
  const Cloud cloud = read_cloud(home / "cloud/cloud.ply").value();
  const auto levels = column_of(ply, "thermal0", cloud.points.size());
  const auto views = column_of(ply, "thermal0_views", cloud.points.size());
  ASSERT_EQ(levels.size(), cloud.points.size());
  ASSERT_EQ(views.size(), cloud.points.size());
  const json& stated = reconstruction["uncertainty"];
  const double point_mm =
      std::hypot(stated["median_calibration_mm"].get<double>(), stated["median_decoding_mm"].get<double>());
  const Rig truth = read_true_rig(home / "a/truth").value();
  const Sensor& thermal = truth.sensors[truth.find("thermal0").value()];
  double squares = 0, variances_px2 = 0, seen = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (views[i] == 0) {
      EXPECT_EQ(levels[i], 0);
      continue;
    }
    const Eigen::Vector3d in_camera = thermal.sensor_from_mount * cloud.points[i].position_mm;
    const auto pixel = thermal.lens.project(in_camera);
    ASSERT_TRUE(pixel);
    squares += std::pow(levels[i] - (kDark + kSlopeX * pixel->x() + kSlopeY * pixel->y()), 2);
    const double point_px = point_mm * thermal.lens.parameters()[0] / in_camera.z();
    variances_px2 += std::pow(point_px, 2) + std::pow(thermal_sigma_px(calibration, *pixel, thermal.lens.size()), 2);
    ++seen;
  }
  // The panel lies in the middle of the thermal image and hides nothing of itself.
  ASSERT_GT(seen, 0.95 * static_cast<double>(cloud.points.size()));
  EXPECT_LE(std::sqrt(squares / seen), 0.5 + 4 * std::sqrt(variances_px2 / seen) * std::hypot(kSlopeX, kSlopeY));
}

TEST(SeveralSensors, AreCalibratedTogetherAndTheThermalImageIsMapped) {
  const TemporaryFolder home;
  simulate(kScene, "board_1,board_2,board_3,panel_1", (home / "a").string());
  std::string other = content_of(kScene);
  other.replace(other.find("projector: proj0"), 16, "projector: proj1");
  write_content(home / "b.yaml", other);
  simulate((home / "b.yaml").string(), "board_1,board_2", (home / "b").string());
  if (HasFatalFailure()) return;
  join(home);
  const std::string capture = " '" + (home / "capture.yaml").string() + "' --json ";
  const std::string truth = " --truth='" + (home / "a/truth").string() + "'";

  const ProgramRun calibrated =
      run_program("calibrate" + capture + truth + " --nooverlays --noreport --out='" + (home / "rig").string() + "'");
  ASSERT_THAT(calibrated.exit_code, testing::AnyOf(0, 4)) << calibrated.err;  // five placements are few
  const json summary = json::parse(calibrated.out);
  std::set<std::string> seen;
  for (const json& view : summary["views"]) {
    seen.insert(view["sensor"].get<std::string>() + "." + view["kind"].get<std::string>());
  }
  EXPECT_THAT(
      seen, UnorderedElementsAre("cam0.corners", "cam1.corners", "thermal0.corners", "proj0.stripes", "proj1.stripes"));
  // Five lenses of nine parameters and four mounts of six.
  ASSERT_EQ(summary["truth"]["parameters"].size(), 69U);
  EXPECT_GE(summary["truth"]["share_within_3_sigma"], 0.95);

  draw_slope(home / "a/panel_1/thermal0/000.png");
  const ProgramRun reconstructed = run_program("reconstruct" + capture + truth + " --rig='" + (home / "rig").string() +
                                               "' --stations=panel_1 --out='" + (home / "cloud").string() + "'");
  ASSERT_EQ(reconstructed.exit_code, 0) << reconstructed.err;
  const json cloud = json::parse(reconstructed.out);
  EXPECT_EQ(cloud["stations"].size(), 2U);  // one view of each camera
  const std::string ply = content_of(home / "cloud/cloud.ply");
  EXPECT_THAT(ply.substr(0, 1000), HasSubstr("property float thermal0\nproperty float thermal0_views\n"));
  expect_slope_on_points(home, summary, cloud);
}

}  // namespace
}  // namespace crumple
