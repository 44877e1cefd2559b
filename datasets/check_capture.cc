#include "datasets/check_capture.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "datasets/board_check.h"
#include "datasets/exposure_check.h"
#include "datasets/motion_check.h"
#include "datasets/sequence_check.h"

namespace crumple {
namespace {

constexpr std::size_t kReaders = 2;

std::string where_of(const std::string& camera, const std::string& station) {
  return fmt::format("station {}, camera {}", station, camera);
}

// Each reader takes every second frame and writes to places of its own.
std::vector<Expected<cv::Mat>> read_frames_in_parallel(const Capture& capture, const std::string& camera,
                                                       const std::string& station) {
  std::vector<Expected<cv::Mat>> images(capture.frames_of(camera).size());
  std::array<std::thread, kReaders> readers;
  for (std::size_t reader = 0; reader < kReaders; ++reader) {
    readers[reader] = std::thread([&, reader] {
      for (std::size_t frame = reader; frame < images.size(); frame += kReaders) {
        images[frame] = read_frame(capture, camera, station, frame);
      }
    });
  }
  for (std::thread& reader : readers) reader.join();
  return images;
}

// Frames of the rarer depth are dropped, since they cannot be compared with the others.
void check_depths(std::vector<ShownFrame>& frames, const std::string& where, std::vector<Finding>& findings) {
  std::map<int, int> count_by_depth;
  for (const ShownFrame& frame : frames) {
    if (!frame.image.empty()) ++count_by_depth[frame.image.depth()];
  }
  if (count_by_depth.size() < 2) return;
  const int common = count_by_depth[CV_8U] >= count_by_depth[CV_16U] ? CV_8U : CV_16U;
  for (ShownFrame& frame : frames) {
    if (frame.image.empty() || frame.image.depth() == common) continue;
    findings.push_back({Severity::error, where,
                        fmt::format("{} has {} bit values, most other frames of the station {}: store all in one depth "
                                    "(colour images count as 16 bit)",
                                    frame.name, common == CV_8U ? 16 : 8, common == CV_8U ? 8 : 16)});
    frame.image = cv::Mat();
  }
}

// FNV-1a over the pixels.
std::uint64_t fingerprint(const std::vector<cv::Mat>& images) {
  std::uint64_t hash = 14695981039346656037U;
  for (const cv::Mat& image : images) {
    if (image.empty()) continue;
    const cv::Mat whole = image.isContinuous() ? image : image.clone();
    const std::size_t bytes = whole.total() * whole.elemSize();
    for (std::size_t i = 0; i < bytes; ++i) hash = (hash ^ whole.data[i]) * 1099511628211U;
    break;
  }
  return hash;
}

bool has_images(const std::vector<cv::Mat>& images) {
  return std::any_of(images.begin(), images.end(), [](const cv::Mat& image) { return !image.empty(); });
}

void check_exclusions(const Capture& capture, std::vector<Finding>& findings) {
  for (const auto& files : capture.files) {
    const std::string& camera = files.first;
    const bool all = std::all_of(capture.stations.begin(), capture.stations.end(), [&](const Station& station) {
      return !capture.took_images(camera, station) || capture.exclusion(station.id, camera).has_value();
    });
    if (all) {
      findings.push_back({Severity::error, "camera " + camera, "every station is excluded: nothing is left to use"});
    }
  }
}

std::vector<Finding> check_station_board(const Capture& capture, const std::string& camera, const Station& station,
                                         const StationFrames& frames) {
  // A tracker looks after the LEDs; whether it sees a board as well is no fault of the capture.
  if (station.boards.empty() || capture.sensor(camera)->mount == Mount::world) return {};
  std::vector<ShownFrame> shown;
  for (std::size_t i = 0; i < frames.images.size(); ++i) {
    const std::string name = capture.image_file(camera, station.id, i).filename().string();
    shown.push_back({capture.frames_of(camera)[i], name, frames.images[i]});
  }
  std::vector<Finding> findings;
  for (const std::size_t b : station.boards) {
    const BoardSpec& board = capture.boards[b];
    std::string where = where_of(camera, station.id);
    if (capture.boards.size() > 1) where += ", " + board.name;
    for (const Finding& finding : check_board(shown, board, station.boards.size(), full_scale_of(shown), where))
      findings.push_back(finding);
  }
  return findings;
}

// An image of the blinking sequence that was never written is an erasure, which words are long enough to bear; all of
// them missing is a mistake.
std::vector<Finding> unreadable_frames(const Capture& capture, const std::string& camera, const std::string& station,
                                       const std::vector<Expected<cv::Mat>>& read) {
  const std::string where = where_of(camera, station);
  const std::vector<FrameContent>& contents = capture.frames_of(camera);
  std::vector<Finding> findings;
  std::size_t blinking = 0;
  std::size_t missing = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const bool of_leds = contents[i].kind == FrameContent::Kind::leds;
    blinking += of_leds ? 1 : 0;
    if (read[i]) continue;
    std::error_code unknown;
    const bool erased = of_leds && !std::filesystem::exists(capture.image_file(camera, station, i), unknown);
    missing += erased ? 1 : 0;
    findings.push_back({erased ? Severity::warning : Severity::error, where, read[i].error().message});
  }
  if (blinking > 0 && missing == blinking) {
    findings.push_back({Severity::error, where,
                        "has no image of the blinking sequence: say `trackers: false` at the station, or exclude it"});
  }
  return findings;
}

}  // namespace

