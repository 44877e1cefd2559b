#include "datasets/sequence_check.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core.hpp>

#include "datasets/motion_check.h"
#include "datasets/sequence_order.h"
#include "datasets/sequence_statistics.h"
#include "datasets/stripe_geometry.h"

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr double kLitThreshold = 0.04;   // of full scale: a pixel that changes by less is not lit by the projector
constexpr double kLeastLitShare = 0.01;  // of the image
constexpr double kSmallLitShare = 0.05;
constexpr double kSame = 0.95;  // correlation of two images of the same thing
constexpr std::size_t kFewestPixels = 500;
constexpr double kOutsideShare = 0.05;

class SequenceChecker {
 public:
  SequenceChecker(const std::vector<ShownFrame>& frames, const SequenceSetup& setup) : frames_(frames), setup_(setup) {
    std::vector<cv::Mat> images;
    bool inverses = true;
    for (const ShownFrame& frame : frames) {
      const Kind kind = frame.content.kind;
      if (kind == Kind::stripes) inverses = inverses && setup.orientations[frame.content.orientation].inverse;
      // Other frames keep their places, since a dropped frame shifts everything, but say nothing about stripes.
      const bool of_stripes = kind == Kind::stripes || kind == Kind::white || kind == Kind::black;
      contents_.push_back(frame.content);
      names_.push_back(frame.name);
      images.push_back(of_stripes ? frame.image : cv::Mat());
    }
    const auto stripes = std::count_if(contents_.begin(), contents_.end(),
                                       [](const FrameContent& c) { return c.kind == Kind::stripes; });
    // With inverses every pixel is lit in half the stripe frames, so a few spoilt ones may be left out of its range.
    const int outliers = inverses && stripes >= 8 ? 2 : 0;
    statistics_ = sequence_statistics(images, outliers, kLitThreshold * setup.full_scale);
  }

  std::vector<Finding> findings() {
    if (statistics_.lit_share < kLeastLitShare) {
      add(Severity::error,
          fmt::format("the projector lights none of what the camera sees: {:.2g} % of the pixels change by more than "
                      "{:.0f} % of full scale; check the projector, its cable, the lens cap and the exposure",
                      100 * statistics_.lit_share, 100 * kLitThreshold));
      return findings_;
    }
    if (statistics_.lit_share < kSmallLitShare) {
      add(Severity::warning,
          fmt::format("the projector lights only {:.1f} % of the image; aim it at what the camera sees",
                      100 * statistics_.lit_share));
    }
    const OrderVerdict verdict = find_order(contents_, statistics_);
    describe(verdict);
    if (verdict.fault == OrderFault::none) describe_geometry();
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& sentence) { findings_.push_back({severity, setup_.where, sentence}); }

  // "graycode_03.png (bit 1 of orientation 0, inverted)"
  std::string words(std::size_t frame) const {
    return fmt::format("{} ({})", names_[frame], frame_words(contents_[frame]));
  }

  std::string alternatives(const std::vector<std::size_t>& frames) const {
    std::vector<std::string> all;
    for (const std::size_t frame : frames) all.push_back(words(frame));
    if (all.size() > 4) return fmt::format("one of {} to {}", all.front(), all.back());
    return fmt::format("{}", fmt::join(all, " or "));
  }

  void describe(const OrderVerdict& verdict) {
    switch (verdict.fault) {
      case OrderFault::none:
        return;
      case OrderFault::exchanged:
        for (std::size_t i = 0; i + 1 < verdict.involved.size(); i += 2) {
          describe_exchange(verdict.involved[i], verdict.involved[i + 1]);
        }
        return;
      case OrderFault::inverses_first:
        return add(Severity::error, fmt::format("orientation {} shows each inverse before its pattern: say so in "
                                                "`frames`, or correct the files",
                                                fmt::join(verdict.involved, ", ")));
      case OrderFault::finest_first:
        return add(Severity::error,
                   fmt::format("orientation {} shows the finest bit first: add `order: finest_first` to its entry in "
                               "`frames`",
                               fmt::join(verdict.involved, ", ")));
      case OrderFault::dropped:
        return add(Severity::error,
                   fmt::format("a frame was dropped: what {} should show is missing, and every later image shows what "
                               "the next one should; take the station again, or move the later images up by one",
                               alternatives(verdict.involved)));
      case OrderFault::repeated:
        return add(Severity::error,
                   fmt::format("an image too many stands at {}: every later one shows what the one before it should; "
                               "take it out, or mark it `unused` in `frames`",
                               alternatives(verdict.involved)));
      case OrderFault::bad_frame:
        return describe_bad_frames(verdict.involved);
      case OrderFault::unclear:
        return describe_unclear(verdict.involved);
    }
  }

