// Are faults of a campaign found, and by their names? Simulated campaigns of random tracked systems with one fault in
// each, taken in turns, and as many sound ones as false alarms need. Seeds are fixed, every campaign counts.
#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "calib/image_parts.h"
#include "calib/rig_check.h"
#include "calib/swapped_axes.h"
#include "calib/verdict.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "solvers/parallel.h"
#include "tests/benchmark/made_faults.h"

DEFINE_int32(campaigns, 500, "with a fault");
DEFINE_int32(sound, 200, "without one");
DEFINE_int32(first_seed, 1, "of the first campaign");
DEFINE_string(only, "", "of the faults, those with this in their name");
DEFINE_bool(reasons, false, "print what each verdict says where the fault was not named");
DEFINE_string(out, "out/bench/faults.json", "the result");

namespace crumple {
namespace {

using Json = nlohmann::ordered_json;

struct Judged {
  bool said = false;            // anything as a reason
  bool fault_named = false;     // of any kind, whether there or not, in a reason or a note
  bool named = false;           // the fault that is there
  bool beside_others = false;   // and only as one of several that cannot be told apart
  bool would_not_show = false;  // it was said that a fault of this size would not
  bool true_gaps = false;       // all that was said: parts of images that truly nothing was observed in
  std::vector<std::string> reasons;
  std::vector<std::string> notes;

