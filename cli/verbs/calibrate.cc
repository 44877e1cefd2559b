// calibrate: capture -> rig, summary.
#include <chrono>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gflags/gflags.h>

#include "calib/cross_validate.h"
#include "calib/determined_part.h"
#include "calib/fold_differences.h"
#include "calib/led_layout.h"
#include "calib/swapped_axes.h"
#include "calib/verdict.h"
#include "cli/calibrate_hand_eye.h"
#include "cli/calibration_input.h"
#include "cli/calibration_report.h"
#include "cli/calibration_summary.h"
#include "cli/capture_summary.h"
#include "cli/figures_summary.h"
#include "cli/flags.h"
#include "cli/fold_differences_summary.h"
#include "cli/lens_choice_summary.h"
#include "cli/next_view_summary.h"
#include "cli/progress.h"
#include "cli/record.h"
#include "cli/residual_files.h"
#include "cli/truth_text.h"
#include "cli/verbs/verbs.h"
#include "datasets/earlier_rig.h"
#include "datasets/json_text.h"
#include "datasets/led_images.h"
#include "datasets/output_folder.h"
#include "datasets/rig_file.h"
#include "datasets/truth.h"

DEFINE_string(sensors, "", "names of the sensors to calibrate, comma-separated; empty: all");
DEFINE_string(warp, "auto", "board warp: off, on, or auto: kept where it is significant");
DEFINE_string(projector_from, "auto",
              "what the projector is calibrated from: stripes, chessboard, or auto: all of it that the capture has");
DEFINE_bool(cross_validate, false,
            "also calibrate without each fifth of the views in turn and compare; of a probe that stands still, also "
            "leave each board placement out and reconstruct it with the rig of the others");
DEFINE_string(
    lens, "",
    "lens model of all sensors, such as LENSMODEL_OPENCV5; auto: chosen by the data; empty: as capture.yaml says");
DEFINE_bool(overlays, true, "write every board image with its residuals drawn in, enlarged, into overlays/");
DEFINE_bool(report, true, "write report.html: the calibration as a page to read and to print");
DECLARE_string(invert);
DECLARE_bool(paired);
DEFINE_bool(outliers, true, "leave out outliers by the rule of docs/calibration.md");

DEFINE_bool(
    starts, false,
    "of a tracked probe, also write the rigs of the closed forms alone and of every part refined by itself, to compare "
    "with: closed_forms/ and stagewise/");
DEFINE_string(
    start, "",
    "folder of an earlier rig to go on from: what it knew, with its covariance, is weighed against what is new");
DEFINE_string(
    correct, "",
    "with --start: names of the sensors, and leds, that may be corrected, comma-separated; the others keep what "
    "the earlier rig says; empty: all may");
DEFINE_int32(suggest, 0, "number of views to name that would lower the uncertainty in the measuring volume most");
DEFINE_string(
    map_distances_mm, "",
    "distances, comma-separated, at which to map how well it is known where every sensor sees a point, beside "
    "the one it worked at; inf: infinitely far; empty: none");
DEFINE_bool(hand_eye, false,
            "from two files of poses, the hand's and the eye's, the eye's pose on the hand instead (docs/tracking.md)");