bool has_error(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& finding) { return finding.severity == Severity::error; });
}

StationFrames check_station(const Capture& capture, const std::string& camera, const std::string& station) {
  StationFrames result;
  const std::string where = where_of(camera, station);
  std::vector<ShownFrame> frames;
  const std::vector<Expected<cv::Mat>> read = read_frames_in_parallel(capture, camera, station);
  result.findings = unreadable_frames(capture, camera, station, read);
  for (std::size_t i = 0; i < read.size(); ++i) {
    frames.push_back({capture.frames_of(camera)[i], capture.image_file(camera, station, i).filename().string(),
                      read[i] ? *read[i] : cv::Mat()});
  }
  check_depths(frames, where, result.findings);
  const double full_scale = full_scale_of(frames);
  for (const Finding& finding : check_exposure(frames, full_scale, where)) result.findings.push_back(finding);
  if (capture.projector && capture.sees_patterns(camera)) {
    const SequenceSetup setup{capture.orientations, capture.sensor(*capture.projector)->size, full_scale, where};
    for (const Finding& finding : check_sequence(frames, setup)) result.findings.push_back(finding);
    // Frames in the wrong places would pass for motion.
    if (!has_error(result.findings)) {
      for (const Finding& finding : check_motion(frames, full_scale, where)) result.findings.push_back(finding);
    }
  }
  for (const ShownFrame& frame : frames) result.images.push_back(frame.image);
  return result;
}

std::vector<Finding> check_capture(const Capture& capture) {
  std::vector<Finding> findings;
  check_exclusions(capture, findings);
  for (const auto& sensor : capture.sensors) {
    std::map<std::uint64_t, std::string> station_of_fingerprint;
    for (const Station& station : capture.stations) {
      if (!capture.took_images(sensor.name, station) || capture.exclusion(station.id, sensor.name)) continue;
      const StationFrames frames = check_station(capture, sensor.name, station.id);
      findings.insert(findings.end(), frames.findings.begin(), frames.findings.end());
      if (!has_images(frames.images)) continue;
      // Frames in the wrong places would only mislead the search for the board.
      if (!has_error(frames.findings)) {
        const std::vector<Finding> board = check_station_board(capture, sensor.name, station, frames);
        findings.insert(findings.end(), board.begin(), board.end());
      }
      const auto [same, is_new] = station_of_fingerprint.emplace(fingerprint(frames.images), station.id);
      if (!is_new) {
        findings.push_back({Severity::error, where_of(sensor.name, station.id),
                            fmt::format("holds the same images as station {}: exclude one of them", same->second)});
      }
    }
  }
  return findings;
}

}  // namespace crumple
