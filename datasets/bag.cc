#include "datasets/bag.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <map>
#include <sstream>

#include <fmt/format.h>

#include "datasets/output_folder.h"
#include "datasets/run_record.h"

namespace crumple {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDeclaration = "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n";
constexpr const char* kManifest = "manifest-sha256.txt";
constexpr const char* kTagManifest = "tagmanifest-sha256.txt";
constexpr std::size_t kDigits = 64;

// RFC 8493, 2.1.3: these three would end a line or be taken for an escape.
std::string encoded(const std::string& path) {
  std::string text;
  for (const char c : path)
    text += c == '%' || c == '\n' || c == '\r' ? fmt::format("%{:02X}", int{c}) : std::string(1, c);
  return text;
}

std::string decoded(const std::string& text) {
  std::string path;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::string escape = text.substr(i, 3);
    const char c = escape == "%25"                      ? '%'
                   : escape == "%0A" || escape == "%0a" ? '\n'
                   : escape == "%0D" || escape == "%0d" ? '\r'
                                                        : '\0';
    path += c == '\0' ? text[i] : c;
    if (c != '\0') i += 2;
  }
  return path;
}

// The files below a folder by their paths relative to the bag, sorted.
Expected<std::vector<std::string>> payload_of(const fs::path& bag) {
  std::vector<std::string> files;
  std::error_code failure;
  auto entry = fs::recursive_directory_iterator(bag / "data", failure);
  for (; !failure && entry != fs::recursive_directory_iterator(); entry.increment(failure)) {
    if (!entry->is_directory() || entry->is_symlink()) files.push_back(entry->path().lexically_relative(bag).string());
  }
  if (failure) return fail(fmt::format("{} could not be read: {}", (bag / "data").string(), failure.message()));
  std::sort(files.begin(), files.end());
  return files;
}

Expected<std::string> manifest_text(const fs::path& bag, const std::vector<std::string>& files) {
  std::string text;
  for (const std::string& file : files) {
    const auto digest = sha256_of_file(bag / file);
    if (!digest) return tl::unexpected(digest.error());
    text += fmt::format("{}  {}\n", *digest, encoded(file));
  }
  return text;
}

// Octets and files, as Payload-Oxum states them.
std::string oxum(const fs::path& bag, const std::vector<std::string>& files) {
  std::uintmax_t octets = 0;
  for (const std::string& file : files) {
    std::error_code failure;
    const std::uintmax_t size = fs::file_size(bag / file, failure);
    if (!failure) octets += size;
  }
  return fmt::format("{}.{}", octets, files.size());
}

bool lies_in_bag(const std::string& file) {
  const fs::path path(file);
  return path.is_relative() &&
         std::none_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
}

bool is_digest(const std::string& text) {
  return text.size() == kDigits &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
}

class BagChecker {
 public:
  explicit BagChecker(fs::path bag) : bag_(std::move(bag)) {}

  std::vector<Finding> findings() {
    check_declaration();
    std::error_code failure;
    if (fs::exists(bag_ / "fetch.txt", failure)) {
      add("fetch.txt", "lists files that are elsewhere: fetch them into the bag and delete it");
    }
    const auto payload = payload_of(bag_);
    if (!payload) {
      findings_.push_back({Severity::error, (bag_ / "data").string(), payload.error().message});
      return findings_;
    }
    const auto listed = read_manifest(kManifest, true);
    if (listed) {
      verify(*listed, kManifest);
      for (const std::string& file : *payload) {
        if (!listed->contains(file))
          add(file, fmt::format("is not listed in {}: it was added to the bag later", kManifest));
      }
    }
    if (fs::exists(bag_ / kTagManifest, failure)) {
      if (const auto tags = read_manifest(kTagManifest, false)) verify(*tags, kTagManifest);
    }
    check_oxum(*payload);
    return findings_;
  }

 private:
  using Digests = std::map<std::string, std::string>;  // by path in the bag

  void add(const std::string& file, const std::string& sentence) {
    findings_.push_back({Severity::error, (bag_ / file).string(), sentence});
  }

  void check_declaration() {
    const auto text = read_file(bag_ / "bagit.txt");
    if (!text) {
      add("bagit.txt", "is missing or cannot be read: without it this is no bag");
      return;
    }
    const bool version = text->find("BagIt-Version: 1.0") == 0 || text->find("BagIt-Version: 0.97") == 0;
    if (!version) add("bagit.txt", "does not begin with `BagIt-Version: 1.0`");
    if (text->find("Tag-File-Character-Encoding: UTF-8") == std::string::npos) {
      add("bagit.txt", "does not say `Tag-File-Character-Encoding: UTF-8`");
    }
  }

