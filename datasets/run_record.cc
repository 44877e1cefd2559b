#include "datasets/run_record.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <memory>

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <openssl/evp.h>

#include "datasets/json_text.h"
#include "datasets/output_folder.h"

namespace crumple {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

json reference(const std::string& id) { return {{"@id", id}}; }

// A path as a URI reference: everything but unreserved characters and the slash is percent-encoded (RFC 3986, 2.1).
std::string uri(const std::string& path) {
  std::string encoded;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || std::string("-._~/").find(c) != std::string::npos)
      encoded += c;
    else
      encoded += fmt::format("%{:02X}", byte);
  }
  return encoded;
}

// The regular files at or below a path, sorted.
Expected<std::vector<fs::path>> files_below(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return std::vector<fs::path>{path};
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path, error))
    if (entry.is_regular_file()) files.push_back(entry.path());
  if (error) return fail(fmt::format("{} could not be read: {}.", path.string(), error.message()));
  std::sort(files.begin(), files.end());
  return files;
}

Expected<HashedFile> hashed_file(const fs::path& file) {
  auto hash = sha256_of_file(file);
  if (!hash) return tl::unexpected(hash.error());
  std::error_code error;
  return HashedFile{file, fs::file_size(file, error), std::move(*hash)};
}

json file_entity(const std::string& id, const std::string& name, const HashedFile& file) {
  return {{"@id", id},
          {"@type", "File"},
          {"name", name},
          {"contentSize", std::to_string(file.size)},
          {"sha256", file.sha256}};
}

// The digest of what is added piece by piece.
class RunningDigest {
 public:
  explicit RunningDigest(const EVP_MD* algorithm) : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    good_ = context_ && EVP_DigestInit_ex(context_.get(), algorithm, nullptr) == 1;
  }
  bool add(const char* data, std::size_t size) {
    good_ = good_ && EVP_DigestUpdate(context_.get(), data, size) == 1;
    return good_;
  }
  bool good() const { return good_; }
  std::string hexadecimal() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned length = 0;
    EVP_DigestFinal_ex(context_.get(), digest.data(), &length);
    std::string text;
    for (unsigned i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
  bool good_ = false;
};

Expected<std::string> digest_of_file(const fs::path& file, const EVP_MD* algorithm) {
  std::ifstream stream(file, std::ios::binary);
  RunningDigest hash(algorithm);
  if (!stream || !hash.good()) return fail(fmt::format("{} could not be read.", file.string()));
  std::vector<char> block(1U << 18);
  do {
    stream.read(block.data(), static_cast<std::streamsize>(block.size()));
    if (stream.bad() || !hash.add(block.data(), static_cast<std::size_t>(stream.gcount())))
      return fail(fmt::format("{} could not be read.", file.string()));
  } while (stream);
  return hash.hexadecimal();
}

class Graph {
 public:
  // Adds an entity and returns the reference to it.
  json add(json entity) {
    json result = reference(entity.at("@id").get<std::string>());
    nodes_.push_back(std::move(entity));
    return result;
  }

  json add_property(const std::string& kind, const std::string& name, const json& value) {
    return add({{"@id", fmt::format("#{}-{}", kind, uri(name))},
                {"@type", "PropertyValue"},
                {"name", name},
                {"value", value}});
  }

  json document() const {
    return {{"@context", {"https://w3id.org/ro/crate/1.1/context", {{"sha256", "https://schema.org/sha256"}}}},
            {"@graph", nodes_}};
  }

 private:
  json nodes_ = json::array();
};

json add_inputs(const RunRecord& record, Graph& graph) {
  json references = json::array();
  for (const HashedFile& file : record.inputs) {
    const std::string id = "file://" + uri(fs::absolute(file.path).lexically_normal().string());
    references.push_back(graph.add(file_entity(id, file.path.string(), file)));
  }
  for (const auto& [name, value] : record.flags) references.push_back(graph.add_property("flag", name, value));
  for (const auto& [name, value] : record.seeds) references.push_back(graph.add_property("seed", name, value));
  return references;
}

Expected<json> add_outputs(const fs::path& folder, Graph& graph) {
  const auto files = files_below(folder);
  if (!files) return tl::unexpected(files.error());
  json references = json::array();
  for (const fs::path& file : *files) {
    const std::string name = file.lexically_relative(folder).string();
    if (name == run_record_name) continue;
    const auto hashed = hashed_file(file);
    if (!hashed) return tl::unexpected(hashed.error());
    references.push_back(graph.add(file_entity(uri(name), name, *hashed)));
  }
  return references;
}

}  // namespace

Expected<std::string> sha256_of_file(const fs::path& file) { return digest_of_file(file, EVP_sha256()); }

Expected<std::string> sha512_of_file(const fs::path& file) { return digest_of_file(file, EVP_sha512()); }

std::string sha256_of_text(const std::string& text) {
  RunningDigest hash(EVP_sha256());
  hash.add(text.data(), text.size());
  return hash.hexadecimal();
}

Expected<std::vector<HashedFile>> hashed_files(const std::vector<fs::path>& paths) {
  std::vector<HashedFile> all;
  for (const fs::path& path : paths) {
    const auto files = files_below(path);
    if (!files) return tl::unexpected(files.error());
    for (const fs::path& file : *files) {
      auto hashed = hashed_file(file);
      if (!hashed) return tl::unexpected(hashed.error());
      all.push_back(std::move(*hashed));
    }
  }
  return all;
}

Expected<void> write_run_record(const fs::path& folder, const RunRecord& record) {
  Graph graph;
  graph.add({{"@id", run_record_name},
             {"@type", "CreativeWork"},
             {"about", reference("./")},
             {"conformsTo", reference("https://w3id.org/ro/crate/1.1")}});
  const json program = graph.add({{"@id", "#crumple"},
                                  {"@type", "SoftwareApplication"},
                                  {"name", "crumple"},
                                  {"softwareVersion", record.program_version}});
  json inputs = add_inputs(record, graph);
  auto outputs = add_outputs(folder, graph);
  if (!outputs) return tl::unexpected(outputs.error());
  const json action = graph.add({{"@id", "#run"},
                                 {"@type", "CreateAction"},
                                 {"name", "crumple " + record.verb},
                                 {"instrument", program},
                                 {"object", std::move(inputs)},
                                 {"result", *outputs}});
  graph.add({{"@id", "./"},
             {"@type", "Dataset"},
             {"name", fmt::format("Results of crumple {}", record.verb)},
             {"description", "Written by crumple; see the CreateAction for what went in."},
             {"datePublished", record.date},
             {"license", "No licence is stated."},
             {"hasPart", *outputs},
             {"mentions", action}});
  const auto text = json_text(graph.document());
  if (!text) return tl::unexpected(text.error());
  return write_file(folder / run_record_name, *text + "\n");
}

}  // namespace crumple
