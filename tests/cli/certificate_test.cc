// A board's certificate through the program: its relative uncertainty is in the summary, in the report and in every
// length that is measured with the rig.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/cloud_file.h"
#include "tests/cli/simulated_capture.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;

// As certified_board says: an aluminium board, 12 K warmer than when it was measured.
constexpr double kPitch_mm = 24, kPitchSigma_mm = 0.0012, kWarmer_k = 12, kTemperatureSigma_k = 1.5;
constexpr double kExpansion_per_k = 23e-6, kExpansionSigma_per_k = 2e-6;
const std::string certified_board = R"(operator: A. Surveyor
date: 2026-02-03
temperature_c: 32
temperature_sigma_k: 1.5
board:
  kind: chessboard
  inner_corners: [9, 6]
  pitch_mm: 24
  certificate:
    pitch_sigma_mm: 0.0012
    temperature_c: 20
    expansion_per_k: 23.0e-6
    expansion_sigma_per_k: 2.0e-6
    flatness_mm: 0.4
    serial: B-12
    issuer: a laboratory
    date: 2025-11-30
)";

double relative_sigma() {
  return std::sqrt(std::pow(kPitchSigma_mm / kPitch_mm, 2) + std::pow(kExpansion_per_k * kTemperatureSigma_k, 2) +
                   std::pow(kExpansionSigma_per_k * kWarmer_k, 2));
}

// Rendered once for all tests of a program run, and calibrated with the certificate and without.
class CertifiedBoard {
 public:
  static const CertifiedBoard& get() {
    static const CertifiedBoard board;
    return board;
  }

  const ProgramRun& certified() const { return certified_; }
  const ProgramRun& uncertified() const { return uncertified_; }
  std::filesystem::path description() const { return home_ / "capture/capture.yaml"; }
  std::filesystem::path rig() const { return home_ / "rig"; }

  // Of a description beside the capture's own, with a line of that left out.
  ProgramRun calibrate_without(const std::string& line, const std::filesystem::path& out) const {
    const std::filesystem::path file = home_ / "capture/less.yaml";
    EXPECT_THAT(content_of(description()), HasSubstr(line));
    std::filesystem::copy_file(description(), file, std::filesystem::copy_options::overwrite_existing);
    replace_in(file, line, "");
    return run_program(
        fmt::format("calibrate '{}' --nooverlays --noreport --json --out='{}'", file.string(), out.string()));
  }

 private:
  CertifiedBoard() {
    const ProgramRun rendered =
        run_program(fmt::format("simulate '{}' --nodepth_maps --out='{}'", small_scene, (home_ / "capture").string()));
    EXPECT_EQ(rendered.exit_code, 0) << rendered.err;
    uncertified_ = calibrate("--noreport", home_ / "without");
    const std::string board = "board: {kind: chessboard, inner_corners: [9, 6], pitch_mm: 24}\n";
    EXPECT_THAT(content_of(description()), HasSubstr(board));
    replace_in(description(), board, certified_board);
    replace_in(description(), "    kind: camera\n", "    kind: camera\n    serial: C-0815\n");
    certified_ = calibrate("", rig());
  }

  ProgramRun calibrate(const std::string& flags, const std::filesystem::path& out) const {
    return run_program(
        fmt::format("calibrate '{}' --nooverlays --json {} --out='{}'", description().string(), flags, out.string()));
  }

  TemporaryFolder home_;
  ProgramRun certified_;
  ProgramRun uncertified_;
};

bool says(const json& sentences, const std::string& words) {
  return std::any_of(sentences.begin(), sentences.end(), [&](const json& sentence) {
    return sentence.get<std::string>().find(words) != std::string::npos;
  });
}

// One camera and one projector see one board: images tell nothing of its size, and the scale stays as certified.
TEST(CertificateVerbs, CalibrateStatesTheScalesUncertainty) {
  const ProgramRun& run = CertifiedBoard::get().certified();
  ASSERT_THAT(run.exit_code, AnyOf(0, 4)) << run.err;  // four placements are few
  const json summary = json::parse(run.out);
  ASSERT_TRUE(summary["scale_uncertainty"].is_number()) << summary["scale_uncertainty"];
  EXPECT_NEAR(summary["scale_uncertainty"], relative_sigma(), 1e-6 * relative_sigma());
  EXPECT_FALSE(summary.contains("scale_uncertainty_lacks"));
  EXPECT_NEAR(summary["boards"]["board"]["scale"], 1 + kExpansion_per_k * kWarmer_k, 1e-9);
  EXPECT_FALSE(says(summary["notes"], "unknown")) << summary["notes"];
}

TEST(CertificateVerbs, WithoutACertificateTheScaleIsSaidToBeUnknown) {
  const ProgramRun& run = CertifiedBoard::get().uncertified();
  ASSERT_THAT(run.exit_code, AnyOf(0, 4)) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_THAT(summary["scale_uncertainty"].get<std::string>(), HasSubstr("unknown"));
  EXPECT_TRUE(says(summary["notes"], "the scale's uncertainty is unknown")) << summary["notes"];
}

