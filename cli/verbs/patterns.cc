// patterns: projector size and stripe orientations -> images to project; or the calibration board -> a PDF to print; or
// the words that the probe's LEDs blink -> a table for their controller.
#include <cmath>

#include <fmt/core.h>
#include <gflags/gflags.h>

#include "cli/flags.h"
#include "cli/progress.h"
#include "cli/record.h"
#include "cli/verbs/verbs.h"
#include "datasets/board_pdf.h"
#include "datasets/output_folder.h"
#include "datasets/pattern_files.h"
#include "datasets/target_yaml.h"
#include "tracking/blink_code.h"

DEFINE_int32(width_px, 0, "width of the projector's panel, px; not needed with --board");
DEFINE_int32(height_px, 0, "height of the projector's panel, px; not needed with --board");
DEFINE_string(orientations_deg, "0,90",
              "angles of the stripe coordinate from the panel's x axis towards y, deg: 0 makes columns, 90 rows");
DEFINE_double(stripe_width_px, 1, "width of the finest stripes, px");
DEFINE_int32(bits, 0, "bits per orientation; 0: as few as name every stripe");
DEFINE_int32(code_offset, 0, "added to each stripe's number before it is coded");
DEFINE_bool(inverse, true, "follow each pattern by its inverse");
DEFINE_bool(board, false, "draw the calibration board as a PDF in true scale instead");
DEFINE_string(board_kind, "chessboard", "chessboard, charuco, apriltag or dots");
DEFINE_int32(board_columns, 10, "inner corners, markers or dots of the board along a row");
DEFINE_int32(board_rows, 7, "inner corners, markers or dots of the board along a column");
DEFINE_double(board_pitch_mm, 20, "distance of neighbouring corners, markers or dots, mm");
DEFINE_double(board_mark_mm, 0,
              "side of a marker or diameter of a dot, mm; 0: a share of the pitch that suits the kind");
DEFINE_string(board_dictionary, "", "of the markers, such as 5X5_100; empty: 5X5_250 or, of apriltag, APRILTAG_36h11");
DEFINE_int32(board_first_id, 0, "number of the first marker: boards in one capture must not share any");
DEFINE_bool(board_staggered, false, "dots: every second row shifted by half a pitch");
DEFINE_bool(led, false, "make the words that the probe's LEDs blink instead, a table for their controller");
DEFINE_int32(led_count, 8, "LEDs on the probe");
DEFINE_int32(led_length, 18, "frames of a word: 8 to 24");
DEFINE_string(paper, "auto", "auto, A4, A3, A2, A1, A0, or width x height in mm such as 400x300");

