// BagIt 1.0 bags (RFC 8493): a capture that can prove, years later, that nothing of it was lost or changed.
//
//   BAG/bagit.txt, bag-info.txt        what it is
//   BAG/manifest-sha256.txt            a digest for every file of the payload
//   BAG/tagmanifest-sha256.txt         and for the three above
//   BAG/data/                          the payload: capture.yaml and its images
// Manifests with SHA-512 (manifest-sha512.txt, tagmanifest-sha512.txt) are read as well, and not written. Other files
// beside data/, such as a run record, are tag files of no concern to the bag.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "datasets/finding.h"
#include "solvers/expected.h"

namespace crumple {

// The bag, as an absolute path, that a description (BAG/data/capture.yaml) or the folder BAG itself belongs to.
// BAG/data will do as well.
std::optional<std::filesystem::path> bag_of(const std::filesystem::path& description);

// The folder that is the bag of a description, or can be made one, as an absolute path: FOLDER of
// FOLDER/data/capture.yaml; none where the description lies elsewhere.
std::optional<std::filesystem::path> bag_around(const std::filesystem::path& description);

struct BagInfo {
  std::string description;
  std::string date;                // of bagging, ISO 8601
  std::string operator_name = {};  // who took the capture and when; empty: not stated
  std::string capture_date = {};
};

// The tag files of a bag that lie in a folder, sorted: the declaration, bag-info.txt, manifests of whatever digests.
Expected<std::vector<std::string>> bag_tags_in(const std::filesystem::path& folder);

// Makes a bag of a folder that holds a payload in data/, and tells the tag files that it wrote. Those that are there
// already (bag_tags_in) give way to them. Fails, leaving them as they were, where the payload is or holds a link, where
// fetch.txt lists files that are elsewhere, and where a file cannot be read or written.
Expected<std::vector<std::string>> write_bag_tags(const std::filesystem::path& bag, const BagInfo& info);

// What keeps a bag from being complete and valid, each file named: missing, changed, not in every manifest; tag files
// that are missing or damaged. Links are not followed: a payload lies in the bag. Manifests of other digests than
// SHA-256 and SHA-512 are not looked at.
std::vector<Finding> check_bag(const std::filesystem::path& bag);

}  // namespace crumple
