// A photogrammetric camera calibration with its published adjustment: 21 photographs of a sheet of coded dots, 100
// points of which four are control points, reports of several lens models. Read from the public data sets (dbat_camcal,
// BSD-2, Boerlin & Grussenmeyer, Damped Bundle Adjustment Toolbox), never kept here.
//
// As one of our problems: one camera on a probe that moves, a station for each photograph, the points as LEDs fixed to
// the world. The toolbox's camera sees along -z with y up; that is the probe frame here, and the mount turns it. Its
// unit of length for objects, metres, stays.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "solvers/observations.h"
#include "solvers/state.h"

namespace crumple {

struct DbatNetwork {
  static constexpr double kPixelSize_mm = 5.43764 / 1704;
  static constexpr double kSigma_px = 0.1;
  std::size_t photographs = 0;
  std::vector<LedView> views;  // several of each photograph, which is their station
  std::vector<int> ids;        // of the points, as LEDs
  std::map<std::size_t, Eigen::Vector3d> control;

  std::size_t led(int id) const;
};

// Throws std::runtime_error where the files are not the data set's, as do the next two.
DbatNetwork read_dbat_network(const std::filesystem::path& folder);

// One number of a report: "Camera Constant" or "Omega", of which photograph where it is of one; as printed.
struct DbatValue {
  std::string name;
  std::string photograph;
  std::string value;
  std::string deviation;  // empty where it was held
};

struct DbatReport {
  std::map<std::string, std::string> facts;  // "Sigma0", "Redundancy", "Maximum X standard deviation", ...
  std::vector<DbatValue> values;
  std::vector<std::string> photographs;  // "P8250021.JPG", ...
};

DbatReport read_dbat_report(const std::filesystem::path& file);

// Rows of comma-separated text, comments left out.
std::vector<std::vector<std::string>> read_dbat_table(const std::filesystem::path& file);

// What one in the last place of a printed number is worth, where so many significant digits are printed (trailing zeros
// are not); and whether a number rounds to the printed one.
double last_place(const std::string& printed, int significant_digits);
bool rounds_to(double number, const std::string& printed, int significant_digits);

}  // namespace crumple
