#include "datasets/bag.h"

#include <algorithm>
#include <array>
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

constexpr const char* kDeclarationFile = "bagit.txt";
constexpr const char* kDeclaration = "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n";
constexpr const char* kInfoFile = "bag-info.txt";
constexpr const char* kFetchFile = "fetch.txt";
constexpr const char* kFetchAdvice = "lists files that are elsewhere: fetch them into the bag and delete it";

struct DigestKind {
  const char* name;
  const char* manifest;
  const char* tag_manifest;
  std::size_t digits;
  Expected<std::string> (*of_file)(const fs::path&);
};

// Those that RFC 8493, 2.4 obliges programs to read; the first is written.
constexpr std::array<DigestKind, 2> kDigestKinds = {
    {{"SHA-256", "manifest-sha256.txt", "tagmanifest-sha256.txt", 64, sha256_of_file},
     {"SHA-512", "manifest-sha512.txt", "tagmanifest-sha512.txt", 128, sha512_of_file}}};

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
  if (fs::is_symlink(bag / "data", failure)) {
    return fail(fmt::format("{} is a link: a bag holds its files itself", (bag / "data").string()));
  }
  auto entry = fs::recursive_directory_iterator(bag / "data", failure);
  for (; !failure && entry != fs::recursive_directory_iterator(); entry.increment(failure)) {
    if (!entry->is_directory() || entry->is_symlink()) files.push_back(entry->path().lexically_relative(bag).string());
  }
  if (failure) return fail(fmt::format("{} could not be read: {}", (bag / "data").string(), failure.message()));
  std::sort(files.begin(), files.end());
  return files;
}

std::string manifest_line(const std::string& digest, const std::string& file) {
  return fmt::format("{}  {}\n", digest, encoded(file));
}

