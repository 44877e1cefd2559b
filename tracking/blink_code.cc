#include "tracking/blink_code.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

namespace crumple {
namespace {

using Word = std::uint32_t;

Word turn(Word word, int by, int length) {
  const Word mask = (Word{1} << length) - 1;
  by %= length;
  return by == 0 ? word : ((word >> by) | (word << (length - by))) & mask;
}

int distance_of(Word a, Word b) { return std::popcount(a ^ b); }

int least_distance(Word a, Word b, int length) {
  int least = length;
  for (int s = 0; s < length; ++s) least = std::min(least, distance_of(a, turn(b, s, length)));
  return least;
}

int least_distance_to_itself(Word word, int length) {
  int least = length;
  for (int s = 1; s <= length / 2; ++s) least = std::min(least, distance_of(word, turn(word, s, length)));
  return least;
}

bool on_often_enough(Word word, int length) {
  const int on = std::popcount(word);
  return 2 * on >= length && on <= length - BlinkCode::kLeastDistance;
}

// One word of each class of turned words that has no smaller period, ascending (Cattell et al., J. Algorithms 37,
// 2000).
class Necklaces {
 public:
  explicit Necklaces(int length) : length_(length), bits_(static_cast<std::size_t>(length) + 1, 0) { extend(1, 1); }
  const std::vector<Word>& words() const { return words_; }

 private:
  void extend(int place, int period) {
    if (place > length_) {
      if (period != length_) return;
      Word word = 0;
      for (int i = 1; i <= length_; ++i) word = word << 1 | bits_[static_cast<std::size_t>(i)];
      if (on_often_enough(word, length_)) words_.push_back(word);
      return;
    }
    const auto at = static_cast<std::size_t>(place);
    bits_[at] = bits_[at - static_cast<std::size_t>(period)];
    extend(place + 1, period);
    if (bits_[at] != 0) return;
    bits_[at] = 1;
    extend(place + 1, place);
  }

  int length_;
  std::vector<Word> bits_;
  std::vector<Word> words_;
};

std::vector<Word> lexicographic_code(const std::vector<Word>& candidates, std::size_t count, int length, int distance) {
  std::vector<Word> chosen;
  for (const Word word : candidates) {
    const auto far = [&](Word other) { return least_distance(other, word, length) >= distance; };
    if (least_distance_to_itself(word, length) < distance || !std::all_of(chosen.begin(), chosen.end(), far)) continue;
    chosen.push_back(word);
    if (chosen.size() == count) break;
  }
  return chosen;
}

void turn_apart(std::vector<Word>& chosen, int length) {
  for (std::size_t i = 1; i < chosen.size(); ++i) {
    int best = -1;
    Word best_word = chosen[i];
    for (int s = 0; s < length; ++s) {
      const Word word = turn(chosen[i], s, length);
      int least = length;
      for (std::size_t k = 0; k < i; ++k) least = std::min(least, distance_of(chosen[k], word));
      if (least <= best) continue;
      best = least;
      best_word = word;
    }
    chosen[i] = best_word;
  }
}

}  // namespace

Expected<BlinkCode> BlinkCode::generate(std::size_t leds, int length) {
  if (length < kShortest || length > kLongest) {
    return fail(fmt::format("a blink word of {} frames: it has to have {} to {}", length, kShortest, kLongest));
  }
  if (leds == 0) return fail("a blink code for no LED at all");
  const Necklaces necklaces(length);
  for (int distance = length / 2; distance >= kLeastDistance; --distance) {
    std::vector<Word> chosen = lexicographic_code(necklaces.words(), leds, length, distance);
    if (chosen.size() < leds) continue;
    turn_apart(chosen, length);
    return BlinkCode(length, std::move(chosen));
  }
  return fail(fmt::format("{} frames are too few to tell {} LEDs apart: take longer words", length, leds));
}

Expected<BlinkCode> BlinkCode::create(int length, std::vector<Word> words) {
  if (length < kShortest || length > kLongest) {
    return fail(fmt::format("a blink word of {} frames: it has to have {} to {}", length, kShortest, kLongest));
  }
  if (words.empty()) return fail("a blink code for no LED at all");
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] >> length != 0) return fail(fmt::format("the word of LED {} is longer than {} frames", i, length));
    const int on = std::popcount(words[i]);
    if (on < kLeastDistance || on > length - kLeastDistance) {
      return fail(fmt::format("LED {} is on in {} of {} frames: at least {} have to be on and as many off", i, on,
                              length, kLeastDistance));
    }
    if (least_distance_to_itself(words[i], length) < kLeastDistance) {
      return fail(fmt::format("the word of LED {} looks nearly the same at another start phase", i));
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (least_distance(words[k], words[i], length) >= kLeastDistance) continue;
      return fail(fmt::format("the words of LEDs {} and {} differ in fewer than {} frames at some start phase", k, i,
                              kLeastDistance));
    }
  }
  return BlinkCode(length, std::move(words));
}

Word BlinkCode::turned(std::size_t led, int phase) const { return turn(words_[led], phase, length_); }

int BlinkCode::distance() const {
  int least = length_;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    least = std::min(least, least_distance_to_itself(words_[i], length_));
    for (std::size_t k = 0; k < i; ++k) least = std::min(least, least_distance(words_[k], words_[i], length_));
  }
  return least;
}

int BlinkCode::distance_in_step() const {
  int least = length_;
  for (std::size_t i = 0; i < words_.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) least = std::min(least, distance_of(words_[k], words_[i]));
  }
  return least;
}

}  // namespace crumple
