// What is wrong with a capture, file by file: what `crumple check` prints.
//
// Files that are missing, empty, truncated, of another size, depth or format; frames that are dark or saturated
// (exposure_check.h); a board that is not found or not lit (board_check.h); frames out of order (sequence_check.h); two
// stations that hold the same images; exclusions that leave nothing. Excluded stations are not read.
#pragma once

#include <string>
#include <vector>

#include "datasets/capture.h"
#include "datasets/finding.h"

namespace crumple {

struct StationFrames {
  std::vector<cv::Mat> images;  // one per frame of the camera; empty where it could not be used
  std::vector<Finding> findings;
};

// Reads all frames of one camera at one station, two at a time, and checks them. The result does not depend on timing.
StationFrames check_station(const Capture& capture, const std::string& camera, const std::string& station);

// All stations and cameras, in the capture's order.
std::vector<Finding> check_capture(const Capture& capture);

bool has_error(const std::vector<Finding>& findings);

}  // namespace crumple
