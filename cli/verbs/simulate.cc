// simulate: a scene's description -> a capture with ground truth.
#include "datasets/simulate.h"

#include <algorithm>
#include <chrono>
#include <regex>

#include <fmt/format.h>
#include <gflags/gflags.h>

#include "cli/flags.h"
#include "cli/progress.h"
#include "cli/record.h"
#include "cli/verbs/verbs.h"
#include "datasets/bag.h"
#include "datasets/output_folder.h"
#include "datasets/scene_file.h"

DEFINE_int32(seed, -1, "seed of the noise and the sampling, 0 or more; -1: the scene's own");
DEFINE_bool(depth_maps, true, "write the true depth per camera pixel into truth/STATION");

namespace crumple {
namespace {

// truth/scene.yaml has to state the seed that was used.
std::string with_seed(const std::string& scene_text, std::uint64_t seed) {
  const std::regex line("(^|\n)seed:[^\n]*");
  const std::string stated = fmt::format("seed: {}", seed);
  if (std::regex_search(scene_text, line)) return std::regex_replace(scene_text, line, "$1" + stated);
  return scene_text + (scene_text.ends_with('\n') ? "" : "\n") + stated + "\n";
}

Expected<void> keep_stations(Scene& scene, const std::vector<std::string>& ids) {
  const auto chosen = [&](const SceneStation& station) {
    return std::find(ids.begin(), ids.end(), station.id) != ids.end();
  };
  for (const std::string& id : ids) {
    const bool known = std::any_of(scene.stations.begin(), scene.stations.end(),
                                   [&](const SceneStation& station) { return station.id == id; });
    if (!known) return fail(fmt::format("--stations: the scene has no station {}", id));
  }
  if (!ids.empty()) std::erase_if(scene.stations, [&](const SceneStation& station) { return !chosen(station); });
  return {};
}

Expected<void> write_bag(const Scene& scene, const std::string& scene_text, const std::filesystem::path& folder,
                         const SimulateOptions& options) {
  const std::filesystem::path payload = folder / "data";
  std::error_code failure;
  std::filesystem::create_directory(payload, failure);
  if (failure) return fail(fmt::format("{} cannot be made: {}", payload.string(), failure.message()));
  if (auto written = write_simulated_capture(scene, scene_text, payload, options); !written) return written;
  if (const auto tags = write_bag_tags(folder, {scene.name, date_of_run()}); !tags) return tl::unexpected(tags.error());
  return {};
}

nlohmann::json summary_json(const Scene& scene, std::size_t images, double seconds) {
  nlohmann::json stations = nlohmann::json::array();
  for (const SceneStation& station : scene.stations) stations.push_back(station.id);
  return {{"out", FLAGS_out},  {"title", scene.name}, {"stations", stations},
          {"images", images},  {"seed", scene.seed},  {"samples_per_pixel", scene.samples},
          {"seconds", seconds}};
}

Expected<VerbResult> run_simulate(const VerbContext& context) {
  const auto began = std::chrono::steady_clock::now();
  if (FLAGS_seed < -1) return usage_error(fmt::format("--seed={} is below 0.", FLAGS_seed));
  const std::filesystem::path file = context.inputs.front();
  auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  auto scene = parse_scene(*text, file.string());
  if (!scene) return tl::unexpected(scene.error());
  if (FLAGS_seed >= 0) {
    scene->seed = static_cast<std::uint64_t>(FLAGS_seed);
    *text = with_seed(*text, scene->seed);
  }
  if (auto kept = keep_stations(*scene, parse_names(FLAGS_stations)); !kept) return usage_error(kept.error().message);
  auto folder = OutputFolder::create(FLAGS_out, FLAGS_overwrite);
  if (!folder) return tl::unexpected(folder.error());

  const std::size_t images = image_count(*scene);
  {
    Progress progress("rendering", images);
    const SimulateOptions options{thread_count(), FLAGS_overwrite, FLAGS_depth_maps,
                                  [&progress](std::size_t, std::size_t) { progress.advance(); }};
    const auto written = FLAGS_bag ? write_bag(*scene, *text, folder->path(), options)
                                   : write_simulated_capture(*scene, *text, folder->path(), options);
    if (!written) return tl::unexpected(written.error());
  }
  if (auto done = commit_with_record(*folder, context, {file}, {{"scene", scene->seed}}); !done) {
    return tl::unexpected(done.error());
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  VerbResult result;
  result.text = fmt::format("{}: {} images at {} stations, seed {}, in {:.1f} s\nwritten to {}\n", scene->name, images,
                            scene->stations.size(), scene->seed, seconds, FLAGS_out);
  result.document = summary_json(*scene, images, seconds);
  return result;
}

}  // namespace

Verb simulate_verb() {
  return {.name = "simulate",
          .purpose = "render a scene as a capture, with the truth beside it",
          .usage = "SCENE.yaml --out=DIR [--flags]",
          .description =
              "Renders every frame of every camera at every station of the scene (docs/scenes.md), with the optics, "
              "light and noise it states, and writes what a real campaign would have left: capture.yaml and images. "
              "The folder truth/ holds the rig, the placements and the depth maps. With --bag all of it lies in data/, "
              "and `crumple check` verifies every file. --stations empty: all.",
          .example =
              "$ crumple simulate datasets/scenes/small.yaml --out=small\n"
              "A small board and a small panel: 180 images at 5 stations, seed 7, in 4.2 s\n"
              "written to small\n",
          .min_inputs = 1,
          .max_inputs = 1,
          .flags = {"out", "stations", "seed", "bag", "depth_maps", "threads", "overwrite", "json"},
          .required = {"out"},
          .run = run_simulate};
}

}  // namespace crumple
