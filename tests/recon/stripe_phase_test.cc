#include "recon/stripe_phase.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "tests/recon/synthetic_stripes.h"

namespace crumple {
namespace {

struct Errors {
  double rms_px = 0;
  double predicted_px = 0;
  double fraction = 0;  // of lit pixels away from the image's border
};

StripeCoordinates estimate(const StripeImages& images, const PhaseOptions& options = {}, std::size_t stack = 0) {
  const BitRule rule = images.stacks[stack].inverses.empty() ? BitRule::half : BitRule::inverse;
  const DecodeOptions decode{.bit_rule = rule};
  const auto decoded = decode_stripes(images, stack, lit_mask(images, decode), decode);
  return estimate_stripe_phase(images, stack, *decoded, options);
}

Errors errors(const StripeScene& scene, const StripeOrientation& orientation, const StripeCoordinates& found) {
  constexpr int kBorder = 4;
  Errors e;
  int n = 0, all = 0;
  for (int y = kBorder; y < scene.camera.height - kBorder; ++y) {
    for (int x = kBorder; x < scene.camera.width - kBorder; ++x, ++all) {
      const double sigma = found.sigma_px.at<float>(y, x);
      if (sigma <= 0) continue;
      e.rms_px += std::pow(found.coordinate_px.at<double>(y, x) - true_coordinate(scene, orientation, x, y), 2);
      e.predicted_px += sigma * sigma;
      ++n;
    }
  }
  e.rms_px = std::sqrt(e.rms_px / n);
  e.predicted_px = std::sqrt(e.predicted_px / n);
  e.fraction = static_cast<double>(n) / all;
  return e;
}

const StripeOrientation kColumns{.bits = 7};
// Narrow oblique stripes are drawn as staircases of whole pixels, which no decoding can undo.
const StripeOrientation kOblique{.angle_rad = 0.6, .stripe_width_px = 2, .bits = 7};

TEST(StripePhase, FindsTheCoordinateOfBlurredStripes) {
  const StripeScene scene;
  const Errors e = errors(scene, kColumns, estimate(render_stripes(scene, {kColumns})));
  EXPECT_GT(e.fraction, 0.99);
  EXPECT_LT(e.rms_px, 0.02);  // whole stripes: 0.29
}

TEST(StripePhase, FindsTheCoordinateOfObliqueStripes) {
  StripeScene scene;
  scene.projector_blur_px = 2.5;
  const Errors e = errors(scene, kOblique, estimate(render_stripes(scene, {kOblique})));
  EXPECT_GT(e.fraction, 0.99);
  EXPECT_LT(e.rms_px, 0.1);  // whole stripes: 0.58
}

// The staircases of narrow oblique stripes move every boundary by up to a quarter pixel, differently from pixel to
// pixel: the blur is that of the mean boundary, not a sharper one with a skirt.
TEST(StripePhase, StaircasesDoNotSharpenTheBlur) {
  StripeScene scene;
  scene.noise = 1;
  const StripeOrientation staircase{.angle_rad = std::atan(0.5), .stripe_width_px = 4 / std::sqrt(5.0), .bits = 7};
  const auto found = estimate(render_stripes(scene, {staircase}));
  const Errors e = errors(scene, staircase, found);
  EXPECT_GT(e.fraction, 0.99);
  EXPECT_LT(e.rms_px, 0.2);
  EXPECT_NEAR(e.predicted_px / e.rms_px, 1, 0.2);
}

TEST(StripePhase, PredictedSigmaIsTheScatter) {
  StripeScene scene;
  scene.noise = 2;
  const StripeImages images = render_stripes(scene, {kColumns});
  const Errors e = errors(scene, kColumns, estimate(images));
  EXPECT_GT(e.fraction, 0.99);
  EXPECT_LT(e.rms_px, 0.05);
  EXPECT_NEAR(e.predicted_px / e.rms_px, 1, 0.2);
}

TEST(StripePhase, CorrectionTakesThePhaseErrorOfAForeignBlurAway) {
  StripeScene scene;
  scene.projector_blur_px = 0.3;  // far from a Gaussian: square projector pixels all but sharp
  scene.noise = 0.5;
  const StripeImages images = render_stripes(scene, {kColumns});
  const Errors raw = errors(scene, kColumns, estimate(images, {.correct = false}));
  const Errors corrected = errors(scene, kColumns, estimate(images));
  EXPECT_LT(corrected.rms_px, 0.8 * raw.rms_px);
}

// Stripes about as wide as the camera's pixels, so that their phase drifts slowly over the image.
StripeScene drifting_scene() {
  StripeScene scene;
  scene.projector = {192, 96};
  scene.projector_from_camera = [](const Eigen::Vector2d& at) {
    return Eigen::Vector2d(8.3 + 1.04 * at.x() + 0.05 * at.y(), 12 + 0.6 * at.y());
  };
  return scene;
}

// Second differences tell little of an error that goes with a slowly drifting phase. Noise, which is least near the
// stripes' boundaries, must not pass for one.
TEST(StripePhase, NoiseIsNotTakenForPhaseError) {
  StripeScene scene = drifting_scene();
  scene.camera_blur_px = 1;
  scene.noise = 4;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F, cv::Scalar(1));
  for (int j = 0; j < scene.reflectance.rows; ++j) {
    for (int i = 0; i < scene.reflectance.cols; ++i) {
      if ((i / 90 + j / 90) % 2 == 0) scene.reflectance.at<float>(j, i) = 0.06F;
    }
  }
  const StripeOrientation orientation{.bits = 8};
  const StripeCoordinates found = estimate(render_stripes(scene, {orientation}));
  double sine = 0, cosine = 0, count = 0;
  for (int y = 4; y < scene.camera.height - 4; ++y) {
    for (int x = 4; x < scene.camera.width - 4; ++x) {
      if (found.sigma_px.at<float>(y, x) <= 0) continue;
      const double truth = true_coordinate(scene, orientation, x, y);
      const double error = found.coordinate_px.at<double>(y, x) - truth;
      sine += error * std::sin(2 * M_PI * truth);
      cosine += error * std::cos(2 * M_PI * truth);
      ++count;
    }
  }
  EXPECT_GT(count, 8000);
  EXPECT_LT(2 * std::hypot(sine, cosine) / count, 0.006);
}

// Whoever takes the best of many pixels must not get those whose noise makes them look better than they are: sigma is
// nearly the same whatever the pixel's own noise.
TEST(StripePhase, SigmaDoesNotFollowThePixelsOwnNoise) {
  StripeScene scene = drifting_scene();
  scene.projector_blur_px = 0.5;
  scene.noise = 4;
  const StripeOrientation orientation{.bits = 8};
  const cv::Mat one = estimate(render_stripes(scene, {orientation})).sigma_px;
  scene.seed = 2;
  const cv::Mat other = estimate(render_stripes(scene, {orientation})).sigma_px;
  double squares = 0, count = 0;
  for (int y = 8; y < scene.camera.height - 8; ++y) {
    for (int x = 8; x < scene.camera.width - 8; ++x) {
      const double a = one.at<float>(y, x), b = other.at<float>(y, x);
      if (a <= 0 || b <= 0) continue;
      squares += std::pow(std::log(a / b), 2);
      ++count;
    }
  }
  EXPECT_GT(count, 10000);
  EXPECT_LT(std::sqrt(squares / count / 2), 0.015);
}

// The surface grows brighter to one side, too slowly for any pixel's noise to show it.
TEST(StripePhase, ShadingDoesNotPullTheCoordinate) {
  StripeScene scene;
  scene.noise = 0.5;
  scene.white = 230;
  scene.camera_blur_px = 3;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F);
  for (int i = 0; i < scene.reflectance.cols; ++i) {
    const bool printed = i / 20 % 8 == 0 && i > 400;
    scene.reflectance.col(i) =
        (printed ? 0.4F : 1.0F) * std::exp(0.008F * static_cast<float>(i - scene.reflectance.cols) / 4);
  }
  const auto mean_error = [&](const StripeCoordinates& found) {
    double sum = 0, n = 0;
    for (int y = 4; y < scene.camera.height - 4; ++y) {
      for (int x = 4; x < 90; ++x) {
        if (found.sigma_px.at<float>(y, x) <= 0) continue;
        sum += found.coordinate_px.at<double>(y, x) - true_coordinate(scene, kColumns, x, y);
        ++n;
      }
    }
    return sum / n;
  };
  const StripeImages images = render_stripes(scene, {kColumns});
  EXPECT_GT(mean_error(estimate(images, {.correct = false})), 0.003);
  EXPECT_LT(std::abs(mean_error(estimate(images))), 0.0012);
}

