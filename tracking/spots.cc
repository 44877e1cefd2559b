#include "tracking/spots.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

constexpr int kSamplingStep = 2;  // of a block's pixels, in both directions
constexpr int kFrame_px = 2;      // around a spot's pixels that its fit takes in

struct Background {
  cv::Mat level;  // CV_32F
  cv::Mat sigma;
};

// Median, and how far the 16th percentile lies below it.
Background background_of(const cv::Mat& image, int block_px) {
  const int side = std::max(8, block_px);
  const int rows = std::max(1, image.rows / side), columns = std::max(1, image.cols / side);
  cv::Mat level(rows, columns, CV_32F), sigma(rows, columns, CV_32F);
  std::vector<float> values;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      values.clear();
      for (int y = r * image.rows / rows; y < (r + 1) * image.rows / rows; y += kSamplingStep) {
        const float* row = image.ptr<float>(y);
        for (int x = c * image.cols / columns; x < (c + 1) * image.cols / columns; x += kSamplingStep) {
          values.push_back(row[x]);
        }
      }
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      const auto low = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 16 / 100);
      std::nth_element(values.begin(), middle, values.end());
      level.at<float>(r, c) = *middle;
      std::nth_element(values.begin(), low, middle);
      sigma.at<float>(r, c) = level.at<float>(r, c) - *low;
    }
  }
  Background result;
  cv::resize(level, result.level, image.size(), 0, 0, cv::INTER_LINEAR);
  cv::resize(sigma, result.sigma, image.size(), 0, 0, cv::INTER_LINEAR);
  return result;
}

class SpotFinder {
 public:
  SpotFinder(const cv::Mat& image, double range, const SpotOptions& options)
      : image_(image),
        options_(options),
        noise_{options.noise.dark * range / 255, options.noise.gain * range / 255},
        saturated_level_(options.saturation * range),
        background_(background_of(image, options.block_px)) {
    cv::Mat threshold = cv::max(options.noise_sigmas * background_.sigma, options.contrast * range);
    threshold += background_.level;
    cv::Mat bright;
    cv::compare(image_, threshold, bright, cv::CMP_GT);
    count_ = cv::connectedComponentsWithStats(bright, labels_, stats_, centroids_, 8, CV_32S);
  }

  SpotsFound found() const {
    SpotsFound result;
    for (int label = 1; label < count_; ++label) add(label, result);
    return result;
  }

 private:
  cv::Rect box(int label) const {
    const int* s = stats_.ptr<int>(label);
    return {s[cv::CC_STAT_LEFT], s[cv::CC_STAT_TOP], s[cv::CC_STAT_WIDTH], s[cv::CC_STAT_HEIGHT]};
  }

  double light(int x, int y) const { return image_.at<float>(y, x) - background_.level.at<float>(y, x); }

  void add(int label, SpotsFound& result) const {
    const cv::Rect b = box(label);
    const int area = stats_.at<int>(label, cv::CC_STAT_AREA);
    const Eigen::Vector2d middle(centroids_.at<double>(label, 0), centroids_.at<double>(label, 1));
    const auto refuse = [&](SpotRefusal why) { result.refused.push_back({middle, why}); };
    if (area < options_.fewest_pixels) return refuse(SpotRefusal::hot_pixel);
    if (area > options_.most_pixels) return refuse(SpotRefusal::too_big);
    if (b.x < 1 || b.y < 1 || b.x + b.width > image_.cols - 1 || b.y + b.height > image_.rows - 1) {
      return refuse(SpotRefusal::at_the_edge);
    }
    Spot spot;
    SpotModel start;
    if (!moments(label, b, spot, start)) return refuse(SpotRefusal::elongated);
    const auto fit = fit_spot(samples(label, b), start, noise_, options_.largest_width_px);
    if (!fit) return refuse(SpotRefusal::no_spot);
    spot.pixel = fit->model.centre_px;
    spot.covariance_px2 = fit->covariance_px2;
    spot.width_px = fit->model.width_px;
    result.spots.push_back(spot);
  }

  // False where they are too long for their width.
  bool moments(int label, const cv::Rect& b, Spot& spot, SpotModel& start) const {
    double sum = 0;
    Eigen::Vector2d first = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for (int y = b.y; y < b.y + b.height; ++y) {
      for (int x = b.x; x < b.x + b.width; ++x) {
        if (labels_.at<int>(y, x) != label) continue;
        const double w = light(x, y);
        const Eigen::Vector2d p(x, y);
        sum += w;
        first += w * p;
        second += w * p * p.transpose();
        spot.peak = std::max(spot.peak, w);
        spot.saturated += image_.at<float>(y, x) >= saturated_level_;
        ++spot.pixels;
      }
    }
    spot.centre_of_gravity_px = first / sum;
    second = second / sum - spot.centre_of_gravity_px * spot.centre_of_gravity_px.transpose();
    // A row of pixels has no width of its own: that of a pixel is the least.
    const Eigen::Vector2d axes = symmetric_eigen2(second + Eigen::Matrix2d::Identity() / 12).values;
    const double width = std::clamp(std::sqrt(second.trace() / 2), 0.4, 0.9 * options_.largest_width_px);
    const double middle_level = background_.level.at<float>(static_cast<int>(spot.centre_of_gravity_px.y() + 0.5),
                                                            static_cast<int>(spot.centre_of_gravity_px.x() + 0.5));
    start = {spot.centre_of_gravity_px, width, 1.1 * sum, middle_level};
    return axes[1] <= options_.largest_elongation * options_.largest_elongation * axes[0];
  }

  std::vector<SpotSample> samples(int label, const cv::Rect& b) const {
    std::vector<SpotSample> result;
    const cv::Rect wide =
        cv::Rect(b.x - kFrame_px, b.y - kFrame_px, b.width + 2 * kFrame_px, b.height + 2 * kFrame_px) &
        cv::Rect({0, 0}, image_.size());
    for (int y = wide.y; y < wide.y + wide.height; ++y) {
      for (int x = wide.x; x < wide.x + wide.width; ++x) {
        const int of = labels_.at<int>(y, x);
        const double level = image_.at<float>(y, x);
        if ((of == 0 || of == label) && level < saturated_level_) result.push_back({x, y, level});
      }
    }
    return result;
  }

  const cv::Mat& image_;
  const SpotOptions& options_;
  LevelNoise noise_;
  double saturated_level_;
  Background background_;
  cv::Mat labels_, stats_, centroids_;
  int count_ = 0;
};

}  // namespace

const char* words(SpotRefusal refusal) {
  switch (refusal) {
    case SpotRefusal::hot_pixel:
      return "too few pixels: a hot pixel or a far reflection";
    case SpotRefusal::too_big:
      return "too many pixels: a lamp or a window";
    case SpotRefusal::at_the_edge:
      return "cut by the image's edge";
    case SpotRefusal::elongated:
      return "elongated: two lights that run together, or one that moved";
    case SpotRefusal::no_spot:
      return "its light does not fall off like a spot's";
  }
  return "";
}

Expected<SpotsFound> find_spots(const cv::Mat& image, const SpotOptions& options) {
  if (image.empty()) return fail("there is no image to look for spots in");
  if (image.type() != CV_8UC1 && image.type() != CV_16UC1) {
    return fail("spots are looked for in grey images of 8 or 16 bit: convert the image first");
  }
  cv::Mat levels;
  image.convertTo(levels, CV_32F);
  return SpotFinder(levels, image.depth() == CV_8U ? 255 : 65535, options).found();
}

}  // namespace crumple
