#include "datasets/report/capture_section.h"

#include <algorithm>

#include <fmt/format.h>

#include "datasets/report/html.h"

namespace crumple {
namespace {

// Above this many input files the images are told by one hash.
constexpr std::size_t kMostFilesListed = 60;

std::string or_not_stated(const std::string& text) { return text.empty() ? "not stated" : html_text(text); }

std::string temperature_words(const std::optional<Temperature>& temperature) {
  if (!temperature) return "not stated";
  return fmt::format("{:g} °C, standard uncertainty {:g} K", temperature->celsius, temperature->sigma_k);
}

std::string certificate_words(const std::optional<BoardCertificate>& certificate, const char* what) {
  if (!certificate) return "no certificate";
  std::string words =
      fmt::format("certificate {} by {}, {}: u({}) = {:g} mm at {:g} °C", or_not_stated(certificate->serial),
                  or_not_stated(certificate->issuer), or_not_stated(certificate->date), what,
                  certificate->pitch_sigma_mm, certificate->temperature_c);
  if (certificate->expansion_per_k) {
    const std::optional<double>& sigma_per_k = certificate->expansion_sigma_per_k;
    words += fmt::format(", expansion {:g} /K, u {}", *certificate->expansion_per_k,
                         sigma_per_k ? fmt::format("= {:g} /K", *sigma_per_k) : "not stated");
  }
  if (certificate->flatness_mm) words += fmt::format(", flatness {:g} mm", *certificate->flatness_mm);
  return words;
}

std::string sensor_table(const CalibrationReport& report) {
  std::vector<std::vector<std::string>> rows;
  for (const Sensor& sensor : report.calibration.bundle.state.rig.sensors) {
    const CaptureSensor* const described = report.capture.sensor(sensor.name);
    rows.push_back({html_text(sensor.name), sensor.kind == SensorKind::camera ? "camera" : "projector",
                    sensor.mount == Mount::probe ? "the probe" : "the room",
                    fmt::format("{} × {}", sensor.lens.size().width_px, sensor.lens.size().height_px),
                    html_text(sensor.lens.model()), or_not_stated(described ? described->serial : "")});
  }
  return html_table({{"Sensor", true},
                     {"Kind", true},
                     {"Carried by", true},
                     {"Size, px"},
                     {"Lens model", true},
                     {"Serial number", true}},
                    rows);
}

std::string skipped_list(const std::vector<SkippedView>& skipped) {
  if (skipped.empty()) return "";
  std::vector<std::string> items;
  for (const SkippedView& view : skipped) {
    items.push_back(html_text(fmt::format("station {}, {}: {}{}", view.station, view.sensor, view.reason,
                                          view.by_hand ? " (excluded in capture.yaml)" : "")));
  }
  return "<h3>Views left out</h3>\n" + html_list(items);
}

std::string hash_cell(const std::string& sha256) { return "<code>" + sha256 + "</code>"; }

// As `sha256sum FILE...` prints them, hashed once more.
std::string files_table(const std::vector<HashedFile>& files) {
  std::vector<std::vector<std::string>> rows;
  const bool all = files.size() <= kMostFilesListed;
  std::string lines;
  std::uintmax_t bytes = 0;
  for (const HashedFile& file : files) {
    if (all || &file == &files.front()) {
      rows.push_back(
          {"<code>" + html_text(file.path.string()) + "</code>", fmt::format("{}", file.size), hash_cell(file.sha256)});
      if (!all) continue;
    }
    lines += fmt::format("{}  {}\n", file.sha256, file.path.string());
    bytes += file.size;
  }
  if (!all) {
    rows.push_back({fmt::format("{} further files, by the list of their hashes", files.size() - 1),
                    fmt::format("{}", bytes), hash_cell(sha256_of_text(lines))});
  }
  return html_table({{"File", true}, {"Bytes"}, {"SHA-256", true}}, rows);
}

}  // namespace

std::string capture_section(const CalibrationReport& report) {
  const Capture& capture = report.capture;
  const Calibration& calibration = report.calibration;
  std::vector<HtmlLine> lines{{"Capture", html_text(capture.title)},
                              {"Taken", or_not_stated(capture.record.date)},
                              {"Operator", or_not_stated(capture.record.operator_name)},
                              {"Temperature of the boards", temperature_words(capture.record.temperature)}};
  for (const Board& board : calibration.bundle.state.boards) {
    const auto spec = std::find_if(capture.boards.begin(), capture.boards.end(),
                                   [&](const BoardSpec& candidate) { return candidate.name == board.name; });
    if (spec == capture.boards.end()) continue;
    lines.push_back(
        {"Board " + board.name, html_text(words(spec->target)) + "; " + certificate_words(spec->certificate, "pitch")});
  }
  for (const CaptureBar& bar : capture.scale_bars) {
    lines.push_back({"Scale bar " + bar.name,
                     fmt::format("{:g} mm; ", bar.length_mm) + certificate_words(bar.certificate, "length")});
  }
  lines.push_back({"Board placements", fmt::format("{}", calibration.placement_names.size())});
  if (!calibration.station_names.empty()) {
    lines.push_back({"Stations of the probe", fmt::format("{}", calibration.station_names.size())});
  }
  if (!calibration.bundle.state.rig.leds.empty()) {
    lines.push_back({"LEDs and reference points", fmt::format("{}", calibration.bundle.state.rig.leds.size())});
  }
  if (calibration.earlier) lines.push_back({"Goes on from", "an earlier rig with its covariance"});
  return "<section id=\"capture\">\n<h2>What was calibrated</h2>\n" + html_lines(lines) + sensor_table(report) +
         skipped_list(report.skipped) + "</section>\n";
}

std::string inputs_section(const RunRecord& record, const std::string& command) {
  std::vector<HtmlLine> lines{{"Program", "crumple " + html_text(record.program_version)},
                              {"Run", html_text(record.date)},
                              {"Command line", "<code>" + html_text(command) + "</code>"}};
  std::string flags;
  for (const auto& [name, value] : record.flags) {
    if (!value.empty()) flags += fmt::format("--{}={} ", name, value);
  }
  lines.push_back({"Flags in force", "<code>" + html_text(flags) + "</code>"});
  std::string seeds;
  for (const auto& [name, value] : record.seeds) seeds += fmt::format("{} {} ", name, value);
  lines.push_back({"Seeds", seeds.empty() ? "none: nothing in this run is random" : html_text(seeds)});
  std::string html = "<section id=\"inputs\">\n<h2>Inputs and command line</h2>\n" + html_lines(lines);
  if (!record.inputs.empty()) html += files_table(record.inputs);
  return html + "<p>Every file is listed in ro-crate-metadata.json, beside this report.</p>\n</section>\n";
}

}  // namespace crumple
