// The help texts, word for word, against tests/data/help/*.txt. CRUMPLE_UPDATE_GOLDEN=1 writes them anew.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/program.h"

namespace crumple {
namespace {

const std::filesystem::path golden_folder = CRUMPLE_SOURCE_DIR "/tests/data/help";

void expect_golden(const std::string& text, const std::string& name) {
  const std::filesystem::path file = golden_folder / (name + ".txt");
  if (std::getenv("CRUMPLE_UPDATE_GOLDEN")) write_content(file, text);
  EXPECT_EQ(text, content_of(file)) << "see " << file;
}

// The words under "Verbs" that start a line of `crumple help`.
std::vector<std::string> verbs() {
  std::istringstream lines(run_program("help").out);
  std::vector<std::string> names;
  bool listed = false;
  for (std::string line; std::getline(lines, line);) {
    if (listed && line.empty()) return names;
    if (listed) names.push_back(line.substr(2, line.find(' ', 2) - 2));
    listed = listed || line == "Verbs";
  }
  return names;
}

TEST(Help, ProgramHelp) {
  const ProgramRun run = run_program("help");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.err, "");
  expect_golden(run.out, "crumple");
  EXPECT_EQ(run_program("--help").out, run.out);
}

TEST(Help, EveryVerb) {
  ASSERT_FALSE(verbs().empty());
  for (const std::string& verb : verbs()) {
    const ProgramRun run = run_program("help " + verb);
    EXPECT_EQ(run.exit_code, 0);
    expect_golden(run.out, verb);
    EXPECT_EQ(run_program(verb + " --help").out, run.out);
    std::istringstream lines(run.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;
  }
}

TEST(Help, UnknownVerb) {
  const ProgramRun run = run_program("help patern");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, testing::HasSubstr("Did you mean patterns?"));
}

}  // namespace
}  // namespace crumple
