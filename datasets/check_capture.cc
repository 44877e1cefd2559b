#include "datasets/check_capture.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
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
  std::vector<Expected<cv::Mat>> images(capture.frames.size());
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
      return capture.exclusion(station.id, camera).has_value();
    });
    if (all) {
      findings.push_back({Severity::error, "camera " + camera, "every station is excluded: nothing is left to use"});
    }
  }
}

std::vector<Finding> check_station_board(const Capture& capture, const std::string& camera, const Station& station,
                                         const StationFrames& frames) {
  if (station.boards.empty()) return {};
  std::vector<ShownFrame> shown;
  for (std::size_t i = 0; i < frames.images.size(); ++i) {
    const std::string name = capture.image_file(camera, station.id, i).filename().string();
    shown.push_back({capture.frames[i], name, frames.images[i]});
  }
  std::vector<Finding> findings;
  for (const std::size_t b : station.boards) {
    const BoardSpec& board = capture.boards[b];
    std::string where = where_of(camera, station.id);
    if (capture.boards.size() > 1) where += ", " + board.name;
    for (const Finding& finding : check_board(shown, board, full_scale_of(shown), where)) findings.push_back(finding);
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
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (!read[i]) result.findings.push_back({Severity::error, where, read[i].error().message});
    frames.push_back({capture.frames[i], capture.image_file(camera, station, i).filename().string(),
                      read[i] ? *read[i] : cv::Mat()});
  }
  check_depths(frames, where, result.findings);
  const double full_scale = full_scale_of(frames);
  for (const Finding& finding : check_exposure(frames, full_scale, where)) result.findings.push_back(finding);
  if (capture.projector) {
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
      if (sensor.kind != SensorKind::camera || capture.exclusion(station.id, sensor.name)) continue;
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
