// Hand-eye calibration beside OpenCV's five methods on the same pairs of poses: made ones with known truth, and, where
// the public recordings are there, how far the board scatters in the world.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.h"
#include "tests/tracking/hand_eye_campaign.h"
#include "tests/tracking/real_comparison.h"

DEFINE_int32(cases, 1000, "made calibrations");
DEFINE_int32(first_case, 0, "number of the first; each number draws its own");

namespace crumple {
namespace {

using Json = nlohmann::ordered_json;

struct Errors {
  std::string method;
  std::vector<PoseError> all;
};

// Ours first. Over the cases of one kind (all: past the last) that we answered, or over all.
std::vector<Errors> collect(const std::vector<CampaignCase>& cases, std::size_t kind, bool answered) {
  std::vector<Errors> methods{{"Crumple", {}}};
  for (const std::string& name : kOpencvHandEyeMethods) methods.push_back({"OpenCV " + name, {}});
  for (const CampaignCase& c : cases) {
    if ((kind < kCampaignKinds.size() && c.kind != kind) || (answered && c.answer == Answer::refused)) continue;
    methods[0].all.push_back(c.ours);
    for (std::size_t m = 0; m < c.peers.size(); ++m) methods[m + 1].all.push_back(c.peers[m]);
  }
  return methods;
}

void table(const std::vector<CampaignCase>& cases, std::size_t kind, bool answered, Json& rows) {
  const std::string name = kind < kCampaignKinds.size() ? kCampaignKinds[kind] : "all kinds";
  for (const Errors& method : collect(cases, kind, answered)) {
    if (method.all.empty()) continue;
    const auto garbage = std::count_if(method.all.begin(), method.all.end(), is_garbage);
    const double deg = median_rotation_deg(method.all), mm = median_translation_mm(method.all);
    fmt::print("| {}{} | {} | {} | {:.4f} | {:.3f} | {} |\n", name, answered ? ", answered" : "", method.all.size(),
               method.method, deg, mm, garbage);
    rows.push_back({{"cases", name},
                    {"answered_only", answered},
                    {"count", method.all.size()},
                    {"method", method.method},
                    {"median_rotation_deg", deg},
                    {"median_translation_mm", mm},
                    {"beyond_5_deg_or_50_mm", garbage}});
  }
}

// How our answers and their sigmas hold against the truth.
Json honesty(const std::vector<CampaignCase>& cases) {
  std::size_t counts[3] = {}, garbage[3] = {};
  double worst_sigmas = 0, worst_deg = 0, worst_mm = 0;
  for (const CampaignCase& c : cases) {
    const auto a = static_cast<std::size_t>(c.answer);
    ++counts[a];
    garbage[a] += is_garbage(c.ours) ? 1 : 0;
    if (c.answer != Answer::trusted) continue;
    worst_sigmas = std::max(worst_sigmas, c.sigmas);
    worst_deg = std::max(worst_deg, c.ours.rotation_deg);
    worst_mm = std::max(worst_mm, c.ours.translation_mm);
  }
  fmt::print(
      "\nours: {} trusted ({} of them beyond 5 deg or 50 mm; worst {:.2f} deg, {:.1f} mm, {:.1f} sigmas), {} "
      "suspect ({} beyond), {} refused\n",
      counts[0], garbage[0], worst_deg, worst_mm, worst_sigmas, counts[1], garbage[1], counts[2]);
  return {{"trusted", counts[0]},         {"trusted_beyond", garbage[0]},
          {"suspect", counts[1]},         {"suspect_beyond", garbage[1]},
          {"refused", counts[2]},         {"worst_trusted_deg", worst_deg},
          {"worst_trusted_mm", worst_mm}, {"worst_trusted_sigmas", worst_sigmas}};
}

Json recording(const RealHandEye& set, const RealComparison& comparison) {
  const HandEyeFit& fit = comparison.calibration.fit;
  fmt::print(
      "\n{}: offset {:.2f} ms, scatter {:.3f} mm RMS (median {:.3f}) over {} accepted pairs, {:.3f} mm (median {:.3f}) "
      "over all {}\n",
      set.name, 1e3 * fit.state.offset_s, comparison.calibration.scatter.rms_mm,
      comparison.calibration.scatter.median_mm, comparison.calibration.scatter.pairs,
      comparison.calibration.scatter_all.rms_mm, comparison.calibration.scatter_all.median_mm, fit.pairs.size());
  fmt::print(
      "| pairs | count | method | hand_from_eye, mm | RMS, mm | median, mm | RMS, deg "
      "|\n|---|---|---|---|---|---|---|\n");
  Json json{{"name", set.name},
            {"offset_s", fit.state.offset_s},
            {"accepted", comparison.calibration.scatter.pairs},
            {"scatter_mm", comparison.calibration.scatter.rms_mm},
            {"scatter_all_mm", comparison.calibration.scatter_all.rms_mm},
            {"rows", Json::array()}};
  for (const PairSetComparison& pairs : comparison.sets) {
    for (const MethodScatter& m : pairs.methods) {
      const Eigen::Vector3d& t = m.hand_from_eye.translation;
      const double deg = m.scatter.rms_rad * 180 / std::numbers::pi;
      fmt::print("| {} | {} | {} | {:.1f} {:.1f} {:.1f} | {:.3f} | {:.3f} | {:.3f} |\n", pairs.pairs, m.scatter.pairs,
                 m.method, t.x(), t.y(), t.z(), m.scatter.rms_mm, m.scatter.median_mm, deg);
      json["rows"].push_back({{"pairs", pairs.pairs},
                              {"count", m.scatter.pairs},
                              {"method", m.method},
                              {"translation_mm", {t.x(), t.y(), t.z()}},
                              {"scatter_mm", m.scatter.rms_mm},
                              {"scatter_median_mm", m.scatter.median_mm},
                              {"scatter_deg", deg}});
    }
  }
  return json;
}

Json recordings() {
  Json json = Json::array();
  for (const RealHandEye& set : kRealHandEye) {
    const TemporaryFolder folder;
    const auto unpacked = unpack(set, folder.path());
    if (!unpacked) {
      fmt::print("\n{}: the recording is not there; set CRUMPLE_DATA\n", set.name);
      continue;
    }
    const auto comparison = compare_on_recording(set, *unpacked);
    if (comparison) {
      json.push_back(recording(set, *comparison));
    } else {
      fmt::print("\n{}: {}\n", set.name, comparison.error().message);
    }
  }
  return json;
}

int run() {
  std::vector<CampaignCase> cases;
  for (int i = 0; i < FLAGS_cases; ++i) cases.push_back(run_campaign_case(FLAGS_first_case + i));
  Json json{{"rows", Json::array()}};
  fmt::print(
      "| cases | count | method | median, deg | median, mm | beyond 5 deg or 50 mm |\n|---|---|---|---|---|---|\n");
  for (std::size_t kind = 0; kind <= kCampaignKinds.size(); ++kind) table(cases, kind, false, json["rows"]);
  table(cases, kCampaignKinds.size(), true, json["rows"]);
  json["ours"] = honesty(cases);
  json["recordings"] = recordings();
  std::filesystem::create_directories("out/bench");
  std::ofstream("out/bench/hand_eye.json") << json.dump(2) << '\n';
  return 0;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
