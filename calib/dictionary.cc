#include "calib/dictionary.h"

#include <algorithm>
#include <cassert>

#include <opencv2/aruco.hpp>

namespace crumple {

const std::vector<std::string>& dictionary_names() {
  // In the order of cv::aruco::PREDEFINED_DICTIONARY_NAME.
  static const std::vector<std::string> names = {
      "4X4_50",   "4X4_100",  "4X4_250",        "4X4_1000",      "5X5_50",        "5X5_100",        "5X5_250",
      "5X5_1000", "6X6_50",   "6X6_100",        "6X6_250",       "6X6_1000",      "7X7_50",         "7X7_100",
      "7X7_250",  "7X7_1000", "ARUCO_ORIGINAL", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h10", "APRILTAG_36h11"};
  return names;
}

std::optional<int> dictionary_number(const std::string& name) {
  const auto& names = dictionary_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<int>(found - names.begin());
}

DictionarySize size_of_dictionary(const std::string& name) {
  const auto dictionary = cv::aruco::getPredefinedDictionary(dictionary_number(name).value());
  return {dictionary->bytesList.rows, dictionary->markerSize + 2};
}

cv::Mat marker_modules(const std::string& dictionary, int id) {
  assert(id >= 0 && id < size_of_dictionary(dictionary).markers);
  cv::Mat modules;
  cv::aruco::getPredefinedDictionary(dictionary_number(dictionary).value())
      ->drawMarker(id, size_of_dictionary(dictionary).modules, modules, 1);
  return modules;
}

}  // namespace crumple
