#include "datasets/frame_list.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace crumple {
namespace {

using Kind = FrameContent::Kind;

constexpr std::size_t kMostFrames = 10000;
constexpr int kLargestNumber = 1000000;

const std::map<std::string, Kind>& plain_kinds() {
  static const std::map<std::string, Kind> kinds = {
      {"white", Kind::white}, {"black", Kind::black}, {"ambient", Kind::ambient}, {"chessboard", Kind::chessboard}};
  return kinds;
}

// Appends frames; an unused image takes a number and nothing else.
class FrameAppender {
 public:
  explicit FrameAppender(Capture& capture) : capture_(capture) {}
  int next_number() const { return next_number_; }
  void skip(int count) { next_number_ += count; }
  void add(const FrameContent& content) {
    capture_.frames.push_back(content);
    capture_.frame_numbers.push_back(next_number_++);
  }

 private:
  Capture& capture_;
  int next_number_ = 0;
};

// An index into the capture's orientations.
std::optional<std::size_t> read_orientation_index(const YamlValue& value, const Capture& capture) {
  if (capture.orientations.empty()) {
    value.problem("there is no such orientation: list it under `patterns.orientations`");
    return {};
  }
  const int last = static_cast<int>(capture.orientations.size()) - 1;
  const int index = value.integer(0, std::numeric_limits<int>::max());
  if (index <= last) return static_cast<std::size_t>(index);
  value.problem(fmt::format("there is no orientation {}: the last one listed is {}", index, last));
  return {};
}

bool add_stripes(YamlMap& map, const YamlValue& stripes, const Capture& capture, FrameAppender& frames) {
  const auto index = read_orientation_index(stripes, capture);
  const auto show = map.find("show");
  const auto order = map.find("order");
  if (!index) return false;
  const StripeOrientation& orientation = capture.orientations[*index];
  const std::string shown = show ? show->one_of({"pairs", "patterns", "inverses"}) : "pairs";
  const bool finest_first = order && order->one_of({"coarsest_first", "finest_first"}) == "finest_first";
  for (int i = 0; i < orientation.bits; ++i) {
    const int bit = finest_first ? orientation.bits - 1 - i : i;
    if (shown != "inverses") frames.add({Kind::stripes, *index, bit, false});
    if (shown == "inverses" || (shown == "pairs" && orientation.inverse)) {
      frames.add({Kind::stripes, *index, bit, true});
    }
  }
  return true;
}

bool add_single_stripe_frame(YamlMap& map, const YamlValue& index_value, const Capture& capture,
                             FrameAppender& frames) {
  const auto index = read_orientation_index(index_value, capture);
  const auto bit = map.require("bit", "0 is the coarsest");
  const auto inverse = map.find("inverse");
  if (!index || !bit) return false;
  frames.add(
      {Kind::stripes, *index, bit->integer(0, capture.orientations[*index].bits - 1), inverse && inverse->boolean()});
  return true;
}

// False where the item's frames could not be told.
bool read_item(const YamlValue& item, const Capture& capture, FrameAppender& frames) {
  if (item.is_scalar()) {
    const std::string word = item.one_of({"unused", "white", "black", "ambient", "chessboard"});
    const auto kind = plain_kinds().find(word);
    if (kind == plain_kinds().end()) {
      frames.skip(1);
    } else {
      frames.add({kind->second, 0, 0, false});
    }
    return true;
  }
  YamlMap map = item.map();
  const auto stripes = map.find("stripes");
  const auto orientation = map.find("orientation");
  const auto unused = map.find("unused");
  if (int{stripes.has_value()} + int{orientation.has_value()} + int{unused.has_value()} != 1) {
    item.problem(
        "must be white, black, ambient, chessboard, unused, {stripes: 0}, {orientation: 0, bit: 3, inverse: true} or "
        "{unused: 2}");
    return false;
  }
  bool told = true;
  if (stripes) told = add_stripes(map, *stripes, capture, frames);
  if (orientation) told = add_single_stripe_frame(map, *orientation, capture, frames);
  if (unused) frames.skip(unused->integer(1, 100000));
  map.finish();
  return told;
}

// The numbers frames have in file names, before the offset.
std::string numbers(const std::vector<std::size_t>& frames, const Capture& capture) {
  std::vector<int> all;
  for (const std::size_t frame : frames) all.push_back(capture.frame_numbers[frame]);
  return fmt::format("{}", fmt::join(all, " and "));
}

// Each orientation's patterns and inverses must all be there, and once.
void check_bits(const YamlValue& value, const Capture& capture) {
  std::map<std::tuple<std::size_t, int, bool>, std::vector<std::size_t>> shown;
  for (std::size_t i = 0; i < capture.frames.size(); ++i) {
    const FrameContent& frame = capture.frames[i];
    if (frame.kind == Kind::stripes) shown[{frame.orientation, frame.bit, frame.inverted}].push_back(i);
  }
  std::vector<std::string> repeated;
  for (const auto& [key, at] : shown) {
    const auto& [orientation, bit, inverted] = key;
    if (at.size() > 1) {
      repeated.push_back(fmt::format("{} (frames {})", frame_words(capture.frames[at[0]]), numbers(at, capture)));
    }
    if (inverted && !capture.orientations[orientation].inverse) {
      value.problem(fmt::format("frame {} is an inverse, but orientation {} says `inverse: false`",
                                capture.frame_numbers[at[0]], orientation));
    }
  }
  if (!repeated.empty()) {
    value.problem(
        fmt::format("shows more than once: {}; mark the images not to be used as `unused`", fmt::join(repeated, ", ")));
  }
  for (std::size_t o = 0; o < capture.orientations.size(); ++o) {
    std::vector<std::string> missing;
    for (int bit = 0; bit < capture.orientations[o].bits; ++bit) {
      if (!shown.contains({o, bit, false})) missing.push_back(fmt::format("bit {}", bit));
      if (capture.orientations[o].inverse && !shown.contains({o, bit, true})) {
        missing.push_back(fmt::format("the inverse of bit {}", bit));
      }
    }
    if (!missing.empty()) {
      value.problem(fmt::format("orientation {} lacks {}: add the frames, or correct the orientation", o,
                                fmt::join(missing, ", ")));
    }
  }
}

void check_plain_frames(const YamlValue& value, const Capture& capture) {
  for (const auto& [word, kind] : plain_kinds()) {
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < capture.frames.size(); ++i) {
      if (capture.frames[i].kind == kind) at.push_back(i);
    }
    if (at.size() > 1) {
      value.problem(fmt::format("shows more than once: {} (frames {}); mark the images not to be used as `unused`",
                                word, numbers(at, capture)));
    }
    if (!at.empty() && kind != Kind::ambient && !capture.projector) {
      value.problem(fmt::format("frame {} is {}, but no `patterns` say which projector shows it",
                                capture.frame_numbers[at[0]], word));
    }
  }
  if (capture.find_frame(Kind::chessboard) && capture.projector && !capture.projected_chessboard) {
    value.problem("has a chessboard frame: describe the board under `patterns.chessboard`");
  }
}