  bool alarm() const { return said || fault_named; }
};

// What a person is told: the verdict's reasons, or why there is no calibration.
std::vector<std::string> told(const CalibrationData& data, const std::optional<CalibrationData>& later,
                              std::vector<std::string>& notes) {
  const CalibrationOptions options;
  const auto calibration = calibrate(data, options);
  if (!calibration) {
    std::vector<std::string> reasons{calibration.error().message};
    if (const auto swapped = find_swapped_axes(data, options, nullptr)) reasons.push_back(*swapped);
    return reasons;
  }
  Verdict verdict = judge(data, *calibration, 1);
  notes = std::move(verdict.notes);
  std::vector<std::string> reasons = std::move(verdict.reasons);
  if (const auto swapped = find_swapped_axes(data, options, &*calibration)) reasons.push_back(*swapped);
  if (!later) return reasons;
  EarlierRig earlier{.rig = calibrated_rig(*calibration)};
  for (const Board& board : calibration->bundle.state.boards) earlier.board_scales[board.name] = board.scale;
  const auto check = check_rig(*later, earlier, 1);
  if (!check) {
    reasons.push_back(check.error().message);
    return reasons;
  }
  for (const PartCheck& part : check->parts) {
    if (part.block.kind == BlockId::Kind::led && part.would_show_mm)
      notes.push_back(fmt::format("a move would show from {} mm on of {}", *part.would_show_mm, part.name));
  }
  for (const PartChange& change : check->changed) {
    reasons.push_back(check->parts[change.part].name + " changed by " + check->parts[change.part].how_far);
    for (const std::size_t other : change.or_else) reasons.back() += "; or " + check->parts[other].name;
  }
  return reasons;
}

// The number that the expression's group holds in the first note that it is found in; 0 where there is none.
double number_in(const std::vector<std::string>& notes, const std::string& expression) {
  const std::regex with_number(expression);
  for (const std::string& note : notes) {
    std::smatch match;
    if (std::regex_search(note, match, with_number)) return std::stod(match[1]);
  }
  return 0;
}

bool said_in(const std::vector<std::string>& sentences, const std::string& expression) {
  return std::any_of(sentences.begin(), sentences.end(), [words = std::regex(expression)](const std::string& sentence) {
    return std::regex_search(sentence, words);
  });
}

// Whether some sentence that the expression is found in speaks of that part alone.
bool said_alone(const std::vector<std::string>& sentences, const std::string& expression) {
  return std::any_of(sentences.begin(), sentences.end(), [words = std::regex(expression)](const std::string& sentence) {
    return std::regex_search(sentence, words) && !names_one_of_several(sentence);
  });
}

// Whether the notes say of the fault that it would not show: of the only board that nothing could contradict its size,
// of one beside another and of a move that it would show from more on than there is.
bool said_not_to_show(const FaultyCampaign& campaign, const std::vector<std::string>& notes) {
  if (campaign.stretch != 0 && campaign.data.boards.size() == 1) {
    return said_in(notes, "nothing here could contradict the size of board 'board': a wrong pitch would not show");
  }
  if (campaign.stretch != 0) {
    return number_in(notes, "a wrong pitch would show.* from ([0-9.e+-]+) % on of board 'board'") >
           100 * std::abs(campaign.stretch);
  }
  if (campaign.moved_mm == 0) return false;
  return number_in(notes, "a move would show from ([0-9.e+-]+) mm on of " + campaign.moved_led + "$") >
         campaign.moved_mm;
}

// Whether a sentence says of parts of a probe sensor's image that no view covers them, and in truth nothing was
// observed there: by the corners and stripes as they were observed, columns and rows of a projector of the same camera
// pixels.
bool names_true_gaps(const FaultyCampaign& campaign, const std::string& sentence) {
  static const std::regex gap("^no view covers (.*) of ([^ ]+): what is seen there");
  std::smatch match;
  if (!std::regex_search(sentence, match, gap)) return false;
  const CalibrationData& data = campaign.data;
  const auto named = std::find_if(data.sensors.begin(), data.sensors.end(),
                                  [&](const SensorSpec& sensor) { return sensor.name == match[2]; });
  const auto sensor = static_cast<std::size_t>(named - data.sensors.begin());
  std::set<std::string> seen;
  const auto add = [&](const Eigen::Vector2d& pixel) {
    seen.insert(kImagePartNames.at(image_part(pixel, named->size)));
  };
  for (const CornerView& view : data.observations.corners) {
    for (const Eigen::Vector2d& pixel : view.pixels) {
      if (view.sensor == sensor) add(pixel);
    }
  }
  const std::vector<StripeView>& stripes = data.observations.stripes;
  for (std::size_t v = 0; v + 1 < stripes.size(); v += 2) {
    for (std::size_t i = 0; i < stripes[v].coordinates_px.size(); ++i) {
      if (stripes[v].projector == sensor) add({stripes[v].coordinates_px[i], stripes[v + 1].coordinates_px[i]});
    }
  }
  static const std::regex part("the ([a-z]+( (left|right))?)( and |, |$)");
  const std::string parts = match[1];
  for (std::sregex_iterator at(parts.begin(), parts.end(), part), end; at != end; ++at) {
    if (seen.contains((*at)[1])) return false;
  }
  return true;
}

Judged judge_campaign(Fault fault, unsigned seed) {
  const FaultyCampaign campaign = make_faulty(fault, seed);
  Judged judged;
  judged.reasons = told(campaign.data, campaign.later, judged.notes);
  judged.said = !judged.reasons.empty();
  std::vector<std::string> sentences = judged.reasons;
  sentences.insert(sentences.end(), judged.notes.begin(), judged.notes.end());
  judged.fault_named = std::any_of(sentences.begin(), sentences.end(), names_a_fault);
  judged.named = !campaign.named_by.empty() &&
                 std::all_of(campaign.named_by.begin(), campaign.named_by.end(),
                             [&](const std::string& expression) { return said_in(sentences, expression); });
  judged.beside_others = judged.named && !std::all_of(campaign.named_by.begin(), campaign.named_by.end(),
                                                      [&](const std::string& e) { return said_alone(sentences, e); });
  judged.would_not_show = !judged.named && said_not_to_show(campaign, judged.notes);
  judged.true_gaps = judged.said && !judged.fault_named &&
                     std::all_of(judged.reasons.begin(), judged.reasons.end(),
                                 [&](const std::string& reason) { return names_true_gaps(campaign, reason); });
  return judged;
}

struct Tally {
  int campaigns = 0;
  int said = 0;
  int fault_named = 0;
  int alarms = 0;
  int named = 0;
  int beside_others = 0;
  int would_not_show = 0;
  int true_gaps = 0;

