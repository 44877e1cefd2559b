// Words that LEDs blink, one frame of the cameras per bit, so that a camera can tell them apart.
//
// All LEDs of the probe repeat words of the same length in step with each other: frame k of a sequence shows bit
// (k + start phase) mod length of every word. The start phase is unknown, but all LEDs share it.
//
// Code set. Any two words, and any word and itself turned, differ in at least `distance` places at every turn of one
// against the other, so that a single LED of unknown phase is told too. At equal phase, which is what LEDs seen
// together have, they differ in more: each word is turned so that it lies as far as possible from those before it. Each
// word is on in at least half of its frames, so that its spot is well measured, and off in at least four, so that a
// lamp is no LED. Made here: a lexicographic code (Conway & Sloane, IEEE Trans. Inf. Theory 32, 1986) over the
// necklaces, one word per class of turned words, with the largest distance for which there are enough of them. The same
// length and number of LEDs always give the same words.
//
// Decoding. Frames that show the same place of the word are pooled first: the majority counts, a tie is no reading. A
// frame that is missing is no reading. At each phase every LED takes its nearest word; the phases for which the sum of
// the errors, at most four of each LED, is within three of the least remain possible. An LED is told where at each of
// them the nearest word is the same one, has at most one error, and every other word has at least three errors more.
// That corrects one error and refuses more; a wrong word takes at least three errors of one LED, all in its disfavour.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "solvers/expected.h"

namespace crumple {

class BlinkCode {
 public:
  static constexpr int kShortest = 8, kLongest = 24;
  static constexpr int kLeastDistance = 4;

  // As described above, for at least one LED. Fails where the length is out of range or too short for as many LEDs.
  static Expected<BlinkCode> generate(std::size_t leds, int length);

  // Words of a controller that exists: bit k of a word is its state in frame k. Fails where two of them come nearer
  // than the least distance at some turn, or one is off in too few frames.
  static Expected<BlinkCode> create(int length, std::vector<std::uint32_t> words);

  int length() const { return length_; }
  std::size_t size() const { return words_.size(); }
  const std::vector<std::uint32_t>& words() const { return words_; }
  bool lit(std::size_t led, int frame) const { return (words_[led] >> (frame % length_) & 1u) != 0; }

  // The word as it is read by a sequence that starts at that phase.
  std::uint32_t turned(std::size_t led, int phase) const;

  int distance() const;          // over all turns, of words with each other and with themselves
  int distance_in_step() const;  // of different words at equal phase; the length where there is one word only

 private:
  BlinkCode(int length, std::vector<std::uint32_t> words) : length_(length), words_(std::move(words)) {}

  int length_;
  std::vector<std::uint32_t> words_;
};

enum class BlinkState : char { off, on, missing };

// The states of one LED, or what looks like one, frame by frame.
using BlinkReading = std::vector<BlinkState>;

enum class BlinkRefusal { none, too_few_frames, always_on, no_word, several_words };
const char* words(BlinkRefusal refusal);

struct BlinkDecoded {
  std::optional<std::size_t> led;
  BlinkRefusal refusal = BlinkRefusal::none;
  int errors = 0;       // against the nearest word at the best phase
  int places_read = 0;  // of the word
};

struct BlinkDecoding {
  int start_phase = 0;            // the best one
  bool start_phase_told = false;  // no other is possible
  std::vector<BlinkDecoded> leds;
};

// All readings share the start phase; they may come from several cameras whose frames are taken together.
BlinkDecoding decode_blinks(const BlinkCode& code, const std::vector<BlinkReading>& readings);

// One LED where the start phase is known.
BlinkDecoded decode_word(const BlinkCode& code, const BlinkReading& reading, int start_phase);

// What to expect of one word read at a known start phase when every state is flipped with one probability and every
// frame missing with another, independently: upper bounds by summing over the other words.
struct BlinkRates {
  double refused = 0;
  double wrong = 0;
};
BlinkRates predicted_blink_rates(const BlinkCode& code, std::size_t led, int cycles, double flipped, double missing);

}  // namespace crumple
