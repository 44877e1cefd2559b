#include "datasets/capture.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "datasets/check_capture.h"
#include "datasets/exposure_check.h"
#include "datasets/file_template.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

Expected<const CaptureSensor*> find_camera(const Capture& capture, const std::string& camera) {
  const CaptureSensor* sensor = capture.sensor(camera);
  if (sensor == nullptr || sensor->kind != SensorKind::camera || !capture.files.contains(camera)) {
    return fail(fmt::format("{} describes no camera `{}`", capture.description.string(), camera));
  }
  return sensor;
}

// The sentences of the errors, the first five where there are more.
std::string joined_errors(const std::vector<Finding>& findings) {
  std::string text;
  int count = 0;
  for (const Finding& finding : findings) {
    if (finding.severity != Severity::error || ++count > 5) continue;
    text += fmt::format("{}{}: {}", text.empty() ? "" : "\n", finding.where, finding.sentence);
  }
  return count > 5 ? fmt::format("{}\nand {} more errors", text, count - 5) : text;
}

std::optional<std::size_t> first_of(FrameContent::Kind kind, const std::vector<FrameContent>& frames) {
  const auto found = std::find_if(frames.begin(), frames.end(), [&](const auto& f) { return f.kind == kind; });
  if (found == frames.end()) return {};
  return static_cast<std::size_t>(std::distance(frames.begin(), found));
}

// A capture's folder, or its bag, may stand for the description in it.
std::filesystem::path description_in(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_directory(path, failure)) return path;
  const std::filesystem::path bagged = path / "data" / "capture.yaml";
  return std::filesystem::exists(bagged, failure) ? bagged : path / "capture.yaml";
}

}  // namespace

const CaptureSensor* Capture::sensor(const std::string& name) const {
  const auto found = std::find_if(sensors.begin(), sensors.end(), [&](const auto& s) { return s.name == name; });
  return found == sensors.end() ? nullptr : &*found;
}

const Station* Capture::station(const std::string& id) const {
  const auto found = std::find_if(stations.begin(), stations.end(), [&](const auto& s) { return s.id == id; });
  return found == stations.end() ? nullptr : &*found;
}

std::optional<Exclusion> Capture::exclusion(const std::string& station_id, const std::string& sensor_name) const {
  for (const Exclusion& e : excluded) {
    if (e.station == station_id && (e.sensor.empty() || e.sensor == sensor_name)) return e;
  }
  return {};
}

const std::string& Capture::projector_at(const std::string& station_id) const {
  const Station* known = station(station_id);
  return known == nullptr || known->projector.empty() ? *projector : known->projector;
}

std::optional<std::size_t> Capture::find_frame(FrameContent::Kind kind) const { return first_of(kind, frames); }

std::optional<std::size_t> Capture::find_frame(FrameContent::Kind kind, const std::string& camera) const {
  return first_of(kind, frames_of(camera));
}

const std::vector<FrameContent>& Capture::frames_of(const std::string& camera) const {
  static const std::vector<FrameContent> ambient = {FrameContent{}};
  const CaptureSensor* known = sensor(camera);
  if (known != nullptr && known->mount == Mount::world) return tracker_frames;
  return known != nullptr && known->ambient_only ? ambient : frames;
}

bool Capture::sees_patterns(const std::string& camera) const { return &frames_of(camera) == &frames; }

bool Capture::took_images(const std::string& camera, const Station& at) const {
  const CaptureSensor* known = sensor(camera);
  if (known == nullptr || known->kind != SensorKind::camera) return false;
  const bool stood_there = known->stations.empty() ||
                           std::find(known->stations.begin(), known->stations.end(), at.id) != known->stations.end();
  return stood_there && (known->mount == Mount::world ? at.trackers : at.scan);
}

std::filesystem::path Capture::image_file(const std::string& camera, const std::string& station_id,
                                          std::size_t frame) const {
  const auto naming = files.find(camera);
  if (naming == files.end()) return {};
  const auto parsed = FileTemplate::parse(naming->second.path_template);
  if (!parsed) return {};
  const Station* known = station(station_id);
  FileTemplateValues values;
  values.station = known != nullptr && !known->name_in_files.empty() ? known->name_in_files : station_id;
  values.sensor = camera;
  const bool listed = sees_patterns(camera);
  const bool numbered = listed && frame < frame_numbers.size();
  values.frame = naming->second.frame_offset + (numbered ? frame_numbers[frame] : static_cast<int>(frame));
  values.frame_name = listed && frame < frame_names.size() ? frame_names[frame] : "";
  return images / parsed->expand(values);
}

std::vector<std::filesystem::path> capture_files(const Capture& capture) {
  std::vector<std::filesystem::path> files{capture.description};
  for (const Station& station : capture.stations) {
    for (const CaptureSensor& sensor : capture.sensors) {
      if (!capture.took_images(sensor.name, station)) continue;
      for (std::size_t frame = 0; frame < capture.frames_of(sensor.name).size(); ++frame) {
        const std::filesystem::path file = capture.image_file(sensor.name, station.id, frame);
        std::error_code unreadable;
        if (std::filesystem::exists(file, unreadable)) files.push_back(file);
      }
    }
  }
  return files;
}

