// track: capture + rig -> the probe's pose at every station.
#include <fmt/format.h>
#include <gflags/gflags.h>

#include "calib/led_layout.h"
#include "calib/station_poses.h"
#include "calib/unknown_probe.h"
#include "calib/verdict.h"
#include "cli/calibration_input.h"
#include "cli/cloud_uncertainty.h"
#include "cli/flags.h"
#include "cli/pose_flags.h"
#include "cli/posed_rig.h"
#include "cli/progress.h"
#include "cli/record.h"
#include "cli/rig_doubts.h"
#include "cli/track_summary.h"
#include "cli/verbs/verbs.h"
#include "datasets/earlier_rig.h"
#include "datasets/json_text.h"
#include "datasets/led_images.h"
#include "datasets/near_poses.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"

DECLARE_string(rig);

namespace crumple {
namespace {

// The named stations, else all at which trackers took images.
Expected<std::vector<std::string>> tracked_stations(const Capture& capture) {
  const std::vector<std::string> named = parse_names(FLAGS_stations);
  for (const std::string& id : named) {
    if (capture.station(id) == nullptr) {
      return fail(fmt::format("--stations: {} has no station {}", capture.description.string(), id));
    }
  }
  if (!named.empty()) return named;
  std::vector<std::string> all;
  for (const Station& station : capture.stations) {
    if (station.trackers && !capture.exclusion(station.id, "")) all.push_back(station.id);
  }
  return all;
}

// Whether the capture's probe has LEDs of which the rig knows none.
bool probe_is_unknown(const Capture& capture, const Rig& rig) {
  bool any = false;
  for (const CaptureLed& led : capture.leds) {
    if (led.mount != Mount::probe) continue;
    any = true;
    for (const Led& known : rig.leds) {
      if (known.name == led.name) return false;
    }
  }
  return any;
}

// The rig's trackers with the LEDs of a probe that they see for the first time, and whether that is to be trusted.
struct FoundProbe {
  Rig rig;
  Verdict verdict;
};

Expected<FoundProbe> find_probe(const Capture& capture) {
  const auto trackers = read_earlier_rig(FLAGS_rig);
  if (!trackers) return tl::unexpected(trackers.error());
  std::vector<std::string> names;
  for (const CaptureSensor& sensor : capture.sensors) {
    if (sensor.mount == Mount::world && trackers->rig.find(sensor.name)) names.push_back(sensor.name);
  }
  if (names.empty()) return fail("the rig knows none of the capture's cameras that are fixed to the world");
  const auto input =
      read_calibration_input(capture, names, ProjectorSource::automatic, thread_count(), NeedsBoards::no);
  if (!input) return tl::unexpected(input.error());
  const auto nominal_mm = nominal_places_mm(capture);
  auto probe = unknown_probe(input->data, *trackers, nominal_mm, thread_count());
  if (!probe) return tl::unexpected(probe.error());
  Verdict verdict = judge(input->data, probe->calibration, thread_count());
  for (std::string& said : check_led_layout(probe->rig, nominal_mm)) verdict.reasons.push_back(std::move(said));
  verdict.ok = verdict.reasons.empty();
  // What was said against the trackers holds for what they found.
  probe->rig.doubts = trackers->rig.doubts;
  probe->rig.doubts.insert(probe->rig.doubts.end(), verdict.reasons.begin(), verdict.reasons.end());
  probe->rig.rejected = trackers->rig.rejected || verdict.rejected;
  return FoundProbe{std::move(probe->rig), std::move(verdict)};
}

// What the rig's covariance makes of a pose.
std::optional<Matrix6d> pose_by_rig(const Rig& rig, const Constellation& where) {
  if (rig.covariance.names.empty()) return std::nullopt;
  const auto d_rig = d_pose_d_rig(rig, used_readings(rig, where), where.pose.world_from_probe);
  if (!d_rig) return std::nullopt;
  return Matrix6d(*d_rig * rig.covariance.matrix * d_rig->transpose());
}

// Of a probe that was not known.
void tell_found_probe(const Verdict& verdict, VerbResult& result) {
  result.document["found_probe"] = {{"verdict", level_of(verdict)}, {"reasons", verdict.reasons}};
  std::string text = "the rig knows no LED of this probe: rig/ holds the trackers with its LEDs\n";
  for (const std::string& reason : verdict.reasons) text += fmt::format("{}: {}\n", level_of(verdict), reason);
  result.text = text + result.text;
  if (!verdict.ok) result.exit_code = ExitCode::not_trusted;
}

// Into a folder of its own.
Expected<void> write_found_rig(const std::filesystem::path& folder, const Rig& rig) {
  std::error_code failure;
  std::filesystem::create_directory(folder, failure);
  if (failure) return fail(fmt::format("{} cannot be made: {}", folder.string(), failure.message()));
  return write_rig(folder, rig);
}

std::vector<std::pair<std::string, Constellation>> constellations(const std::vector<TrackedStation>& stations) {
  std::vector<std::pair<std::string, Constellation>> found;
  for (const TrackedStation& station : stations) {
    if (station.found) found.emplace_back(station.station, station.found->constellation);
  }
  return found;
}

Expected<VerbResult> run_track(const VerbContext& context) {
  const auto method = pose_method();
  if (!method) return usage_error(method.error().message);
  const bool by_pixels = *method == PoseMethod::pixels;
  const auto capture = read_capture(context.inputs.front(), images_folder());
  if (!capture) return tl::unexpected(capture.error());
  auto rig = read_rig(FLAGS_rig);
  if (!rig) return tl::unexpected(rig.error());
  const Rig calibrated = *rig;
  const bool unknown = probe_is_unknown(*capture, *rig);
  Verdict of_unknown;
  if (unknown) {
    auto found = find_probe(*capture);
    if (!found) return fail(fmt::format("{}: {}", capture->description.string(), found.error().message));
    rig = std::move(found->rig);
    of_unknown = std::move(found->verdict);
  }
  if (!is_tracked(*capture, *rig)) {
    return fail(fmt::format("{} and {}: a probe is tracked by LEDs that both describe", capture->description.string(),
                            FLAGS_rig));
  }
  const auto stations = tracked_stations(*capture);
  if (!stations) return tl::unexpected(stations.error());
  auto near = NearPoses::create(FLAGS_near, *rig);
  if (!near) return tl::unexpected(near.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());

  std::vector<TrackedStation> tracked;
  CloudUncertainty uncertainty(*rig);
  if (!by_pixels) uncertainty.refuse(kMarkersLack);
  {
    Progress progress("tracking", stations->size());
    for (const std::string& station : *stations) {
      auto found = by_pixels ? near->pose(*capture, *rig, station) : station_pose(*capture, *rig, station, *method);
      tracked.push_back({station, std::move(found)});
      if (tracked.back().found && by_pixels) {
        tracked.back().by_rig = pose_by_rig(*rig, tracked.back().found->constellation);
      }
      progress.advance();
    }
  }
  PosedRig posed;
  if (!unknown && by_pixels) posed = posed_rig(*rig, constellations(tracked));
  for (TrackedStation& station : tracked) {
    if (!station.found) continue;
    Constellation& where = station.found->constellation;
    where.pose.covariance = restated_covariance(*rig, where, posed.noisier);
    uncertainty.add_tracked(station.station, *station.found);
  }
  VerbResult result;
  result.document = track_summary(*rig, tracked, *method);
  result.text = track_text(tracked, *method);
  const auto failed = std::count_if(tracked.begin(), tracked.end(), [](const TrackedStation& t) { return !t.found; });
  if (failed == static_cast<std::ptrdiff_t>(tracked.size())) return fail("no station could be tracked\n" + result.text);
  result.exit_code = failed == 0 ? ExitCode::done : ExitCode::part_of_batch_failed;
  if (!unknown && by_pixels) {
    result.document["rig_check"] = posed.document;
    result.text = posed.text + result.text;
    if (!posed.holds || !posed.misfits.empty()) result.exit_code = ExitCode::not_trusted;
  }
  if (unknown) {
    tell_found_probe(of_unknown, result);
    if (auto done = write_found_rig(*folder / "rig", *rig); !done) return tl::unexpected(done.error());
  }
  tell_doubts(calibrated, result);
  const auto written =
      write_file(*folder / "poses.csv", poses_csv(tracked, *method))
          .and_then([&] { return unknown ? Expected<void>{} : uncertainty.write(folder->path()); })
          .and_then([&] { return json_text(result.document); })
          .and_then([&](const std::string& text) { return write_file(*folder / "summary.json", text); })
          .and_then([&] {
            std::vector<std::filesystem::path> inputs = capture_files(*capture);
            inputs.emplace_back(FLAGS_rig);
            if (near->file()) inputs.push_back(*near->file());
            return commit_with_record(*folder, context, inputs);
          });
  if (!written) return tl::unexpected(written.error());
  return result;
}

}  // namespace

Verb track_verb() {
  return {
      .name = "track",
      .purpose = "find the probe's pose at every station from its LEDs",
      .usage = "CAPTURE.yaml --rig=DIR --out=DIR [--flags]",
      .description =
          "Finds the spots in every tracker's frames, tells the LEDs by the words they blink, and poses the probe from "
          "the pixels of all trackers at once, with its covariance. Writes poses.csv (world_from_probe of each "
          "station), stations.yaml with how the poses depend on the rig, and summary.json. Where the rig has trackers "
          "but no LED of the probe, the LEDs are found first, "
          "from all stations together, and written to rig/. A station at which something moved between two readings "
          "of the LEDs fails, and so does one at which several poses explain the pixels, as three LEDs before one "
          "tracker allow, unless --near tells which. Poses by --pose=markers have no covariance: poses.csv is without "
          "it then, and there is no stations.yaml. Exit code 5 where some stations failed and the others are "
          "written; 4 where the LEDs of all stations together show that a tracker or an LED has moved since the "
          "calibration or meanwhile, which is named, where those of one station contradict each other, and where what "
          "was found of an unknown probe is not to be trusted.",
      .example =
          "$ crumple track door/capture.yaml --rig=rig --out=poses\n"
          "door_1: 10 readings, 0 left out, chi-square 14.2 of 14; sigma 0.021 deg, 0.32 mm by LEDs, "
          "0.009 deg, 0.21 mm by rig\n",
      .min_inputs = 1,
      .max_inputs = 1,
      .flags = {"rig", "out", "images", "stations", "pose", "near", "threads", "overwrite", "json"},
      .required = {"rig", "out"},
      .run = run_track};
}

}  // namespace crumple