  // A push shows once, and lasts. Frames in wrong places differ from what stands before and after them.
  std::optional<Motion> push() const {
    const std::vector<Motion> motions = find_motions(frames_, setup_.full_scale);
    if (motions.size() != 1 || motions.front().seen == Motion::Seen::once) return std::nullopt;
    return motions.front();
  }

  bool all_within(const Motion& motion, const std::vector<std::size_t>& wrong) const {
    const auto number = [&](const std::string& name) { return std::find(names_.begin(), names_.end(), name); };
    const auto from = number(motion.from), to = number(motion.to);
    return std::all_of(wrong.begin(), wrong.end(), [&](std::size_t frame) {
      const auto at = names_.begin() + static_cast<std::ptrdiff_t>(frame);
      return from <= at && at <= to;
    });
  }

  // Says nothing of a push that the images tell from what else it could be: check_motion does.
  void describe_push(const Motion& motion, const std::string& otherwise) {
    if (motion.seen == Motion::Seen::on_both_sides) return;
    add(Severity::error,
        fmt::format("either {}, or {}: take the station again, or exclude it", motion.sentence, otherwise));
  }

  void describe_unclear(const std::vector<std::size_t>& worst) {
    // A small one would not make frames of either place unlike what they should show.
    const auto motion = push();
    if (motion && motion->shift_px >= kUselessShift_px) {
      return describe_push(*motion, "the frames are not those that are described");
    }
    add(Severity::error,
        fmt::format("the frames do not show what the description says, and no simple exchange explains it: either they "
                    "are others or in another order, or the rig or the object moved too far to be measured; those that "
                    "fit worst are {}; compare `patterns` and `frames` with what was projected, and where they agree "
                    "take the station again",
                    alternatives(worst)));
  }

  void describe_exchange(std::size_t a, std::size_t b) {
    const FrameContent& first = contents_[a];
    const FrameContent& second = contents_[b];
    if (first.kind == Kind::stripes && second.kind == Kind::stripes && first.orientation == second.orientation &&
        first.bit == second.bit) {
      add(Severity::error, fmt::format("{} and {} are swapped: the pattern is where its inverse should be; exchange "
                                       "the two files",
                                       words(a), words(b)));
    } else {
      add(Severity::error, fmt::format("{} and {} are swapped: exchange the two files", words(a), words(b)));
    }
  }

  void describe_bad_frames(const std::vector<std::size_t>& frames) {
    std::vector<std::string> unexplained;
    for (const std::size_t frame : frames) {
      if (what_it_shows(frame).empty()) unexplained.push_back(words(frame));
    }
    if (unexplained.size() == frames.size()) {
      const char* const show = frames.size() == 1 ? "shows" : "show";
      const std::string others = fmt::format("{} {} something else", fmt::join(unexplained, " and "), show);
      const auto motion = push();
      if (motion && all_within(*motion, frames)) return describe_push(*motion, others);
    }
    for (const std::size_t frame : frames) {
      const std::string shown = what_it_shows(frame);
      const std::string why = shown.empty() ? "either another image stands there, or the rig or the object moved about "
                                              "then, too far to be measured"
                                            : shown;
      add(Severity::error,
          fmt::format("{} does not show what it should: {}; take the station again", words(frame), why));
    }
  }

  // Empty where that cannot be said.
  std::string what_it_shows(std::size_t frame) const {
    if (statistics_.dark_share[frame] > 0.98) return "it is dark all over";
    if (statistics_.dark_share[frame] < 0.02) return "it is lit all over";
    for (std::size_t other = 0; other < contents_.size(); ++other) {
      const bool stripes = contents_[other].kind == Kind::stripes && contents_[frame].kind == Kind::stripes;
      if (other != frame && stripes && correlation(frame, other) > kSame) {
        return fmt::format("it shows the same as {}", names_[other]);
      }
    }
    return {};
  }

  double correlation(std::size_t a, std::size_t b) const {
    return statistics_.correlation(static_cast<int>(a), static_cast<int>(b));
  }

