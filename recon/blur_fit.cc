#include "recon/blur_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/core/utility.hpp>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kBlurParameters = 4;
constexpr int kBlurIterations = 6;
// Reach of the grid around the whole-stripe code: one bit that flipped in noise costs one stripe.
constexpr double kPhaseReach = 2;
constexpr std::size_t kGlobalSample = 2500;
constexpr int kLevels = 25;
constexpr int kLevelStep = 2;  // of the search; a parabola finds the rest
constexpr double kLevelsPerOctave = 16;
constexpr double kGate = 9;  // times the median square
// Times the core's width, at least: a narrower skirt would trade with the core.
constexpr double kLeastSkirt = 3;
constexpr int kMiddleLevel = kLevels / 2;
constexpr std::size_t kEnoughInTile = 40;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double relative_squares(const StripeFit& fit) { return fit.squares / (fit.gain * fit.gain); }

// One blur for the whole image: Gauss-Newton on blur and offsets.
class GlobalFit {
 public:
  GlobalFit(const StripeSpectrum& spectrum, int bits, std::span<const PixelSignal> pixels)
      : spectrum_(spectrum), bits_(bits) {
    const std::size_t every = std::max<std::size_t>(1, pixels.size() / kGlobalSample);
    for (std::size_t i = 0; i < pixels.size(); i += every) pixels_.push_back(pixels[i]);
  }

  struct Estimate {
    StripeBlur blur;
    BitVector offsets = BitVector::Zero();
    StripeTable table;
  };

  Estimate run() {
    Estimate estimate = best_start();
    for (int i = 0; i < kBlurIterations && !pixels_.empty(); ++i) step(estimate);
    return estimate;
  }

 private:
  void tabulate(Estimate& e) const {
    e.table = spectrum_.blurred([&](double f) { return blur_transfer(e.blur, f); });
  }

  // Fits every pixel and marks the ones to use; the result is the median of the relative squares.
  double fit_pixels(const Estimate& e) {
    std::vector<double> squares;
    fits_.clear();
    for (const PixelSignal& p : pixels_) {
      fits_.push_back(fit_stripe(e.table, e.offsets, p.differences, p.start, kPhaseReach));
      if (fits_.back().gain > 0) squares.push_back(relative_squares(fits_.back()));
    }
    const double middle = median(std::move(squares));
    for (StripeFit& fit : fits_) {
      if (!(relative_squares(fit) < kGate * middle)) fit.information = 0;
    }
    return middle;
  }

  Estimate best_start() {
    Estimate best;
    double least = -1;
    for (const double core : {0.35, 0.5, 0.7, 1.0, 1.4}) {
      Estimate e;
      e.blur.core = core;
      tabulate(e);
      const double squares = fit_pixels(e);
      if (least < 0 || squares < least) {
        least = squares;
        best = std::move(e);
      }
    }
    return best;
  }

  void step(Estimate& e) {
    const double variance = std::max(fit_pixels(e) / std::max(1.0, bits_ - 2.0), 1e-8);
    const int n = kBlurParameters + bits_;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    accumulate(e, normal, right);
    normal /= variance;
    right /= variance;
    add_prior(e, normal, right);
    apply(solve_symmetric(normal, right), e);
    tabulate(e);
  }

  void accumulate(const Estimate& e, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
    std::vector<StripeTable> derivatives;
    for (std::size_t p = 0; p < kBlurParameters; ++p) {
      derivatives.push_back(spectrum_.blurred([&](double f) { return d_blur_transfer(e.blur, f)[p]; }));
    }
    Eigen::MatrixXd jacobian(bits_, normal.cols());
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const StripeFit& fit = fits_[i];
      if (!(fit.information > 0)) continue;
      const StripeTable::Sample at = e.table.at(fit.u);
      const BitVector model = at.value + e.offsets;
      const BitVector left = pixels_[i].differences / static_cast<float>(fit.gain) - model;
      jacobian.rightCols(bits_).setIdentity();
      for (int p = 0; p < kBlurParameters; ++p) {
        jacobian.col(p) = derivatives[static_cast<std::size_t>(p)].at(fit.u).value.head(bits_).cast<double>();
      }
      // What the pixel's own gain and coordinate can absorb says nothing about the blur.
      const Eigen::VectorXd value = model.head(bits_).cast<double>().normalized();
      Eigen::VectorXd slope = at.slope.head(bits_).cast<double>();
      slope = (slope - value * value.dot(slope)).normalized();
      jacobian -= value * (value.transpose() * jacobian).eval();
      jacobian -= slope * (slope.transpose() * jacobian).eval();
      normal += jacobian.transpose() * jacobian;
      right += jacobian.transpose() * left.head(bits_).cast<double>();
    }
  }

  void add_prior(const Estimate& e, Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
    const StripeBlur typical;
    const auto pull = [&](Eigen::Index i, double away, double sigma) {
      normal(i, i) += 1 / (sigma * sigma);
      right[i] -= away / (sigma * sigma);
    };
    pull(0, std::log(e.blur.core / typical.core), 1.0);
    pull(1, std::log(e.blur.skirt / typical.skirt), 0.3);
    pull(2, e.blur.skirt_share - typical.skirt_share, 0.1);
    pull(3, e.blur.halo_share - typical.halo_share, 0.1);
    for (int b = 0; b < bits_; ++b) pull(kBlurParameters + b, double{e.offsets[b]}, 0.02);
  }

  void apply(const Eigen::VectorXd& step, Estimate& e) const {
    const auto limited = [](double x, double limit) { return std::clamp(x, -limit, limit); };
    e.blur.core = std::clamp(e.blur.core * std::exp(limited(step[0], 0.4)), 0.1, 3.0);
    e.blur.skirt = std::clamp(e.blur.skirt * std::exp(limited(step[1], 0.4)), kLeastSkirt * e.blur.core, 12.0);
    e.blur.skirt_share = std::clamp(e.blur.skirt_share + limited(step[2], 0.1), 0.0, 0.4);
    e.blur.halo_share = std::clamp(e.blur.halo_share + limited(step[3], 0.1), 0.0, 0.4);
    for (int b = 0; b < bits_; ++b) {
      e.offsets[b] += static_cast<float>(limited(step[kBlurParameters + b], 0.05));
    }
  }

  const StripeSpectrum& spectrum_;
  int bits_;
  std::vector<PixelSignal> pixels_;
  std::vector<StripeFit> fits_;
};

