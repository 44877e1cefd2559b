#include "datasets/motion_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include <Eigen/Core>
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "solvers/decompositions.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr int kBlock_px = 48;
constexpr double kWarning_px = 0.15;
constexpr double kSharp_px = 0.03;         // a block whose shift is less certain than this says nothing
constexpr double kSignificant = 6;         // standard deviations
constexpr double kLeastMovedShare = 0.15;  // of the blocks that can tell
constexpr std::size_t kFewestBlocks = 4;
constexpr double kSaturated = 0.98;  // of full scale

// In the order they were taken.
using FramePair = std::pair<const ShownFrame*, const ShownFrame*>;

struct PairSum {
  std::string first, second;  // the frames' names
  cv::Mat1f sum;
};

// White and black: where other frames were taken between them, they are of no one time.
std::optional<FramePair> reference_pair(const std::vector<ShownFrame>& frames) {
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const ShownFrame &a = frames[i - 1], &b = frames[i];
    const bool are_references = (a.content.kind == Kind::white && b.content.kind == Kind::black) ||
                                (a.content.kind == Kind::black && b.content.kind == Kind::white);
    if (are_references && !a.image.empty() && !b.image.empty()) return FramePair{&a, &b};
  }
  return std::nullopt;
}

// In the order they were taken.
std::vector<PairSum> pair_sums(const std::vector<ShownFrame>& frames, double full_scale) {
  std::map<std::tuple<std::size_t, int, bool>, const ShownFrame*> shown;
  for (const ShownFrame& frame : frames) {
    if (frame.content.kind != Kind::stripes || frame.image.empty()) continue;
    shown[{frame.content.orientation, frame.content.bit, frame.content.inverted}] = &frame;
  }
  std::vector<FramePair> pairs;
  if (const auto references = reference_pair(frames)) pairs.push_back(*references);
  for (const auto& [key, frame] : shown) {
    const auto& [orientation, bit, inverted] = key;
    const auto inverse = shown.find({orientation, bit, true});
    if (!inverted && inverse != shown.end()) pairs.push_back(std::minmax(frame, inverse->second));
  }
  std::sort(pairs.begin(), pairs.end());  // frames lie in one array, in their order
  std::vector<PairSum> sums;
  for (const auto& [first, second] : pairs) {
    PairSum pair{first->name, second->name, {}};
    cv::add(first->image, second->image, pair.sum, cv::noArray(), CV_32F);
    const cv::Mat lost = (first->image >= kSaturated * full_scale) | (second->image >= kSaturated * full_scale);
    pair.sum.setTo(std::numeric_limits<float>::quiet_NaN(), lost);
    sums.push_back(std::move(pair));
  }
  return sums;
}

struct BlockShift {
  double shift_px = 0;
  double sigma_px = 0;
};

// to - from = d . gradient + a from + b, solved for d, a and b. None where the block is flat or mostly saturated.
std::optional<BlockShift> block_shift(const cv::Mat1f& from, const cv::Mat1f& to, const cv::Rect& block) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double squares = 0;
  int count = 0;
  for (int y = block.y; y < block.br().y; ++y) {
    for (int x = block.x; x < block.br().x; ++x) {
      const double dx = 0.25 * (from(y, x + 1) - from(y, x - 1) + to(y, x + 1) - to(y, x - 1));
      const double dy = 0.25 * (from(y + 1, x) - from(y - 1, x) + to(y + 1, x) - to(y - 1, x));
      const double difference = to(y, x) - from(y, x);
      if (!std::isfinite(dx + dy + difference)) continue;
      const Eigen::Vector4d row(-dx, -dy, from(y, x), 1);
      normal += row * row.transpose();
      right += difference * row;
      squares += difference * difference;
      ++count;
    }
  }
  if (count < block.area() / 2) return std::nullopt;
  // The shift's own information, light eliminated.
  const Eigen::Matrix2d light = normal.bottomRightCorner<2, 2>() + 1e-9 * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d gain = solve_symmetric(light, normal.bottomLeftCorner<2, 2>());
  const Eigen::Matrix2d information = normal.topLeftCorner<2, 2>() - normal.topRightCorner<2, 2>() * gain;
  const Eigen::Vector2d reduced = right.head<2>() - gain.transpose() * right.tail<2>();
  const SymmetricEigen eigen = symmetric_eigen(information);
  const double strongest = eigen.values[1];
  if (!(strongest > 0)) return std::nullopt;
  const Eigen::Vector4d solution = solve_symmetric(normal, right);
  const double variance = std::max(0.0, squares - solution.dot(right)) / (count - 4);
  const double along = eigen.vectors.col(1).dot(reduced) / strongest;
  return BlockShift{std::abs(along), std::sqrt(variance / strongest)};
}

