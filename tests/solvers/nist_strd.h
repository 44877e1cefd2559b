// NIST's Statistical Reference Datasets for nonlinear regression: data, starts and certified results of each problem,
// and the models. Public domain; read from the public data sets, never kept here.
#pragma once

#include <array>
#include <complex>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace crumple {

using StrdRow = std::vector<long double>;

struct StrdProblem {
  std::string name;
  std::vector<Eigen::VectorXd> starts;  // two, the nearer one last
  Eigen::VectorXd certified;
  Eigen::VectorXd certified_sigma;
  double certified_sum_of_squares = 0;
  std::vector<long double> y;
  std::vector<StrdRow> x;  // one per observation
};

// Throws std::runtime_error where the file is not one of NIST's.
StrdProblem read_strd(const std::filesystem::path& file);

// Model and derivatives are evaluated on complex numbers: f(b + i h e_k) / h has the derivative as its imaginary part,
// exact to rounding for h = 1e-100 (Squire & Trapp, SIAM Review 1998). Extended precision, because the residuals of
// Lanczos1 (1e-13) drown in the rounding of its data.
using Complex = std::complex<long double>;
using StrdModel = std::function<Complex(const std::vector<Complex>& b, const StrdRow& x)>;

const std::map<std::string, StrdModel>& strd_models();

}  // namespace crumple