// Squares relative to the gain's, of each pixel at one level; infinite where the level does not explain the pixel.
std::vector<double> squares_at(const StripeModel& model, int level, const std::vector<const PixelSignal*>& pixels) {
  std::vector<double> squares;
  for (const PixelSignal* p : pixels) {
    const StripeFit fit =
        fit_stripe(model.tables[static_cast<std::size_t>(level)], model.offsets, p->differences, p->start, kPhaseReach);
    squares.push_back(fit.gain > 0 ? relative_squares(fit) : std::numeric_limits<double>::infinity());
  }
  return squares;
}

// The level of least squares over the pixels that the middle level explains, refined by a parabola through the
// neighbours. A median of the squares would prefer blur that is too narrow: half of the pixels tell little of it.
double best_level(const StripeModel& model, const std::vector<const PixelSignal*>& pixels) {
  std::vector<std::vector<double>> squares;
  for (int level = 0; level < kLevels; level += kLevelStep) squares.push_back(squares_at(model, level, pixels));
  const std::vector<double>& middle = squares[squares.size() / 2];
  const double limit = kGate * median(middle);
  std::vector<double> cost(squares.size(), 0.0);
  bool explained = false;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!(middle[i] < limit)) continue;
    explained = true;
    for (std::size_t l = 0; l < cost.size(); ++l) cost[l] += std::min(squares[l][i], limit);
  }
  if (!explained) return kMiddleLevel;
  const auto best = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  double level = static_cast<double>(best);
  if (best > 0 && best + 1 < cost.size()) {
    const double curvature = cost[best - 1] - 2 * cost[best] + cost[best + 1];
    if (curvature > 0) level += 0.5 * (cost[best - 1] - cost[best + 1]) / curvature;
  }
  return kLevelStep * level;
}

void fit_levels(StripeModel& model, std::span<const PixelSignal> pixels) {
  std::vector<std::vector<const PixelSignal*>> in_tile(static_cast<std::size_t>(model.level.tile_count()));
  for (const PixelSignal& p : pixels) {
    in_tile[static_cast<std::size_t>(model.level.tile_of(p.x, p.y))].push_back(&p);
  }
  cv::parallel_for_({0, model.level.tile_count()}, [&](const cv::Range& range) {
    for (int tile = range.start; tile < range.end; ++tile) {
      const auto& mine = in_tile[static_cast<std::size_t>(tile)];
      model.level.tile(tile)[0] = mine.size() < kEnoughInTile ? kMiddleLevel : best_level(model, mine);
    }
  });
}

}  // namespace

const StripeTable& StripeModel::table_at(int x, int y) const {
  double fractional = 0;
  level.at(x, y, {&fractional, 1});
  return tables[static_cast<std::size_t>(std::lround(fractional))];
}

StripeModel fit_stripe_model(const StripeOrientation& orientation, ImageSize projector, cv::Size camera,
                             std::span<const PixelSignal> pixels) {
  const StripeSpectrum spectrum(orientation, projector);
  const GlobalFit::Estimate global = GlobalFit(spectrum, orientation.bits, pixels).run();
  StripeModel model{.blur = global.blur, .offsets = global.offsets, .tables = {}, .level = TileMap(camera, 1)};
  for (int i = 0; i < kLevels; ++i) {
    StripeBlur blur = global.blur;
    blur.core *= std::exp2((i - kMiddleLevel) / kLevelsPerOctave);
    model.tables.push_back(spectrum.blurred([&](double f) { return blur_transfer(blur, f); }));
  }
  fit_levels(model, pixels);
  return model;
}

}  // namespace crumple