Expected<std::string> manifest_text(const fs::path& bag, const std::vector<std::string>& payload) {
  std::string text;
  for (const std::string& file : payload) {
    std::error_code failure;
    if (!fs::is_regular_file(fs::symlink_status(bag / file, failure))) {
      return fail(fmt::format("{} is no plain file: a bag holds its files itself", (bag / file).string()));
    }
    const auto digest = kDigestKinds.front().of_file(bag / file);
    if (!digest) return tl::unexpected(digest.error());
    text += manifest_line(*digest, file);
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

bool is_digest(const std::string& text, std::size_t digits) {
  return text.size() == digits &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
}

class BagChecker {
 public:
  explicit BagChecker(fs::path bag) : bag_(std::move(bag)) {}

  std::vector<Finding> findings() {
    check_declaration();
    std::error_code failure;
    if (fs::exists(bag_ / kFetchFile, failure)) add(kFetchFile, kFetchAdvice);
    const auto payload = payload_of(bag_);
    if (!payload) {
      findings_.push_back({Severity::error, (bag_ / "data").string(), payload.error().message});
      return findings_;
    }
    if (std::none_of(kDigestKinds.begin(), kDigestKinds.end(),
                     [&](const DigestKind& kind) { return fs::exists(bag_ / kind.manifest, failure); })) {
      add(kDigestKinds[0].manifest,
          fmt::format("is missing, and so is {}: the bag's files cannot be verified", kDigestKinds[1].manifest));
    }
    for (const DigestKind& kind : kDigestKinds) {
      if (fs::exists(bag_ / kind.manifest, failure)) verify_payload(kind, *payload);
      if (!fs::exists(bag_ / kind.tag_manifest, failure)) continue;
      if (const auto tags = read_manifest(kind, kind.tag_manifest, false)) verify(*tags, kind, kind.tag_manifest);
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
    const auto text = read_file(bag_ / kDeclarationFile);
    if (!text) {
      add(kDeclarationFile, "is missing or cannot be read: without it this is no bag");
      return;
    }
    const bool version = text->find("BagIt-Version: 1.0") == 0 || text->find("BagIt-Version: 0.97") == 0;
    if (!version) add(kDeclarationFile, "does not begin with `BagIt-Version: 1.0`");
    if (text->find("Tag-File-Character-Encoding: UTF-8") == std::string::npos) {
      add(kDeclarationFile, "does not say `Tag-File-Character-Encoding: UTF-8`");
    }
  }

  // Every manifest lists the whole payload (RFC 8493, 2.1.3).
  void verify_payload(const DigestKind& kind, const std::vector<std::string>& payload) {
    const auto listed = read_manifest(kind, kind.manifest, true);
    if (!listed) return;
    verify(*listed, kind, kind.manifest);
    for (const std::string& file : payload) {
      if (!listed->contains(file))
        add(file, fmt::format("is not listed in {}: it was added to the bag later", kind.manifest));
    }
  }

  // Nothing where it cannot be read at all; lines that cannot are named.
  std::optional<Digests> read_manifest(const DigestKind& kind, const std::string& name, bool of_payload) {
    const auto text = read_file(bag_ / name);
    if (!text) {
      add(name, "cannot be read: the bag's files cannot be verified by it");
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
      if (begin == std::string::npos || !is_digest(line.substr(0, end), kind.digits)) {
        add(name,
            fmt::format("line {} is not a digest of {} hexadecimal digits and a file's path", number, kind.digits));
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

  void verify(const Digests& listed, const DigestKind& kind, const std::string& manifest) {
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
      const auto actual = kind.of_file(bag_ / file);
      const bool same = actual && std::equal(digest.begin(), digest.end(), actual->begin(), actual->end(),
                                             [](unsigned char a, unsigned char b) { return std::tolower(a) == b; });
      if (!actual) add(file, "cannot be read");
      if (actual && !same) add(file, fmt::format("was changed: its {} is not the one in {}", kind.name, manifest));
    }
  }

  void check_oxum(const std::vector<std::string>& payload) {
    std::error_code failure;
    if (!fs::exists(bag_ / kInfoFile, failure)) return;  // optional
    const auto read = read_file(bag_ / kInfoFile);
    if (!read) {
      add(kInfoFile, "cannot be read");
      return;
    }
    const std::string text = "\n" + *read;
    const std::string key = "\nPayload-Oxum: ";
    const std::size_t at = text.find(key);
    if (at == std::string::npos) return;
    const std::size_t begin = at + key.size();
    const std::string stated = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
    const std::string actual = oxum(bag_, payload);
    if (stated != actual) {
      add(kInfoFile, fmt::format("states a payload of {} (octets.files), but it is {}", stated, actual));
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

// RFC 8493 has no words of its own for who took a capture and when; it lets others be added.
std::string info_text(const BagInfo& info, const std::string& payload_oxum) {
  std::string text =
      fmt::format("Bagging-Date: {}\nExternal-Description: {}\n", info.date, on_one_line(info.description));
  if (!info.operator_name.empty()) text += fmt::format("Capture-Operator: {}\n", on_one_line(info.operator_name));
  if (!info.capture_date.empty()) text += fmt::format("Capture-Date: {}\n", on_one_line(info.capture_date));
  return text + fmt::format("Payload-Oxum: {}\n", payload_oxum);
}

bool is_bag_tag(const std::string& name) {
  const bool manifest = name.starts_with("manifest-") || name.starts_with("tagmanifest-");
  return name == kDeclarationFile || name == kInfoFile || (manifest && name.ends_with(".txt"));
}

// All of them beside their places first, so that a full disk leaves what was there. Earlier ones that no new one takes
// the place of, such as manifests of other digests, go.
Expected<void> replace_tags(const fs::path& bag, const std::vector<std::string>& earlier,
                            const std::map<std::string, std::string>& texts) {
  std::error_code failure, ignored;
  const auto staged = [&](const std::string& name) { return bag / fmt::format(".{}.new", name); };
  for (const auto& [name, text] : texts) {
    const auto written = write_file(staged(name), text);
    if (written) continue;
    for (const auto& entry : texts) fs::remove(staged(entry.first), ignored);
    return written;
  }
  for (const auto& entry : texts) {
    fs::rename(staged(entry.first), bag / entry.first, failure);
    if (failure) return fail(fmt::format("{} cannot be written: {}", (bag / entry.first).string(), failure.message()));
  }
  for (const std::string& name : earlier) {
    if (texts.contains(name)) continue;
    fs::remove(bag / name, failure);
    if (failure) return fail(fmt::format("{} cannot be removed: {}", (bag / name).string(), failure.message()));
  }
  return {};
}

}  // namespace

std::optional<fs::path> bag_of(const fs::path& description) {
  std::error_code failure;
  const auto is_bag = [&](const fs::path& folder) { return fs::exists(folder / kDeclarationFile, failure); };
  const fs::path absolute = fs::absolute(description, failure).lexically_normal();
  const bool folder = fs::is_directory(absolute, failure);
  if (folder && is_bag(absolute)) return absolute;
  auto bag = bag_around(folder ? absolute / "capture.yaml" : absolute);
  return bag && is_bag(*bag) ? bag : std::nullopt;
}

std::optional<fs::path> bag_around(const fs::path& description) {
  std::error_code failure;
  const fs::path payload = fs::absolute(description, failure).lexically_normal().parent_path();
  if (payload.filename() != "data") return std::nullopt;
  return payload.parent_path();
}

Expected<std::vector<std::string>> bag_tags_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failure, unknown;
  auto entry = fs::directory_iterator(folder, failure);
  for (; !failure && entry != fs::directory_iterator(); entry.increment(failure)) {
    const std::string name = entry->path().filename().string();
    if (is_bag_tag(name) && !fs::is_directory(entry->symlink_status(unknown))) names.push_back(name);
  }
  if (failure) return fail(fmt::format("{} could not be read: {}", folder.string(), failure.message()));
  std::sort(names.begin(), names.end());
  return names;
}

Expected<std::vector<std::string>> write_bag_tags(const fs::path& bag, const BagInfo& info) {
  const DigestKind& kind = kDigestKinds.front();
  std::error_code failure;
  if (fs::exists(bag / kFetchFile, failure)) {
    return fail(fmt::format("{} {}", (bag / kFetchFile).string(), kFetchAdvice));
  }
  const auto earlier = bag_tags_in(bag);
  if (!earlier) return tl::unexpected(earlier.error());
  const auto payload = payload_of(bag);
  if (!payload) return tl::unexpected(payload.error());
  const auto manifest = manifest_text(bag, *payload);
  if (!manifest) return tl::unexpected(manifest.error());
  std::map<std::string, std::string> texts = {
      {kDeclarationFile, kDeclaration}, {kInfoFile, info_text(info, oxum(bag, *payload))}, {kind.manifest, *manifest}};
  std::string tag_manifest;
  for (const auto& [name, text] : texts) tag_manifest += manifest_line(sha256_of_text(text), name);
  texts.emplace(kind.tag_manifest, std::move(tag_manifest));
  if (auto done = replace_tags(bag, *earlier, texts); !done) return tl::unexpected(done.error());
  std::vector<std::string> names;
  for (const auto& entry : texts) names.push_back(entry.first);
  return names;
}

std::vector<Finding> check_bag(const fs::path& bag) { return BagChecker(bag).findings(); }

}  // namespace crumple
