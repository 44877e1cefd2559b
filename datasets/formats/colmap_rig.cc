#include "datasets/formats/colmap_rig.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/formats/foreign_rig.h"
#include "datasets/limits.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

constexpr double kHalfPixel = 0.5;
constexpr double kUnitLength = 1e-4;

std::string colmap_pose(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return fmt::format("{} {} {} {} {} {} {}", q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
}

std::string camera_line(const Sensor& camera, std::size_t id) {
  std::vector<double> parameters = camera.lens.parameters();
  parameters[2] += kHalfPixel;
  parameters[3] += kHalfPixel;
  const char* model = "FULL_OPENCV";
  if (parameters.size() == 4) model = "PINHOLE";
  if (parameters.size() == 8) model = "OPENCV";
  if (parameters.size() == 9) parameters.resize(12);
  return fmt::format("{} {} {} {} {}\n", id, model, camera.lens.size().width_px, camera.lens.size().height_px,
                     fmt::join(parameters, " "));
}

std::string cameras_text(const std::vector<Sensor>& cameras) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) text += camera_line(cameras[i], i + 1);
  return text;
}

std::string rigs_text(const std::vector<Sensor>& cameras) {
  std::string text =
      "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, HAS_POSE, [QW, QX, "
      "QY, QZ, TX, TY, TZ])\n";
  text += fmt::format("1 {} CAMERA 1", cameras.size());
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    text += fmt::format(" CAMERA {} 1 {}", i + 1, colmap_pose(cameras[i].sensor_from_mount));
  }
  return text + "\n";
}

std::string frames_text(std::size_t count) {
  std::string text =
      "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, "
      "SENSOR_ID, DATA_ID)\n";
  text += fmt::format("1 1 1 0 0 0 0 0 0 {}", count);
  for (std::size_t id = 1; id <= count; ++id) text += fmt::format(" CAMERA {} {}", id, id);
  return text + "\n";
}

std::string images_text(const std::vector<Sensor>& cameras) {
  std::string text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    text += fmt::format("{} {} {} {}/0000.png\n\n", i + 1, colmap_pose(cameras[i].sensor_from_mount), i + 1,
                        cameras[i].name);
  }
  return text;
}

// One line of a text file, word by word. A number that cannot be read is NaN, and the line then unusable.
class Line {
 public:
  Line(const std::string& text, std::string where) : stream_(text), where_(std::move(where)) {}

  std::string word() {
    std::string text;
    stream_ >> text;
    return text;
  }
  double number() {
    const std::string text = word();
    double value = 0;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure == std::errc() && end == text.data() + text.size() && std::abs(value) <= kLargestValue) return value;
    broken_ = true;
    return 0;
  }
  int integer() {
    const double value = number();
    if (value >= 0 && value <= 1e9 && value == std::floor(value)) return static_cast<int>(value);
    broken_ = true;
    return 0;
  }
  std::vector<double> numbers() {
    std::vector<double> values;
    while (stream_ >> std::ws && !stream_.eof()) values.push_back(number());
    return values;
  }
  std::string rest() {
    std::string text;
    std::getline(stream_ >> std::ws, text);
    return text;
  }
  Pose pose() {
    const double w = number(), x = number(), y = number(), z = number();
    const double tx = number(), ty = number(), tz = number();
    const Eigen::Quaterniond rotation(w, x, y, z);
    if (!(std::abs(rotation.norm() - 1) < kUnitLength)) broken_ = true;
    return {broken_ ? Eigen::Quaterniond::Identity() : rotation.normalized(), {tx, ty, tz}};
  }
  bool empty() { return (stream_ >> std::ws).eof(); }
  bool broken() const { return broken_; }
  tl::unexpected<Error> problem(const std::string& sentence) const { return fail(where_ + ": " + sentence); }

 private:
  std::istringstream stream_;
  std::string where_;
  bool broken_ = false;
};

