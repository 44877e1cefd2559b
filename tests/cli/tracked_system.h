// A tracked probe's capture that the program itself rendered and calibrated.
#pragma once

#include "tests/cli/program.h"

namespace crumple {

// Rendered and calibrated once for all tests of a program run.
class TrackedSystem {
 public:
  static const TrackedSystem& get() {
    static const TrackedSystem system;
    return system;
  }

  std::string capture() const { return (home_ / "capture").string(); }
  std::string rig() const { return (home_ / "rig").string(); }
  // The same capture with these stations alone, as lines of its description.
  std::string with_stations(const std::string& name, const std::string& lines) const {
    const std::string whole = content_of(capture() + "/capture.yaml");
    const std::filesystem::path file = home_ / "capture" / name;
    write_content(file, whole.substr(0, whole.find("\nstations:")) + "\nstations:\n" + lines);
    return file.string();
  }
  const ProgramRun& rendered() const { return rendered_; }
  const ProgramRun& calibrated() const { return calibrated_; }

 private:
  TrackedSystem()
      : rendered_(run_program("simulate '" CRUMPLE_SOURCE_DIR
                              "/tests/data/scenes/tracked.yaml' --nodepth_maps --out='" +
                              capture() + "'")),
        calibrated_(run_program("calibrate '" + capture() + "/capture.yaml' --truth='" + capture() +
                                "/truth' --starts --cross_validate --nooverlays --json --out='" + rig() + "'")) {}

  TemporaryFolder home_;
  ProgramRun rendered_;
  ProgramRun calibrated_;
};

}  // namespace crumple