// Contrast is white minus black; without inverses, the threshold is between them.
void check_references(const YamlValue& value, const Capture& capture) {
  if (capture.orientations.empty()) return;
  if (!capture.find_frame(Kind::white)) value.problem("has stripes but no white frame, which decoding needs: add it");
  for (std::size_t o = 0; o < capture.orientations.size(); ++o) {
    if (!capture.orientations[o].inverse && !capture.find_frame(Kind::black)) {
      value.problem(fmt::format("orientation {} has no inverses, so decoding needs a black frame: add it", o));
    }
  }
}

}  // namespace

void read_frames(const YamlValue& value, Capture& capture) {
  FrameAppender frames(capture);
  bool all_told = true;
  for (const YamlValue& item : value.list()) {
    all_told = read_item(item, capture, frames) && all_told;
    if (capture.frames.size() > kMostFrames) {
      value.problem(fmt::format("has more than {} frames", kMostFrames));
      return;
    }
    if (frames.next_number() > kLargestNumber) {
      value.problem(fmt::format("counts to more than {}: list fewer unused images", kLargestNumber));
      return;
    }
  }
  if (!all_told) return;
  if (capture.frames.empty()) value.problem("at least one frame that is used is needed");
  check_bits(value, capture);
  check_plain_frames(value, capture);
  check_references(value, capture);
}

}  // namespace crumple
