// reconstruct: capture + rig -> clouds, a picture, summary.
#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "cli/flags.h"
#include "cli/pose_flags.h"
#include "cli/progress.h"
#include "cli/reconstruct_summary.h"
#include "cli/reconstructor.h"
#include "cli/record.h"
#include "cli/refined_stations.h"
#include "cli/rig_doubts.h"
#include "cli/verbs/verbs.h"
#include "datasets/capture.h"
#include "datasets/cloud_file.h"
#include "datasets/cloud_picture.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"

DEFINE_string(rig, "", "folder of the rig");
DEFINE_string(estimator, "weighted",
              "weighted, paper or edges; of several, comma-separated, the first is the main one");
DEFINE_string(
    compare, "",
    "names of folders below the rig's, comma-separated, with rigs to compare it with against the truth, such as "
    "those that calibrate --starts writes: their clouds are posed by markers, scored and not written");
DEFINE_bool(refine_stations, false,
            "refine the poses of a tracked probe's stations together, from LEDs and from the surface where stations "
            "overlap, the rig free under its own covariance; reads the images twice");
DEFINE_bool(clean, true, "take noise, grazing and edge points out of every view");
DEFINE_bool(merge, true,
            "fuse stations where they overlap into one cloud; of tracked captures with several stations, since others "
            "have no common frame");
DEFINE_double(spacing, 0, "mm between merged points; 0: as the first station's points lie");
DEFINE_double(smooth, 0, "radius in mm of a local polynomial fit that the points are moved onto; 0: none");
DEFINE_string(bit_rule, "inverse",
              "what a pattern is compared with: inverse (its inverse), half (the mean of white and black) or paper "
              "(white less a fixed threshold)");

