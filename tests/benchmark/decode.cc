// Integer decoding of a whole stripe sequence, columns and rows, beside OpenCV's pixel-by-pixel reading of the same
// frames.
#include "recon/decode.h"

#include <cstdlib>

#include <fmt/format.h>
#include <gflags/gflags.h>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/structured_light.hpp>

#include "tests/benchmark/report.h"

DEFINE_int32(turns, 7, "times that ours and the peer run, in turns; the best counts");
DEFINE_int32(threads, 2, "ours; the peer's loop has one");

namespace crumple {
namespace {

constexpr ImageSize kPanel{1024, 768};

// The panel's own images, dimmed, with noise of 3 grey levels: columns of 10 bits, then rows, each with its inverse.
StripeImages seen_frames() {
  cv::RNG random(1);
  const auto seen = [&](const cv::Mat& image) {
    cv::Mat noise(image.size(), CV_32F), frame;
    random.fill(noise, cv::RNG::NORMAL, 20, 3);
    image.convertTo(frame, CV_32F, 0.6);
    frame += noise;
    frame.convertTo(frame, CV_8U);
    return frame;
  };
  const cv::Mat lit(kPanel.height_px, kPanel.width_px, CV_8U, cv::Scalar(255));
  StripeImages images{.projector = kPanel, .stacks = {}, .white = seen(lit), .black = seen(0 * lit)};
  for (const double angle_rad : {0.0, CV_PI / 2}) {
    StripeStack stack{.orientation = {.angle_rad = angle_rad}, .patterns = {}, .inverses = {}};
    for (int bit = 0; bit < stack.orientation.bits; ++bit) {
      stack.patterns.push_back(seen(draw_stripes(stack.orientation, kPanel, bit, false)));
      stack.inverses.push_back(seen(draw_stripes(stack.orientation, kPanel, bit, true)));
    }
    images.stacks.push_back(stack);
  }
  return images;
}

std::vector<cv::Mat> in_their_order(const StripeImages& images) {
  std::vector<cv::Mat> frames;
  for (const StripeStack& stack : images.stacks) {
    for (std::size_t bit = 0; bit < stack.patterns.size(); ++bit) {
      frames.push_back(stack.patterns[bit]);
      frames.push_back(stack.inverses[bit]);
    }
  }
  return frames;
}

// How many pixels both decode, and how many of those to the same column and row.
void compare(const std::vector<cv::Mat>& ours, const cv::Mat& theirs) {
  std::size_t both = 0, same = 0;
  for (int y = 0; y < theirs.rows; ++y) {
    for (int x = 0; x < theirs.cols; ++x) {
      const auto peer = theirs.at<cv::Vec2i>(y, x);
      const cv::Vec2i own(ours[0].at<int>(y, x), ours[1].at<int>(y, x));
      if (peer[0] < 0 || own[0] < 0 || own[1] < 0) continue;
      ++both;
      same += own == peer;
    }
  }
  fmt::print(stderr, "{} pixels decoded by both, {} of them alike\n", both, same);
  if (1000 * same < 999 * both || 2 * both < theirs.total()) std::exit(1);
}

int run() {
  const StripeImages images = seen_frames();
  const cv::Mat everywhere(images.white.size(), CV_8U, cv::Scalar(255));
  const auto pattern = cv::structured_light::GrayCodePattern::create(kPanel.width_px, kPanel.height_px);
  pattern->setWhiteThreshold(5);
  const std::vector<cv::Mat> frames = in_their_order(images);
  std::vector<cv::Mat> decoded(2);
  cv::Mat theirs(images.white.size(), CV_32SC2, cv::Scalar(-1, -1));
  const auto ours = [&](int threads) {
    cv::setNumThreads(threads);
    return seconds_of([&] {
      for (std::size_t stack = 0; stack < 2; ++stack) {
        decoded[stack] = decode_stripes(images, stack, everywhere, {})->stripe;
      }
    });
  };
  const auto peer = [&] {
    cv::setNumThreads(1);
    return seconds_of([&] {
      for (int y = 0; y < theirs.rows; ++y) {
        for (int x = 0; x < theirs.cols; ++x) {
          cv::Point point;
          // It returns true where it fails.
          if (!pattern->getProjPixel(frames, x, y, point)) theirs.at<cv::Vec2i>(y, x) = {point.x, point.y};
        }
      }
    });
  };
  std::vector<BenchRow> rows;
  for (const int threads : {FLAGS_threads, 1}) {
    const std::string name = fmt::format("decode 40 frames of 1024x768, {} thread{}", threads, threads == 1 ? "" : "s");
    rows.push_back(in_turns(
        name, "OpenCV 4.6 getProjPixel loop", FLAGS_turns, [&] { return ours(threads); }, peer));
    compare(decoded, theirs);
  }
  report("decode", rows);
  return 0;
}

}  // namespace
}  // namespace crumple

int main(int argc, char** argv) {
  gflags::ParseCommandLineFlags(&argc, &argv, true);
  return crumple::run();
}