  // Nothing where it cannot be read at all; lines that cannot are named.
  std::optional<Digests> read_manifest(const std::string& name, bool of_payload) {
    const auto text = read_file(bag_ / name);
    if (!text) {
      add(name, "is missing or cannot be read: the bag's files cannot be verified");
      return std::nullopt;
    }
    Digests digests;
    std::istringstream lines(*text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty()) continue;
      const std::size_t end = line.find_first_of(" \t");
      const std::size_t begin = end == std::string::npos ? end : line.find_first_not_of(" \t*", end);
      if (begin == std::string::npos || !is_digest(line.substr(0, end))) {
        add(name, fmt::format("line {} is not a digest of {} hexadecimal digits and a file's path", number, kDigits));
        continue;
      }
      const std::string file = decoded(line.substr(begin));
      if (!lies_in_bag(file) || (file.rfind("data/", 0) == 0) != of_payload) {
        add(name, fmt::format("line {} names {}, which is not a file of the {}", number, file,
                              of_payload ? "payload" : "bag's tags"));
        continue;
      }
      if (!digests.emplace(file, line.substr(0, end)).second) add(name, fmt::format("lists {} twice", file));
    }
    return digests;
  }

  void verify(const Digests& listed, const std::string& manifest) {
    for (const auto& [file, digest] : listed) {
      std::error_code failure;
      const fs::file_status status = fs::symlink_status(bag_ / file, failure);
      if (!fs::exists(status)) {
        add(file, fmt::format("is missing; {} lists it", manifest));
        continue;
      }
      if (!fs::is_regular_file(status)) {
        add(file, "is no plain file: a bag holds its files itself");
        continue;
      }
      const auto actual = sha256_of_file(bag_ / file);
      const bool same = actual && std::equal(digest.begin(), digest.end(), actual->begin(), actual->end(),
                                             [](unsigned char a, unsigned char b) { return std::tolower(a) == b; });
      if (!actual) add(file, "cannot be read");
      if (actual && !same) add(file, fmt::format("was changed: its SHA-256 is not the one in {}", manifest));
    }
  }

  void check_oxum(const std::vector<std::string>& payload) {
    const auto text = read_file(bag_ / "bag-info.txt");
    if (!text) return;  // optional
    const std::string key = "Payload-Oxum: ";
    const std::size_t at = text->find(key);
    if (at == std::string::npos) return;
    const std::size_t begin = at + key.size();
    const std::string stated = text->substr(begin, text->find_first_of("\r\n", begin) - begin);
    const std::string actual = oxum(bag_, payload);
    if (stated != actual) {
      add("bag-info.txt", fmt::format("states a payload of {} (octets.files), but it is {}", stated, actual));
    }
  }

  fs::path bag_;
  std::vector<Finding> findings_;
};

// A value on one line.
std::string on_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20; }, ' ');
  return text;
}

}  // namespace

std::optional<fs::path> bag_of(const fs::path& description) {
  std::error_code failure;
  const fs::path absolute = fs::absolute(description, failure).lexically_normal();
  const bool folder = fs::is_directory(absolute, failure);
  const fs::path bag = folder ? absolute : absolute.parent_path().parent_path();
  const bool inside = folder || absolute.parent_path().filename() == "data";
  if (!inside || !fs::exists(bag / "bagit.txt", failure)) return std::nullopt;
  return bag;
}

Expected<void> write_bag_tags(const fs::path& bag, const BagInfo& info) {
  const auto payload = payload_of(bag);
  if (!payload) return tl::unexpected(payload.error());
  const auto manifest = manifest_text(bag, *payload);
  if (!manifest) return tl::unexpected(manifest.error());
  const std::string about = fmt::format("Bagging-Date: {}\nExternal-Description: {}\nPayload-Oxum: {}\n", info.date,
                                        on_one_line(info.description), oxum(bag, *payload));
  if (auto done = write_file(bag / "bagit.txt", kDeclaration); !done) return done;
  if (auto done = write_file(bag / "bag-info.txt", about); !done) return done;
  if (auto done = write_file(bag / kManifest, *manifest); !done) return done;
  const auto tags = manifest_text(bag, {"bag-info.txt", "bagit.txt", kManifest});
  if (!tags) return tl::unexpected(tags.error());
  return write_file(bag / kTagManifest, *tags);
}

std::vector<Finding> check_bag(const fs::path& bag) { return BagChecker(bag).findings(); }

}  // namespace crumple
