// A capture: what capture.yaml describes (docs/formats.md). Images stay on disk until asked for.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "calib/board_spec.h"
#include "datasets/image_io.h"
#include "recon/patterns.h"
#include "recon/stripe_images.h"
#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/rig.h"

namespace crumple {

struct CaptureSensor {
  std::string name;
  SensorKind kind = SensorKind::camera;
  ImageSize size;
  std::string lens_model;                        // LENSMODEL_OPENCV5 unless capture.yaml says otherwise
  ColourEncoding colour = ColourEncoding::srgb;  // how a camera's colour images become grey
  std::string serial = {};                       // for the record
  Mount mount = Mount::probe;
  bool ambient_only = false;  // a probe camera that takes one ambient image at a station, as a thermal camera does
  std::string lens_of = {};   // the camera that this one was before it was moved to where it stands; empty: none
  std::vector<std::string> stations = {};  // at which it took images; empty: all
};

// A light that blinks for the cameras fixed to the world.
struct CaptureLed {
  std::string name;
  std::string word;  // '1' where it is lit, '0' where dark, one a time step, over and over; of one length for all
  Mount mount = Mount::probe;
  std::optional<Eigen::Vector3d> nominal_mm = {};  // where it should be, in its mount's frame
};

// Two LEDs fixed to the world at a certified distance.
struct CaptureBar {
  std::string name;
  std::array<std::string, 2> leds;
  double length_mm = 0;
  BoardCertificate certificate = {};  // of the length in place of a pitch
  double placing_sigma_mm = 0;
  // The stations during which it lay at each of its places; empty: at one place throughout.
  std::vector<std::vector<std::string>> places = {};
};

// How a camera's files are named: a path below the image folder with {station}, {sensor}, {frame} or {frame:02}, and
// {frame_name}; the first frame has the number `frame_offset`.
struct FileNaming {
  std::string path_template;
  int frame_offset = 0;
};

// What the projector showed while a frame was taken.
struct FrameContent {
  enum class Kind { ambient, white, black, stripes, chessboard, leds };
  Kind kind = Kind::ambient;    // ambient: no projector involved, such as a plain board image
  std::size_t orientation = 0;  // stripes: index into Capture::orientations
  int bit = 0;                  // stripes: 0 is the most significant
  bool inverted = false;        // stripes
  std::size_t step = 0;         // leds: the time step of the blinking sequence, from 0
};

struct Station {
  std::string id;
  std::vector<std::size_t> boards;  // in view: into Capture::boards
  std::string name_in_files;        // what {station} stands for; empty: the id
  // Stations of the same placement see the boards at the same place in the world; empty: a placement of its own.
  std::string placement = {};
  std::string projector = {};  // that shows the patterns there; empty: Capture::projector
  bool scan = true;            // false: no images by what the probe carries
  bool trackers = true;        // false: no images by the cameras fixed to the world
};

struct Exclusion {
  std::string station;
  std::string sensor;  // empty: every sensor
  std::string reason;
};

// Under what circumstances it was taken; empty where that is not stated.
struct CaptureRecord {
  std::string operator_name;
  std::string date;
  std::optional<Temperature> temperature;  // of the boards
};

struct Capture {
  int schema = 0;                     // of the description: crumple-capture/1, /2 or /3
  std::filesystem::path description;  // the capture.yaml it was read from
  std::filesystem::path images;       // the folder that file names are relative to
  std::string title;
  CaptureRecord record;
  std::vector<CaptureSensor> sensors;
  std::vector<BoardSpec> boards;         // what the stations may show
  std::optional<std::string> projector;  // the sensor that shows the frames' content, unless a station has another
  std::vector<StripeOrientation> orientations;
  std::optional<ProjectedChessboard> projected_chessboard;
  std::vector<FrameContent> frames;      // in the order they were taken, without the unused ones
  std::vector<int> frame_numbers;        // of each frame, before the offset; empty: 0, 1, 2...
  std::vector<std::string> frame_names;  // of each frame, for {frame_name}; may be empty
  std::vector<CaptureLed> leds;
  std::vector<CaptureBar> scale_bars;
  std::vector<FrameContent> tracker_frames;  // of the cameras fixed to the world: ambient and leds, numbered from 0
  std::vector<Station> stations;
  std::map<std::string, FileNaming> files;  // camera name -> its files
  std::vector<Exclusion> excluded;

  const CaptureSensor* sensor(const std::string& name) const;
  const Station* station(const std::string& id) const;
  // The exclusion that covers this sensor (or, by an empty name, all sensors) at this station.
  std::optional<Exclusion> exclusion(const std::string& station, const std::string& sensor) const;
  // Which projector shows the patterns at a station. Precondition: there is one.
  const std::string& projector_at(const std::string& station) const;
  // The first frame of `frames` that shows this (kind other than stripes).
  std::optional<std::size_t> find_frame(FrameContent::Kind kind) const;

  // What a camera's images at a station show, in order: `frames`, or `tracker_frames` where it is fixed to the world,
  // or one ambient image. Frames are counted in this list wherever a camera is named beside them.
  const std::vector<FrameContent>& frames_of(const std::string& camera) const;
  std::optional<std::size_t> find_frame(FrameContent::Kind kind, const std::string& camera) const;
  bool sees_patterns(const std::string& camera) const;  // whether that list is `frames`
  // Whether the camera took images there: not at a station without a scan, or without trackers, or where it did not
  // stand.
  bool took_images(const std::string& camera, const Station& station) const;
  std::filesystem::path image_file(const std::string& camera, const std::string& station, std::size_t frame) const;
};

// The description and every image it speaks of that exists: what a run that used the capture depends on.
std::vector<std::filesystem::path> capture_files(const Capture& capture);

// Says what a frame shows: "white", "the inverse of bit 3 of orientation 0", "step 7 of the blinking".
std::string frame_words(const FrameContent& content);

// Validates a description's text; `images` is as written there. Errors name the file, line and column.
Expected<Capture> parse_capture(const std::string& text, const std::string& file_name);

// Reads and validates a description, or the one in a capture's folder or bag (datasets/bag.h); images are looked for in
// `images` where given, else in the folder the description names, else beside it.
Expected<Capture> read_capture(const std::filesystem::path& description,
                               const std::optional<std::filesystem::path>& images = {});

// One frame, single-channel, CV_8U or CV_16U, of the size the capture states for that camera.
Expected<cv::Mat> read_frame(const Capture& capture, const std::string& camera, const std::string& station,
                             std::size_t frame);

// Frames as decoding takes them. Precondition: an image per frame; stripe frames are of the orientations.
StripeImages sorted_into_stacks(ImageSize projector, const std::vector<StripeOrientation>& orientations,
                                const std::vector<FrameContent>& frames, const std::vector<cv::Mat>& images);

// The same for a frame in which the scene must be lit. Fails where it is dark or saturated by the rules of
// exposure_check.h.
Expected<cv::Mat> read_lit_frame(const Capture& capture, const std::string& camera, const std::string& station,
                                 std::size_t frame);

// The frame to look for the board in: the white one, else the ambient one. Fails where it is dark or saturated by the
// rules of exposure_check.h: a board that is not found there would only be half the story.
Expected<cv::Mat> read_board_image(const Capture& capture, const std::string& camera, const std::string& station);

// The whole stripe sequence of a station. Fails on whatever check_station (check_capture.h) calls an error: missing or
// unreadable files, other sizes or depths, dark or saturated frames, frames out of order.
Expected<StripeImages> read_stripe_images(const Capture& capture, const std::string& camera,
                                          const std::string& station);

}  // namespace crumple
