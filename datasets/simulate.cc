#include "datasets/simulate.h"

#include <mutex>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

#include "datasets/image_io.h"
#include "datasets/output_folder.h"
#include "datasets/render/render.h"
#include "datasets/rig_file.h"
#include "datasets/simulate_yaml.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

Expected<void> make_folder(const fs::path& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) return fail(fmt::format("{} cannot be made: {}", folder.string(), failure.message()));
  return {};
}

Expected<void> write_depth(const fs::path& file, const cv::Mat1d& depth_mm) {
  cv::Mat1f single;
  depth_mm.convertTo(single, CV_32F);
  try {
    if (cv::imwrite(file.string(), single)) return {};
  } catch (const std::exception&) {
    // Said below: OpenCV's own words name no file.
  }
  return fail(fmt::format("{} cannot be written: check the folder, its permissions and the free space", file.string()));
}

Expected<void> write_truth(const Scene& scene, const std::string& scene_text, const fs::path& folder) {
  return make_folder(folder)
      .and_then([&] { return write_file(folder / "scene.yaml", scene_text); })
      .and_then([&] { return make_folder(folder / "rig"); })
      .and_then([&] { return write_rig(folder / "rig", true_rig(scene)); })
      .and_then([&] { return write_file(folder / "stations.yaml", true_stations_yaml(scene)); });
}

Expected<void> write_depth_maps(const Scene& scene, const Renderer& renderer, std::size_t station,
                                const fs::path& folder) {
  if (const auto made = make_folder(folder); !made) return made;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const TrueGeometry truth = renderer.true_geometry(station, i);
    const auto written = write_depth(folder / (scene.cameras[i].sensor.name + "_depth.tiff"), truth.depth_mm);
    if (!written) return written;
  }
  return {};
}

Expected<void> make_folders(const fs::path& station, const std::vector<SceneCamera>& cameras) {
  for (const SceneCamera& camera : cameras) {
    if (const auto made = make_folder(station / camera.sensor.name); !made) return made;
  }
  return {};
}

class ProgressCounter {
 public:
  ProgressCounter(const SimulateOptions& options, std::size_t total) : options_(options), total_(total) {}
  void count_one() {
    if (!options_.progress) return;
    const std::lock_guard lock(mutex_);
    options_.progress(++done_, total_);
  }

 private:
  const SimulateOptions& options_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::size_t total_;
};

}  // namespace

std::size_t image_count(const Scene& scene) {
  std::size_t count = 0;
  for (const SceneStation& station : scene.stations) {
    for (const SceneCamera& camera : scene.cameras) count += station.scan ? frames_of(scene, camera).size() : 0;
    if (station.trackers) count += scene.tracking.trackers.size() * scene.tracking.frames.size();
  }
  return count;
}

Expected<void> write_simulated_capture(const Scene& scene, const std::string& scene_text, const fs::path& folder,
                                       const SimulateOptions& options) {
  const auto described = write_file(folder / "capture.yaml", capture_yaml(scene)).and_then([&] {
    return write_truth(scene, scene_text, folder / "truth");
  });
  if (!described) return described;
  const Renderer renderer(scene, options.threads);
  ProgressCounter progress(options, image_count(scene));
  for (std::size_t station = 0; station < scene.stations.size(); ++station) {
    const std::string& id = scene.stations[station].id;
    const auto writer = [&](const std::vector<SceneCamera>& cameras) {
      return [&cameras, &folder, &id, &progress](const RenderedFrame& frame) -> Expected<void> {
        const std::string& camera = cameras[frame.camera].sensor.name;
        const auto written = write_png(folder / id / camera / fmt::format("{:03}.png", frame.frame), frame.image);
        if (!written) return tl::unexpected(written.error());
        progress.count_one();
        return {};
      };
    };
    if (scene.stations[station].trackers) {
      const auto rendered = make_folders(folder / id, scene.tracking.trackers).and_then([&] {
        return renderer.render_trackers(station, writer(scene.tracking.trackers));
      });
      if (!rendered) return rendered;
    }
    if (!scene.stations[station].scan) continue;
    const auto rendered = make_folders(folder / id, scene.cameras).and_then([&] {
      return renderer.render_station(station, writer(scene.cameras));
    });
    if (!rendered) return rendered;
    if (!options.depth_maps) continue;
    const auto mapped = write_depth_maps(scene, renderer, station, folder / "truth" / id);
    if (!mapped) return mapped;
  }
  return {};
}

Expected<fs::path> simulate(const Scene& scene, const std::string& scene_text, const fs::path& folder,
                            const SimulateOptions& options) {
  auto output = OutputFolder::create(folder, options.overwrite);
  if (!output) return tl::unexpected(output.error());
  const auto done =
      write_simulated_capture(scene, scene_text, output->path(), options).and_then([&] { return output->commit(); });
  if (!done) return tl::unexpected(done.error());
  return output->final_path();
}

}  // namespace crumple
