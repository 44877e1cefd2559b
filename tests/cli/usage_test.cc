#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace crumple {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

struct Mistake {
  const char* arguments;
  const char* said;
};

void PrintTo(const Mistake& mistake, std::ostream* stream) { *stream << mistake.arguments; }

class UsageErrors : public testing::TestWithParam<Mistake> {};

TEST_P(UsageErrors, EndWithCodeTwoAndASentence) {
  const TemporaryFolder home;
  const std::string out = " --out='" + (home / "out").string() + "'";
  const ProgramRun run = run_program(std::string(GetParam().arguments) + out);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr(GetParam().said));
  EXPECT_THAT(run.out, IsEmpty());
  EXPECT_EQ(home.entries(), 0);
}

INSTANTIATE_TEST_SUITE_P(
    Usage, UsageErrors,
    testing::Values(Mistake{"paterns", "Did you mean patterns?"},  //
                    Mistake{"patterns --widht_px=64 --height_px=48", "Did you mean --width_px?"},
                    Mistake{"patterns --width_px=64 --height_px=48 extra", "Unexpected argument extra"},
                    Mistake{"patterns --width_px=64 --height_px=48 -- --json", "Unexpected argument --json"},
                    Mistake{"patterns --width_px=64 --width_px=64 --height_px=48", "--width_px is given twice"},
                    Mistake{"patterns --width_px=64 --height_px=48 --inverse --noinverse", "--inverse is given twice"},
                    Mistake{"patterns --width_px=64x --height_px=48", "--width_px=64x is not a whole number"},
                    Mistake{"patterns --width_px=99999999999 --height_px=48", "is not a whole number"},
                    Mistake{"patterns --width_px= --height_px=48", "--width_px= is not"},
                    Mistake{"patterns --width_px --height_px=48", "--width_px needs a value"},
                    Mistake{"patterns --nowidth_px --height_px=48", "Unknown flag --nowidth_px"},
                    Mistake{"patterns --width_px=64 --height_px=48 --noinverse=true", "Unknown flag --noinverse"},
                    Mistake{"patterns --width_px=64 --height_px=48 --inverse=maybe", "is not true or false"},
                    Mistake{"patterns --width_px=64 --height_px=48 --stripe_width_px=nan", "is not a finite number"},
                    Mistake{"patterns --width_px=64 --height_px=48 --stripe_width_px=1e999", "is not a finite number"},
                    Mistake{"patterns --width_px=64 --height_px=48 --stripe_width_px=0", "stripe width"},
                    Mistake{"patterns --width_px=64 --height_px=48 --orientations_deg=0,,1", "list of numbers"},
                    Mistake{"patterns --width_px=64 --height_px=48 --bits=3", "bits"},
                    Mistake{"patterns --height_px=48", "--width_px and --height_px"},
                    Mistake{"patterns --board --board_rows=1", "10 x 1"},
                    Mistake{"patterns --board --paper=A4 --board_pitch_mm=50", "A4"},
                    // Flags of the libraries below are none of ours, and gflags' own would hide mistakes.
                    Mistake{"patterns --flagfile=x", "Unknown flag --flagfile"},
                    Mistake{"patterns --undefok=x", "Unknown flag --undefok"},
                    Mistake{"patterns --fromenv=x", "Unknown flag --fromenv"},
                    Mistake{"patterns --minloglevel=0", "Unknown flag --minloglevel"},
                    Mistake{"patterns --version", "Unknown flag --version"},
                    Mistake{"patterns --", "Unexpected argument --out"}));

TEST(Usage, AlternativeFormsOfFlags) {
  const TemporaryFolder home;
  const std::string out = (home / "out").string();
  const ProgramRun run = run_program("patterns -width_px 64 --height-px=48 --noinverse --stripe_width_px 2 -out '" +
                                     out + "' --json=true");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json document = json::parse(run.out);
  EXPECT_EQ(document["files"].size(), 2U + 5U + 5U);
}

TEST(Usage, NothingPrintsTheHelpOnStderr) {
  const ProgramRun run = run_program("");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("Usage"));
  EXPECT_THAT(run.out, IsEmpty());
}

TEST(Usage, RequiredFlagIsNamed) {
  for (const char* const arguments : {"patterns --board", "patterns --board --out="}) {
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, AllOf(HasSubstr("patterns needs --out"), HasSubstr("crumple help patterns")));
  }
}

TEST(Usage, MistakesAreJsonTooWhereJsonWasAskedFor) {
  for (const char* const arguments : {"patterns --json --wdith_px=3", "paterns --json", "patterns --json"}) {
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2);
    const json document = json::parse(run.out);
    EXPECT_EQ(document["exit_code"], 2);
    EXPECT_THAT(run.err, HasSubstr(document["error"].get<std::string>()));
  }
}

TEST(Usage, Version) {
  const ProgramRun run = run_program("--version");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, testing::MatchesRegex("crumple [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST(Usage, AFullStdoutIsNoSuccess) {
  const TemporaryFolder home;
  const std::string command = "'" + program_path() + "' help >/dev/full 2>'" + (home / "err").string() + "'";
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 3);
  EXPECT_THAT(content_of(home / "err"), HasSubstr("stdout"));
}

}  // namespace
}  // namespace crumple
