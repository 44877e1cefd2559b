// A scene: what a synthetic capture is made from, in memory. datasets/scene_file.h reads one from YAML.
//
// Everything sits in the probe frame, that of the first camera. Where trackers watch the probe, they and what they
// share with it sit in the world frame, that of the first tracker. Radiance is relative: 1 is what a white Lambert
// surface (albedo 1) sends out where it faces the fully lit projector on its axis, at the lighting's reference
// distance.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "datasets/capture.h"
#include "datasets/render/box.h"
#include "datasets/render/surfaces.h"
#include "recon/patterns.h"
#include "solvers/observations.h"
#include "solvers/pose.h"
#include "solvers/rig.h"

namespace crumple {

// How sharp a lens is: a Gaussian blur everywhere, and a thin lens' disc of confusion off its focus distance.
struct Optics {
  double blur_px = 0;      // sigma, on top of the square pixel itself
  double aperture_mm = 0;  // diameter; 0 is a pinhole, sharp at every distance
  double focus_distance_mm = 1e3;
};

struct Detector {
  double exposure = 0.7;  // share of the full well that radiance 1 fills on the camera's axis
  double full_well_electrons = 10000;
  double read_noise_electrons = 0;
  bool shot_noise = true;
  int bits = 8;       // 8..16; above 8 the codes are spread over the 16-bit range, so that saturation is 65535
  double offset = 0;  // dark level as a share of the code range
};

struct Emitter {
  double gamma = 1;       // emission = black + (1 - black) (code / 255)^gamma
  double black = 0;       // what a dark pixel still emits
  double pixel_fill = 1;  // side of the lit square within the pixel pitch, 0..1
};

struct SceneCamera {
  Sensor sensor;
  Optics optics;
  Detector detector;
  bool thermal = false;  // sees what materials send out by themselves, whatever light falls on them
};

struct SceneProjector {
  Sensor sensor;
  Optics optics;
  Emitter emitter;
};

struct Lighting {
  double reference_distance_mm = 800;
  double ambient = 0;     // radiance of a white Lambert surface under the room's light, the same from everywhere
  double background = 0;  // radiance where a ray leaves the scene, as a share of ambient
  double thermal_background = 0.4;  // what a thermal camera sees there
  bool bounce = false;  // whether light of the projector reaches the camera over a second point of the surface, too
};

// A named thing to look at: a car's side before or after a crash, reference balls, a plate.
struct SceneObject {
  std::string name;
  std::shared_ptr<const Surface> surface;
};

struct SceneStation {
  std::string id;
  bool board = true;        // else the panel, or the object
  Pose probe_from_surface;  // of the board or of the panel
  bool in_view = true;      // false: neither is there, only lights are
  Pose world_from_probe = {};
  std::string placement = {};  // stations that name the same one have the board or the panel at one place in the world
  bool scan = true;            // whether the probe's cameras take images
  bool trackers = true;        // whether the trackers do
  std::optional<std::size_t> object = {};  // into Scene::objects, in place of board and panel
};

// Brightness of a light: what its spot holds, summed over the pixels, in full wells of the tracker, on the axis at the
// lighting's reference distance, in an image of the blinking sequence.
struct SceneLed {
  Led led;
  std::string word;  // lit at the steps with a '1'
  double brightness = 10;
  std::optional<Eigen::Vector3d> nominal_mm = {};  // what capture.yaml says
};

// A light in the room that no code tells.
struct Lamp {
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  double brightness = 10;
};

// A flat round mirror in the room: LEDs are seen in it, too.
struct Mirror {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, to the side that reflects
  double radius_mm = 100;
  double reflectance = 0.5;
};

// What cameras fixed to the world see of a probe that is moved about.
struct Tracking {
  std::vector<SceneCamera> trackers;
  std::vector<SceneLed> leds;
  std::vector<FrameContent> frames;  // of every tracker at every station: ambient and leds
  std::size_t blink_start = 0;       // the step of the words that the first image of the sequence shows
  double led_exposure = 0.1;         // of the images of the blinking sequence, as a share of the ambient one's
  std::vector<Lamp> lamps;
  std::vector<Mirror> mirrors;
  std::optional<Box> probe_body;  // in the probe frame
  double led_dropout = 0;         // probability that a lit LED stays dark in one image of one tracker
  double missing_frames = 0;      // probability that an image of the blinking sequence is not written
};

struct Scene {
  std::string name;
  std::vector<SceneCamera> cameras;          // the first one's frame is the probe frame
  std::optional<SceneProjector> projector;   // the one that shows the patterns
  std::vector<Sensor> dark_projectors = {};  // on the probe as well; other captures are theirs
  Lighting lighting;
  std::optional<BoardPlate> board;
  std::optional<Panel> panel;
  std::vector<SceneObject> objects = {};
  std::vector<SceneStation> stations;
  std::vector<StripeOrientation> orientations;
  std::optional<ProjectedChessboard> projected_chessboard;
  std::vector<FrameContent> frames;
  Tracking tracking = {};
  int samples = 16;  // traced per camera pixel; four times as many where those do not all see the same material
  std::uint64_t seed = 1;
};

// The scene's sensors, the probe's cameras first, then the projector, the trackers and the projectors that stay dark,
// and its LEDs; no covariance, for nothing was estimated.
Rig true_rig(const Scene& scene);

Pose world_from_surface(const SceneStation& station);

// What a camera on the probe takes at a station: the scene's frames, or one ambient image where it is a thermal one.
const std::vector<FrameContent>& frames_of(const Scene& scene, const SceneCamera& camera);

// Precondition: the station's board, panel or object exists and is in view.
const Surface& surface_at(const Scene& scene, const SceneStation& station);

// All frames of the orientations, most significant bit first, each inverse after its pattern.
std::vector<FrameContent> stripe_frames(const std::vector<StripeOrientation>& orientations);

// The 8-bit image the projector shows; empty for a frame without it. Precondition: the scene has a projector where the
// frame needs one.
cv::Mat projector_image(const Scene& scene, const FrameContent& frame);

// What the measurement model says the sensors observe, free of noise: corners in every camera, stripe coordinates on a
// grid of camera pixels `grid_step_px` apart, and projected chessboard corners where the scene has them; with trackers,
// also the corners in their ambient images and the LEDs. Sensors and LEDs are numbered as in true_rig. Placements
// number the places of the board, in the order of the stations; stations are told where there are trackers. Only what
// lies inside the images and on the plate is listed; occlusion cannot occur with one plate in view, and what the
// probe's body hides from trackers is listed all the same.
Observations ideal_observations(const Scene& scene, int grid_step_px);

}  // namespace crumple