namespace crumple {
namespace {

Expected<ReconstructorOptions> choices_from_flags() {
  static const std::vector<NamedEstimator> known{
      {"weighted", Estimator::weighted}, {"paper", Estimator::paper}, {"edges", Estimator::edges}};
  ReconstructorOptions choices;
  for (const std::string& name : parse_names(FLAGS_estimator)) {
    const auto named = [&](const NamedEstimator& candidate) { return candidate.name == name; };
    const auto found = std::find_if(known.begin(), known.end(), named);
    if (found == known.end()) return fail(fmt::format("--estimator: {} is none of weighted, paper and edges.", name));
    if (std::any_of(choices.estimators.begin(), choices.estimators.end(), named)) {
      return fail(fmt::format("--estimator: {} is given twice.", name));
    }
    choices.estimators.push_back(*found);
  }
  if (choices.estimators.empty()) return fail("--estimator names none of weighted, paper and edges.");
  const auto method = pose_method();
  if (!method) return tl::unexpected(method.error());
  choices.pose = *method;
  if (FLAGS_spacing < 0) return fail(fmt::format("--spacing={} is negative.", FLAGS_spacing));
  if (FLAGS_smooth < 0) return fail(fmt::format("--smooth={} is negative.", FLAGS_smooth));
  choices.assembly = {.clean = FLAGS_clean,
                      .merge = FLAGS_merge,
                      .spacing_mm = FLAGS_spacing,
                      .smooth_radius_mm = FLAGS_smooth,
                      .threads = thread_count()};
  if (FLAGS_bit_rule == "half") {
    choices.rule = BitRule::half;
  } else if (FLAGS_bit_rule == "paper") {
    choices.rule = BitRule::paper;
  } else if (FLAGS_bit_rule != "inverse") {
    return fail(fmt::format("--bit_rule={} is none of inverse, half and paper.", FLAGS_bit_rule));
  }
  return choices;
}

// The named stations; else those without the board, for they show what was to be measured; else all.
Expected<std::vector<std::string>> chosen_stations(const Capture& capture) {
  const std::vector<std::string> named = parse_names(FLAGS_stations);
  for (const std::string& id : named) {
    if (capture.station(id) == nullptr) {
      return fail(fmt::format("--stations: {} has no station {}", capture.description.string(), id));
    }
    if (const auto exclusion = capture.exclusion(id, "")) {
      return fail(fmt::format("--stations: station {} is excluded in {}: {}", id, capture.description.string(),
                              exclusion->reason));
    }
  }
  if (!named.empty()) return named;
  std::vector<std::string> all, without_board;
  for (const Station& station : capture.stations) {
    if (capture.exclusion(station.id, "") || !station.scan) continue;
    all.push_back(station.id);
    if (station.boards.empty()) without_board.push_back(station.id);
  }
  if (all.empty()) return fail(fmt::format("{}: every station is excluded", capture.description.string()));
  return without_board.empty() ? all : without_board;
}

Expected<std::vector<ComparedRig>> rigs_to_compare(const Capture& capture) {
  std::vector<ComparedRig> rigs;
  for (const std::string& name : parse_names(FLAGS_compare)) {
    auto rig = read_rig(std::filesystem::path(FLAGS_rig) / name);
    if (!rig) return tl::unexpected(rig.error());
    auto pairs = sensor_pairs(capture, *rig, (std::filesystem::path(FLAGS_rig) / name).string());
    if (!pairs) return tl::unexpected(pairs.error());
    // The closed forms go with the reference method's spots; every other rig with the same spots as the joint one.
    const auto pose = name == "closed_forms" ? PoseMethod::markers : PoseMethod::markers_by_spots;
    rigs.push_back({name, std::move(*rig), std::move(*pairs), pose});
  }
  return rigs;
}

// What is reconstructed with: the rig, and where stations are if that is known better than by each one's LEDs.
struct Setup {
  Rig rig;
  std::vector<SensorPair> pairs;
  std::optional<RefinedStations> refined = std::nullopt;
  std::string refusal = {};  // why nothing was refined
};

// Refines the stations and the rig with them. Where overlap contradicts the LEDs both stay as they are, which is said.
Expected<void> refine_setup(const Capture& capture, const ReconstructorOptions& options,
                            const std::vector<std::string>& stations, Setup& setup) {
  StationOptions reading;
  reading.decode.bit_rule = options.rule;
  auto refined = refined_stations(capture, setup.rig, stations, setup.pairs, reading, options.near);
  if (!refined) {
    setup.refusal = refined.error().message;
    return {};
  }
  auto pairs = sensor_pairs(capture, refined->rig, FLAGS_rig);
  if (!pairs) return tl::unexpected(pairs.error());
  setup.rig = refined->rig;
  setup.pairs = std::move(*pairs);
  setup.refined = std::move(*refined);
  return {};
}

// Deviations per cloud, in the world frame after one rigid move onto the surface; empty without --truth.
Expected<std::vector<std::vector<Deviation>>> compare_with_truth(const std::optional<Scene>& scene,
                                                                 Reconstructor& work) {
  std::vector<std::vector<Deviation>> deviations;
  if (!scene) return deviations;
  for (const NamedCloud& named : work.clouds) {
    auto found = deviations_from_truth(named.cloud, *scene, thread_count());
    if (!found) return tl::unexpected(found.error());
    const bool in_world = named.cloud.frame == "world";
    work.reconstruction.truth.push_back({named.estimator, summarise(named.cloud, *found), in_world});
    deviations.push_back(in_world ? moved_deviations(named.cloud, std::move(*found)) : std::move(*found));
  }
  if (work.compared.empty()) return deviations;
  work.reconstruction.compared.push_back({"joint", work.reconstruction.truth.front().summary, true});
  for (const ComparedRig& beside : work.compared) {
    const auto found = deviations_from_truth(beside.cloud, *scene, thread_count());
    if (!found) return tl::unexpected(found.error());
    work.reconstruction.compared.push_back({beside.name, summarise(beside.cloud, *found), true});
  }
  return deviations;
}

CloudPicture picture_of(const Capture& capture, const Reconstructor& work,
                        const std::vector<std::vector<Deviation>>& deviations) {
  const Cloud& cloud = work.clouds.front().cloud;
  CloudPicture picture = picture_of_sigma(cloud, capture.title);
  picture.subtitle = fmt::format("{}, {} points", work.clouds.front().estimator, cloud.points.size());
  if (deviations.empty()) return picture;
  const EstimatorTruth& truth = work.reconstruction.truth.front();
  picture.subtitle += fmt::format(", RMS distance from the true surface {:.3f} mm", truth.cloud_rms_mm());
  if (truth.in_world) picture.subtitle += " after one rigid move onto it";
  picture.label = "distance from the true surface, mm";
  picture.is_signed = true;
  for (std::size_t i = 0; i < picture.values.size(); ++i) {
    picture.values[i] = static_cast<float>(deviations.front()[i].distance_mm);
  }
  return picture;
}

Expected<void> write_results(const OutputFolder& folder, const Capture& capture, const Reconstructor& work,
                             const std::vector<std::vector<Deviation>>& deviations, const nlohmann::json& document) {
  for (std::size_t i = 0; i < work.clouds.size(); ++i) {
    const std::string name = i == 0 ? "cloud.ply" : fmt::format("cloud_{}.ply", work.clouds[i].estimator);
    if (auto done = write_cloud(folder / name, work.clouds[i].cloud); !done) return done;
  }
  if (auto done = work.uncertainty.write(folder.path()); !done) return done;
  const CloudPicture picture = picture_of(capture, work, deviations);
  const auto drawn = write_cloud_picture(folder / "picture.png", work.clouds.front().cloud, picture);
  if (!drawn) return drawn;
  return json_text(document).and_then(
      [&](const std::string& text) { return write_file(folder / "summary.json", text); });
}

Expected<void> refuse_if_all_failed(const Reconstruction& reconstruction) {
  if (!reconstruction.views.empty()) return {};
  std::string sentence = "no station could be reconstructed";
  for (const FailedView& view : reconstruction.failed) {
    sentence += fmt::format("\n  station {}, {}: {}", view.station, view.camera, view.reason);
  }
  return fail(sentence);
}

Expected<VerbResult> run_reconstruct(const VerbContext& context) {
  const auto began = std::chrono::steady_clock::now();
  auto choices = choices_from_flags();
  if (!choices) return usage_error(choices.error().message);
  if (!FLAGS_compare.empty() && FLAGS_truth.empty())
    return usage_error("--compare wants --truth: the rigs are compared with it");
  if (FLAGS_refine_stations && choices->pose == PoseMethod::markers) {
    return usage_error("--refine_stations wants --pose=pixels: markers have no uncertainty to refine under");
  }
  const auto capture = read_capture(context.inputs.front(), images_folder());
  if (!capture) return tl::unexpected(capture.error());
  auto rig = read_rig(FLAGS_rig);
  if (!rig) return tl::unexpected(rig.error());
  auto near = NearPoses::create(FLAGS_near, *rig);
  if (!near) return tl::unexpected(near.error());
  choices->near = std::move(*near);
  if (FLAGS_refine_stations && !is_tracked(*capture, *rig)) {
    return usage_error("--refine_stations wants a capture in which trackers see the probe's LEDs");
  }
  const auto stations = chosen_stations(*capture);
  if (!stations) return tl::unexpected(stations.error());
  std::optional<Scene> scene;
  if (!FLAGS_truth.empty()) {
    auto read = read_true_scene(FLAGS_truth);
    if (!read) return tl::unexpected(read.error());
    scene = std::move(*read);
  }
  auto pairs = sensor_pairs(*capture, *rig, FLAGS_rig);
  if (!pairs) return tl::unexpected(pairs.error());
  auto compared = rigs_to_compare(*capture);
  if (!compared) return tl::unexpected(compared.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());

  const Rig calibrated = *rig;
  Setup setup{std::move(*rig), std::move(*pairs)};
  if (FLAGS_refine_stations) {
    if (const auto done = refine_setup(*capture, *choices, *stations, setup); !done) {
      return tl::unexpected(done.error());
    }
  }
  Reconstructor work(*capture, setup.rig, *choices, std::move(*compared), stations->size());
  if (!setup.refusal.empty()) {
    work.reconstruction.refined = {{"refused", setup.refusal}};
    work.reconstruction.refined_text =
        fmt::format("not refined: stations stay where their LEDs put them, for {}\n", setup.refusal);
  }
  if (setup.refined) {
    work.place(std::move(setup.refined->poses));
    work.uncertainty.know(std::move(setup.refined->known));
    work.reconstruction.refined = std::move(setup.refined->summary);
    work.reconstruction.refined_text = std::move(setup.refined->text);
  }
  {
    Progress progress("reconstructing", stations->size() * setup.pairs.size());
    for (const std::string& station : *stations) {
      work.go_to(station);
      for (const SensorPair& pair : setup.pairs) {
        work.add(station, pair);
        progress.advance();
      }
    }
  }
  if (auto some = refuse_if_all_failed(work.reconstruction); !some) return tl::unexpected(some.error());
  work.hold_against(calibrated);
  if (auto done = work.finish(); !done) return tl::unexpected(done.error());
  if (auto done = work.map_images(*stations); !done) return tl::unexpected(done.error());
  const auto deviations = compare_with_truth(scene, work);
  if (!deviations) return tl::unexpected(deviations.error());

  VerbResult result;
  result.exit_code = work.reconstruction.failed.empty() ? ExitCode::done : ExitCode::part_of_batch_failed;
  const bool trusted = work.reconstruction.rig.holds && work.reconstruction.rig.misfits.empty() &&
                       stations_off(work.reconstruction).empty() && setup.refusal.empty();
  if (!trusted) result.exit_code = ExitCode::not_trusted;
  result.text = reconstruction_text(work.reconstruction);
  result.document = reconstruction_summary(work.reconstruction);
  result.document["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  tell_doubts(calibrated, result);
  const auto written = write_results(*folder, *capture, work, *deviations, result.document).and_then([&] {
    std::vector<std::filesystem::path> inputs = capture_files(*capture);
    inputs.emplace_back(FLAGS_rig);
    if (choices->near.file()) inputs.push_back(*choices->near.file());
    return commit_with_record(*folder, context, inputs);
  });
  if (!written) return tl::unexpected(written.error());
  return result;
}

}  // namespace

Verb reconstruct_verb() {
  return {
      .name = "reconstruct",
      .purpose = "compute a cloud with uncertainty from a capture and its rig",
      .usage = "CAPTURE.yaml --rig=DIR --out=DIR [--flags]",
      .description =
          "Reconstructs every camera that the rig knows, station after station: in the probe frame or, where trackers "
          "watch the probe's LEDs, in the world frame, with overlapping stations fused by their uncertainties. Writes "
          "cloud.ply by the first estimator, cloud_NAME.ply by each further one, picture.png and summary.json, and "
          "with "
          "the estimator weighted stations.yaml, from which `crumple measure` has the points' uncertainty. "
          "What cameras without patterns show, such as thermal ones, is mapped to the points of the first cloud. "
          "--stations empty: those without the board, or all where every station shows it; excluded ones never. "
          "Orientations whose stripes run along the epipolar lines are left out and named. Exit code 5 where some "
          "stations failed and the others are written; 4 where the LEDs of all stations together show that a tracker "
          "or an LED has moved since the calibration or meanwhile, which is named, where those of one station "
          "contradict each other, where a station lies off the others by more than rig and poses allow, and where "
          "--refine_stations was refused.",
      .example =
          "$ crumple reconstruct door/capture.yaml --rig=rig --out=cloud\n"
          "door_01, cam0, weighted: 412345 points, 97.1 % of the lit pixels, median sigma 0.0301 mm\n",
      .min_inputs = 1,
      .max_inputs = 1,
      .flags = {"rig", "out", "images", "stations", "estimator", "bit_rule", "pose", "near", "refine_stations", "clean",
                "merge", "spacing", "smooth", "compare", "truth", "threads", "overwrite", "json"},
      .required = {"rig", "out"},
      .run = run_reconstruct};
}

}  // namespace crumple
