#include "calib/correlation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t kRings = 40;
constexpr int kHighestDegree = 4;
constexpr int kLowestDegree = 2;  // below it a view's pose takes nearly all
constexpr int kEnoughPerMode = 4;
constexpr double kEnoughModes = 20;

// The pixels and residuals of one view.
using Residuals = std::pair<const std::vector<Eigen::Vector2d>*, const ViewSummary*>;

struct Correlogram {
  std::vector<double> products = std::vector<double>(kRings, 0.0);
  std::vector<double> pairs = std::vector<double>(kRings, 0.0);
  double squares = 0;
  double count = 0;
};

void add_view(const Residuals& view, double ring_px, Correlogram& sums) {
  const auto& [pixels, summary] = view;
  const auto dimension =
      summary->residuals_px.size() / static_cast<Eigen::Index>(std::max<std::size_t>(1, pixels->size()));
  const auto residual = [&, s = summary](std::size_t i) {
    return s->residuals_px.segment(dimension * static_cast<Eigen::Index>(i), dimension);
  };
  for (std::size_t i = 0; i < pixels->size(); ++i) {
    if (!summary->inlier[i]) continue;
    sums.squares += residual(i).squaredNorm();
    sums.count += 1;
    for (std::size_t j = i + 1; j < pixels->size(); ++j) {
      if (!summary->inlier[j]) continue;
      const double distance = ((*pixels)[i] - (*pixels)[j]).norm();
      const auto ring = static_cast<std::size_t>(std::lround(distance / ring_px));
      if (ring >= kRings) continue;
      sums.products[ring] += residual(i).dot(residual(j));
      sums.pairs[ring] += 1;
    }
  }
}

double near_inflation(const std::vector<Residuals>& views, double ring_px) {
  Correlogram sums;
  for (const Residuals& view : views) add_view(view, ring_px, sums);
  if (!(sums.squares > 0)) return 1;
  const double variance = sums.squares / sums.count;
  double inflation = 1;
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    if (sums.pairs[ring] == 0) continue;
    const double correlation = sums.products[ring] / sums.pairs[ring] / variance;
    if (correlation <= 1 / std::sqrt(sums.pairs[ring])) break;
    inflation += 2 * sums.pairs[ring] / sums.count * correlation;
  }
  return inflation;
}

double mean_spacing_px(const std::vector<CornerView>& views) {
  double sum = 0, count = 0;
  for (const CornerView& view : views) {
    for (const Eigen::Vector2d& pixel : view.pixels) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Eigen::Vector2d& other : view.pixels) {
        if (&other != &pixel) nearest = std::min(nearest, (other - pixel).norm());
      }
      if (!std::isfinite(nearest)) continue;
      sum += nearest;
      count += 1;
    }
  }
  return count > 0 ? std::max(1.0, sum / count) : 1;
}

constexpr int polynomials(int degree) { return (degree + 1) * (degree + 2) / 2; }

// Orthonormal polynomials over the accepted observations of a view, a column each with its degree; zero rows for the
// other observations. None where too few are accepted.
struct SmoothModes {
  Eigen::MatrixXd columns;
  std::vector<int> degrees;
};

Eigen::MatrixXd monomials(const std::vector<Eigen::Vector2d>& pixels, const std::vector<char>& inlier, int degree) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double accepted = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!inlier[i]) continue;
    mean += pixels[i];
    ++accepted;
  }
  mean /= accepted;
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pixels.size()), polynomials(degree));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!inlier[i]) continue;
    constexpr double kScale_px = 200;  // any length: it only keeps the powers comparable
    const Eigen::Vector2d p = (pixels[i] - mean) / kScale_px;
    auto row = values.row(static_cast<Eigen::Index>(i));
    row[0] = 1;
    // Those of a degree are those of the degree before times x, and its last times y.
    for (int d = 1; d <= degree; ++d) {
      const int first = polynomials(d - 1);
      row.segment(first, d) = p.x() * row.segment(polynomials(d - 2), d);
      row[first + d] = p.y() * row[first - 1];
    }
  }
  return values;
}

SmoothModes smooth_modes(const std::vector<Eigen::Vector2d>& pixels, const std::vector<char>& inlier) {
  const auto accepted = std::count_if(inlier.begin(), inlier.end(), [](char c) { return c != 0; });
  int degree = kHighestDegree;
  while (degree >= kLowestDegree && accepted < kEnoughPerMode * polynomials(degree)) --degree;
  if (degree < kLowestDegree) return {};
  // Gram and Schmidt, twice for the rounding; without what depends on others, as x^3 on three columns of corners.
  SmoothModes modes{monomials(pixels, inlier, degree), {}};
  Eigen::Index kept = 0;
  for (int d = 0; d <= degree; ++d) {
    for (Eigen::Index k = polynomials(d - 1); k < polynomials(d); ++k) {
      Eigen::VectorXd mode = modes.columns.col(k).normalized();
      for (int pass = 0; pass < 2; ++pass) {
        mode -= modes.columns.leftCols(kept) * (modes.columns.leftCols(kept).transpose() * mode).eval();
      }
      if (!(mode.norm() > 1e-6)) continue;
      modes.columns.col(kept++) = mode.normalized();
      modes.degrees.push_back(d);
    }
  }
  modes.columns.conservativeResize(Eigen::NoChange, kept);
  return modes;
}

// Squares of the residuals along the polynomials of each degree, over sigma, and what is expected of uncorrelated ones.
struct ModeSums {
  std::array<double, kHighestDegree + 1> squares = {};
  std::array<double, kHighestDegree + 1> expected = {};
};