// The lines that are no comments. Empty ones are kept: an image without points has one.
Expected<std::vector<Line>> read_lines(const fs::path& file, bool keep_empty) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  std::vector<Line> lines;
  std::istringstream stream(*text);
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    const bool empty = first == std::string::npos;
    if (empty ? keep_empty : line[first] != '#') {
      lines.emplace_back(line, fmt::format("{}:{}", file.string(), number));
    }
  }
  return lines;
}

Expected<Lens> lens_of(const std::string& model, ImageSize size, std::vector<double> p) {
  static const std::map<std::string, std::size_t> counts = {{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4},
                                                            {"RADIAL", 5},         {"OPENCV", 8},  {"FULL_OPENCV", 12}};
  const auto found = counts.find(model);
  if (found == counts.end()) return fail(fmt::format("the model {} is none of Crumple's lens models", model));
  if (p.size() != found->second) return fail(fmt::format("{} has {} parameters", model, found->second));
  if (model.starts_with("SIMPLE") || model == "RADIAL") p.insert(p.begin(), p.front());
  if (model.ends_with("RADIAL")) p.resize(8);  // k2 where it is missing, p1 and p2
  if (model == "FULL_OPENCV" && p[9] == 0 && p[10] == 0 && p[11] == 0) p.resize(9);
  p[2] -= kHalfPixel;
  p[3] -= kHalfPixel;
  const std::string name = p.size() == 4 ? "LENSMODEL_PINHOLE" : fmt::format("LENSMODEL_OPENCV{}", p.size() - 4);
  return Lens::create(name, size, std::move(p));
}

struct ColmapCamera {
  int id;
  Lens lens;
};

Expected<std::vector<ColmapCamera>> read_cameras(const fs::path& file) {
  auto lines = read_lines(file, false);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<ColmapCamera> cameras;
  for (Line& line : *lines) {
    const int id = line.integer();
    const std::string model = line.word();
    const ImageSize size{line.integer(), line.integer()};
    const std::vector<double> parameters = line.numbers();
    if (line.broken()) return line.problem("has to be CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
    auto lens = lens_of(model, size, parameters);
    if (!lens) return line.problem(lens.error().message);
    for (const ColmapCamera& other : cameras) {
      if (other.id == id) return line.problem(fmt::format("there is a camera {} already", id));
    }
    cameras.push_back({id, std::move(*lens)});
  }
  if (cameras.empty()) return fail(file.string() + ": holds no camera");
  return cameras;
}

struct ColmapImage {
  Pose camera_from_world;
  int camera = 0;
  std::string name;
};

Expected<std::vector<ColmapImage>> read_images(const fs::path& file) {
  auto lines = read_lines(file, true);
  if (!lines) return tl::unexpected(lines.error());
  std::vector<ColmapImage> images;
  for (std::size_t i = 0; i < lines->size(); ++i) {
    Line& line = (*lines)[i];
    if (line.empty()) continue;
    ColmapImage image;
    line.integer();
    image.camera_from_world = line.pose();
    image.camera = line.integer();
    image.name = line.rest();
    if (line.broken() || image.name.empty()) {
      return line.problem("has to be IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, with a line of points after it");
    }
    images.push_back(std::move(image));
    ++i;  // its points
  }
  return images;
}

// Poses by camera; the reference is the first entry.
using CameraPoses = std::vector<std::pair<int, Pose>>;

Expected<CameraPoses> poses_of_rig(const fs::path& file) {
  auto lines = read_lines(file, false);
  if (!lines) return tl::unexpected(lines.error());
  if (lines->size() != 1) {
    return fail(fmt::format("{}: holds {} rigs: keep the one to be imported", file.string(), lines->size()));
  }
  Line& line = lines->front();
  line.integer();
  const int count = line.integer();
  CameraPoses poses;
  for (int i = 0; i < count && !line.broken(); ++i) {
    const std::string type = line.word();
    const int id = line.integer();
    if (type != "CAMERA") return line.problem(fmt::format("the sensor '{}' is not a CAMERA", type));
    if (i > 0 && line.integer() != 1) return line.problem(fmt::format("the pose of camera {} is not known", id));
    poses.emplace_back(id, i == 0 ? Pose() : line.pose());
  }
  if (line.broken() || poses.empty()) return line.problem("cannot be read: see COLMAP's documentation of rigs.txt");
  return poses;
}

Expected<CameraPoses> poses_of_images(const std::vector<ColmapImage>& images, const fs::path& file) {
  CameraPoses poses;
  for (const ColmapImage& image : images) {
    for (const auto& [id, pose] : poses) {
      if (id != image.camera) continue;
      return fail(
          fmt::format("{}: camera {} has several images, and without a rigs.txt (COLMAP 3.12 or later) the poses of "
                      "the cameras to one another are not known: keep one image per camera",
                      file.string(), id));
    }
    poses.emplace_back(image.camera, image.camera_from_world);
  }
  if (poses.empty()) return fail(file.string() + ": holds no image, and so no pose");
  return poses;
}

// CAMERA/0000.png is of CAMERA; a name without a folder is one by itself.
std::string name_of(int camera, const std::vector<ColmapImage>& images) {
  for (const ColmapImage& image : images) {
    if (image.camera != camera) continue;
    const fs::path path = image.name;
    return plain_name(path.has_parent_path() ? path.parent_path().filename().string() : path.stem().string());
  }
  return fmt::format("camera{}", camera);
}

}  // namespace

