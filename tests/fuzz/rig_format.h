// What the targets of other programs' rig formats have in common: what is read of a folder of made-up files can be
// written as a rig of ours, and read again.
#pragma once

#include "datasets/formats/rig_format.h"
#include "datasets/rig_file.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/input.h"

namespace crumple {

inline int read_in_format(const std::string& name, const std::uint8_t* data, std::size_t size) {
  const TemporaryFolder given;
  unpack(text_of(data, size), given.path());
  const auto rig = rig_format(name).value().read({given.path()});
  if (!rig) {
    require(!rig.error().message.empty(), "a refusal says why");
    return 0;
  }
  const TemporaryFolder home;
  const auto written = write_rig(home.path(), *rig);
  // Names are the other program's, and two sensors may have come to one.
  if (!written && written.error().message.starts_with("Two sensors")) return 0;
  require(written.has_value(), "what is read can be written: " + (written ? "" : written.error().message));
  const auto again = read_rig(home.path());
  require(again.has_value(), "what is written can be read: " + (again ? "" : again.error().message));
  return 0;
}

}  // namespace crumple