  void describe_geometry() {
    const StripeGeometry geometry = stripe_geometry(contents_, statistics_, setup_.orientations, setup_.projector);
    for (std::size_t o = 0; o < geometry.orientations.size(); ++o) {
      const StripeGeometry::Orientation& stripes = geometry.orientations[o];
      if (stripes.decoded_pixels < kFewestPixels || stripes.outside_share < kOutsideShare) continue;
      if (stripes.outside_if_swapped < stripes.outside_share / 5) return add_swapped_coarsest({o});
      return add(
          Severity::error,
          fmt::format("{:.0f} % of the pixels hold codes of orientation {} that no stripe has: check its "
                      "code_offset, bits, stripe_width_px and the projector's size_px, and that the orientations "
                      "are listed in the order they were shown",
                      100 * stripes.outside_share, o));
    }
    describe_mirroring(geometry);
  }

  void describe_mirroring(const StripeGeometry& geometry) {
    std::vector<int> mirrored(setup_.orientations.size(), 0);
    int pairs = 0;
    int mirrored_pairs = 0;
    for (const StripeGeometry::Pair& pair : geometry.pairs) {
      if (pair.places < kFewestPixels) continue;
      ++pairs;
      if (pair.upright_share > 0.5) continue;
      ++mirrored_pairs;
      ++mirrored[pair.first];
      ++mirrored[pair.second];
    }
    if (mirrored_pairs == 0) return;
    std::vector<std::size_t> suspects;
    for (std::size_t o = 0; o < mirrored.size(); ++o) {
      const bool possible = geometry.orientations[o].outside_if_swapped < kOutsideShare;
      if (mirrored[o] == *std::max_element(mirrored.begin(), mirrored.end()) && possible) suspects.push_back(o);
    }
    if (suspects.size() == 1 || (suspects.size() > 1 && mirrored_pairs < pairs)) return add_swapped_coarsest(suspects);
    add(Severity::error,
        "the projector's pixels appear mirrored to the camera, which no arrangement of lenses does: either the "
        "coarsest "
        "pattern and its inverse are swapped in one orientation, or two orientations are exchanged, or the images or "
        "the "
        "projection were flipped");
  }

  void add_swapped_coarsest(const std::vector<std::size_t>& suspects) {
    std::vector<std::string> pairs;
    for (const std::size_t orientation : suspects) {
      std::vector<std::string> frames;
      for (std::size_t f = 0; f < contents_.size(); ++f) {
        const FrameContent& c = contents_[f];
        if (c.kind == Kind::stripes && c.orientation == orientation && c.bit == 0) frames.push_back(words(f));
      }
      pairs.push_back(fmt::format("{}", fmt::join(frames, " and ")));
    }
    add(Severity::error,
        fmt::format("{} are swapped, or the projection was flipped along that orientation: the codes run backwards",
                    fmt::join(pairs, ", or ")));
  }

  const std::vector<ShownFrame>& frames_;
  SequenceSetup setup_;
  std::vector<FrameContent> contents_;
  std::vector<std::string> names_;
  SequenceStatistics statistics_;
  std::vector<Finding> findings_;
};

// White and black alone: which is brighter, and whether there is light at all.
std::vector<Finding> compare_white_and_black(const std::vector<ShownFrame>& frames, const SequenceSetup& setup) {
  const ShownFrame* white = nullptr;
  const ShownFrame* black = nullptr;
  for (const ShownFrame& frame : frames) {
    if (frame.content.kind == Kind::white && !frame.image.empty()) white = &frame;
    if (frame.content.kind == Kind::black && !frame.image.empty()) black = &frame;
  }
  if (white == nullptr || black == nullptr) return {};
  const double threshold = kLitThreshold * setup.full_scale;
  cv::Mat difference;
  cv::subtract(white->image, black->image, difference, cv::noArray(), CV_32F);
  const auto total = static_cast<double>(difference.total());
  const double lit = cv::countNonZero(difference > threshold) / total;
  const double reversed = cv::countNonZero(difference < -threshold) / total;
  if (reversed > kLeastLitShare && reversed > 10 * lit) {
    return {{Severity::error, setup.where,
             fmt::format("{} (white) is darker than {} (black): exchange the two files", white->name, black->name)}};
  }
  if (lit < kLeastLitShare) {
    return {{Severity::error, setup.where,
             fmt::format("the projector lights none of what the camera sees: {} and {} look alike", white->name,
                         black->name)}};
  }
  return {};
}

}  // namespace

std::vector<Finding> check_sequence(const std::vector<ShownFrame>& frames, const SequenceSetup& setup) {
  const auto stripes = [](const ShownFrame& f) { return f.content.kind == Kind::stripes && !f.image.empty(); };
  if (std::none_of(frames.begin(), frames.end(), stripes)) return compare_white_and_black(frames, setup);
  return SequenceChecker(frames, setup).findings();
}

}  // namespace crumple