// Where a view's observations lie without their noise, which would tell rows of corners apart that are one line.
std::vector<Eigen::Vector2d> predicted(std::vector<Eigen::Vector2d> pixels, const View& view,
                                       const ViewEvaluation& at) {
  if (view.kind() != View::Kind::corners) return pixels;  // stripes are read at pixels
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] += at.residuals.segment<2>(2 * static_cast<Eigen::Index>(i));
  return pixels;
}

ModeSums mode_sums(const View& view, const std::vector<Eigen::Vector2d>& pixels, const ViewSummary& summary,
                   double sigma_px, const BundleResult& bundle) {
  ViewEvaluation at;
  if (!view.evaluate(bundle.state, true, at)) return {};
  const SmoothModes modes = smooth_modes(predicted(pixels, view, at), summary.inlier);
  if (modes.degrees.empty()) return {};
  const Eigen::MatrixXd covariance = bundle.covariance.of(view.blocks(), bundle.state) / (sigma_px * sigma_px);
  const Eigen::MatrixXd local_covariance = at.local_from_blocks * covariance * at.local_from_blocks.transpose();
  const Eigen::Index d = view.dimension(), columns = at.jacobian.cols();
  ModeSums sums;
  for (Eigen::Index coordinate = 0; coordinate < d; ++coordinate) {
    const Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>> residuals(at.residuals.data() + coordinate,
                                                                               view.size(), Eigen::InnerStride<>(d));
    const Eigen::Map<const RowMajorMatrix, 0, Eigen::OuterStride<>> jacobian(
        at.jacobian.data() + coordinate * columns, view.size(), columns, Eigen::OuterStride<>(d * columns));
    const Eigen::MatrixXd by_mode = modes.columns.transpose() * jacobian;
    const Eigen::VectorXd left = modes.columns.transpose() * residuals / sigma_px;
    const Eigen::VectorXd fitted = (by_mode * local_covariance).cwiseProduct(by_mode).rowwise().sum();
    for (std::size_t k = 0; k < modes.degrees.size(); ++k) {
      const auto degree = static_cast<std::size_t>(modes.degrees[k]);
      const auto row = static_cast<Eigen::Index>(k);
      sums.squares[degree] += left[row] * left[row];
      sums.expected[degree] += 1 - fitted[row];
    }
  }
  return sums;
}

ModeSums sum_of(const std::vector<ModeSums>& views) {
  ModeSums all;
  for (const ModeSums& view : views) {
    for (std::size_t d = 0; d < all.squares.size(); ++d) {
      all.squares[d] += view.squares[d];
      all.expected[d] += view.expected[d];
    }
  }
  return all;
}

struct KnownInflation {
  double factor = 1;
  double degrees_of_freedom = std::numeric_limits<double>::infinity();
};

// All degrees together tell it best, but where the lower ones alone tell of more than their scatter above it, they
// count.
KnownInflation far_inflation(const ModeSums& sums) {
  KnownInflation far;
  const double all = std::accumulate(sums.expected.begin(), sums.expected.end(), 0.0);
  if (all >= kEnoughModes) far.degrees_of_freedom = all;
  for (int highest = kHighestDegree; highest >= kLowestDegree; --highest) {
    const double squares = std::accumulate(sums.squares.begin(), sums.squares.begin() + highest + 1, 0.0);
    const double expected = std::accumulate(sums.expected.begin(), sums.expected.begin() + highest + 1, 0.0);
    if (expected < kEnoughModes) continue;
    const bool best_known = highest == kHighestDegree;
    const double ratio = squares / expected, least = best_known ? 1 : 1 + std::sqrt(2 / expected);
    if (ratio > least * far.factor) far = {ratio, expected};
  }
  return far;
}

double group_sigma_px(const BundleResult& bundle, const ViewSummary& view) {
  const auto group = std::find_if(bundle.groups.begin(), bundle.groups.end(), [&](const GroupSummary& g) {
    return g.sensor == view.sensor && g.kind == view.kind;
  });
  return group->sigma_px;
}

}  // namespace

Inflation inflation(const Observations& observations, const BundleResult& bundle, int threads) {
  const auto views = make_views(observations, bundle.state.board_of);
  std::vector<Residuals> corners, stripes;
  std::vector<const std::vector<Eigen::Vector2d>*> pixels(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v]->kind() == View::Kind::corners) {
      pixels[v] = &observations.corners[corners.size()].pixels;
      corners.emplace_back(pixels[v], &bundle.views[v]);
    }
    if (views[v]->kind() == View::Kind::stripes) {
      pixels[v] = &observations.stripes[stripes.size()].camera_pixels;
      stripes.emplace_back(pixels[v], &bundle.views[v]);
    }
  }
  std::vector<ModeSums> sums(views.size());
  parallel_for(views.size(), threads, [&](std::size_t v) {
    if (pixels[v] == nullptr) return;
    sums[v] = mode_sums(*views[v], *pixels[v], bundle.views[v], group_sigma_px(bundle, bundle.views[v]), bundle);
  });
  std::vector<ModeSums> corner_sums, stripe_sums;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v]->kind() == View::Kind::corners) corner_sums.push_back(sums[v]);
    if (views[v]->kind() == View::Kind::stripes) stripe_sums.push_back(sums[v]);
  }
  constexpr double kStripeCell_px = 12;
  const auto larger = [](double near, const KnownInflation& far) {
    return KnownInflation{std::max(near, far.factor), far.degrees_of_freedom};
  };
  const double near_corners = near_inflation(corners, mean_spacing_px(observations.corners));
  const KnownInflation of_corners = larger(near_corners, far_inflation(sum_of(corner_sums)));
  const KnownInflation of_stripes = larger(near_inflation(stripes, kStripeCell_px), far_inflation(sum_of(stripe_sums)));
  return {of_corners.factor, of_stripes.factor, of_corners.degrees_of_freedom, of_stripes.degrees_of_freedom};
}

}  // namespace crumple
