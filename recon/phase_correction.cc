#include "recon/phase_correction.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <opencv2/core.hpp>

namespace crumple {
namespace {

constexpr int kTerms = PhaseCorrection::kTerms;
constexpr int kUnknowns = kTerms + 1;     // the last is the mixing
constexpr double kPriorPhase = 0.03;      // stripe widths
constexpr double kPriorVariation = 0.01;  // of a tile against the mean
constexpr double kPriorMixing_px2 = 1;
constexpr double kMixingDoubt = 0.25;
// Smaller brightness gradients (per pixel) are mostly noise, which would bias the mixing towards zero.
constexpr double kLeastChange = 0.04;
constexpr std::size_t kEnoughTriples = 1000;

using Terms = cv::Vec<float, kUnknowns>;
using Vector = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

void fill_phase_terms(double u, Terms& terms) {
  // Higher frequencies by the double-angle formulas, from a quarter of a cycle per stripe.
  double s = std::sin(M_PI_2 * u);
  double c = std::cos(M_PI_2 * u);
  const std::array<int, 4> slot = {6, 4, 0, 2};
  for (const int i : slot) {
    terms[i] = static_cast<float>(s);
    terms[i + 1] = static_cast<float>(c);
    const double twice_s = 2 * s * c;
    c = c * c - s * s;
    s = twice_s;
  }
}

// The gradient of u over the 7 x 7 neighbourhood, by least squares over the pixels that have a coordinate.
Eigen::Vector2d gradient_at(const cv::Mat& u, const cv::Mat& sigma, int x, int y) {
  constexpr int kReach = 3;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double centre = u.at<double>(y, x);
  for (int j = std::max(0, y - kReach); j <= std::min(u.rows - 1, y + kReach); ++j) {
    for (int i = std::max(0, x - kReach); i <= std::min(u.cols - 1, x + kReach); ++i) {
      if (sigma.at<float>(j, i) <= 0) continue;
      const double rise = u.at<double>(j, i) - centre;
      if (std::abs(rise) > 4 * kReach) continue;
      const Eigen::Vector3d a(i - x, j - y, 1);
      normal += a * a.transpose();
      right += a * rise;
    }
  }
  if (normal(2, 2) < 10 || normal.determinant() < 1e-3 * normal(2, 2)) return Eigen::Vector2d::Zero();
  return normal.ldlt().solve(right).head<2>();
}

Eigen::Vector2d log_gradient(const cv::Mat& contrast, int x, int y) {
  const auto c = [&](int i, int j) {
    return static_cast<double>(
        contrast.at<float>(std::clamp(j, 0, contrast.rows - 1), std::clamp(i, 0, contrast.cols - 1)));
  };
  return Eigen::Vector2d(c(x + 1, y) - c(x - 1, y), c(x, y + 1) - c(x, y - 1)) / (2 * std::max(c(x, y), 1.0));
}

cv::Mat error_terms(const cv::Mat& u, const cv::Mat& sigma, const cv::Mat& contrast) {
  cv::Mat terms(u.size(), CV_32FC(kUnknowns), cv::Scalar::all(0));
  cv::parallel_for_({0, u.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < u.cols; ++x) {
        if (sigma.at<float>(y, x) <= 0) continue;
        auto& t = terms.at<Terms>(y, x);
        fill_phase_terms(u.at<double>(y, x), t);
        const Eigen::Vector2d change = log_gradient(contrast, x, y);
        if (change.norm() < kLeastChange) continue;
        t[kTerms] = static_cast<float>(gradient_at(u, sigma, x, y).dot(change));
      }
    }
  });
  return terms;
}

struct Triple {
  double difference;  // u_before - 2 u + u_after
  double sigma;       // predicted
};

// Calls visit(triple, before, middle, after) for every triple of valid pixels centred in the rectangle.
template <typename Visit>
void for_each_triple(const cv::Mat& u, const cv::Mat& sigma, const cv::Rect& area, Visit visit) {
  for (const cv::Point step : {cv::Point(1, 0), cv::Point(2, 0), cv::Point(0, 1), cv::Point(0, 2)}) {
    const int x1 = std::min(area.br().x, u.cols - step.x);
    const int y1 = std::min(area.br().y, u.rows - step.y);
    for (int y = std::max(area.y, step.y); y < y1; ++y) {
      for (int x = std::max(area.x, step.x); x < x1; ++x) {
        const cv::Point middle(x, y), before = middle - step, after = middle + step;
        const double sb = sigma.at<float>(before), sm = sigma.at<float>(middle), sa = sigma.at<float>(after);
        if (sb <= 0 || sm <= 0 || sa <= 0) continue;
        const Triple triple{u.at<double>(before) - 2 * u.at<double>(middle) + u.at<double>(after),
                            std::sqrt(sb * sb + 4 * sm * sm + sa * sa)};
        // Beyond the gate is an edge of the surface, not an error to be modelled.
        if (std::abs(triple.difference) < 5 * triple.sigma + 0.1) visit(triple, before, middle, after);
      }
    }
  }
}

