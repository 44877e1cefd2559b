#include "cli/capture_summary.h"

#include <algorithm>
#include <optional>
#include <string>

namespace crumple {
namespace {

using nlohmann::json;

void add_stated(const char* key, const std::string& text, json& object) {
  if (!text.empty()) object[key] = text;
}

void add_stated(const char* key, const std::optional<double>& number, json& object) {
  if (number) object[key] = *number;
}

json certificate_json(const BoardCertificate& certificate, const char* sigma_key) {
  json result{{sigma_key, certificate.pitch_sigma_mm}, {"temperature_c", certificate.temperature_c}};
  add_stated("expansion_per_k", certificate.expansion_per_k, result);
  add_stated("expansion_sigma_per_k", certificate.expansion_sigma_per_k, result);
  add_stated("flatness_mm", certificate.flatness_mm, result);
  add_stated("serial", certificate.serial, result);
  add_stated("issuer", certificate.issuer, result);
  add_stated("date", certificate.date, result);
  return result;
}

}  // namespace

json capture_summary(const Capture& capture, const CalibrationState& calibrated) {
  const CaptureRecord& record = capture.record;
  json result{{"title", capture.title}};
  add_stated("operator", record.operator_name, result);
  add_stated("date", record.date, result);
  if (record.temperature) {
    result["temperature_c"] = record.temperature->celsius;
    result["temperature_sigma_k"] = record.temperature->sigma_k;
  }
  for (const Sensor& sensor : calibrated.rig.sensors) {
    const CaptureSensor* const described = capture.sensor(sensor.name);
    if (described != nullptr && !described->serial.empty()) result["serials"][sensor.name] = described->serial;
  }
  for (const Board& board : calibrated.boards) {
    const auto described = std::find_if(capture.boards.begin(), capture.boards.end(),
                                        [&](const BoardSpec& spec) { return spec.name == board.name; });
    if (described == capture.boards.end() || !described->certificate) continue;
    result["certificates"]["boards"][board.name] = certificate_json(*described->certificate, "pitch_sigma_mm");
  }
  for (const CaptureBar& bar : capture.scale_bars) {
    result["certificates"]["scale_bars"][bar.name] = certificate_json(bar.certificate, "length_sigma_mm");
  }
  return result;
}

}  // namespace crumple
