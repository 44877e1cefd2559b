#include "solvers/lens_domain.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crumple {
namespace {

// Polynomials by ascending powers.
using Polynomial = std::vector<double>;

// Slopes of 100 are 89.4 degrees off axis: a fold further out bounds nothing that z > 0 does not.
constexpr double kSearchedSquare = 1e4;
constexpr int kBisections = 80;

double value_of(const Polynomial& p, double s) {
  double value = 0;
  for (auto c = p.rbegin(); c != p.rend(); ++c) value = value * s + *c;
  return value;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial d;
  for (std::size_t i = 1; i < p.size(); ++i) d.push_back(static_cast<double>(i) * p[i]);
  return d;
}

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial p(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) p[i + j] += a[i] * b[j];
  }
  return p;
}

// Where the polynomial changes sign between 0 and the search's end: between its extrema it is monotonic, and they are
// the derivative's sign changes.
std::vector<double> sign_changes(const Polynomial& p) {
  if (p.size() < 2) return {};
  std::vector<double> ends = sign_changes(derivative(p));
  ends.push_back(kSearchedSquare);
  std::vector<double> roots;
  double low = 0;
  for (const double end : ends) {
    const bool rises = value_of(p, low) < 0;
    if (rises != (value_of(p, end) < 0)) {
      double from = low, to = end;
      for (int i = 0; i < kBisections; ++i) {
        const double middle = 0.5 * (from + to);
        ((value_of(p, middle) < 0) == rises ? from : to) = middle;
      }
      roots.push_back(from);
    }
    low = end;
  }
  return roots;
}

// The polynomial is positive from 0 to here.
double positive_until(const Polynomial& p) {
  if (p.front() <= 0) return 0;
  const std::vector<double> roots = sign_changes(p);
  return roots.empty() ? std::numeric_limits<double>::infinity() : roots.front();
}

// From p(s) to p + 2 s p', the derivative of r p(r^2) by r.
Polynomial d_radius(const Polynomial& p) {
  Polynomial d = p;
  for (std::size_t i = 1; i < p.size(); ++i) d[i] += 2 * static_cast<double>(i) * p[i];
  return d;
}

struct RadialFraction {
  Polynomial numerator, denominator;
};

RadialFraction radial_fraction(const std::vector<double>& parameters) {
  const auto term = [&](std::size_t i) { return i < parameters.size() ? parameters[i] : 0.0; };
  return {{1, term(4), term(5), term(8)}, {1, term(9), term(10), term(11)}};
}

}  // namespace

LensDomain LensDomain::opencv(const std::vector<double>& parameters) {
  const auto [numerator, denominator] = radial_fraction(parameters);
  // d/dr (r N / D) has the sign of (N + 2 s N') D - 2 s N D'.
  Polynomial rises = product(d_radius(numerator), denominator);
  const Polynomial falls = product(numerator, derivative(denominator));
  for (std::size_t i = 0; i < falls.size(); ++i) rises[i + 1] -= 2 * falls[i];
  LensDomain domain(Kind::radial);
  domain.largest_square_ = std::min(positive_until(rises), positive_until(denominator));
  return domain;
}

LensDomain LensDomain::opencv_past_fold(const std::vector<double>& parameters) {
  LensDomain domain(Kind::radial);
  domain.largest_square_ = positive_until(radial_fraction(parameters).denominator);
  return domain;
}

LensDomain LensDomain::cahvor(const std::vector<double>& parameters) {
  LensDomain domain(Kind::cahvor);
  const double alpha = parameters[4], beta = parameters[5];
  domain.axis_ << std::sin(alpha) * std::cos(beta), std::sin(beta), std::cos(alpha) * std::cos(beta);
  domain.radial_ << parameters[6], parameters[7], parameters[8];
  domain.largest_square_ = positive_until(d_radius({1 + parameters[6], parameters[7], parameters[8]}));
  return domain;
}

LensDomain LensDomain::stereographic(const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  LensDomain domain(Kind::stereographic);
  domain.low_ = low;
  domain.high_ = high;
  return domain;
}

double LensDomain::largest_slope() const { return std::sqrt(largest_square_); }

bool LensDomain::contains(const Eigen::Vector3d& point) const {
  switch (kind_) {
    case Kind::radial: {
      return point.z() > 0 && point.head<2>().squaredNorm() < largest_square_ * point.z() * point.z();
    }
    case Kind::cahvor: {
      const double along = point.dot(axis_);
      const Eigen::Vector3d across = point - along * axis_;
      if (!(point.z() > 0 && along > 0)) return false;
      const double s = across.squaredNorm() / (along * along);
      const double stretch = radial_[0] + s * (radial_[1] + s * radial_[2]);
      return s < largest_square_ && point.z() + stretch * across.z() > 0;
    }
    case Kind::stereographic:
      break;
  }
  const double half = 0.5 * (point.norm() + point.z());
  if (!(half > 0)) return false;
  const Eigen::Vector2d u = point.head<2>() / half;
  return (u.array() >= low_.array()).all() && (u.array() <= high_.array()).all();
}

}  // namespace crumple