std::string frame_words(const FrameContent& content) {
  switch (content.kind) {
    case Kind::white:
      return "white";
    case Kind::black:
      return "black";
    case Kind::ambient:
      return "ambient light";
    case Kind::chessboard:
      return "the projected chessboard";
    case Kind::stripes:
      return fmt::format("{}bit {} of orientation {}", content.inverted ? "the inverse of " : "", content.bit,
                         content.orientation);
    case Kind::leds:
      return fmt::format("step {} of the blinking", content.step);
  }
  return {};
}

Expected<Capture> read_capture(const std::filesystem::path& description,
                               const std::optional<std::filesystem::path>& images) {
  const std::filesystem::path file = description_in(description);
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto capture = parse_capture(*text, file.string());
  if (!capture) return capture;
  capture->description = file;
  capture->images = images ? *images : file.parent_path() / capture->images;
  if (capture->images.empty()) capture->images = ".";  // the folder one stands in
  std::error_code failure;
  if (!std::filesystem::is_directory(capture->images, failure)) {
    return fail(
        fmt::format("{}: the image folder {} does not exist: correct `images`, or name the folder on the "
                    "command line",
                    file.string(), capture->images.string()));
  }
  return capture;
}

Expected<cv::Mat> read_frame(const Capture& capture, const std::string& camera, const std::string& station,
                             std::size_t frame) {
  const auto sensor = find_camera(capture, camera);
  if (!sensor) return tl::unexpected(sensor.error());
  const std::filesystem::path file = capture.image_file(camera, station, frame);
  auto image = read_image(file, (*sensor)->colour);
  if (!image) return image;
  const ImageSize size = (*sensor)->size;
  if (image->cols != size.width_px || image->rows != size.height_px) {
    return fail(fmt::format("{} is {} x {} px, but camera {} has {} x {}: correct size_px, or the file", file.string(),
                            image->cols, image->rows, camera, size.width_px, size.height_px));
  }
  return image;
}

StripeImages sorted_into_stacks(ImageSize projector, const std::vector<StripeOrientation>& orientations,
                                const std::vector<FrameContent>& frames, const std::vector<cv::Mat>& images) {
  StripeImages result;
  result.projector = projector;
  for (const StripeOrientation& orientation : orientations) {
    StripeStack stack{orientation, std::vector<cv::Mat>(orientation.bits), {}};
    if (orientation.inverse) stack.inverses.resize(orientation.bits);
    result.stacks.push_back(stack);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const FrameContent& frame = frames[i];
    if (frame.kind == Kind::white) result.white = images[i];
    if (frame.kind == Kind::black) result.black = images[i];
    if (frame.kind != Kind::stripes) continue;
    StripeStack& stack = result.stacks[frame.orientation];
    (frame.inverted ? stack.inverses : stack.patterns)[frame.bit] = images[i];
  }
  return result;
}

Expected<cv::Mat> read_lit_frame(const Capture& capture, const std::string& camera, const std::string& station,
                                 std::size_t frame) {
  auto image = read_frame(capture, camera, station, frame);
  if (!image) return image;
  const std::string name = capture.image_file(camera, station, frame).string();
  const std::vector<ShownFrame> shown = {{capture.frames_of(camera)[frame], name, *image}};
  const std::vector<Finding> findings =
      check_exposure(shown, full_scale_of(shown), fmt::format("station {}, camera {}", station, camera));
  if (has_error(findings)) return fail(joined_errors(findings));
  return image;
}

Expected<cv::Mat> read_board_image(const Capture& capture, const std::string& camera, const std::string& station) {
  auto frame = capture.find_frame(Kind::white, camera);
  if (!frame) frame = capture.find_frame(Kind::ambient, camera);
  if (!frame) {
    return fail(fmt::format("{} has neither a white nor an ambient frame of camera {} to look for the board in",
                            capture.description.string(), camera));
  }
  return read_lit_frame(capture, camera, station, *frame);
}

Expected<StripeImages> read_stripe_images(const Capture& capture, const std::string& camera,
                                          const std::string& station) {
  const auto sensor = find_camera(capture, camera);
  if (!sensor) return tl::unexpected(sensor.error());
  if (!capture.sees_patterns(camera)) {
    return fail(fmt::format("{}: camera {} takes no images of the stripes", capture.description.string(), camera));
  }
  if (!capture.projector || capture.orientations.empty()) {
    return fail(fmt::format("{} describes no stripe patterns: add `patterns` and list them in `frames`",
                            capture.description.string()));
  }
  const StationFrames frames = check_station(capture, camera, station);
  if (has_error(frames.findings)) return fail(joined_errors(frames.findings));
  return sorted_into_stacks(capture.sensor(*capture.projector)->size, capture.orientations, capture.frames,
                            frames.images);
}

}  // namespace crumple