namespace crumple {
namespace {

Expected<CalibrationOptions> options_from_flags() {
  CalibrationOptions options;
  if (FLAGS_warp == "off") {
    options.warp = WarpChoice::off;
  } else if (FLAGS_warp == "on") {
    options.warp = WarpChoice::on;
  } else if (FLAGS_warp != "auto") {
    return fail(fmt::format("--warp={} is none of off, on and auto", FLAGS_warp));
  }
  if (FLAGS_suggest < 0) return fail(fmt::format("--suggest={} is not a number of views", FLAGS_suggest));
  if (!FLAGS_correct.empty() && FLAGS_start.empty()) return fail("--correct is about an earlier rig: give --start");
  options.bundle.reject_outliers = FLAGS_outliers;
  options.bundle.threads = thread_count();
  return options;
}

Expected<ProjectorSource> source_from_flags() {
  if (FLAGS_projector_from == "auto") return ProjectorSource::automatic;
  if (FLAGS_projector_from == "stripes") return ProjectorSource::stripes;
  if (FLAGS_projector_from == "chessboard") return ProjectorSource::chessboard;
  return fail(fmt::format("--projector_from={} is none of auto, stripes and chessboard", FLAGS_projector_from));
}

Expected<void> check_lens_flag() {
  if (FLAGS_lens.empty() || FLAGS_lens == "auto" || !lens_parameter_names(FLAGS_lens).empty()) return {};
  return fail(fmt::format("--lens={} is neither auto nor one of {}", FLAGS_lens, lens_model_choices()));
}

// Sets the sensors' lens models as --lens says; the comparison where it was to be made.
Expected<std::vector<LensChoice>> apply_lens_flag(const CalibrationOptions& options, CalibrationData& data) {
  if (FLAGS_lens == "auto") {
    Progress progress("choosing the lens models", lens_choice_steps(data));
    auto choices = choose_lenses(data, options, [&progress] { progress.advance(); });
    if (choices) data = with_lenses(std::move(data), *choices);
    return choices;
  }
  for (SensorSpec& sensor : data.sensors) {
    if (!FLAGS_lens.empty()) sensor.lens_model = FLAGS_lens;
  }
  return std::vector<LensChoice>();
}

// --map_distances_mm.
Expected<std::vector<double>> map_distances_from_flag() {
  constexpr double kNearest_mm = 1, kFarthest_mm = 1e9;
  std::vector<double> distances_mm;
  for (const std::string& name : parse_names(FLAGS_map_distances_mm)) {
    if (name == "inf") {
      distances_mm.push_back(std::numeric_limits<double>::infinity());
      continue;
    }
    const auto numbers = parse_numbers("map_distances_mm", name);
    if (!numbers) return numbers;
    if (!(numbers->front() >= kNearest_mm && numbers->front() <= kFarthest_mm)) {
      return fail(fmt::format("--map_distances_mm: {} is no distance from {:g} to {:g} mm, nor inf", name, kNearest_mm,
                              kFarthest_mm));
    }
    distances_mm.push_back(numbers->front());
  }
  return distances_mm;
}

// --start and --correct.
Expected<std::optional<EarlierRig>> earlier_from_flags() {
  if (FLAGS_start.empty()) return std::optional<EarlierRig>();
  auto earlier = read_earlier_rig(FLAGS_start);
  if (!earlier) return tl::unexpected(earlier.error());
  for (const std::string& name : parse_names(FLAGS_correct)) {
    if (name != "leds" && !earlier->rig.find(name)) {
      return fail(fmt::format("--correct: {} has no sensor {}", FLAGS_start, name));
    }
    earlier->corrected.insert(name);
  }
  return std::optional<EarlierRig>(std::move(*earlier));
}

Expected<void> check_start_flags() {
  if (!FLAGS_start.empty() && (FLAGS_lens == "auto" || FLAGS_cross_validate || FLAGS_starts)) {
    return fail(
        "--start goes on from a rig: --lens=auto, --cross_validate and --starts are about calibrations from nothing");
  }
  return {};
}

// What stopped the calibration, with the views it had to do without.
std::string explained(const std::string& message, const Capture& capture, const std::vector<SkippedView>& skipped) {
  std::string text = fmt::format("{}: {}", capture.description.string(), message);
  for (const SkippedView& view : skipped) {
    text += fmt::format("\nleft out: station {}, {}: {}", view.station, view.sensor, view.reason);
  }
  return text;
}

// Of a rig that is not determined.
std::string determined_part_text(const DeterminedPart& part) {
  std::string text = fmt::format("nothing tells {}", fmt::join(part.open, ", "));
  for (const DeterminedProjection& sensor : part.projections) {
    text += fmt::format(
        "\nwhat stays determined: {} projects points at the depth of what it saw to {:.2g} px (infinitely far: {:.2g} "
        "px)",
        sensor.sensor, sensor.there_px, sensor.far_px);
  }
  return text;
}

// Read before hours of work, not after.
Expected<std::optional<Rig>> truth_from_flags() {
  if (FLAGS_truth.empty()) return std::nullopt;
  auto truth = read_true_rig(FLAGS_truth);
  if (!truth) return tl::unexpected(truth.error());
  return std::move(*truth);
}

// The rigs that the joint refinement is compared with, into folders of their own; against the truth where there is one.
Expected<void> write_starts(const CalibrationData& data, const CalibrationOptions& options,
                            const Calibration& calibration, const std::optional<Rig>& truth,
                            const std::filesystem::path& folder, VerbResult& result) {
  const auto closed = closed_forms(data, options.bundle);
  if (!closed) return tl::unexpected(closed.error());
  const std::pair<const char*, const Rig*> starts[] = {{"closed_forms", &closed->rig},
                                                       {"stagewise", &calibration.start.rig}};
  for (const auto& [name, rig] : starts) {
    std::error_code failure;
    std::filesystem::create_directory(folder / name, failure);
    if (failure) return fail(fmt::format("{} cannot be made: {}", (folder / name).string(), failure.message()));
    if (auto done = write_rig(folder / name, *rig); !done) return done;
  }
  if (!truth) return {};
  const std::pair<const char*, const Rig*> all[] = {
      {"closed_forms", &closed->rig}, {"stagewise", &calibration.start.rig}, {"joint", &calibration.bundle.state.rig}};
  for (const auto& [name, rig] : all) {
    if (auto added = add_system_truth(*truth, *rig, name, result); !added) return added;
  }
  return {};
}

// --suggest. Where nothing can be suggested that is said, and the calibration goes without it.
void add_suggestions(const CalibrationData& data, const Calibration& calibration, VerbResult& result) {
  if (FLAGS_suggest == 0) return;
  const auto next = next_views(data, calibration, FLAGS_suggest, thread_count());
  if (next) {
    result.document["next_views"] = next_views_summary(*next, calibration);
    result.text += next_views_text(*next, calibration);
    return;
  }
  result.document["next_views"] = {{"not_done", next.error().message}};
  result.text += fmt::format("next views: {}\n", next.error().message);
}

// With what the LEDs' drawing and cross-validation tell.
Verdict full_verdict(const Capture& capture, const CalibrationData& data, const CalibrationOptions& options,
                     const Calibration& calibration, const std::optional<FoldDifferences>& folds) {
  Verdict verdict = judge(data, calibration, thread_count());
  std::vector<std::string>& reasons = verdict.reasons;
  if (folds) {
    for (const std::string& said : reasons_of(*folds)) reasons.push_back(said);
  }
  if (const auto swapped = find_swapped_axes(data, options, &calibration)) {
    reasons.insert(reasons.begin(), *swapped);
    verdict.rejected = true;
  }
  for (const std::string& said : check_led_layout(calibration.bundle.state.rig, nominal_places_mm(capture))) {
    reasons.insert(reasons.begin(), said);
  }
  verdict.ok = reasons.empty();
  return verdict;
}

// --cross_validate. Where it cannot be had that is said, and the calibration goes without it.
std::optional<FoldDifferences> folds_by_flag(const CalibrationData& data, const Calibration& calibration,
                                             VerbResult& result) {
  if (!FLAGS_cross_validate) return std::nullopt;
  Progress progress("cross-validating", fold_steps(data.observations, calibration));
  auto folds = fold_differences(data, calibration, thread_count(), [&progress] { progress.advance(); });
  if (folds) {
    result.document["folds"] = fold_differences_summary(*folds);
    result.text = fold_differences_text(*folds);
    return std::move(*folds);
  }
  result.document["folds"] = {{"not_done", folds.error().message}};
  result.text = folds.error().message + "\n";
  return std::nullopt;
}

// Of a probe that stands still, into the result too; where it cannot be had that is said there.
std::optional<CrossValidation> cross_validation_by_flag(const CalibrationInput& input,
                                                        const CalibrationOptions& options, VerbResult& result) {
  if (!FLAGS_cross_validate || input.stripes.empty() || !input.data.station_names.empty()) return std::nullopt;
  Progress progress("reconstructing boards left out", input.stripes.size());
  auto validation = cross_validate(input.data, input.stripes, options, {}, [&progress] { progress.advance(); });
  if (!validation) {
    result.document["cross_validation"] = {{"not_done", validation.error().message}};
    result.text += validation.error().message + "\n";
    return std::nullopt;
  }
  result.document["cross_validation"] = cross_validation_summary(*validation);
  result.text += cross_validation_text(*validation);
  return std::move(*validation);
}

// What the flags say by themselves; the files that they name are read apart.
struct Settings {
  CalibrationOptions options;
  ProjectorSource source = ProjectorSource::automatic;
  std::vector<double> map_distances_mm;
};

Expected<Settings> settings_from_flags() {
  if (!FLAGS_invert.empty()) return fail("--invert is about poses; give it with --hand_eye");
  if (FLAGS_paired) return fail("--paired is about poses; give it with --hand_eye");
  auto options = options_from_flags();
  if (!options) return tl::unexpected(options.error());
  const auto source = source_from_flags();
  if (!source) return tl::unexpected(source.error());
  if (const auto known = check_lens_flag(); !known) return tl::unexpected(known.error());
  if (const auto can = check_start_flags(); !can) return tl::unexpected(can.error());
  auto map_distances_mm = map_distances_from_flag();
  if (!map_distances_mm) return tl::unexpected(map_distances_mm.error());
  return Settings{std::move(*options), *source, std::move(*map_distances_mm)};
}

struct Calibrated {
  std::vector<LensChoice> lenses;
  Calibration calibration;
};

// Fails with the views that were left out, and with the axes where they are swapped.
Expected<Calibrated> calibrated_by_flags(const Capture& capture, const CalibrationOptions& options,
                                         CalibrationInput& input) {
  auto lenses = apply_lens_flag(options, input.data);
  if (!lenses) return fail(explained(lenses.error().message, capture, input.skipped));
  auto calibration = calibrate(input.data, options);
  if (calibration) return Calibrated{std::move(*lenses), std::move(*calibration)};
  const auto swapped = find_swapped_axes(input.data, options, nullptr);
  std::string said = calibration.error().message + (swapped ? "\n" + *swapped : "");
  if (const auto part = determined_part(input.data, options)) said += "\n" + determined_part_text(*part);
  return fail(explained(said, capture, input.skipped));
}

// What a calibration is judged by, and all that is told of it.
struct Told {
  std::optional<FoldDifferences> folds;
  Verdict verdict;
  CalibrationFigures figures;
  std::optional<CrossValidation> validation;
  VerbResult result;
};

Told tell(const Capture& capture, const CalibrationInput& input, const Settings& settings,
          const Calibrated& calibrated) {
  const auto& [lenses, calibration] = calibrated;
  Told told;
  VerbResult of_folds;
  told.folds = folds_by_flag(input.data, calibration, of_folds);
  told.verdict = full_verdict(capture, input.data, settings.options, calibration, told.folds);
  told.figures = calibration_figures(input.data, calibration, thread_count(), settings.map_distances_mm);

  VerbResult& result = told.result;
  result.exit_code = told.verdict.ok ? ExitCode::done : ExitCode::not_trusted;
  result.document = calibration_summary(calibration, told.verdict, input.skipped);
  result.document["capture"] = capture_summary(capture, calibration.bundle.state);
  result.text = calibration_text(calibration, told.verdict, input.skipped);
  if (!lenses.empty()) {
    result.document["lens_choice"] = lens_choice_summary(lenses);
    result.text += lens_choice_text(lenses);
  }
  result.document.update(figures_summary(told.figures, calibration));
  result.text += projection_maps_text(told.figures, calibration);
  result.document.update(of_folds.document);
  result.text += of_folds.text;
  told.validation = cross_validation_by_flag(input, settings.options, result);
  add_suggestions(input.data, calibration, result);
  return told;
}

// Everything but the run record's file, which ends the folder.
Expected<RunRecord> write_outputs(const VerbContext& context, const Capture& capture, const CalibrationInput& input,
                                  const Calibration& calibration, const Told& told, const OutputFolder& folder) {
  const auto summary = json_text(told.result.document);
  if (!summary) return tl::unexpected(summary.error());
  Rig rig = calibrated_rig(calibration);
  rig.doubts = told.verdict.reasons;
  rig.rejected = told.verdict.rejected;
  if (auto done = write_rig(folder.path(), rig); !done) return tl::unexpected(done.error());
  if (auto done = write_file(folder / "summary.json", *summary); !done) return tl::unexpected(done.error());
  if (auto done = write_residual_files(capture, input, calibration, FLAGS_overlays, folder.path()); !done) {
    return tl::unexpected(done.error());
  }
  std::vector<std::filesystem::path> inputs = capture_files(capture);
  if (!FLAGS_start.empty()) inputs.emplace_back(FLAGS_start);
  auto record = record_of_run(context, inputs);
  if (!record || !FLAGS_report) return record;
  const CalibrationReport report{capture,    calibration,     told.verdict, told.figures,         input.skipped,
                                 told.folds, told.validation, *record,      command_line(context)};
  if (auto done = write_calibration_report(report, folder); !done) return tl::unexpected(done.error());
  return record;
}

Expected<VerbResult> run_calibrate(const VerbContext& context) {
  if (FLAGS_hand_eye) return run_calibrate_hand_eye(context);
  if (context.inputs.size() != 1) return usage_error("calibrate takes one capture; two files of poses with --hand_eye");
  const auto began = std::chrono::steady_clock::now();
  auto settings = settings_from_flags();
  if (!settings) return usage_error(settings.error().message);
  auto earlier = earlier_from_flags();
  if (!earlier) return tl::unexpected(earlier.error());
  settings->options.earlier = std::move(*earlier);
  const auto truth = truth_from_flags();
  if (!truth) return tl::unexpected(truth.error());
  const auto capture = read_capture(context.inputs.front(), images_folder());
  if (!capture) return tl::unexpected(capture.error());
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  const auto& going_on_from = settings->options.earlier;
  auto input = read_calibration_input(*capture, parse_names(FLAGS_sensors), settings->source, thread_count(),
                                      NeedsBoards::yes, going_on_from ? going_on_from->rig.leds : std::vector<Led>());
  if (!input) return tl::unexpected(input.error());
  if (FLAGS_starts && input->data.station_names.empty()) {
    return usage_error("--starts is about a probe that trackers watch");
  }

  const auto calibrated = calibrated_by_flags(*capture, settings->options, *input);
  if (!calibrated) return tl::unexpected(calibrated.error());
  const Calibration& calibration = calibrated->calibration;
  Told told = tell(*capture, *input, *settings, *calibrated);
  if (*truth) {
    const auto added = add_rig_truth(**truth, calibrated_rig(calibration), told.result);
    if (!added) return tl::unexpected(added.error());
  }
  if (FLAGS_starts) {
    const auto done = write_starts(input->data, settings->options, calibration, *truth, folder->path(), told.result);
    if (!done) return tl::unexpected(done.error());
  }
  if (settings->options.earlier) {
    for (const std::string& doubt : settings->options.earlier->rig.doubts) {
      log_warning("the rig that --start goes on from was not trusted when calibrated: " + doubt);
    }
  }
  told.result.document["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const auto record = write_outputs(context, *capture, *input, calibration, told, *folder);
  if (!record) return tl::unexpected(record.error());
  if (auto done = commit_with_record(*folder, *record); !done) return tl::unexpected(done.error());
  return std::move(told.result);
}

}  // namespace

Verb calibrate_verb() {
  return {
      .name = "calibrate",
      .purpose = "estimate a rig from a capture of the board",
      .usage = "CAPTURE.yaml --out=DIR [--flags]\n  crumple calibrate --hand_eye HAND.csv EYE.csv --out=DIR",
      .description =
          "Finds the board in every image, starts from the closed forms and refines everything at once. Writes the "
          "rig, its covariance and summary.json. Where trackers watch the probe's LEDs, everything is refined "
          "together: "
          "the probe's sensors and LEDs, the trackers, every pose. Exit code 4 where the calibration is not to be "
          "trusted: the "
          "reasons say why. With --hand_eye it takes two streams of poses, t, x, y, z (m), qx, qy, qz, qw a line, "
          "whose clocks need not agree, and writes hand_eye.yaml, covariance.npy and summary.json; with --paired "
          "two lists whose poses belong together line by line, one of which may be poses.csv of `crumple track`.",
      .example =
          "$ crumple calibrate stereo_chessboard.yaml --images=photos --sensors=left --out=rig\n"
          "verdict: ok\n"
          "placements: 13\n"
          "left (LENSMODEL_OPENCV5)\n"
          "  corners      702 observations,   25 outliers, RMS 0.1745 px, sigma 0.1279 px\n"
          "  fx      533.474717 +- 0.446626\n"
          "  ...\n"
          "board warp: -0.0410 -0.1750 mm (statistic 114.3)\n",
      .min_inputs = 1,
      .max_inputs = 2,
      .flags = {"out",      "images", "sensors", "warp",    "projector_from",   "outliers", "lens",    "cross_validate",
                "overlays", "report", "truth",   "starts",  "map_distances_mm", "start",    "correct", "suggest",
                "hand_eye", "invert", "paired",  "threads", "overwrite",        "json"},
      .required = {"out"},
      .run = run_calibrate};
}

}  // namespace crumple
