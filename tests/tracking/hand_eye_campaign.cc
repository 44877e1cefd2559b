#include "tests/tracking/hand_eye_campaign.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Cholesky>

#include "tests/tracking/made_hand_eye.h"
#include "tracking/hand_eye_verdict.h"

namespace crumple {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

double between(std::mt19937& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random()) + 0.5) / 4294967296.0;
}

// Evenly in the logarithm.
double scale_between(std::mt19937& random, double low, double high) {
  return std::exp(between(random, std::log(low), std::log(high)));
}

MadeHandEyeOptions options_of(std::size_t kind, std::mt19937& random) {
  MadeHandEyeOptions o;
  o.poses = static_cast<int>(between(random, 4, 31));
  o.turn_deg = between(random, 20, 60);
  const double scale = kind == 1 ? scale_between(random, 4, 20) : scale_between(random, 0.5, 4);
  o.hand_sigma_deg = 0.02 * scale;
  o.hand_sigma_mm = 0.1 * scale;
  o.eye_sigma_deg = 0.1 * scale;
  o.eye_sigma_mm = 0.5 * scale;
  if (kind == 2) o.spread_deg = scale_between(random, 0.1, 15);
  if (kind == 3) o.turn_deg = scale_between(random, 0.2, 10);
  return o;
}

PoseError error_of(const Pose& found, const Pose& truth) {
  const Vector6d step = local_step(truth, found);
  const PoseError error{step.head<3>().norm() * 180 / std::numbers::pi, step.tail<3>().norm()};
  return step.allFinite() ? error : PoseError{kInfinite, kInfinite};
}

template <typename Member>
double median_of_member(const std::vector<PoseError>& errors, Member member) {
  std::vector<double> values;
  for (const PoseError& error : errors) values.push_back(error.*member);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

CampaignCase run_campaign_case(int number) {
  std::mt19937 random(static_cast<unsigned>(number) + 1);
  CampaignCase result;
  result.kind = static_cast<std::size_t>(number) % kCampaignKinds.size();
  const MadeHandEyeOptions options = options_of(result.kind, random);
  result.poses = options.poses;
  const MadeHandEye made = make_hand_eye(options, random);
  for (std::size_t m = 0; m < result.peers.size(); ++m) {
    result.peers[m] = error_of(opencv_hand_eye(made.pairs, m), made.hand_from_eye);
  }
  const auto calibration = calibrate_hand_eye(made.pairs);
  if (!calibration) {
    result.words = calibration.error().message;
    result.ours = {kInfinite, kInfinite};
    return result;
  }
  const HandEyeVerdict verdict = judge(*calibration);
  result.answer = verdict.ok ? Answer::trusted : Answer::suspect;
  if (!verdict.ok) result.words = verdict.reasons.front();
  result.ours = error_of(calibration->fit.state.hand_from_eye, made.hand_from_eye);
  const Vector6d step = local_step(calibration->fit.state.hand_from_eye, made.hand_from_eye);
  const Matrix6d covariance = calibration->fit.covariance.topLeftCorner<6, 6>();
  result.sigmas = std::sqrt(step.dot(covariance.ldlt().solve(step)) / 6);
  return result;
}

double median_rotation_deg(const std::vector<PoseError>& errors) {
  return median_of_member(errors, &PoseError::rotation_deg);
}

double median_translation_mm(const std::vector<PoseError>& errors) {
  return median_of_member(errors, &PoseError::translation_mm);
}

bool is_garbage(const PoseError& error) { return !(error.rotation_deg <= 5 && error.translation_mm <= 50); }

}  // namespace crumple
