#include "datasets/earlier_rig.h"

#include "datasets/output_folder.h"
#include "datasets/placements_file.h"
#include "datasets/rig_file.h"
#include "datasets/yaml_reader.h"

namespace crumple {

Expected<EarlierRig> read_earlier_rig(const std::filesystem::path& folder) {
  auto rig = read_rig(folder);
  if (!rig) return tl::unexpected(rig.error());
  EarlierRig earlier{.rig = std::move(*rig)};
  const std::filesystem::path file = folder / "placements.yaml";
  if (std::error_code unreadable; !std::filesystem::exists(file, unreadable)) return earlier;
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const auto placements = parse_placements(*text, file.string());
  if (!placements) return tl::unexpected(placements.error());
  for (const PlacedBoard& board : placements->boards) earlier.board_scales[board.name] = board.scale;
  return earlier;
}

}  // namespace crumple
