#include "cli/rig_doubts.h"

#include <fmt/format.h>

namespace crumple {

void tell_doubts(const Rig& rig, VerbResult& result) {
  if (rig.doubts.empty()) return;
  const char* const level = rig.rejected ? "rejected" : "suspect";
  result.document["rig_verdict"] = {{"level", level}, {"reasons", rig.doubts}};
  std::string text;
  for (const std::string& doubt : rig.doubts) text += fmt::format("the rig was {} when calibrated: {}\n", level, doubt);
  result.text = text + result.text;
  if (rig.rejected) result.exit_code = ExitCode::not_trusted;
}

}  // namespace crumple
