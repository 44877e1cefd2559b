// `crumple measure` on a made cloud: two spheres and a plate before a tracked probe at two stations.
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/cloud_file.h"
#include "datasets/stations_file.h"
#include "tests/calib/sphere_cap.h"
#include "tests/calib/tracked_probe.h"
#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string list_of(const Eigen::Vector3d& x) { return fmt::format("[{}, {}, {}]", x.x(), x.y(), x.z()); }

class MeasureVerb : public testing::Test {
 protected:
  MeasureVerb() {
    TrackedProbe probe;
    Eigen::VectorXd sigma(probe.size());
    for (Eigen::Index i = 0; i < sigma.size(); ++i) sigma[i] = probe.scale_of(static_cast<std::size_t>(i));
    probe.truth.rig.covariance.matrix = Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal());
    StationPoses poses = probe.poses(probe.truth.rig, probe.readings);
    poses.stations[1].name = "second";
    const Pose &first = poses.stations[0].world_from_probe, &second = poses.stations[1].world_from_probe;
    left_ = first * Eigen::Vector3d(-70, 5, 800);
    right_ = first * Eigen::Vector3d(75, -10, 820);
    plate_ = second * Eigen::Vector3d(0, 0, 1150);
    top_ = second * Eigen::Vector3d(20, 20, 1150);
    Cloud cloud{"world", {"station", "second"}, {}};
    constexpr double kSigma_mm = 0.02;
    add_points(sphere_cap(first, first.inverse() * left_, 25, 1.0, 14), 0, first, kSigma_mm, cloud);
    add_points(sphere_cap(first, first.inverse() * right_, 25, 1.0, 14), 0, first, kSigma_mm, cloud);
    std::vector<Eigen::Vector3d> flat;
    for (int x = -12; x <= 12; ++x) {
      for (int y = -9; y <= 9; ++y) flat.emplace_back(second * Eigen::Vector3d(5 * x, 5 * y, 1150));
    }
    add_points(flat, 1, second, kSigma_mm, cloud);
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0, kSigma_mm);
    for (CloudPoint& point : cloud.points) point.position_mm += normal(random) * point.normal.cast<double>();
    std::filesystem::create_directory(home_ / "cloud");
    EXPECT_TRUE(write_cloud(home_ / "cloud/cloud.ply", cloud));
    EXPECT_TRUE(write_stations(home_ / "cloud", probe.truth.rig, poses));
  }

  ProgramRun measure(const std::string& plan, const std::string& flag = "--points",
                     const std::string& more = "") const {
    write_content(home_ / "plan.yaml", plan);
    return run_program("measure '" + (home_ / "cloud").string() + "' " + flag + "='" + (home_ / "plan.yaml").string() +
                       "' " + more);
  }
  void expect_refused(const std::string& plan, const std::string& said, const std::string& flag = "--points") const {
    const ProgramRun run = measure(plan, flag);
    EXPECT_EQ(run.exit_code, 3) << plan;
    EXPECT_THAT(run.err, HasSubstr(said)) << plan;
  }

  std::string spheres() const {
    return fmt::format("spheres:\n  left: {{near_mm: {}, radius_mm: 25}}\n  right: {{near_mm: {}, radius_mm: 25}}\n",
                       list_of(left_ + Eigen::Vector3d(2, -1, 3)), list_of(right_));
  }
  std::string artefacts(double diameter_mm) const {
    const auto sphere = [&](const Eigen::Vector3d& centre) {
      return fmt::format("{{near_mm: {}, diameter_mm: {}, diameter_sigma_mm: 0.001}}", list_of(centre), diameter_mm);
    };
    return fmt::format(
        "schema: crumple-vdi2634/1\nspheres:\n  left: {}\n  right: {}\nplates:\n  plate: {{near_mm: {}, radius_mm: "
        "40}}\n"
        "ball_bars:\n  bar: {{spheres: [left, right], length_mm: {}, length_sigma_mm: 0.002}}\n",
        sphere(left_), sphere(right_), list_of(plate_), (right_ - left_).norm());
  }

  // Of a board, by a certificate that lacks what is said.
  void know_scale(const std::vector<std::string>& lacks) const {
    StationsAndRig known = read_stations(home_ / "cloud").value();
    RigCovariance& covariance = known.rig.covariance;
    const auto rows = static_cast<Eigen::Index>(covariance.names.size()) + 1;
    covariance.names.emplace_back("board.scale");
    covariance.matrix.conservativeResizeLike(Eigen::MatrixXd::Zero(rows, rows));
    covariance.matrix(rows - 1, rows - 1) = 1e-10;
    known.poses.d_rig.conservativeResizeLike(Eigen::MatrixXd::Zero(known.poses.d_rig.rows(), rows));
    known.rig.scale_lacks = lacks;
    ASSERT_TRUE(write_stations(home_ / "cloud", known.rig, known.poses));
  }

  TemporaryFolder home_;
  Eigen::Vector3d left_, right_, plate_, top_;
};

