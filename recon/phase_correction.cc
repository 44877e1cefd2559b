#include "recon/phase_correction.h"

#include <algorithm>
#include <cmath>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kTerms = PhaseCorrection::kTerms;
constexpr int kUnknowns = kTerms + 1;     // the last is the mixing
constexpr double kPriorPhase = 0.03;      // stripe widths
constexpr double kPriorVariation = 0.01;  // of a tile against the mean
constexpr double kPriorMixing_px2 = 1;
constexpr double kMixingDoubt = 0.25;
// Smaller brightness gradients (per pixel) of single pixels are mostly noise.
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

// The slope between two differences at a distance of one pixel. At a blurred printed edge it changes several times over
// within that pixel: the geometric mean follows it (of a Gaussian's flank it is a constant share of the slope, whatever
// the place), where the mean of both would see the edge from one pixel too far.
float slope_between(float before, float after) {
  return before * after > 0 ? std::copysign(std::sqrt(before * after), after) : 0.0F;
}

// Of log contrast.
struct BrightnessChanges {
  // CV_32FC2. Printed edges have their own; shading, too weak to be told from the noise of one pixel, has its
  // neighbourhood's mean, and next to an edge, where that is not to be had, zero.
  cv::Mat gradient;
  // CV_32F, by the larger difference to the neighbours on either side: beside an edge a pixel's gradient may come out
  // as none.
  cv::Mat steepest;
};

BrightnessChanges brightness_changes(const cv::Mat& contrast) {
  cv::Mat central(contrast.size(), CV_32FC2), own(contrast.size(), CV_32FC2), steepest(contrast.size(), CV_32F);
  const auto c = [&](int i, int j) {
    return contrast.at<float>(std::clamp(j, 0, contrast.rows - 1), std::clamp(i, 0, contrast.cols - 1));
  };
  for (int y = 0; y < contrast.rows; ++y) {
    for (int x = 0; x < contrast.cols; ++x) {
      const float here = c(x, y), scale = 1 / std::max(here, 1.0F);
      const cv::Vec2f before(here - c(x - 1, y), here - c(x, y - 1)), after(c(x + 1, y) - here, c(x, y + 1) - here);
      central.at<cv::Vec2f>(y, x) = 0.5F * scale * (before + after);
      own.at<cv::Vec2f>(y, x) = {scale * slope_between(before[0], after[0]),
                                 scale * slope_between(before[1], after[1])};
      steepest.at<float>(y, x) = scale * std::hypot(std::max(std::abs(before[0]), std::abs(after[0])),
                                                    std::max(std::abs(before[1]), std::abs(after[1])));
    }
  }
  std::array<cv::Mat, 2> components;
  cv::split(central, components.data());
  cv::Mat steepness, near_edge, changes;
  cv::magnitude(components[0], components[1], steepness);
  const cv::Mat edge = steepness >= kLeastChange;
  const cv::Size reach(7, 7);
  cv::dilate(edge, near_edge, cv::Mat::ones(reach, CV_8U));
  cv::blur(central, changes, reach, {-1, -1}, cv::BORDER_REPLICATE);
  changes.setTo(cv::Scalar::all(0), near_edge);
  own.copyTo(changes, edge);
  steepest.setTo(0, ~near_edge);
  return {changes, steepest};
}

