#include "tests/solvers/dbat_camcal.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

namespace crumple {
namespace {

// A view's equations are dense in its points: a hundred in one would take a hundred times as long.
constexpr std::size_t kMarksPerView = 5;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \r\t"), last = text.find_last_not_of(" \r\t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

std::ifstream opened(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + " cannot be read");
  return stream;
}

std::string first_word(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  words >> word;
  return word;
}

}  // namespace

std::vector<std::vector<std::string>> read_dbat_table(const std::filesystem::path& file) {
  std::ifstream stream = opened(file);
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(stream, line);) {
    if (trimmed(line).empty() || line[0] == '#') continue;
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(trimmed(cell));
  }
  return rows;
}

std::size_t DbatNetwork::led(int id) const {
  const auto found = std::lower_bound(ids.begin(), ids.end(), id);
  if (found == ids.end() || *found != id) throw std::runtime_error("no point " + std::to_string(id));
  return static_cast<std::size_t>(found - ids.begin());
}

DbatNetwork read_dbat_network(const std::filesystem::path& folder) {
  const auto marks = read_dbat_table(folder / "measurements/markpts.txt");
  DbatNetwork network;
  std::set<int> ids;
  for (const auto& mark : marks) ids.insert(std::stoi(mark.at(1)));
  network.ids.assign(ids.begin(), ids.end());
  for (const auto& mark : marks) {
    const auto photograph = static_cast<std::size_t>(std::stoi(mark.at(0)) - 1);
    if (network.views.empty() || network.views.back().station != photograph ||
        network.views.back().leds.size() == kMarksPerView) {
      network.views.push_back({0, {}, {}, photograph});
    }
    network.photographs = std::max(network.photographs, photograph + 1);
    if (std::stod(mark.at(4)) != DbatNetwork::kSigma_px) throw std::runtime_error("marks have other sigmas");
    network.views.back().leds.push_back(network.led(std::stoi(mark.at(1))));
    network.views.back().pixels.emplace_back(std::stod(mark.at(2)), std::stod(mark.at(3)));
  }
  for (const auto& row : read_dbat_table(folder / "reference/camcal-fixed.txt")) {
    network.control[network.led(std::stoi(row.at(0)))] = {std::stod(row.at(2)), std::stod(row.at(3)),
                                                          std::stod(row.at(4))};
  }
  return network;
}

DbatReport read_dbat_report(const std::filesystem::path& file) {
  std::ifstream stream = opened(file);
  DbatReport report;
  std::string name, photograph;
  for (std::string line; std::getline(stream, line);) {
    const std::string text = trimmed(line);
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) {
      if (text.rfind("Redundancy", 0) == 0) report.facts["Redundancy"] = first_word(text.substr(10));
      continue;
    }
    const std::string key = text.substr(0, colon), rest = trimmed(text.substr(colon + 1));
    if (rest.empty()) {
      name = trimmed(key.substr(0, key.find(" - ")));
    } else if (key == "Value") {
      report.values.push_back({name, photograph, first_word(rest), ""});
    } else if (key == "Deviation") {
      report.values.back().deviation = first_word(rest);
    } else if (key.rfind("Photo ", 0) == 0) {
      photograph = first_word(rest);
      report.photographs.push_back(photograph);
    } else {
      report.facts.emplace(key, rest);
    }
  }
  if (!report.facts.contains("Sigma0")) throw std::runtime_error(file.string() + " is no report");
  return report;
}

double last_place(const std::string& printed, int significant_digits) {
  return std::pow(10.0, std::floor(std::log10(std::abs(std::stod(printed)))) + 1 - significant_digits);
}

bool rounds_to(double number, const std::string& printed, int significant_digits) {
  return std::abs(number - std::stod(printed)) <= (0.5 + 1e-6) * last_place(printed, significant_digits);
}

}  // namespace crumple
