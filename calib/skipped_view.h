// A view that a calibration did without, and why.
#pragma once

#include <string>

namespace crumple {

struct SkippedView {
  std::string station;
  std::string sensor;
  std::string reason;
  bool by_hand = false;  // excluded in capture.yaml
};

}  // namespace crumple
