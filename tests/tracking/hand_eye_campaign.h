// Hand-eye calibrations of made poses with known truth, ours beside OpenCV's five methods on the same pairs.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "tests/tracking/opencv_hand_eye.h"

namespace crumple {

inline const std::array<std::string, 4> kCampaignKinds{"usual", "noisy", "near-parallel axes", "small rotations"};

struct PoseError {
  double rotation_deg = 0;
  double translation_mm = 0;
};

enum class Answer { trusted, suspect, refused };

struct CampaignCase {
  std::size_t kind = 0;
  int poses = 0;
  Answer answer = Answer::refused;
  std::string words;               // why refused, or the first reason why suspect
  PoseError ours;                  // infinite where refused
  double sigmas = 0;               // root of the error's square by its covariance, over six
  std::array<PoseError, 5> peers;  // infinite where the method gave no numbers
};

// Case `number` of the campaign; the same at every call. Kinds follow each other in turn.
CampaignCase run_campaign_case(int number);

double median_rotation_deg(const std::vector<PoseError>& errors);
double median_translation_mm(const std::vector<PoseError>& errors);

// Beyond any use: 5 deg or 50 mm.
bool is_garbage(const PoseError& error);

}  // namespace crumple