cv::Mat error_terms(const cv::Mat& u, const cv::Mat& sigma, const cv::Mat& slopes, const cv::Mat& changes) {
  cv::Mat terms(u.size(), CV_32FC(kUnknowns), cv::Scalar::all(0));
  cv::parallel_for_({0, u.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < u.cols; ++x) {
        if (sigma.at<float>(y, x) <= 0) continue;
        auto& t = terms.at<Terms>(y, x);
        fill_phase_terms(u.at<double>(y, x), t);
        t[kTerms] = slopes.at<cv::Vec2f>(y, x).dot(changes.at<cv::Vec2f>(y, x));
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
    n.matrix.noalias() += a * (weight * a).transpose();
    n.right += weight * t.difference * a;
  });
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
  const Vector mean = solve_symmetric(all.matrix, all.right);
  Eigen::Map<Eigen::Matrix<double, kTerms, 1>>(c.mean.data()) = mean.head<kTerms>();
  c.mixing_px2 = std::clamp(mean[kTerms], 0.0, 4.0);

  constexpr double kVariationWeight = 1 / (kPriorVariation * kPriorVariation);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    Eigen::Matrix<double, kTerms, kTerms> matrix = normals[i].matrix.topLeftCorner<kTerms, kTerms>();
    Eigen::Matrix<double, kTerms, 1> right =
        normals[i].right.head<kTerms>() - normals[i].matrix.topRightCorner<kTerms, 1>() * c.mixing_px2;
    matrix.diagonal().array() += kVariationWeight;
    right += kVariationWeight * mean.head<kTerms>();
    Eigen::Map<Eigen::Matrix<double, kTerms, 1>>(c.local.tile(static_cast<int>(i)).data()) =
        solve_symmetric(matrix, right);
  }
}

void take_out(const PhaseCorrection& c, const cv::Mat& terms, const cv::Mat& sigma, cv::Mat& u) {
  cv::parallel_for_({0, u.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < u.cols; ++x) {
        if (sigma.at<float>(y, x) <= 0) continue;
        const auto& t = terms.at<Terms>(y, x);
        std::array<double, kTerms> coefficients;
        c.local.at(x, y, coefficients);
        double error = c.mixing_px2 * double{t[kTerms]};
        for (int k = 0; k < kTerms; ++k) error += coefficients[static_cast<std::size_t>(k)] * double{t[k]};
        u.at<double>(y, x) -= error;
      }
    }
  });
}

// A pixel too isolated for a slope of its own is next to edges most of all: it has the mean one.
void add_doubt(double mixing_px2, const cv::Mat& slopes, const cv::Mat& steepest, cv::Mat& sigma) {
  double sum = 0, count = 0;
  const auto steepness_at = [&](int y, int x) { return cv::norm(slopes.at<cv::Vec2f>(y, x)); };
  for (int y = 0; y < sigma.rows; ++y) {
    for (int x = 0; x < sigma.cols; ++x) {
      const double slope = sigma.at<float>(y, x) > 0 ? steepness_at(y, x) : 0;
      sum += slope;
      count += slope > 0 ? 1 : 0;
    }
  }
  const double mean = count > 0 ? sum / count : 0;
  cv::parallel_for_({0, sigma.rows}, [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < sigma.cols; ++x) {
        auto& s = sigma.at<float>(y, x);
        if (s <= 0) continue;
        const double own = steepness_at(y, x), slope = own > 0 ? own : mean;
        s = static_cast<float>(std::hypot(double{s}, kMixingDoubt * mixing_px2 * slope * steepest.at<float>(y, x)));
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

PhaseCorrection correct_phase(cv::Mat& u, cv::Mat& sigma, const cv::Mat& contrast, const PhaseNeighbourhoods& mean) {
  PhaseCorrection c;
  c.local = TileMap(u.size(), kTerms);
  // Terms and weights are the neighbourhood's: a pixel's own share its noise, and as noise is least near the stripes'
  // boundaries, they would show a phase error where there is none.
  const BrightnessChanges changes = brightness_changes(contrast);
  const cv::Mat mean_terms = error_terms(mean.u, mean.sigma, mean.slopes, changes.gradient);
  std::vector<Normal> normals(static_cast<std::size_t>(c.local.tile_count()));
  cv::parallel_for_({0, static_cast<int>(normals.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      normals[static_cast<std::size_t>(i)] = tile_normal(u, mean.sigma, mean_terms, c.local.area(i));
    }
  });
  solve_terms(normals, c);
  take_out(c, error_terms(u, sigma, mean.slopes, changes.gradient), sigma, u);
  c.sigma_scale = observed_over_predicted(u, sigma);
  sigma *= c.sigma_scale;
  add_doubt(c.mixing_px2, mean.slopes, changes.steepest, sigma);
  return c;
}

}  // namespace crumple