struct Normal {
  Matrix matrix = Matrix::Zero();
  Vector right = Vector::Zero();
};

Normal tile_normal(const cv::Mat& u, const cv::Mat& sigma, const cv::Mat& terms, const cv::Rect& area) {
  Normal n;
  for_each_triple(u, sigma, area, [&](const Triple& t, cv::Point before, cv::Point middle, cv::Point after) {
    const auto& tb = terms.at<Terms>(before);
    const auto& tm = terms.at<Terms>(middle);
    const auto& ta = terms.at<Terms>(after);
    Vector a;
    for (int i = 0; i < kUnknowns; ++i) a[i] = double{tb[i]} - 2 * double{tm[i]} + double{ta[i]};
    const double weight = 1 / (t.sigma * t.sigma);
    n.matrix.selfadjointView<Eigen::Lower>().rankUpdate(a, weight);
    n.right += weight * t.difference * a;
  });
  n.matrix = n.matrix.selfadjointView<Eigen::Lower>();
  return n;
}

void solve_terms(const std::vector<Normal>& normals, PhaseCorrection& c) {
  Normal all;
  for (const Normal& n : normals) {
    all.matrix += n.matrix;
    all.right += n.right;
  }
  all.matrix.diagonal().head<kTerms>().array() += 1 / (kPriorPhase * kPriorPhase);
  all.matrix(kTerms, kTerms) += 1 / (kPriorMixing_px2 * kPriorMixing_px2);
  const Vector mean = all.matrix.ldlt().solve(all.right);
  Eigen::Map<Eigen::Matrix<double, kTerms, 1>>(c.mean.data()) = mean.head<kTerms>();
  c.mixing_px2 = std::clamp(mean[kTerms], 0.0, 4.0);

  constexpr double kVariationWeight = 1 / (kPriorVariation * kPriorVariation);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    Eigen::Matrix<double, kTerms, kTerms> matrix = normals[i].matrix.topLeftCorner<kTerms, kTerms>();
    Eigen::Matrix<double, kTerms, 1> right =
        normals[i].right.head<kTerms>() - normals[i].matrix.topRightCorner<kTerms, 1>() * c.mixing_px2;
    matrix.diagonal().array() += kVariationWeight;
    right += kVariationWeight * mean.head<kTerms>();
    Eigen::Map<Eigen::Matrix<double, kTerms, 1>>(c.local.tile(static_cast<int>(i)).data()) = matrix.ldlt().solve(right);
  }
}

void apply(const PhaseCorrection& c, const cv::Mat& terms, cv::Mat& u, cv::Mat& sigma) {
  cv::parallel_for_({0, u.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < u.cols; ++x) {
        auto& s = sigma.at<float>(y, x);
        if (s <= 0) continue;
        const auto& t = terms.at<Terms>(y, x);
        std::array<double, kTerms> coefficients;
        c.local.at(x, y, coefficients);
        const double mixing = c.mixing_px2 * double{t[kTerms]};
        double error = mixing;
        for (int k = 0; k < kTerms; ++k) error += coefficients[static_cast<std::size_t>(k)] * double{t[k]};
        u.at<double>(y, x) -= error;
        s = static_cast<float>(std::hypot(double{s}, kMixingDoubt * mixing));
      }
    }
  });
}

double observed_over_predicted(const cv::Mat& u, const cv::Mat& sigma) {
  std::vector<float> ratios;
  for_each_triple(u, sigma, {{0, 0}, u.size()}, [&](const Triple& t, cv::Point, cv::Point, cv::Point) {
    ratios.push_back(static_cast<float>(std::abs(t.difference) / t.sigma));
  });
  if (ratios.size() < kEnoughTriples) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  constexpr double kSigmaOverMedian = 1.4826;
  return std::clamp(kSigmaOverMedian * *middle, 0.5, 3.0);
}

}  // namespace

PhaseCorrection correct_phase(cv::Mat& u, cv::Mat& sigma, const cv::Mat& contrast) {
  PhaseCorrection c;
  c.local = TileMap(u.size(), kTerms);
  const cv::Mat terms = error_terms(u, sigma, contrast);
  std::vector<Normal> normals(static_cast<std::size_t>(c.local.tile_count()));
  cv::parallel_for_({0, static_cast<int>(normals.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      normals[static_cast<std::size_t>(i)] = tile_normal(u, sigma, terms, c.local.area(i));
    }
  });
  solve_terms(normals, c);
  apply(c, terms, u, sigma);
  c.sigma_scale = observed_over_predicted(u, sigma);
  sigma *= c.sigma_scale;
  return c;
}

}  // namespace crumple
