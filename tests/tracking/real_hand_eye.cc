#include "tests/tracking/real_hand_eye.h"

#include "tests/datasets/public_data.h"
#include "tests/python.h"

namespace crumple {

std::optional<std::filesystem::path> unpack(const RealHandEye& set, const std::filesystem::path& folder) {
  const auto data = public_data("hand_eye");
  if (!data) return std::nullopt;
  const std::string archive = (*data / (set.name + ".zip")).string();
  const std::string script = "import sys, zipfile\nzipfile.ZipFile('" + archive + "').extractall(sys.argv[1])\n";
  if (!run_python(script, folder.string()).empty()) return std::nullopt;
  return folder;
}

}  // namespace crumple