// One column, drawn with its edges at several places within a pixel: the two pixels next to the black are pulled apart.
TEST(StripePhase, BlackEdgesDoNotPullTheirNeighbours) {
  StripeScene scene;
  scene.noise = 0.5;
  scene.white = 230;
  scene.camera_blur_px = 1.5;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F, cv::Scalar(1));
  for (int i = 0; i < scene.reflectance.cols; ++i) {
    if (i % 81 < 40) scene.reflectance.col(i) = 0.06F;
  }
  const StripeImages images = render_stripes(scene, {kColumns});
  const auto rms = [&](const StripeCoordinates& found, int from, int to) {
    double sum = 0, n = 0;
    for (int x = 8; x < scene.camera.width - 8; ++x) {
      // In quarter pixels from the edge, on the white side.
      const int after = (4 * x + 2) % 81 - 40, before = 81 - (4 * x + 2) % 81;
      const int away = std::min(after, before);
      if (away < from || away >= to) continue;
      double mean = 0, count = 0;
      for (int y = 4; y < scene.camera.height - 4; ++y) {
        if (found.sigma_px.at<float>(y, x) <= 0) continue;
        mean += found.coordinate_px.at<double>(y, x) - true_coordinate(scene, kColumns, x, y);
        ++count;
      }
      sum += mean * mean / (count * count);
      ++n;
    }
    return std::sqrt(sum / n);
  };
  const StripeCoordinates raw = estimate(images, {.correct = false}), corrected = estimate(images);
  EXPECT_GT(rms(raw, 0, 4), 0.1);
  EXPECT_LT(rms(corrected, 0, 4), 0.02);
  EXPECT_LT(rms(corrected, 4, 8), rms(raw, 4, 8));
}

