#include "tracking/blink_code.h"

#include <array>
#include <bit>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crumple {
namespace {

using testing::HasSubstr;

constexpr std::array<std::uint32_t, 8> kWords{0x005bfu, 0x3b9c0u, 0x35827u, 0x1ec1cu,
                                              0x2d09du, 0x36155u, 0x21e56u, 0x2a27au};

std::vector<BlinkReading> exact_readings(const BlinkCode& code, int phase, int frames) {
  std::vector<BlinkReading> readings(code.size());
  for (std::size_t led = 0; led < code.size(); ++led) {
    for (int k = 0; k < frames; ++k) {
      readings[led].push_back(code.lit(led, k + phase) ? BlinkState::on : BlinkState::off);
    }
  }
  return readings;
}

void flip(BlinkState& state) { state = state == BlinkState::on ? BlinkState::off : BlinkState::on; }

TEST(BlinkCode, WordsDifferAtEveryTurn) {
  for (const std::size_t leds : {1u, 3u, 8u, 16u}) {
    const BlinkCode code = BlinkCode::generate(leds, 18).value();
    ASSERT_EQ(code.size(), leds);
    EXPECT_GE(code.distance(), leds <= 8 ? 6 : 5);
    EXPECT_GE(code.distance_in_step(), code.distance());
    EXPECT_TRUE(BlinkCode::create(18, code.words()));
    for (std::size_t a = 0; a < leds; ++a) {
      const int on = std::popcount(code.words()[a]);
      EXPECT_GE(on, 9);
      EXPECT_LE(on, 14);
      for (std::size_t b = 0; b < leds; ++b) {
        for (int turn = a == b ? 1 : 0; turn < 18; ++turn) {
          EXPECT_GE(std::popcount(code.words()[a] ^ code.turned(b, turn)), code.distance());
        }
      }
    }
  }
}

// Controllers hold these: a change of the generator must not go unnoticed.
TEST(BlinkCode, TheWordsOfEightLeds) {
  const BlinkCode code = BlinkCode::generate(8, 18).value();
  EXPECT_EQ(code.distance(), 6);
  EXPECT_EQ(code.distance_in_step(), 8);
  EXPECT_EQ(code.words(), BlinkCode::generate(8, 18).value().words());
  EXPECT_THAT(code.words(), testing::ElementsAreArray(kWords));
}

TEST(BlinkCode, EveryPhaseIsFoundAndOneErrorCorrected) {
  const BlinkCode code = BlinkCode::generate(5, 18).value();
  for (int phase = 0; phase < 18; ++phase) {
    std::vector<BlinkReading> readings = exact_readings(code, phase, 18);
    for (std::size_t led = 0; led < code.size(); ++led) flip(readings[led][(3 * led + 5) % 18]);
    const BlinkDecoding decoding = decode_blinks(code, readings);
    EXPECT_TRUE(decoding.start_phase_told);
    EXPECT_EQ(decoding.start_phase, phase);
    for (std::size_t led = 0; led < code.size(); ++led) {
      EXPECT_EQ(decoding.leds[led].led, led);
      EXPECT_EQ(decoding.leds[led].errors, 1);
    }
  }
}

TEST(BlinkCode, TwoErrorsAreRefusedNeverWrong) {
  const BlinkCode code = BlinkCode::generate(8, 18).value();
  for (std::size_t a = 0; a < 18; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      std::vector<BlinkReading> readings = exact_readings(code, 7, 18);
      flip(readings[2][a]);
      flip(readings[2][b]);
      const BlinkDecoding decoding = decode_blinks(code, readings);
      EXPECT_FALSE(decoding.leds[2].led);
      EXPECT_EQ(decoding.leds[2].refusal, BlinkRefusal::no_word);
      EXPECT_EQ(decoding.leds[3].led, 3u);
    }
  }
}

TEST(BlinkCode, OneLedAloneIsToldFromAnyPhase) {
  const BlinkCode code = BlinkCode::generate(8, 18).value();
  for (std::size_t led = 0; led < 8; ++led) {
    BlinkReading reading = exact_readings(code, 11, 36)[led];
    reading[4] = reading[20] = reading[25] = BlinkState::missing;
    EXPECT_EQ(decode_blinks(code, {reading}).leds[0].led, led);
  }
}

// Nor where missing frames leave the start phase open.
TEST(BlinkCode, TwoErrorsOfOneLedAloneAreNeverWrong) {
  const BlinkCode code = BlinkCode::generate(8, 18).value();
  std::mt19937 random(7);
  int told = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::size_t led = random() % 8;
    BlinkReading reading = exact_readings(code, static_cast<int>(random() % 18), 18)[led];
    for (int errors = 0; errors < 2; ++errors) flip(reading[random() % 18]);
    for (BlinkState& state : reading) {
      if (random() % 5 < 2) state = BlinkState::missing;
    }
    const BlinkDecoded decoded = decode_blinks(code, {reading}).leds[0];
    EXPECT_TRUE(!decoded.led || *decoded.led == led);
    told += decoded.led.has_value();
  }
  EXPECT_GT(told, 200);
}

