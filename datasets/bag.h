// BagIt 1.0 bags (RFC 8493): a capture that can prove, years later, that nothing of it was lost or changed.
//
//   BAG/bagit.txt, bag-info.txt        what it is
//   BAG/manifest-sha256.txt            a digest for every file of the payload
//   BAG/tagmanifest-sha256.txt         and for the three above
//   BAG/data/                          the payload: capture.yaml and its images
// Other files beside data/, such as a run record, are tag files of no concern to the bag.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "datasets/finding.h"
#include "solvers/expected.h"

namespace crumple {

// The bag, as an absolute path, that a description (BAG/data/capture.yaml) or the folder BAG itself belongs to.
std::optional<std::filesystem::path> bag_of(const std::filesystem::path& description);

struct BagInfo {
  std::string description;
  std::string date;  // ISO 8601
};

// Makes a bag of a folder that holds a payload in data/.
Expected<void> write_bag_tags(const std::filesystem::path& bag, const BagInfo& info);

// What keeps a bag from being complete and valid, each file named: missing, changed, not in the manifest; tag files
// that are missing or damaged. Links are not followed: a payload lies in the bag.
std::vector<Finding> check_bag(const std::filesystem::path& bag);

}  // namespace crumple