TEST(CertificateVerbs, TheSummaryTellsWhoWithWhatAndHowWarm) {
  const json capture = json::parse(CertifiedBoard::get().certified().out)["capture"];
  EXPECT_EQ(capture["operator"], "A. Surveyor");
  EXPECT_EQ(capture["date"], "2026-02-03");
  EXPECT_EQ(capture["temperature_c"], 32);
  EXPECT_EQ(capture["temperature_sigma_k"], kTemperatureSigma_k);
  ASSERT_EQ(capture["serials"].size(), 1U) << capture;  // the projector's is not stated
  EXPECT_EQ(*capture["serials"].begin(), "C-0815");
  EXPECT_EQ(capture["certificates"]["boards"]["board"], json({{"pitch_sigma_mm", kPitchSigma_mm},
                                                              {"temperature_c", 20.0},
                                                              {"expansion_per_k", kExpansion_per_k},
                                                              {"expansion_sigma_per_k", kExpansionSigma_per_k},
                                                              {"flatness_mm", 0.4},
                                                              {"serial", "B-12"},
                                                              {"issuer", "a laboratory"},
                                                              {"date", "2025-11-30"}}));
  const json uncertified = json::parse(CertifiedBoard::get().uncertified().out)["capture"];
  EXPECT_EQ(uncertified.size(), 1U) << uncertified;
  EXPECT_TRUE(uncertified["title"].is_string());
}

TEST(CertificateVerbs, TheReportTellsWhoWithWhatAndHowWarm) {
  const std::string report = content_of(CertifiedBoard::get().rig() / "report.html");
  EXPECT_THAT(report, HasSubstr("A. Surveyor"));
  EXPECT_THAT(report, HasSubstr("C-0815"));
  EXPECT_THAT(report, HasSubstr("32 °C, standard uncertainty 1.5 K"));
  EXPECT_THAT(report, HasSubstr("certificate B-12 by a laboratory, 2025-11-30"));
  EXPECT_THAT(report, HasSubstr("flatness 0.4 mm"));
  EXPECT_THAT(report, Not(HasSubstr("scale's uncertainty is unknown")));
}

// Two places of the panel that lie well within it and far apart.
std::string far_apart(const Cloud& cloud) {
  std::vector<Eigen::Vector3d> points;
  for (const CloudPoint& point : cloud.points) points.push_back(point.position_mm);
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  std::string plan = "schema: crumple-measure/1\npoints:\n";
  for (const auto& [name, at] :
       {std::pair("left", points[points.size() / 8]), std::pair("right", points[points.size() * 7 / 8])}) {
    plan += fmt::format("  {}: {{near_mm: [{}, {}, {}], radius_mm: 5}}\n", name, at.x(), at.y(), at.z());
  }
  return plan + "distances: [[left, right]]\n";
}

// From the certificate through the rig and the cloud to what is measured.
TEST(CertificateVerbs, WhatTheCertificateLacksIsSaidOfAMeasuredDistance) {
  const CertifiedBoard& board = CertifiedBoard::get();
  const TemporaryFolder home;
  const std::string lack = "the standard uncertainty of the thermal expansion of board 'board' is not stated";
  const ProgramRun calibrated = board.calibrate_without("    expansion_sigma_per_k: 2.0e-6\n", home / "rig");
  ASSERT_THAT(calibrated.exit_code, AnyOf(0, 4)) << calibrated.err;
  const json summary = json::parse(calibrated.out);
  EXPECT_EQ(summary["scale_uncertainty_lacks"], lack);
  EXPECT_TRUE(says(summary["notes"], lack)) << summary["notes"];
  EXPECT_FALSE(summary["capture"]["certificates"]["boards"]["board"].contains("expansion_sigma_per_k"));
  const ProgramRun reconstructed =
      run_program(fmt::format("reconstruct '{}' --rig='{}' --stations=panel_1 --json --out='{}'",
                              board.description().string(), (home / "rig").string(), (home / "cloud").string()));
  ASSERT_EQ(reconstructed.exit_code, 0) << reconstructed.err;
  const json cloud = json::parse(reconstructed.out);
  EXPECT_EQ(cloud["uncertainty"]["scale_lacks"], json::array({lack}));
  write_content(home / "plan.yaml", far_apart(read_cloud(home / "cloud/cloud.ply").value()));
  const std::string measure =
      fmt::format("measure '{}' --points='{}'", (home / "cloud").string(), (home / "plan.yaml").string());
  EXPECT_EQ(json::parse(run_program(measure + " --json").out)["scale_lacks"], json::array({lack}));
  EXPECT_THAT(run_program(measure).out, HasSubstr("scale uncertainty incomplete: " + lack));
}

TEST(CertificateVerbs, AMeasuredDistanceHoldsTheScalesUncertainty) {
  const CertifiedBoard& board = CertifiedBoard::get();
  const TemporaryFolder home;
  const ProgramRun reconstructed =
      run_program(fmt::format("reconstruct '{}' --rig='{}' --stations=panel_1 --out='{}'", board.description().string(),
                              board.rig().string(), (home / "cloud").string()));
  ASSERT_EQ(reconstructed.exit_code, 0) << reconstructed.err;
  write_content(home / "plan.yaml", far_apart(read_cloud(home / "cloud/cloud.ply").value()));
  const ProgramRun run = run_program(
      fmt::format("measure '{}' --points='{}' --json", (home / "cloud").string(), (home / "plan.yaml").string()));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(run.out);
  EXPECT_TRUE(document["scale_known"]);
  EXPECT_FALSE(document.contains("scale_lacks"));
  const json& distance = document["distances_mm"][0];
  const double length_mm = distance["value"], u = distance["u"];
  EXPECT_GT(length_mm, 100);
  // The board's scale is 1 + kExpansion_per_k kWarmer_k: of that, its uncertainty is so much less a share.
  const double share = relative_sigma() / (1 + kExpansion_per_k * kWarmer_k);
  EXPECT_NEAR(distance["budget"]["scale"], share * length_mm, 1e-5 * share * length_mm);
  double variance = 0;
  for (const json& part : distance["budget"]) variance += std::pow(part.get<double>(), 2);
  EXPECT_NEAR(u, std::sqrt(variance), 1e-9);
  EXPECT_NEAR(distance["U"], 2 * u, 1e-12);
}

}  // namespace
}  // namespace crumple
