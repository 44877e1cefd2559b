// Small captures on disk, rendered once per run of the tests and copied for each of them to damage.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "datasets/simulate.h"
#include "tests/cli/program.h"

namespace crumple {

// Board placements for one camera and one projector of 320 x 240 px; 28 frames a station.
enum class SmallCapture { sound, turned_away, parallel };

// A copy of the capture; `home` gets the folders `capture` and, for results, `results`.
class DamagedCapture : public testing::Test {
 protected:
  void make(SmallCapture which);

  std::filesystem::path description() const { return home_ / "capture/capture.yaml"; }
  // Frame number `frame` of station board_`station`.
  std::filesystem::path image(int station, int frame) const;

  // Runs the verb and expects exit code 3, `said` on stderr or, for check, on stdout, and an empty results folder.
  void expect_refused(const std::string& verb, const std::vector<std::string>& said, const std::string& before = "");

  TemporaryFolder home_;
};

}  // namespace crumple