constexpr const char* kHead = "schema: crumple-measure/1\n";

TEST_F(MeasureVerb, ValuesComeWithTheirBudget) {
  const ProgramRun run = measure(
      kHead + spheres() +
          fmt::format(
              "planes:\n  plate: {{near_mm: {}, radius_mm: 40}}\npoints:\n  top: {{near_mm: {}, radius_mm: 4}}\n",
              list_of(plate_), list_of(top_)) +
          "distances: [[left, right], [plate, left]]\nangles: [[left, top, right]]\n",
      "--points", "--json --out='" + (home_ / "out").string() + "'");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(run.out);
  EXPECT_EQ(json::parse(content_of(home_ / "out/summary.json")), document);
  EXPECT_FALSE(document["scale_known"]);
  const json& apart = document["distances_mm"][0];
  EXPECT_EQ(apart["of"], json({"left", "right"}));
  EXPECT_NEAR(apart["value"], (right_ - left_).norm(), 0.03);
  EXPECT_TRUE(apart["budget"]["scale"].is_null());
  EXPECT_GT(apart["budget"]["calibration"], 0);
  EXPECT_NEAR(apart["U"], 2 * apart["u"].get<double>(), 1e-12);
  // The other station's pose makes a distance to it far less sure than one within a station.
  EXPECT_GT(document["distances_mm"][1]["budget"]["station"], 5 * apart["budget"]["station"].get<double>());
  EXPECT_EQ(document["angles_deg"].size(), 1U);
  const auto plate_at = std::find_if(document["features"].begin(), document["features"].end(),
                                     [](const json& feature) { return feature["name"] == "plate"; });
  ASSERT_NE(plate_at, document["features"].end());
  const json& plate = *plate_at;
  ASSERT_EQ(plate["normal_tilts_mrad"].size(), 2U);
  const json &more = plate["normal_tilts_mrad"][0], &less = plate["normal_tilts_mrad"][1];
  EXPECT_GE(more["u"], less["u"]);
  // Of a plate of 40 mm radius, 25 mm^2 to a point: decoding alone tilts it by sigma over the root of sum x^2.
  const double inflated = std::sqrt(plate["decoding_inflation"].get<double>());
  EXPECT_NEAR(less["budget"]["decoding"].get<double>() / inflated, 1e3 * 0.02 / std::sqrt(200 * 400), 0.01);
  EXPECT_EQ(less["k"], 2);
  EXPECT_NEAR(less["U"], 2 * less["u"].get<double>(), 1e-12);
  EXPECT_FALSE(less.contains("value"));
  double across = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    across += more["about"][axis].get<double>() * plate["normal"][axis].get<double>();
  }
  EXPECT_NEAR(across, 0, 1e-12);
  const ProgramRun text = measure(kHead + spheres() + "distances: [[left, right]]\n");
  EXPECT_THAT(text.out, HasSubstr("left - right"));
  EXPECT_THAT(text.out, Not(HasSubstr("tilts")));
  EXPECT_THAT(text.out, HasSubstr("scale uncertainty unknown: no board had a certificate"));
}

// The numbers of a line of the text that starts with a name, from a heading on.
std::vector<double> numbers_of(const std::string& text, const std::string& heading, const std::string& name) {
  std::istringstream line(text.substr(text.find("\n  " + name + " ", text.find(heading)) + 3 + name.size()));
  std::vector<double> numbers;
  for (double number = 0; line.peek() != '\n' && line >> number;) numbers.push_back(number);
  return numbers;
}

