// Are faults of a campaign found, and by their names? Simulated campaigns of random tracked systems with one fault in
// each, taken in turns, and as many sound ones as false alarms need. Seeds are fixed, every campaign counts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

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
  bool alarm = false;
  bool named = false;
  bool too_small = false;  // to be found, and said to be
  std::vector<std::string> reasons;
  std::vector<std::string> notes;
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
  const auto check = check_rig(*later, {.rig = calibrated_rig(*calibration)}, 1);
  if (!check) return {check.error().message};
  for (const PartCheck& part : check->parts) {
    if (part.block.kind == BlockId::Kind::led && part.would_show_mm)
      notes.push_back(fmt::format("a move would show from {} mm on of {}", *part.would_show_mm, part.name));
  }
  for (const PartChange& change : check->changed) {
    reasons.push_back(check->parts[change.part].name + " changed by " + check->parts[change.part].how_far);
    for (const std::size_t other : change.or_else) reasons.push_back("or " + check->parts[other].name);
  }
  return reasons;
}

// The share from which on a wrong pitch of the first board would show, as the notes say; 0 where they do not.
double pitch_that_would_show(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    double percent = 0;
    if (std::sscanf(note.c_str(), "a wrong pitch would show from %lf %% on of board 'board'", &percent) == 1) {
      return percent / 100;
    }
  }
  return 0;
}

// The shift from which on a move of an LED, "LED a", would show; 0 where the notes do not say.
double move_that_would_show(const std::vector<std::string>& notes, const std::string& led) {
  for (const std::string& note : notes) {
    double shift_mm = 0;
    int end = 0;
    if (std::sscanf(note.c_str(), "a move would show from %lf mm on of %n", &shift_mm, &end) == 1 &&
        note.substr(static_cast<std::size_t>(end)) == led) {
      return shift_mm;
    }
  }
  return 0;
}

Judged judge_campaign(Fault fault, unsigned seed) {
  const FaultyCampaign campaign = make_faulty(fault, seed);
  Judged judged;
  judged.reasons = told(campaign.data, campaign.later, judged.notes);
  judged.alarm = !judged.reasons.empty();
  const auto names_it = [&](const std::string& said) {
    return std::any_of(campaign.named_by.begin(), campaign.named_by.end(),
                       [&](const std::string& words) { return said.find(words) != std::string::npos; });
  };
  judged.too_small =
      (campaign.stretch != 0 && pitch_that_would_show(judged.notes) > std::abs(campaign.stretch)) ||
      (campaign.moved_mm != 0 && move_that_would_show(judged.notes, campaign.named_by.front()) > campaign.moved_mm);
  judged.named = std::any_of(judged.reasons.begin(), judged.reasons.end(), names_it) ||
                 std::any_of(judged.notes.begin(), judged.notes.end(), names_it);
  return judged;
}

struct Tally {
  int campaigns = 0;
  int found = 0;
  int named = 0;
  int too_small = 0;
};

Json print_tally(const char* name, const Tally& tally) {
  const double share = 100.0 / std::max(1, tally.campaigns);
  const int told = tally.named + tally.too_small;
  fmt::print("| {} | {} | {} ({:.1f} %) | {} ({:.1f} %) | {} | {:.1f} % |\n", name, tally.campaigns, tally.found,
             tally.found * share, tally.named, tally.named * share, tally.too_small, told * share);
  return {{"fault", name},
          {"campaigns", tally.campaigns},
          {"found", tally.found},
          {"named", tally.named},
          {"said_to_be_too_small", tally.too_small}};
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
      if (tally == &all && plan[i] == Fault::none) continue;
      ++tally->campaigns;
      tally->found += judged[i].alarm ? 1 : 0;
      tally->named += judged[i].named ? 1 : 0;
      tally->too_small += judged[i].too_small && !judged[i].named ? 1 : 0;
    }
    const bool as_it_should = plan[i] == Fault::none ? !judged[i].alarm : judged[i].named;
    if (!FLAGS_reasons || as_it_should) continue;
    fmt::print(stderr, "seed {}, {}:\n", FLAGS_first_seed + static_cast<int>(i), name_of(plan[i]));
    for (const std::string& reason : judged[i].reasons) fmt::print(stderr, "  - {}\n", reason);
    for (const std::string& note : judged[i].notes) fmt::print(stderr, "  note: {}\n", note);
  }
  Json rows = Json::array();
  fmt::print(
      "| fault | campaigns | something was said | it was named | said to be too small | named or said |\n"
      "|---|---:|---:|---:|---:|---:|\n");
  for (const auto& [fault, tally] : tallies) rows.push_back(print_tally(name_of(fault), tally));
  rows.push_back(print_tally("all faults", all));
  const auto text = json_text(Json{{"first_seed", FLAGS_first_seed}, {"rows", rows}});
  return text && write_file(FLAGS_out, *text) ? 0 : 1;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
