// How well a simulated rig is recovered from rendered images: estimate less truth in predicted sigmas, over campaigns
// that share nothing but the rig. Every kind of observation is also replaced by its truth, to see which of them a bias
// is of.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <nlohmann/json.hpp>

#include "calib/rig_truth.h"
#include "datasets/json_text.h"
#include "datasets/output_folder.h"
#include "datasets/scene_file.h"
#include "solvers/parallel.h"
#include "tests/benchmark/simulated_calibrations.h"

DEFINE_int32(seeds, 20, "campaigns, each with its own board poses, sampling and noise");
DEFINE_int32(first_seed, 1, "of the first campaign");
DEFINE_int32(placements, 100, "boards used at most, the scene's first ones");
DEFINE_string(orientations, "", "the scene's stripe orientations used, such as 0,2; empty: all");
DEFINE_int32(substituted_seeds, 4, "also calibrate so many of them from true corners, true stripes and both");
DEFINE_string(out, "out/bench/recovery.json", "the result");

namespace crumple {
namespace {

constexpr int threads = 2;
const auto began = std::chrono::steady_clock::now();

void say(const std::string& text) {
  fmt::print(stderr, "{:6.1f} s  {}\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(),
             text);
}

// One parameter over the seeds.
struct ParameterSeries {
  std::string name;
  std::vector<double> z;
  double error = 0;  // mean
  double sigma = 0;  // mean

  double mean() const {
    double sum = 0;
    for (double value : z) sum += value;
    return sum / static_cast<double>(z.size());
  }
  double rms() const {
    double sum = 0;
    for (double value : z) sum += value * value;
    return std::sqrt(sum / static_cast<double>(z.size()));
  }
  double spread() const { return std::sqrt(std::max(0.0, rms() * rms() - mean() * mean())); }
  double largest() const {
    double most = 0;
    for (double value : z) most = std::max(most, std::abs(value));
    return most;
  }
};

// Every seed's calibration from one kind of data.
struct Series {
  std::string name;
  std::vector<ParameterSeries> parameters;
  double corner_sigma_px = 0;  // means of the estimates
  double stripe_sigma_px = 0;
  double corner_inflation = 0;
  double stripe_inflation = 0;

