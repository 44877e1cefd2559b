#include "calib/correlation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "solvers/parallel.h"

namespace crumple {
namespace {

constexpr std::size_t kRings = 40;
constexpr int kModes = 6;  // 1, x, y, x^2, x y, y^2
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

// Orthonormal polynomials over the accepted observations of a view; zero rows for the others. No columns where too few
// observations are accepted.
Eigen::MatrixXd smooth_modes(const std::vector<Eigen::Vector2d>& pixels, const std::vector<char>& inlier) {
  const auto n = static_cast<Eigen::Index>(pixels.size());
  const auto accepted = static_cast<double>(std::count_if(inlier.begin(), inlier.end(), [](char c) { return c != 0; }));
  if (accepted < kEnoughPerMode * kModes) return Eigen::MatrixXd(n, 0);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (inlier[i]) mean += pixels[i] / accepted;
  }
  Eigen::MatrixXd modes = Eigen::MatrixXd::Zero(n, kModes);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    constexpr double kScale_px = 200;  // any length: it only keeps the powers comparable
    const Eigen::Vector2d p = (pixels[i] - mean) / kScale_px;
    if (inlier[i])
      modes.row(static_cast<Eigen::Index>(i)) << 1, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y();
  }
  // Gram and Schmidt, twice for the rounding.
  for (int pass = 0; pass < 2; ++pass) {
    for (int k = 0; k < kModes; ++k) {
      modes.col(k) -= modes.leftCols(k) * (modes.leftCols(k).transpose() * modes.col(k)).eval();
      const double norm = modes.col(k).norm();
      if (norm < 1e-9) return Eigen::MatrixXd(n, 0);
      modes.col(k) /= norm;
    }
  }
  return modes;
}

struct ModeSums {
  double squares = 0;
  double expected = 0;
};

ModeSums mode_sums(const View& view, const std::vector<Eigen::Vector2d>& pixels, const ViewSummary& summary,
                   double sigma_px, const BundleResult& bundle) {
  const Eigen::MatrixXd modes = smooth_modes(pixels, summary.inlier);
  ViewEvaluation at;
  if (modes.cols() == 0 || !view.evaluate(bundle.state, true, at)) return {};
  const Eigen::MatrixXd covariance = bundle.covariance.of(view.blocks(), bundle.state) / (sigma_px * sigma_px);
  const Eigen::MatrixXd local_covariance = at.local_from_blocks * covariance * at.local_from_blocks.transpose();
  const Eigen::Index d = view.dimension(), columns = at.jacobian.cols();
  ModeSums sums;
  for (Eigen::Index coordinate = 0; coordinate < d; ++coordinate) {
    const Eigen::Map<const Eigen::VectorXd, 0, Eigen::InnerStride<>> residuals(at.residuals.data() + coordinate,
                                                                               view.size(), Eigen::InnerStride<>(d));
    const Eigen::Map<const RowMajorMatrix, 0, Eigen::OuterStride<>> jacobian(
        at.jacobian.data() + coordinate * columns, view.size(), columns, Eigen::OuterStride<>(d * columns));
    const Eigen::MatrixXd by_mode = modes.transpose() * jacobian;
    sums.squares += (modes.transpose() * residuals).squaredNorm() / (sigma_px * sigma_px);
    sums.expected += kModes - (by_mode * local_covariance).cwiseProduct(by_mode).sum();
  }
  return sums;
}

double far_inflation(const std::vector<ModeSums>& views) {
  ModeSums all;
  for (const ModeSums& view : views) {
    all.squares += view.squares;
    all.expected += view.expected;
  }
  if (all.expected < kEnoughModes) return 1;
  const double ratio = all.squares / all.expected;
  return ratio > 1 + std::sqrt(2 / all.expected) ? ratio : 1;
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
  return {std::max(near_inflation(corners, mean_spacing_px(observations.corners)), far_inflation(corner_sums)),
          std::max(near_inflation(stripes, kStripeCell_px), far_inflation(stripe_sums))};
}

}  // namespace crumple
