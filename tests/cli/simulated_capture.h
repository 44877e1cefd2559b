// A small capture that the program itself rendered, once for all tests of a program run.
#pragma once

#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace crumple {

inline const std::string small_scene = CRUMPLE_SOURCE_DIR "/datasets/scenes/small.yaml";

// One board and the panel. The folder holds capture/ and the run's stdout.
class SimulatedCapture {
 public:
  static const SimulatedCapture& get() {
    static const SimulatedCapture capture;
    return capture;
  }

  const ProgramRun& run() const { return run_; }
  std::filesystem::path folder() const { return home_ / "capture"; }
  // A copy that a test may damage.
  void copy_to(const std::filesystem::path& folder_of_test) const {
    std::filesystem::copy(folder(), folder_of_test, std::filesystem::copy_options::recursive);
  }

 private:
  SimulatedCapture()
      : run_(run_program("simulate '" + small_scene + "' --stations=board_1,panel_1 --seed=11 --json --out='" +
                         (home_ / "capture").string() + "'")) {}

  TemporaryFolder home_;
  ProgramRun run_;
};

}  // namespace crumple