namespace crumple {
namespace {

Expected<std::vector<StripeOrientation>> orientations_from_flags(ImageSize projector) {
  const auto angles_deg = parse_numbers("orientations_deg", FLAGS_orientations_deg);
  if (!angles_deg) return tl::unexpected(angles_deg.error());
  std::vector<StripeOrientation> orientations;
  for (const double angle_deg : *angles_deg) {
    StripeOrientation orientation{angle_deg * M_PI / 180, FLAGS_stripe_width_px, FLAGS_bits, FLAGS_code_offset,
                                  FLAGS_inverse};
    if (FLAGS_bits == 0) {
      const auto bits = sufficient_bits(orientation, projector);
      if (!bits) return tl::unexpected(bits.error());
      orientation.bits = *bits;
    }
    const auto sound = checked(orientation, projector);
    if (!sound) return tl::unexpected(sound.error());
    orientations.push_back(*sound);
  }
  return orientations;
}

VerbResult summary(const std::vector<StripeOrientation>& orientations, const std::vector<std::string>& files) {
  VerbResult result;
  result.text = fmt::format("{} images in {}\n", files.size(), FLAGS_out);
  result.document = {{"out", FLAGS_out}, {"files", files}, {"orientations", nlohmann::json::array()}};
  for (const StripeOrientation& orientation : orientations) {
    const double angle_deg = orientation.angle_rad * 180 / M_PI;
    result.text += fmt::format("  {:6.2f} deg: {} bits, stripes of {:g} px\n", angle_deg, orientation.bits,
                               orientation.stripe_width_px);
    result.document["orientations"].push_back({{"angle_deg", angle_deg}, {"bits", orientation.bits}});
  }
  return result;
}

Expected<VerbResult> draw_stripes_for_projector(const VerbContext& context) {
  if (FLAGS_width_px < 1 || FLAGS_height_px < 1) return usage_error("--width_px and --height_px have to be given.");
  const ImageSize projector{FLAGS_width_px, FLAGS_height_px};
  const auto orientations = orientations_from_flags(projector);
  if (!orientations) return usage_error(orientations.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  Progress progress("drawing", pattern_sequence(*orientations).size());
  const auto files = write_patterns(folder->path(), *orientations, projector, [&] { progress.advance(); });
  if (!files) return tl::unexpected(files.error());
  if (auto committed = commit_with_record(*folder, context); !committed) return tl::unexpected(committed.error());
  return summary(*orientations, *files);
}

Expected<Target> target_from_flags() {
  Target target{FLAGS_board_columns, FLAGS_board_rows, FLAGS_board_pitch_mm};
  double share = 0;  // of a mark, of the pitch
  if (FLAGS_board_kind == "charuco") {
    target.kind = TargetKind::charuco;
    target.dictionary = "5X5_250";
    share = 0.75;
  } else if (FLAGS_board_kind == "apriltag") {
    target.kind = TargetKind::apriltag;
    target.dictionary = "APRILTAG_36h11";
    share = 0.8;
  } else if (FLAGS_board_kind == "dots") {
    target.kind = TargetKind::dots;
    target.staggered = FLAGS_board_staggered;
    share = target.staggered ? 0.35 : 0.5;
  } else if (FLAGS_board_kind != "chessboard") {
    return fail(fmt::format("--board_kind={} is none of chessboard, charuco, apriltag and dots", FLAGS_board_kind));
  }
  target.mark_mm = FLAGS_board_mark_mm > 0 ? FLAGS_board_mark_mm : share * target.pitch_mm;
  target.first_id = FLAGS_board_first_id;
  if (!FLAGS_board_dictionary.empty()) target.dictionary = FLAGS_board_dictionary;
  return checked(target);
}

bool looks_the_same_turned(const Target& target) {
  if (target.kind == TargetKind::dots) return !target.staggered || target.rows % 2 == 0;
  return target.kind == TargetKind::chessboard && target.columns % 2 == target.rows % 2;
}

Expected<VerbResult> draw_board(const VerbContext& context) {
  const auto board = target_from_flags();
  if (!board) return usage_error(board.error().message);
  const auto paper = choose_paper(FLAGS_paper, *board);
  if (!paper) return usage_error(paper.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  if (auto drawn = write_board_pdf(*folder / "board.pdf", *board, *paper); !drawn) return tl::unexpected(drawn.error());
  if (auto committed = commit_with_record(*folder, context); !committed) return tl::unexpected(committed.error());
  if (looks_the_same_turned(*board)) {
    log_warning(
        "turned by half a turn this board looks the same: one count of inner corners should be even, one odd (of "
        "dots: staggered, with an odd number of rows)");
  }
  VerbResult result;
  result.text = fmt::format("{}/board.pdf: {}, on {}\nin capture.yaml: board: {{{}}}\n", FLAGS_out, words(*board),
                            paper->name, target_yaml(*board));
  result.document = {{"out", FLAGS_out},
                     {"file", "board.pdf"},
                     {"board",
                      {{"kind", name_of(board->kind)},
                       {"columns", board->columns},
                       {"rows", board->rows},
                       {"pitch_mm", board->pitch_mm}}},
                     {"paper_mm", {paper->width_mm, paper->height_mm}}};
  return result;
}

// One line per LED: its number, and 1 or 0 for each frame of the word.
std::string led_table(const BlinkCode& code, const char* between) {
  std::string table;
  for (std::size_t led = 0; led < code.size(); ++led) {
    table += fmt::format("{}", led);
    for (int frame = 0; frame < code.length(); ++frame) {
      table += fmt::format("{}{}", between, int(code.lit(led, frame)));
    }
    table += "\n";
  }
  return table;
}

std::string led_csv(const BlinkCode& code) {
  std::string header = "led";
  for (int frame = 0; frame < code.length(); ++frame) header += fmt::format(",frame_{}", frame);
  return header + "\n" + led_table(code, ",");
}

Expected<VerbResult> write_led_words(const VerbContext& context) {
  if (FLAGS_board) return usage_error("--led and --board make different things: give one of them.");
  if (FLAGS_led_count < 1) return usage_error("--led_count has to be 1 or more.");
  const auto code = BlinkCode::generate(static_cast<std::size_t>(FLAGS_led_count), FLAGS_led_length);
  if (!code) return usage_error(code.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());
  if (auto written = write_file(*folder / "leds.csv", led_csv(*code)); !written) return tl::unexpected(written.error());
  if (auto committed = commit_with_record(*folder, context); !committed) return tl::unexpected(committed.error());
  VerbResult result;
  result.text = fmt::format(
      "{}/leds.csv: {} words of {} frames; any two differ in {} frames or more, and in {} or more from any other "
      "start\n"
      "LED, then its state in each frame\n{}",
      FLAGS_out, code->size(), code->length(), code->distance_in_step(), code->distance(), led_table(*code, " "));
  nlohmann::json words = nlohmann::json::array();
  for (std::size_t led = 0; led < code->size(); ++led) {
    std::vector<int> states;
    for (int frame = 0; frame < code->length(); ++frame) states.push_back(code->lit(led, frame));
    words.push_back(states);
  }
  result.document = {{"out", FLAGS_out},
                     {"file", "leds.csv"},
                     {"length", code->length()},
                     {"distance", code->distance()},
                     {"distance_in_step", code->distance_in_step()},
                     {"words", words}};
  return result;
}

Expected<VerbResult> run_patterns(const VerbContext& context) {
  if (FLAGS_led) return write_led_words(context);
  return FLAGS_board ? draw_board(context) : draw_stripes_for_projector(context);
}

}  // namespace

Verb patterns_verb() {
  return {.name = "patterns",
          .purpose = "draw the stripe images a projector is to show, the board to print, or LED words",
          .usage =
              "--width_px=N --height_px=N --out=DIR [--flags]\n  crumple patterns --board --out=DIR [--flags]\n"
              "  crumple patterns --led --out=DIR [--flags]",
          .description =
              "Writes numbered PNG images in the order to show them (white, black, then the stripes of each "
              "orientation, coarsest first) and patterns.yaml, which lists them in the form capture.yaml "
              "takes. With --board: board.pdf, to be printed at 100 % and checked with a ruler. With --led: "
              "leds.csv, the words that the probe's LEDs are to blink in step, over and over, one state per "
              "frame of the trackers.",
          .example =
              "$ crumple patterns --width_px=1024 --height_px=768 --out=patterns\n"
              "42 images in patterns\n"
              "    0.00 deg: 10 bits, stripes of 1 px\n"
              "   90.00 deg: 10 bits, stripes of 1 px\n",
          .min_inputs = 0,
          .max_inputs = 0,
          .flags = {"out",
                    "width_px",
                    "height_px",
                    "orientations_deg",
                    "stripe_width_px",
                    "bits",
                    "code_offset",
                    "inverse",
                    "board",
                    "board_kind",
                    "board_columns",
                    "board_rows",
                    "board_pitch_mm",
                    "board_mark_mm",
                    "board_dictionary",
                    "board_first_id",
                    "board_staggered",
                    "led",
                    "led_count",
                    "led_length",
                    "paper",
                    "overwrite",
                    "json"},
          .required = {"out"},
          .run = run_patterns};
}

}  // namespace crumple
