#include "datasets/run_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "datasets/json_text.h"
#include "tests/temporary_folder.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// FIPS 180-2, appendices B.1 and C.1.
constexpr const char* sha256_of_abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr const char* sha512_of_abc =
    "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c23a3feebbd454d4423643ce80e"
    "2a9ac94fa54ca49f";

json entity(const json& crate, const std::string& id) {
  for (const json& node : crate["@graph"])
    if (node["@id"] == id) return node;
  return {};
}

TEST(RunRecord, HashesAsFipsSays) {
  const TemporaryFolder home;
  write_content(home / "abc", "abc");
  EXPECT_EQ(sha256_of_file(home / "abc").value(), sha256_of_abc);
  EXPECT_THAT(sha256_of_file(home / "none").error().message, HasSubstr("none"));
  EXPECT_FALSE(sha256_of_file(home.path()));
  EXPECT_EQ(sha256_of_text("abc"), sha256_of_abc);
  EXPECT_EQ(sha512_of_file(home / "abc").value(), sha512_of_abc);
  EXPECT_THAT(sha512_of_file(home / "none").error().message, HasSubstr("none"));
}

TEST(RunRecord, StatesWhatWentInAndCameOut) {
  const TemporaryFolder home;
  std::filesystem::create_directories(home / "in put");
  std::filesystem::create_directories(home / "out/sub");
  write_content(home / "in put/a", "abc");
  write_content(home / "out/sub/b", "abc");
  const RunRecord record{"1.2.3",         "patterns",      "2024-05-06",
                         {{"bits", "7"}}, {{"noise", 42}}, hashed_files({home / "in put"}).value()};
  ASSERT_TRUE(write_run_record(home / "out", record));
  const json crate = json::parse(content_of(home / "out/ro-crate-metadata.json"));
  const json action = entity(crate, "#run");
  EXPECT_EQ(action["result"], json::array({{{"@id", "sub/b"}}}));
  EXPECT_EQ(action["object"].size(), 3U);
  EXPECT_EQ(entity(crate, "sub/b")["sha256"], sha256_of_abc);
  const json input = entity(crate, action["object"][0]["@id"]);
  EXPECT_EQ(input["sha256"], sha256_of_abc);
  EXPECT_THAT(input["@id"].get<std::string>(), HasSubstr("in%20put/a"));
  EXPECT_EQ(entity(crate, "#flag-bits")["value"], "7");
  EXPECT_EQ(entity(crate, "#seed-noise")["value"], 42);
  EXPECT_EQ(entity(crate, "#crumple")["softwareVersion"], "1.2.3");
  EXPECT_EQ(entity(crate, "./")["datePublished"], "2024-05-06");
  EXPECT_EQ(entity(crate, "ro-crate-metadata.json")["about"]["@id"], "./");
}

TEST(RunRecord, AMissingInputIsNamed) {
  const TemporaryFolder home;
  const auto hashed = hashed_files({home / "none"});
  ASSERT_FALSE(hashed);
  EXPECT_THAT(hashed.error().message, HasSubstr("none"));
}

TEST(JsonText, RefusesNumbersThatJsonCannotHold) {
  EXPECT_THAT(json_text({{"a", {1, {{"b", NAN}}}}}).error().message, HasSubstr("/a/1/b"));
  EXPECT_FALSE(json_text(json(INFINITY)));
  EXPECT_EQ(json_text(json(0.1)).value(), "0.1");
  EXPECT_EQ(json::parse(json_text(json("\xff")).value()), "\xEF\xBF\xBD");
}

}  // namespace
}  // namespace crumple