  double share_within(double limit) const {
    double within = 0, count = 0;
    for (const ParameterSeries& p : parameters) {
      for (double z : p.z) within += std::abs(z) <= limit ? 1 : 0;
      count += static_cast<double>(p.z.size());
    }
    return within / count;
  }
  double rms() const {
    double squares = 0;
    for (const ParameterSeries& p : parameters) squares += p.rms() * p.rms();
    return std::sqrt(squares / static_cast<double>(parameters.size()));
  }
};

double group_sigma(const Calibration& calibration, View::Kind kind) {
  for (const GroupSummary& group : calibration.bundle.groups) {
    if (group.kind == kind) return group.sigma_px;
  }
  return 0;
}

void add(const std::vector<ParameterTruth>& parameters, double share, Series& series) {
  series.parameters.resize(parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    ParameterSeries& to = series.parameters[i];
    to.name = parameters[i].name;
    to.z.push_back(parameters[i].z);
    to.error += share * parameters[i].error;
    to.sigma += share * parameters[i].sigma;
  }
}

Expected<Series> calibrate_all(const std::string& name, const Scene& scene, const std::vector<CalibrationData>& all) {
  std::vector<Expected<Calibration>> calibrations(all.size(), fail("not calibrated"));
  parallel_for(all.size(), threads, [&](std::size_t i) { calibrations[i] = calibrate(all[i], {}); });
  Series series;
  series.name = name;
  const double share = 1 / static_cast<double>(all.size());
  for (const auto& calibration : calibrations) {
    if (!calibration) return tl::unexpected(calibration.error());
    const auto compared = compare_with_true_rig(calibrated_rig(*calibration), true_rig(scene));
    if (!compared) return tl::unexpected(compared.error());
    add(compared->parameters, share, series);
    series.corner_sigma_px += share * group_sigma(*calibration, View::Kind::corners);
    series.stripe_sigma_px += share * group_sigma(*calibration, View::Kind::stripes);
    series.corner_inflation += share * calibration->inflation.corners;
    series.stripe_inflation += share * calibration->inflation.stripes;
  }
  say(fmt::format("{}: calibrated", name));
  return series;
}

void print(const Series& series) {
  fmt::print("\n{}: corners {:.4f} px, {:.2f} count as one; stripes {:.4f} px, {:.2f} count as one\n", series.name,
             series.corner_sigma_px, series.corner_inflation, series.stripe_sigma_px, series.stripe_inflation);
  fmt::print("| parameter | mean error | predicted sigma | mean z | spread of z | rms z | max abs z |\n");
  fmt::print("|---|---:|---:|---:|---:|---:|---:|\n");
  for (const ParameterSeries& p : series.parameters) {
    fmt::print("| {} | {:+.3g} | {:.3g} | {:+.2f} | {:.2f} | {:.2f} | {:.2f} |\n", p.name, p.error, p.sigma, p.mean(),
               p.spread(), p.rms(), p.largest());
  }
  fmt::print("within 1, 2, 3 sigma: {:.1f} %, {:.1f} %, {:.1f} %; rms z {:.2f}\n", 100 * series.share_within(1),
             100 * series.share_within(2), 100 * series.share_within(3), series.rms());
  std::fflush(stdout);
}

Expected<std::vector<Series>> all_series(const Scene& scene, const std::vector<SimulatedCalibration>& simulated) {
  std::vector<CalibrationData> data;
  for (const auto& one : simulated) data.push_back(one.data);
  const auto observed = calibrate_all("as observed", scene, data);
  if (!observed) return tl::unexpected(observed.error());
  print(*observed);
  std::vector<Series> all{*observed};
  if (FLAGS_substituted_seeds < 1) return all;
  data.resize(std::min(data.size(), static_cast<std::size_t>(FLAGS_substituted_seeds)));
  const double corners = observed->corner_sigma_px, stripes = observed->stripe_sigma_px;
  for (const auto& [name, true_corners, true_stripes] :
       {std::tuple("true corners", true, false), {"true stripes", false, true}, {"both true", true, true}}) {
    for (std::size_t i = 0; i < data.size(); ++i) {
      data[i] = simulated[i].data;
      if (true_corners) data[i].observations.corners = with_true_corners(simulated[i], corners).observations.corners;
      if (true_stripes) data[i].observations.stripes = with_true_stripes(simulated[i], stripes).observations.stripes;
    }
    auto series = calibrate_all(name, scene, data);
    if (!series) return tl::unexpected(series.error());
    print(*series);
    all.push_back(std::move(*series));
  }
  return all;
}

nlohmann::json document(const Series& series) {
  nlohmann::json parameters = nlohmann::json::array();
  for (const ParameterSeries& p : series.parameters) {
    parameters.push_back({{"name", p.name},
                          {"mean_error", p.error},
                          {"mean_sigma", p.sigma},
                          {"mean_z", p.mean()},
                          {"rms_z", p.rms()},
                          {"max_abs_z", p.largest()},
                          {"z", p.z}});
  }
  return {{"observations", series.name},
          {"parameters", parameters},
          {"share_within_3_sigma", series.share_within(3)},
          {"rms_z", series.rms()},
          {"corner_sigma_px", series.corner_sigma_px},
          {"stripe_sigma_px", series.stripe_sigma_px},
          {"corner_inflation", series.corner_inflation},
          {"stripe_inflation", series.stripe_inflation}};
}

// Keeps the orientations listed, and their frames.
void choose_orientations(const std::string& list, Scene& scene) {
  std::vector<StripeOrientation> kept;
  std::vector<std::optional<std::size_t>> new_index(scene.orientations.size());
  std::istringstream text(list);
  for (std::string word; std::getline(text, word, ',');) {
    const std::size_t index = std::min<std::size_t>(std::stoul(word), scene.orientations.size() - 1);
    new_index[index] = kept.size();
    kept.push_back(scene.orientations[index]);
  }
  scene.orientations = kept;
  std::erase_if(scene.frames, [&](const FrameContent& frame) {
    return frame.kind == FrameContent::Kind::stripes && !new_index[frame.orientation];
  });
  for (FrameContent& frame : scene.frames) {
    if (frame.kind == FrameContent::Kind::stripes) frame.orientation = *new_index[frame.orientation];
  }
}

Scene chosen(Scene scene) {
  std::erase_if(scene.stations, [](const SceneStation& station) { return !station.board; });
  scene.stations.resize(std::min(scene.stations.size(), static_cast<std::size_t>(FLAGS_placements)));
  if (!FLAGS_orientations.empty()) choose_orientations(FLAGS_orientations, scene);
  return scene;
}

Expected<void> run() {
  const auto read = read_scene(CRUMPLE_SOURCE_DIR "/datasets/scenes/door.yaml");
  if (!read) return tl::unexpected(read.error());
  const Scene scene = chosen(*read);
  std::vector<std::uint64_t> seeds;
  std::vector<SimulatedCalibration> simulated;
  for (int i = 0; i < FLAGS_seeds; ++i) {
    seeds.push_back(static_cast<std::uint64_t>(FLAGS_first_seed + i));
    auto one = simulate_calibration(redrawn(scene, seeds.back()), threads);
    if (!one) return tl::unexpected(one.error());
    simulated.push_back(std::move(*one));
    say(fmt::format("seed {} rendered and measured", seeds.back()));
  }
  const ObservationErrors errors = observation_errors(simulated);
  fmt::print("corners: rms {:.4f} px, mean over a view {:.4f} px rms, over all {:+.4f} {:+.4f} px\n",
             errors.corner_rms_px, errors.corner_view_mean_rms_px, errors.corner_mean_px.x(),
             errors.corner_mean_px.y());
  fmt::print("stripes: rms {:.4f} px, mean over a view {:.4f} px rms, over all {:+.4f} px\n", errors.stripe_rms_px,
             errors.stripe_view_mean_rms_px, errors.stripe_mean_px);
  const auto all = all_series(scene, simulated);
  if (!all) return tl::unexpected(all.error());

  nlohmann::json list = nlohmann::json::array();
  for (const Series& series : *all) list.push_back(document(series));
  const bool met = all->front().share_within(3) >= 0.99;
  fmt::print("\n99 % within 3 predicted sigma: {}\n", met ? "met" : "not met");
  const auto text = json_text({{"seeds", seeds},
                               {"placements", scene.stations.size()},
                               {"orientations", scene.orientations.size()},
                               {"met", met},
                               {"corner_rms_px", errors.corner_rms_px},
                               {"corner_view_mean_rms_px", errors.corner_view_mean_rms_px},
                               {"stripe_rms_px", errors.stripe_rms_px},
                               {"stripe_view_mean_rms_px", errors.stripe_view_mean_rms_px},
                               {"series", list}});
  if (!text) return tl::unexpected(text.error());
  const std::filesystem::path file(FLAGS_out);
  std::error_code failure;
  if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), failure);
  return write_file(file, *text);
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  const auto done = crumple::run();
  if (!done) fmt::print(stderr, "recovery: {}\n", done.error().message);
  return done ? 0 : 1;
}
