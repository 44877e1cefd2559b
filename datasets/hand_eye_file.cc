#include "datasets/hand_eye_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "datasets/npy_file.h"
#include "datasets/output_folder.h"
#include "datasets/pose_yaml.h"

namespace crumple {
namespace {

constexpr const char* kHandEyeCovariance = "covariance.npy";

}  // namespace

std::vector<std::string> hand_eye_rows(bool timed) {
  std::vector<std::string> rows;
  for (const char* pose : {"hand_from_eye", "world_from_board"}) {
    for (const char* part : {"rotation", "translation"}) {
      for (const char axis : {'x', 'y', 'z'}) rows.push_back(fmt::format("{}.{}_{}", pose, part, axis));
    }
  }
  if (timed) rows.emplace_back("time_offset");
  return rows;
}

Expected<void> write_hand_eye(const std::filesystem::path& folder, const HandEyeFit& fit) {
  const std::vector<std::string> rows = hand_eye_rows(fit.timed);
  const std::string text = fmt::format(
      "schema: crumple-hand-eye/1\nhand_from_eye:\n{}world_from_board:\n{}{}covariance:\n  file: {}\n  rows: [{}]\n",
      pose_yaml(fit.state.hand_from_eye, 2), pose_yaml(fit.state.world_from_board, 2),
      fit.timed ? fmt::format("time_offset_s: {}\n", fit.state.offset_s) : "", kHandEyeCovariance,
      fmt::join(rows, ", "));
  const auto count = static_cast<Eigen::Index>(rows.size());
  const Eigen::MatrixXd covariance = fit.covariance.topLeftCorner(count, count);
  if (auto done = write_npy(folder / kHandEyeCovariance, covariance); !done) return done;
  return write_file(folder / "hand_eye.yaml", text);
}

}  // namespace crumple
