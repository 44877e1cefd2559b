// A capture: what capture.yaml describes. Images stay on disk until asked for.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "recon/patterns.h"
#include "recon/stripe_images.h"
#include "solvers/board.h"
#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/rig.h"

namespace crumple {

struct CaptureSensor {
  std::string name;
  SensorKind kind = SensorKind::camera;
  ImageSize size;
  std::string lens_model;  // LENSMODEL_OPENCV5 unless capture.yaml says otherwise
};

// What the projector showed while a frame was taken.
struct FrameContent {
  enum class Kind { ambient, white, black, stripes, chessboard };
  Kind kind = Kind::ambient;    // ambient: no projector involved, such as a plain board image
  std::size_t orientation = 0;  // stripes: index into Capture::orientations
  int bit = 0;                  // stripes: 0 is the most significant
  bool inverted = false;        // stripes
};

// The chessboard the projector casts in `chessboard` frames: inner corners on the panel, in projector pixels.
struct ProjectedChessboard {
  int columns = 0;
  int rows = 0;
  Eigen::Vector2d first_corner_px = Eigen::Vector2d::Zero();
  double pitch_px = 0;
};

struct Station {
  std::string id;
  bool board = true;  // the board is in view, at a placement of its own
};

struct Exclusion {
  std::string station;
  std::string sensor;  // empty: every sensor
  std::string reason;
};

struct Capture {
  std::filesystem::path description;  // the capture.yaml it was read from
  std::filesystem::path images;       // the folder that file names are relative to
  std::vector<CaptureSensor> sensors;
  std::optional<Board> board;
  std::optional<std::string> projector;  // the sensor that shows the frames' content
  std::vector<StripeOrientation> orientations;
  std::optional<ProjectedChessboard> projected_chessboard;
  std::vector<FrameContent> frames;  // in the order they were taken
  std::vector<Station> stations;
  std::map<std::string, std::string> file_templates;  // camera name -> template with {station} and {frame:02}
  std::vector<Exclusion> excluded;

  std::optional<Exclusion> exclusion(const std::string& station, const std::string& sensor) const;
  std::filesystem::path image_file(const std::string& camera, const std::string& station, std::size_t frame) const;
  const CaptureSensor* sensor(const std::string& name) const;
};

// Reads and validates a description; images are looked for in `images` where given, else in the folder the description
// names, else beside it. Errors name the file, line and column.
Expected<Capture> read_capture(const std::filesystem::path& description,
                               const std::optional<std::filesystem::path>& images = {});

// One frame, single-channel, CV_8U or CV_16U, of the size the capture states for that camera.
Expected<cv::Mat> read_frame(const Capture& capture, const std::string& camera, const std::string& station,
                             std::size_t frame);

// The frame to look for the board in: the white one, else the ambient one.
Expected<cv::Mat> read_board_image(const Capture& capture, const std::string& camera, const std::string& station);

// The whole stripe sequence of a station, checked: sizes, depths, all-dark or saturated frames, frames that look
// swapped or missing (by name).
Expected<StripeImages> read_stripe_images(const Capture& capture, const std::string& camera,
                                          const std::string& station);

}  // namespace crumple