// Beside a printed edge, along it or across, a pixel may see its surface in part: sigma grows there, and nowhere else.
TEST(StripePhase, SigmaGrowsBesidePrintedEdges) {
  StripeScene scene;
  scene.noise = 0.5;
  scene.white = 230;
  scene.camera_blur_px = 1.5;
  const cv::Mat plain = estimate(render_stripes(scene, {kColumns})).sigma_px;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F, cv::Scalar(1));
  constexpr int kEdge = 60;  // rows above it are black
  scene.reflectance.rowRange(0, 4 * kEdge) = 0.06F;
  const cv::Mat printed = estimate(render_stripes(scene, {kColumns})).sigma_px;
  const auto median_ratio = [&](int y) {
    std::vector<double> ratios;
    for (int x = 8; x < scene.camera.width - 8; ++x) {
      if (plain.at<float>(y, x) > 0 && printed.at<float>(y, x) > 0) {
        ratios.push_back(printed.at<float>(y, x) / plain.at<float>(y, x));
      }
    }
    if (ratios.empty()) return 0.0;
    std::nth_element(ratios.begin(), ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2), ratios.end());
    return ratios[ratios.size() / 2];
  };
  EXPECT_GT(median_ratio(kEdge), 2);
  EXPECT_NEAR(median_ratio(kEdge + 20), 1, 0.2);
}

TEST(StripePhase, PrintedEdgesDoNotPullTheCoordinate) {
  StripeScene scene;
  scene.noise = 0.5;
  scene.reflectance = cv::Mat(4 * scene.camera.height, 4 * scene.camera.width, CV_32F, cv::Scalar(1));
  for (int i = 0; i < scene.reflectance.cols; i += 160) scene.reflectance.colRange(i, i + 80) = 0.5F;
  const StripeImages images = render_stripes(scene, {kColumns});
  const StripeCoordinates raw = estimate(images, {.correct = false});
  const StripeCoordinates corrected = estimate(images);
  const auto rms_at_edges = [&](const StripeCoordinates& found) {
    double sum = 0;
    int n = 0;
    for (int y = 4; y < scene.camera.height - 4; ++y) {
      for (int x = 20; x < scene.camera.width - 4; x += 20) {
        for (const int side : {x - 1, x}) {
          if (found.sigma_px.at<float>(y, side) <= 0) continue;
          sum += std::pow(found.coordinate_px.at<double>(y, side) - true_coordinate(scene, kColumns, side, y), 2);
          ++n;
        }
      }
    }
    return std::sqrt(sum / n);
  };
  EXPECT_GT(corrected.correction.mixing_px2, 0.05);
  EXPECT_LT(rms_at_edges(corrected), 0.7 * rms_at_edges(raw));
}

TEST(StripePhase, WorksWithoutInverses) {
  StripeScene scene;
  scene.noise = 1;
  StripeOrientation orientation = kColumns;
  orientation.inverse = false;
  const StripeImages images = render_stripes(scene, {orientation});
  const Errors e = errors(scene, orientation, estimate(images));
  EXPECT_GT(e.fraction, 0.97);
  EXPECT_LT(e.rms_px, 0.06);
}

TEST(StripePhase, SameBitsOnOneThreadAndTwo) {
  StripeScene scene;
  scene.noise = 2;
  const StripeImages images = render_stripes(scene, {kColumns});
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const StripeCoordinates one = estimate(images);
  cv::setNumThreads(2);
  const StripeCoordinates two = estimate(images);
  cv::setNumThreads(threads);
  EXPECT_EQ(cv::countNonZero(one.coordinate_px != two.coordinate_px), 0);
  EXPECT_EQ(cv::countNonZero(one.sigma_px != two.sigma_px), 0);
}

TEST(StripePhase, NothingLitGivesNothing) {
  StripeScene scene;
  scene.white = 12;
  const StripeImages images = render_stripes(scene, {kColumns});
  EXPECT_EQ(cv::countNonZero(estimate(images).sigma_px), 0);
}

}  // namespace
}  // namespace crumple
