#include "datasets/target_yaml.h"

#include <tuple>

#include <fmt/format.h>

#include "datasets/yaml_values.h"

namespace crumple {
namespace {

constexpr double kLargest_mm = 1000;

TargetKind read_kind(YamlMap& map) {
  const auto kind = map.find("kind");
  const std::string word = kind ? kind->one_of({"chessboard", "charuco", "apriltag", "dots"}) : "chessboard";
  if (word == "charuco") return TargetKind::charuco;
  if (word == "apriltag") return TargetKind::apriltag;
  return word == "dots" ? TargetKind::dots : TargetKind::chessboard;
}

void read_marker_keys(YamlMap& map, Target& target) {
  target.mark_mm =
      required_number(map, "marker_mm", "the side of a marker, its dark border included", 0.1, kLargest_mm);
  if (const auto dictionary = map.require("dictionary", "of the markers, such as 5X5_100 or APRILTAG_36h11")) {
    target.dictionary = dictionary->text();
  }
  if (const auto first = map.find("first_id")) target.first_id = first->integer(0, 100000);
}

std::string text_or_empty(YamlMap& map, const std::string& key) {
  const auto value = map.find(key);
  return value ? value->text() : "";
}

BoardCertificate read_certificate(const YamlValue& value) {
  YamlMap map = value.map();
  BoardCertificate certificate;
  if (const auto sigma = map.require("pitch_sigma_mm", "the standard uncertainty of the mean pitch")) {
    certificate.pitch_sigma_mm = sigma->positive_number();
  }
  if (const auto flatness = map.find("flatness_mm")) certificate.flatness_mm = flatness->positive_number();
  read_expansion_and_record(map, certificate);
  map.finish();
  return certificate;
}

}  // namespace

void read_expansion_and_record(YamlMap& map, BoardCertificate& certificate) {
  certificate.temperature_c = number_or(map, "temperature_c", certificate.temperature_c, -50, 150);
  if (const auto expansion = map.find("expansion_per_k")) certificate.expansion_per_k = expansion->number(-1e-4, 1e-3);
  if (const auto sigma = map.find("expansion_sigma_per_k")) certificate.expansion_sigma_per_k = sigma->number(0, 1e-3);
  certificate.serial = text_or_empty(map, "serial");
  certificate.issuer = text_or_empty(map, "issuer");
  certificate.date = text_or_empty(map, "date");
}

Target read_target(YamlMap& map) {
  Target target;
  target.kind = read_kind(map);
  const char* const counted = target.kind == TargetKind::dots       ? "dots"
                              : target.kind == TargetKind::apriltag ? "markers"
                                                                    : "inner_corners";
  if (target.kind == TargetKind::dots || target.kind == TargetKind::apriltag) {
    std::tie(target.columns, target.rows) = read_columns_and_rows(map, counted, 1);
  } else {
    std::tie(target.columns, target.rows) = read_inner_corners(map);
  }
  if (const auto pitch = map.require("pitch_mm", "the distance between neighbouring corners, markers or dots")) {
    target.pitch_mm = pitch->positive_number();
  }
  if (is_coded(target.kind)) read_marker_keys(map, target);
  if (target.kind == TargetKind::dots) {
    target.mark_mm = required_number(map, "diameter_mm", "of a dot", 0.1, kLargest_mm);
    if (const auto staggered = map.find("staggered")) target.staggered = staggered->boolean();
  }
  return target;
}

BoardSpec read_board(const YamlValue& value, const std::string& name) {
  YamlMap map = value.map();
  BoardSpec board{name, read_target(map), std::nullopt};
  if (const auto certificate = map.find("certificate")) board.certificate = read_certificate(*certificate);
  map.finish();
  const bool complete = board.target.columns > 0 && board.target.pitch_mm > 0;
  if (const auto sound = checked(board.target); complete && !sound) value.problem(sound.error().message);
  return board;
}

std::string target_yaml(const Target& target) {
  const auto counted = [&](const char* key) {
    return fmt::format("kind: {}, {}: [{}, {}], pitch_mm: {}", name_of(target.kind), key, target.columns, target.rows,
                       target.pitch_mm);
  };
  const auto markers = [&] {
    return fmt::format(", marker_mm: {}, dictionary: {}, first_id: {}", target.mark_mm, target.dictionary,
                       target.first_id);
  };
  switch (target.kind) {
    case TargetKind::chessboard:
      return counted("inner_corners");
    case TargetKind::charuco:
      return counted("inner_corners") + markers();
    case TargetKind::apriltag:
      return counted("markers") + markers();
    case TargetKind::dots:
      break;
  }
  return counted("dots") + fmt::format(", diameter_mm: {}, staggered: {}", target.mark_mm, target.staggered);
}

}  // namespace crumple
