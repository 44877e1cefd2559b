#include "datasets/cameramodel_file.h"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "datasets/limits.h"
#include "datasets/output_folder.h"
#include "datasets/python_literal.h"

namespace crumple {
namespace {

Expected<const nlohmann::json*> member(const nlohmann::json& model, const std::string& key) {
  const auto found = model.find(key);
  if (found == model.end()) return fail(fmt::format("'{}' is missing", key));
  return &*found;
}

// A list of numbers; any count where `count` is 0.
Expected<std::vector<double>> numbers(const nlohmann::json& model, const std::string& key, std::size_t count) {
  const auto list = member(model, key);
  if (!list) return tl::unexpected(list.error());
  std::vector<double> values;
  if ((*list)->is_array())
    for (const nlohmann::json& item : **list)
      if (item.is_number() && std::abs(item.get<double>()) <= kLargestValue) values.push_back(item.get<double>());
  if (!(*list)->is_array() || values.size() != (*list)->size() || (count != 0 && values.size() != count))
    return fail(fmt::format("'{}' has to be a list of {}numbers of at most {:g}", key,
                            count == 0 ? "" : std::to_string(count) + " ", kLargestValue));
  return values;
}

Expected<ImageSize> image_size(const nlohmann::json& model) {
  const auto values = numbers(model, "imagersize", 2);
  if (!values) return tl::unexpected(values.error());
  for (const double value : *values)
    if (value < 1 || value > kLargestImage_px || value != std::floor(value))
      return fail("'imagersize' has to hold two whole numbers above 0");
  return ImageSize{static_cast<int>((*values)[0]), static_cast<int>((*values)[1])};
}

}  // namespace

std::string cameramodel_text(const CameraModel& model, const std::string& unit) {
  const Eigen::Vector3d rotation = rotation_vector(model.camera_from_reference.rotation);
  const Eigen::Vector3d& translation = model.camera_from_reference.translation;
  const std::string inputs = model.inputs
                                 ? fmt::format("\n    'icam_intrinsics': {},\n\n    'optimization_inputs': b'{}',\n",
                                               model.inputs->camera, model.inputs->base85)
                                 : "";
  return fmt::format(
      "{{\n"
      "    'lensmodel':  '{}',\n\n"
      "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
      "    'intrinsics': [ {} ],\n\n"
      "    # extrinsics are rt_fromref: rotation vector in rad, translation in {}\n"
      "    'extrinsics': [ {}, {}, {}, {}, {}, {} ],\n\n"
      "    'imagersize': [ {}, {} ],\n"
      "{}"
      "}}\n",
      model.lens.model(), fmt::join(model.lens.parameters(), ", "), unit, rotation.x(), rotation.y(), rotation.z(),
      translation.x(), translation.y(), translation.z(), model.lens.size().width_px, model.lens.size().height_px,
      inputs);
}

Expected<CameraModel> parse_cameramodel(const std::string& text) {
  const auto model = parse_python_literal(text);
  if (!model) return tl::unexpected(model.error());
  if (!model->is_object()) return fail("this is not a .cameramodel: it has to hold a dict {...}");
  const auto lens_model = member(*model, "lensmodel");
  if (!lens_model) return tl::unexpected(lens_model.error());
  if (!(*lens_model)->is_string()) return fail("'lensmodel' has to be a text");
  const auto size = image_size(*model);
  if (!size) return tl::unexpected(size.error());
  auto parameters = numbers(*model, "intrinsics", 0);
  if (!parameters) return tl::unexpected(parameters.error());
  const auto extrinsics = numbers(*model, "extrinsics", 6);
  if (!extrinsics) return tl::unexpected(extrinsics.error());
  auto lens = Lens::create((*lens_model)->get<std::string>(), *size, std::move(*parameters));
  if (!lens) return tl::unexpected(lens.error());
  const std::vector<double>& rt = *extrinsics;
  return CameraModel{std::move(*lens), {rotation_from_vector({rt[0], rt[1], rt[2]}), {rt[3], rt[4], rt[5]}}};
}

Expected<void> write_cameramodel(const std::filesystem::path& file, const CameraModel& model) {
  return write_file(file, cameramodel_text(model));
}

Expected<CameraModel> read_cameramodel(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto model = parse_cameramodel(*text);
  if (!model) return fail(fmt::format("{}: {}", file.string(), model.error().message));
  return model;
}

}  // namespace crumple