TEST(BlinkCode, ErasuresTakeDistanceAndAreRefusedWhereTooMany) {
  const BlinkCode code = BlinkCode::generate(8, 18).value();
  std::mt19937 random(5);
  int told = 0, refused = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<BlinkReading> readings = exact_readings(code, trial % 18, 18);
    for (std::size_t k = 0; k < 18; ++k) {
      if (random() % 2 == 0) continue;
      for (BlinkReading& reading : readings) reading[k] = BlinkState::missing;
    }
    for (std::size_t led = 0; led < 8; ++led) {
      const BlinkDecoded decoded = decode_blinks(code, readings).leds[led];
      if (decoded.led) {
        EXPECT_EQ(*decoded.led, led);  // without flipped states nothing is ever wrong
      } else {
        EXPECT_NE(decoded.refusal, BlinkRefusal::none);
      }
      ++(decoded.led ? told : refused);
    }
  }
  EXPECT_GT(told, 8000);
  EXPECT_GT(refused, 500);
}

TEST(BlinkCode, LampsDoNotOutvoteTheLeds) {
  const BlinkCode code = BlinkCode::generate(4, 18).value();
  std::vector<BlinkReading> readings = exact_readings(code, 5, 18);
  for (int lamp = 0; lamp < 6; ++lamp) readings.emplace_back(18, BlinkState::on);
  readings.emplace_back(18, BlinkState::missing);
  const BlinkDecoding decoding = decode_blinks(code, readings);
  EXPECT_EQ(decoding.start_phase, 5);
  for (std::size_t led = 0; led < 4; ++led) EXPECT_EQ(decoding.leds[led].led, led);
  EXPECT_EQ(decoding.leds[4].refusal, BlinkRefusal::always_on);
  EXPECT_EQ(decoding.leds[10].refusal, BlinkRefusal::too_few_frames);
}

// At rates so harsh that wrong words can be counted. The predictions are upper bounds.
TEST(BlinkCode, ErrorRatesAreThosePredicted) {
  const BlinkCode code = BlinkCode::generate(8, 15).value();
  constexpr double kFlipped = 0.12, kMissing = 0.3;
  constexpr int kCycles = 2, kTrials = 200000;
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  double refused = 0, wrong = 0, predicted_refused = 0, predicted_wrong = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto led = static_cast<std::size_t>(trial % 8);
    BlinkReading reading(kCycles * 15, BlinkState::missing);
    for (int k = 0; k < kCycles * 15; ++k) {
      if (uniform(random) < kMissing) continue;
      reading[static_cast<std::size_t>(k)] =
          code.lit(led, k) != (uniform(random) < kFlipped) ? BlinkState::on : BlinkState::off;
    }
    const BlinkDecoded decoded = decode_word(code, reading, 0);
    refused += !decoded.led;
    wrong += decoded.led && *decoded.led != led;
  }
  for (std::size_t led = 0; led < 8; ++led) {
    const BlinkRates rates = predicted_blink_rates(code, led, kCycles, kFlipped, kMissing);
    predicted_refused += rates.refused / 8;
    predicted_wrong += rates.wrong / 8;
  }
  EXPECT_LT(refused / kTrials, 1.01 * predicted_refused);
  EXPECT_GT(refused / kTrials, 0.88 * predicted_refused);
  EXPECT_GT(wrong, 20);
  EXPECT_NEAR(wrong / kTrials, predicted_wrong, 4 * std::sqrt(wrong) / kTrials);
}

TEST(BlinkCode, RefusesInWords) {
  EXPECT_THAT(BlinkCode::generate(8, 4).error().message, HasSubstr("8 to 24"));
  EXPECT_THAT(BlinkCode::generate(0, 16).error().message, HasSubstr("no LED"));
  EXPECT_THAT(BlinkCode::generate(40, 12).error().message, HasSubstr("take longer words"));
  const std::vector<std::uint32_t> sound = BlinkCode::generate(3, 16).value().words();
  EXPECT_THAT(BlinkCode::create(16, {sound[0], sound[1] ^ 1u << 16}).error().message, HasSubstr("longer than"));
  EXPECT_THAT(BlinkCode::create(16, {sound[0], 0xffffu}).error().message, HasSubstr("as many off"));
  EXPECT_THAT(BlinkCode::create(16, {sound[0], sound[0]}).error().message, HasSubstr("LEDs 0 and 1"));
  EXPECT_THAT(BlinkCode::create(16, {0x5555u}).error().message, HasSubstr("another start phase"));
}

}  // namespace
}  // namespace crumple
