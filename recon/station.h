// One station's point cloud from its stripe frames.
//
// Estimators
//   paper     whole stripes (their centres) per orientation, ray meets light surface, plain average over orientations
//   weighted  the pixel-wise stripe coordinate of every orientation, averaged by what each knows of depth (the default)
//   edges     stripe boundaries between pixels, one point per crossing; nothing is averaged
//
// Orientations whose stripes run along the epipolar lines carry no depth, and a plain average would be ruined by them.
// Rule: an orientation's sensitivity is the median over pixels of |d coordinate / d depth|; it is left out where that
// is below `least_sensitivity` of the best orientation's (paper and edges: a half; weighted: 0.02, since its weight
// vanishes anyway). What was left out is named in the result.
//
// Frames: points in the probe frame; depth maps in the camera's (z, mm).
#pragma once

#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "recon/cloud.h"
#include "recon/decode.h"
#include "recon/stripe_edges.h"
#include "recon/stripe_phase.h"
#include "solvers/expected.h"
#include "solvers/lens.h"
#include "solvers/pose.h"

namespace crumple {

// A camera and a projector as reconstruction needs them. Made once per pair: the rays take a while.
struct StationGeometry {
  StationGeometry(const Lens& camera, const Lens& projector, const Pose& camera_from_probe,
                  const Pose& projector_from_probe);

  Lens camera;
  Lens projector;
  Pose proj_from_cam;
  Pose probe_from_cam;
  RayTable rays;
};

enum class Estimator { paper, weighted, edges };

struct StationOptions {
  Estimator estimator = Estimator::weighted;
  DecodeOptions decode = {};
  PhaseOptions phase = {};
  StripeEdgeOptions edges = {};
  double common_sigma_px = 0.3;  // what calibration may be off by, in stripe coordinates: see weighted_depth
  double gate = 25;              // chi-square per degree of freedom beyond which orientations contradict each other
  double paper_least_sensitivity = 0.5;
  double weighted_least_sensitivity = 0.02;
  // Points with more than this many times the station's median sigma are left out: dim pixels, and pixels that only an
  // all but blind orientation decoded.
  double largest_sigma_ratio = 2.5;
  std::string name = "station";
};

struct OrientationReport {
  double angle_rad = 0;
  double decoded_fraction = 0;       // of lit pixels
  double median_sigma_px = 0;        // of the coordinate, from decoding
  double sensitivity_px_per_mm = 0;  // median |d coordinate / d depth|
  bool used = false;
  std::string reason;  // a sentence where it was left out
};

// What the frames of one station say, before any rig is known.
struct StationReadings {
  ImageSize projector;
  cv::Mat white;
  cv::Mat lit;  // CV_8U, 255 where pixels are lit and unmixed
  std::vector<StripeOrientation> orientations;
  std::vector<StripeCoordinates> coordinates;          // per orientation; the paper's are whole stripes' centres
  std::vector<std::vector<StripeCrossing>> crossings;  // per orientation; only for Estimator::edges
};

struct StationCloud {
  Cloud cloud;
  cv::Mat depth_mm;  // CV_64F per camera pixel; 0 where there is no point; empty for Estimator::edges
  cv::Mat sigma_mm;  // CV_32F likewise
  std::vector<OrientationReport> orientations;
  double decoded_fraction = 0;  // points over lit pixels (edges: crossings over lit pixels)
  double median_sigma_mm = 0;
};

// Fails where images do not fit each other or the bit rule.
Expected<StationReadings> read_stripes(const StripeImages& images, const StationOptions& options);

// Fails where the readings are not of the geometry's sensors, or nothing could be reconstructed.
Expected<StationCloud> reconstruct_readings(const StationGeometry& geometry, const StationReadings& readings,
                                            const StationOptions& options);

// The one after the other.
Expected<StationCloud> reconstruct_station(const StationGeometry& geometry, const StripeImages& images,
                                           const StationOptions& options);

}  // namespace crumple