double shift_between(const std::vector<PairSum>& sums, std::size_t from, std::size_t to) {
  return crumple::shift_between(sums[from].sum, sums[to].sum);
}

std::string moved(const PairSum& before, const PairSum& after, double shift_px, const std::string& how) {
  return fmt::format("the rig or the object {} by about {:.2g} px between {} and {}", how, shift_px, before.first,
                     after.second);
}

// From one pair to the next, or over one that is of neither place.
Motion step(const std::vector<PairSum>& sums, std::size_t before, std::size_t after, double shift_px) {
  Motion motion{shift_px, sums[before].first, sums[after].second, moved(sums[before], sums[after], shift_px, "moved"),
                Motion::Seen::on_both_sides};
  if (after > before + 1) {
    motion.sentence += fmt::format(", in one push between {} and {} or over several frames", sums[before + 1].first,
                                   sums[before + 1].second);
  }
  const bool at_start = before == 0, at_end = after + 1 == sums.size();
  if ((!at_start && shift_between(sums, before - 1, after) <= 0) ||
      (!at_end && shift_between(sums, before, after + 1) <= 0)) {
    motion.seen = Motion::Seen::once;
  } else if (at_start || at_end) {
    motion.seen = Motion::Seen::at_an_end;
  }
  return motion;
}

// From the first pair to one that is far behind it: at once over a pair whose own sum fits neither neighbour, as where
// a push exposed its fine stripes twice, or little by little.
Motion hidden_step_or_creep(const std::vector<PairSum>& sums, std::size_t last, double shift_px) {
  for (std::size_t i = 1; i + 1 < sums.size(); ++i) {
    const double across_px = shift_between(sums, i - 1, i + 1);
    if (across_px > 0.5 * shift_px) return step(sums, i - 1, i + 1, across_px);
  }
  const bool without_either = last > 1 && shift_between(sums, 1, last) > 0 && shift_between(sums, 0, last - 1) > 0;
  return {shift_px, sums[0].first, sums[last].second, moved(sums[0], sums[last], shift_px, "crept"),
          without_either ? Motion::Seen::on_both_sides : Motion::Seen::at_an_end};
}

}  // namespace

double shift_between(const cv::Mat1f& from, const cv::Mat1f& to) {
  std::vector<double> all, shifts;
  for (int y = 1; y + kBlock_px < from.rows; y += kBlock_px) {
    for (int x = 1; x + kBlock_px < from.cols; x += kBlock_px) {
      const auto block = block_shift(from, to, {x, y, kBlock_px, kBlock_px});
      if (!block || block->sigma_px > kSharp_px) continue;
      all.push_back(block->shift_px);
      if (block->shift_px > kSignificant * block->sigma_px && block->shift_px > kWarning_px) {
        shifts.push_back(block->shift_px);
      }
    }
  }
  const double share = static_cast<double>(shifts.size()) / std::max(1.0, static_cast<double>(all.size()));
  if (shifts.size() < kFewestBlocks || share < kLeastMovedShare) return 0;
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::nth_element(shifts.begin(), middle, shifts.end());
  return *middle;
}

std::vector<Motion> find_motions(const std::vector<ShownFrame>& frames, double full_scale) {
  const std::vector<PairSum> sums = pair_sums(frames, full_scale);
  std::vector<Motion> motions;
  for (std::size_t i = 1; i < sums.size(); ++i) {
    const double step_px = shift_between(sums, i - 1, i);
    if (step_px <= 0) continue;
    const bool goes_on = i + 1 < sums.size() && shift_between(sums, i, i + 1) > 0;
    const double across_px = goes_on ? shift_between(sums, i - 1, i + 1) : 0;
    if (across_px > 0) {
      motions.push_back(step(sums, i - 1, i + 1, across_px));
      ++i;
    } else {
      motions.push_back(step(sums, i - 1, i, step_px));
    }
  }
  for (std::size_t i = sums.size(); motions.empty() && i-- > 1;) {
    const double crept_px = shift_between(sums, 0, i);
    if (crept_px > 0) motions.push_back(hidden_step_or_creep(sums, i, crept_px));
  }
  return motions;
}

std::vector<Finding> check_motion(const std::vector<ShownFrame>& frames, double full_scale, const std::string& where) {
  std::vector<Finding> findings;
  for (const Motion& motion : find_motions(frames, full_scale)) {
    const bool useless = motion.shift_px >= kUselessShift_px;
    findings.push_back({useless ? Severity::error : Severity::warning, where,
                        motion.sentence + (useless ? ": take the station again, or exclude it"
                                                   : ": its points are the less certain for it")});
  }
  return findings;
}

}  // namespace crumple