TEST_F(MeasureVerb, TheTextTellsExpandedUncertaintiesOfPointsAndNormals) {
  const std::string plan =
      kHead + fmt::format(
                  "planes:\n  plate: {{near_mm: {}, radius_mm: 40}}\npoints:\n  top: {{near_mm: {}, "
                  "radius_mm: 4}}\n",
                  list_of(plate_), list_of(top_));
  const ProgramRun run = measure(plan), document_run = measure(plan, "--points", "--json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(document_run.out);
  for (const json& feature : document["features"]) {
    const std::vector<double> row = numbers_of(run.out, "positions (mm)", feature["name"]);
    ASSERT_EQ(row.size(), 9U) << run.out;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(row[axis], feature["position_mm"][axis]["value"], 1e-4);
      EXPECT_NEAR(row[3 + axis], feature["position_mm"][axis]["u"], 1e-4);
      EXPECT_NEAR(row[6 + axis], feature["position_mm"][axis]["U"], 1e-4);
    }
    if (feature["kind"] != "plane") continue;
    const json& tilt = feature["normal_tilts_mrad"][0];
    const std::vector<double> said = numbers_of(run.out, "tilts (mrad)", feature["name"]);
    ASSERT_EQ(said.size(), 5U) << run.out;  // then the scale, which is unknown
    EXPECT_NEAR(said[1], tilt["about"][1], 1e-6);
    EXPECT_NEAR(said[3], tilt["u"], 1e-4);
    EXPECT_NEAR(said[4], tilt["U"], 1e-4);
  }
}

