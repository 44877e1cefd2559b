// Dictionaries of coded markers, by OpenCV's names without their DICT_: 4X4_50 ... 7X7_1000, ARUCO_ORIGINAL,
// APRILTAG_16h5, APRILTAG_25h9, APRILTAG_36h10, APRILTAG_36h11.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core/mat.hpp>

namespace crumple {

const std::vector<std::string>& dictionary_names();

// The number OpenCV gives a dictionary.
std::optional<int> dictionary_number(const std::string& name);

struct DictionarySize {
  int markers = 0;
  int modules = 0;  // along one side, the dark border of one module on either side included
};
// Precondition: the name is one of dictionary_names.
DictionarySize size_of_dictionary(const std::string& name);

// The modules of a marker, CV_8U, 0 where it is dark, its border included.
cv::Mat marker_modules(const std::string& dictionary, int id);

}  // namespace crumple