  void add(const Judged& judged) {
    ++campaigns;
    said += judged.said ? 1 : 0;
    fault_named += judged.fault_named ? 1 : 0;
    alarms += judged.alarm() ? 1 : 0;
    named += judged.named ? 1 : 0;
    beside_others += judged.beside_others ? 1 : 0;
    would_not_show += judged.would_not_show ? 1 : 0;
    true_gaps += judged.true_gaps ? 1 : 0;
  }
};

Json print_tally(const char* name, const Tally& tally) {
  const double share = 100.0 / std::max(1, tally.campaigns);
  fmt::print("| {} | {} | {} ({:.1f} %) | {} ({:.1f} %) | {} ({:.1f} %) | {} | {} | {:.1f} % |\n", name,
             tally.campaigns, tally.said, tally.said * share, tally.fault_named, tally.fault_named * share, tally.named,
             tally.named * share, tally.beside_others, tally.would_not_show,
             (tally.named + tally.would_not_show) * share);
  return {{"fault", name},
          {"campaigns", tally.campaigns},
          {"something_said", tally.said},
          {"some_fault_named", tally.fault_named},
          {"either", tally.alarms},
          {"true_gaps_only", tally.true_gaps},
          {"named", tally.named},
          {"named_beside_others", tally.beside_others},
          {"said_not_to_show", tally.would_not_show}};
}

int run() {
  std::vector<Fault> plan;
  for (int i = 0; i < FLAGS_campaigns; ++i)
    plan.push_back(all_faults()[static_cast<std::size_t>(i) % all_faults().size()]);
  for (int i = 0; i < FLAGS_sound; ++i) plan.push_back(Fault::none);
  std::vector<Judged> judged(plan.size());
  const auto wanted = [&](std::size_t i) {
    return std::string(name_of(plan[i])).find(FLAGS_only) != std::string::npos;
  };
  constexpr std::size_t kBatch = 16;
  for (std::size_t first = 0; first < plan.size(); first += kBatch) {
    parallel_for(std::min(kBatch, plan.size() - first), 2, [&](std::size_t i) {
      if (!wanted(first + i)) return;
      judged[first + i] =
          judge_campaign(plan[first + i], static_cast<unsigned>(FLAGS_first_seed) + static_cast<unsigned>(first + i));
    });
    fmt::print(stderr, "{} of {}\n", std::min(plan.size(), first + kBatch), plan.size());
  }
  std::map<Fault, Tally> tallies;
  Tally all;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    if (!wanted(i)) continue;
    for (Tally* tally : {&tallies[plan[i]], &all}) {
      if (tally != &all || plan[i] != Fault::none) tally->add(judged[i]);
    }
    const bool as_it_should = plan[i] == Fault::none ? !judged[i].alarm() : judged[i].named || judged[i].would_not_show;
    if (!FLAGS_reasons || as_it_should) continue;
    fmt::print(stderr, "seed {}, {}:\n", FLAGS_first_seed + static_cast<int>(i), name_of(plan[i]));
    for (const std::string& reason : judged[i].reasons) fmt::print(stderr, "  - {}\n", reason);
    for (const std::string& note : judged[i].notes) fmt::print(stderr, "  note: {}\n", note);
  }
  Json rows = Json::array();
  fmt::print(
      "| fault | campaigns | something was said | a fault of any kind was named | it was named | "
      "of these, beside others | said that it would not show | named or said |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const auto& [fault, tally] : tallies) rows.push_back(print_tally(name_of(fault), tally));
  rows.push_back(print_tally("all faults", all));
  if (const auto sound = tallies.find(Fault::none); sound != tallies.end()) {
    const auto& [campaigns, said, fault_named, alarms, named, beside_others, would_not_show, true_gaps] = sound->second;
    const double share = 100.0 / campaigns;
    fmt::print(
        "\nsound campaigns of which something was said, or a fault named in a note: {} of {} ({:.1f} %)\n"
        "of these, nothing but parts of images that in truth nothing was observed in: {}\n"
        "false alarms, the others: {} ({:.1f} %)\n",
        alarms, campaigns, alarms * share, true_gaps, alarms - true_gaps, (alarms - true_gaps) * share);
  }
  const auto text = json_text(Json{{"first_seed", FLAGS_first_seed}, {"rows", rows}});
  return text && write_file(FLAGS_out, *text) ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