TEST_F(MeasureVerb, ArtefactsAreHeldAgainstTheirCertificates) {
  const ProgramRun run = measure(artefacts(50), "--vdi2634", "--json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(run.out);
  EXPECT_TRUE(document["accepted"].is_null());
  ASSERT_EQ(document["results"].size(), 7U);
  for (const json& result : document["results"]) {
    if (result.contains("predicted_mm")) {
      EXPECT_NEAR(result["observed_mm"].get<double>() / result["predicted_mm"].get<double>(), 1, 0.3) << result;
    } else {
      EXPECT_TRUE(result["within_U"]) << result;
      EXPECT_NEAR(result["budget"]["certificate"], 0.0016, 0.0008) << result;
    }
  }
  const ProgramRun wrong = measure(artefacts(49.5) + "limits_mm: {probing_size: 0.1}\n", "--vdi2634");
  EXPECT_EQ(wrong.exit_code, 4);
  EXPECT_THAT(wrong.out, HasSubstr("beyond U  limit 0.1 exceeded"));
  EXPECT_THAT(wrong.out, HasSubstr("not accepted"));
}

// A limit that the observed value keeps by less than the certificate's uncertainty is not kept.
TEST_F(MeasureVerb, ALimitIsKeptBeyondTheCertificatesUncertaintyOnly) {
  const json sizes = json::parse(measure(artefacts(50), "--vdi2634", "--json").out)["results"];
  double largest_mm = 0;
  for (const json& result : sizes) {
    if (result["what"] == "probing_size") {
      largest_mm = std::max(largest_mm, std::abs(result["observed_mm"].get<double>()));
    }
  }
  const auto judged = [&](double limit_mm) {
    const ProgramRun run =
        measure(artefacts(50) + fmt::format("limits_mm: {{probing_size: {}}}\n", limit_mm), "--vdi2634", "--json");
    std::vector<std::string> verdicts;
    const json document = json::parse(run.out);
    for (const json& result : document["results"]) {
      if (result.contains("limit")) verdicts.push_back(result["limit"]);
    }
    EXPECT_EQ(run.exit_code, document["accepted"] ? 0 : 4);
    return verdicts;
  };
  EXPECT_THAT(judged(largest_mm + 0.01), testing::Each("kept"));
  EXPECT_THAT(judged(largest_mm + 1e-5), testing::Contains("undecided"));
}

TEST_F(MeasureVerb, ATestWithFewPositionsIsSaidToBeReduced) {
  const json positions = json::parse(measure(artefacts(50), "--vdi2634", "--json").out)["positions"];
  EXPECT_EQ(positions, (json{{"spheres", 2}, {"ball_bars", 1}, {"plates", 1}, {"complete", false}}));
  EXPECT_THAT(measure(artefacts(50), "--vdi2634").out,
              HasSubstr("a reduced test: part 2 asks for 10 positions of a sphere, 7 of a ball bar and 6 of a plate, "
                        "here are 2, 1 and 1"));
}

TEST_F(MeasureVerb, AScaleThatIsKnownInPartIsSaidToBe) {
  know_scale({"the expansion is not stated", "the temperature is not stated"});
  const std::string sentence =
      "scale uncertainty incomplete: the expansion is not stated; the temperature is not stated";
  const std::string plan = kHead + spheres() + "distances: [[left, right]]\n";
  for (const auto& [flag, text] : {std::pair("--points", plan), std::pair("--vdi2634", artefacts(50))}) {
    const ProgramRun said = measure(text, flag), document_run = measure(text, flag, "--json");
    ASSERT_EQ(said.exit_code, 0) << said.err;
    EXPECT_THAT(said.out, HasSubstr(sentence));
    const json document = json::parse(document_run.out);
    EXPECT_TRUE(document["scale_known"]);
    EXPECT_EQ(document["scale_lacks"], json({"the expansion is not stated", "the temperature is not stated"}));
  }
  EXPECT_THAT(measure(plan).out, HasSubstr(">=0.0000"));
}

TEST_F(MeasureVerb, AScaleThatIsKnownCompletelyGoesWithoutSaying) {
  know_scale({});
  const std::string plan = kHead + spheres() + "distances: [[left, right]]\n";
  EXPECT_THAT(measure(plan).out, AllOf(Not(HasSubstr("scale uncertainty")), Not(HasSubstr(">="))));
  const json document = json::parse(measure(plan, "--points", "--json").out);
  EXPECT_TRUE(document["scale_known"]);
  EXPECT_FALSE(document.contains("scale_lacks"));
}

TEST_F(MeasureVerb, PlansThatCannotBeCarriedOutAreRefused) {
  expect_refused(kHead + spheres() + "distances: [[left, rihgt]]\n",
                 "plan.yaml:5:20: distances[0][1]: rihgt is no feature of this file; is it right?");
  expect_refused(kHead + spheres() + "angles: [[left, right]]\n", "must name two planes, or three points or spheres");
  expect_refused(kHead, "names nothing to measure");
  expect_refused("schema: crumple-measure/2\n" + spheres(), "crumple-measure/1");
  expect_refused(std::string(kHead) + "points:\n  lost: {near_mm: [0, 0, 0], radius_mm: 3}\n",
                 "point lost: no point of the cloud lies there");
  expect_refused(kHead + fmt::format("spheres:\n  big: {{near_mm: {}, radius_mm: 40}}\n", list_of(left_)),
                 "sphere big: ");
  expect_refused(artefacts(50) + "limits_mm: {probing: 1}\n", "probing", "--vdi2634");
  EXPECT_EQ(run_program("measure '" + (home_ / "cloud").string() + "'").exit_code, 2);
}

TEST_F(MeasureVerb, FoldersThatDoNotBelongTogetherAreRefused) {
  const std::string plan = kHead + spheres();
  Rig fewer = read_stations(home_ / "cloud")->rig;
  fewer.covariance.names.pop_back();
  const auto rows = static_cast<Eigen::Index>(fewer.covariance.names.size());
  fewer.covariance.matrix = fewer.covariance.matrix.topLeftCorner(rows, rows).eval();
  replace_in(home_ / "cloud/stations.yaml", "station: \"second\"", "station: \"third\"");
  expect_refused(plan, "must be one of the stations above");
  replace_in(home_ / "cloud/stations.yaml", "station: \"third\"", "station: \"station\"");
  ASSERT_EQ(measure(plan).exit_code, 0);
  ASSERT_TRUE(write_stations(home_ / "cloud", fewer, read_stations(home_ / "cloud")->poses));
  expect_refused(plan, "stations_d_rig.npy: it is");
  std::filesystem::remove(home_ / "cloud/stations.yaml");
  expect_refused(plan, "holds no stations.yaml");
}

}  // namespace
}  // namespace crumple