Expected<std::vector<std::string>> write_colmap_rig(const RigToExport& source, const fs::path& folder) {
  const Rig rig = scaled(source.rig, 1 / source.mm_per_unit);
  const std::vector<Sensor> cameras = cameras_of(rig);
  if (cameras.empty()) return fail("the rig has no camera, which is all that COLMAP knows");
  for (const Sensor& camera : cameras) {
    if (!is_opencv_lens(camera.lens) || camera.lens.parameter_count() > 12) {
      return lens_refused(camera, "COLMAP", "LENSMODEL_PINHOLE and LENSMODEL_OPENCV4, 5 and 8");
    }
  }
  // COLMAP's rig frame is its reference camera's.
  const auto referred = rig_from_sensors(cameras);
  if (!referred) return tl::unexpected(referred.error());
  const std::vector<Sensor>& posed = referred->sensors;
  const std::vector<std::pair<const char*, std::string>> files = {
      {"cameras.txt", cameras_text(posed)},
      {"rigs.txt", rigs_text(posed)},
      {"frames.txt", frames_text(posed.size())},
      {"images.txt", images_text(posed)},
      {"points3D.txt", "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"}};
  for (const auto& [name, text] : files) {
    if (auto written = write_file(folder / name, text); !written) return tl::unexpected(written.error());
  }
  return left_behind(rig, false);
}

Expected<Rig> read_colmap_rig(const std::vector<fs::path>& inputs) {
  if (inputs.size() != 1 || !fs::is_directory(inputs.front())) {
    return fail("a model of COLMAP's is a folder with cameras.txt and images.txt: give that folder");
  }
  const fs::path& folder = inputs.front();
  const auto cameras = read_cameras(folder / "cameras.txt");
  if (!cameras) return tl::unexpected(cameras.error());
  const auto images = read_images(folder / "images.txt");
  if (!images) return tl::unexpected(images.error());
  const bool has_rig = fs::exists(folder / "rigs.txt");
  const auto poses = has_rig ? poses_of_rig(folder / "rigs.txt") : poses_of_images(*images, folder / "images.txt");
  if (!poses) return tl::unexpected(poses.error());
  std::vector<Sensor> sensors;
  for (const auto& [id, pose] : *poses) {
    const auto is_it = [id = id](const ColmapCamera& camera) { return camera.id == id; };
    const auto camera = std::find_if(cameras->begin(), cameras->end(), is_it);
    if (camera == cameras->end()) {
      return fail(fmt::format("{}: there is no camera {}", (folder / "cameras.txt").string(), id));
    }
    sensors.push_back({name_of(id, *images), SensorKind::camera, camera->lens, pose});
  }
  return rig_from_sensors(std::move(sensors));
}

}  // namespace crumple
