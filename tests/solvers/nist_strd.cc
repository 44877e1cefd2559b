#include "tests/solvers/nist_strd.h"

#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace crumple {
namespace {

using B = std::vector<Complex>;
using X = StrdRow;
constexpr long double kPi = std::numbers::pi_v<long double>;

// "b1 = start start certified sigma" in `line`, which is split at the equal sign.
bool read_parameter(const std::string& line, std::vector<std::array<double, 4>>& rows) {
  const std::size_t equals = line.find('=');
  std::istringstream left(line.substr(0, equals));
  std::string name;
  if (equals == std::string::npos || !(left >> name) || name != "b" + std::to_string(rows.size() + 1)) return false;
  std::istringstream right(line.substr(equals + 1));
  std::array<double, 4> row{};
  for (double& value : row) right >> value;
  if (!right) return false;
  rows.push_back(row);
  return true;
}

Complex square(const Complex& z) { return z * z; }

Complex gauss(const B& b, const X& x) {
  const auto bell = [&](std::size_t k) { return b[k] * std::exp(-square((x[0] - b[k + 1]) / b[k + 2])); };
  return b[0] * std::exp(-b[1] * x[0]) + bell(2) + bell(5);
}

Complex lanczos(const B& b, const X& x) {
  return b[0] * std::exp(-b[1] * x[0]) + b[2] * std::exp(-b[3] * x[0]) + b[4] * std::exp(-b[5] * x[0]);
}

Complex chwirut(const B& b, const X& x) { return std::exp(-b[0] * x[0]) / (b[1] + b[2] * x[0]); }

Complex cubic_ratio(const B& b, const X& x) {
  return (b[0] + x[0] * (b[1] + x[0] * (b[2] + x[0] * b[3]))) / (1.0L + x[0] * (b[4] + x[0] * (b[5] + x[0] * b[6])));
}

Complex saturation(const B& b, const X& x) { return b[0] * (1.0L - std::exp(-b[1] * x[0])); }

Complex enso(const B& b, const X& x) {
  const auto wave = [&](const Complex& c, const Complex& s, const Complex& period) {
    const Complex phase = 2.0L * kPi * x[0] / period;
    return c * std::cos(phase) + s * std::sin(phase);
  };
  return b[0] + wave(b[1], b[2], 12.0L) + wave(b[4], b[5], b[3]) + wave(b[7], b[8], b[6]);
}

}  // namespace

StrdProblem read_strd(const std::filesystem::path& file) {
  std::ifstream stream(file);
  StrdProblem problem;
  problem.name = file.stem().string();
  std::vector<std::array<double, 4>> parameters;
  std::vector<StrdRow> data;
  bool in_data = false;
  for (std::string line; std::getline(stream, line);) {
    if (read_parameter(line, parameters)) continue;
    const std::string sum_key = "Residual Sum of Squares:";
    if (const std::size_t at = line.find(sum_key); at != std::string::npos) {
      problem.certified_sum_of_squares = std::stod(line.substr(at + sum_key.size()));
    }
    std::istringstream text(line);
    if (in_data) {
      StrdRow row;
      for (long double value = 0; text >> value;) row.push_back(value);
      if (row.size() > 1) data.push_back(row);
    }
    std::string first, second;
    text >> first >> second;
    if (first == "Data:" && second == "y") in_data = true;
  }
  if (parameters.empty() || data.empty()) throw std::runtime_error(file.string() + " is no StRD file");
  const auto column = [&](std::size_t k) {
    Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = parameters[static_cast<std::size_t>(i)][k];
    return values;
  };
  problem.starts = {column(0), column(1)};
  problem.certified = column(2);
  problem.certified_sigma = column(3);
  for (const StrdRow& row : data) {
    // Nelson's model is of the logarithm.
    problem.y.push_back(problem.name == "Nelson" ? std::log(row[0]) : row[0]);
    problem.x.emplace_back(row.begin() + 1, row.end());
  }
  return problem;
}

const std::map<std::string, StrdModel>& strd_models() {
  static const std::map<std::string, StrdModel> models{
      {"Bennett5", [](const B& b, const X& x) { return b[0] * std::pow(b[1] + x[0], -1.0L / b[2]); }},
      {"BoxBOD", saturation},
      {"Chwirut1", chwirut},
      {"Chwirut2", chwirut},
      {"DanWood", [](const B& b, const X& x) { return b[0] * std::pow(Complex(x[0]), b[1]); }},
      {"ENSO", enso},
      {"Eckerle4", [](const B& b, const X& x) { return b[0] / b[1] * std::exp(-0.5L * square((x[0] - b[2]) / b[1])); }},
      {"Gauss1", gauss},
      {"Gauss2", gauss},
      {"Gauss3", gauss},
      {"Hahn1", cubic_ratio},
      {"Kirby2",
       [](const B& b, const X& x) {
         return (b[0] + x[0] * (b[1] + x[0] * b[2])) / (1.0L + x[0] * (b[3] + x[0] * b[4]));
       }},
      {"Lanczos1", lanczos},
      {"Lanczos2", lanczos},
      {"Lanczos3", lanczos},
      {"MGH09", [](const B& b, const X& x) { return b[0] * x[0] * (x[0] + b[1]) / (x[0] * (x[0] + b[2]) + b[3]); }},
      {"MGH10", [](const B& b, const X& x) { return b[0] * std::exp(b[1] / (x[0] + b[2])); }},
      {"MGH17",
       [](const B& b, const X& x) { return b[0] + b[1] * std::exp(-x[0] * b[3]) + b[2] * std::exp(-x[0] * b[4]); }},
      {"Misra1a", saturation},
      {"Misra1b", [](const B& b, const X& x) { return b[0] * (1.0L - std::pow(1.0L + b[1] * x[0] / 2.0L, -2.0L)); }},
      {"Misra1c", [](const B& b, const X& x) { return b[0] * (1.0L - std::pow(1.0L + 2.0L * b[1] * x[0], -0.5L)); }},
      {"Misra1d", [](const B& b, const X& x) { return b[0] * b[1] * x[0] / (1.0L + b[1] * x[0]); }},
      {"Nelson", [](const B& b, const X& x) { return b[0] - b[1] * x[0] * std::exp(-b[2] * x[1]); }},
      {"Rat42", [](const B& b, const X& x) { return b[0] / (1.0L + std::exp(b[1] - b[2] * x[0])); }},
      {"Rat43",
       [](const B& b, const X& x) { return b[0] / std::pow(1.0L + std::exp(b[1] - b[2] * x[0]), 1.0L / b[3]); }},
      {"Roszman1", [](const B& b, const X& x) { return b[0] - b[1] * x[0] - std::atan(b[2] / (x[0] - b[3])) / kPi; }},
      {"Thurber", cubic_ratio}};
  return models;
}

}  // namespace crumple
