#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/report/gnuplot.h"
#include "datasets/report/html.h"

namespace crumple {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Html, TextIsEscapedAndMadeUtf8) {
  EXPECT_EQ(html_text("a<b & \"c\">\n\x01"), "a&lt;b &amp; &quot;c&quot;&gt;  ");
  EXPECT_EQ(html_text("caf\xe9"), "caf\xEF\xBF\xBD");
}

TEST(Html, ValuesAreRoundedByTheirUncertainty) {
  EXPECT_EQ(html_value(1402.317087, 0.050974), "<data value=\"1402.317087\">1402.317</data>");
  EXPECT_EQ(html_uncertainty(0.050974), "<data value=\"0.050974\">0.051</data>");
  EXPECT_THAT(html_value(1234.5, 17), HasSubstr(">1234<"));
  EXPECT_THAT(html_value(-3.22e-11, 1.45e-12), HasSubstr(">-3.22e-11<"));
  EXPECT_THAT(html_value(5, 0), HasSubstr(">5<"));
}

TEST(Gnuplot, DrawsEveryPlotWithIdentifiersOfItsOwn) {
  const Plot plot{300, 200, gnuplot_data("d", {{0, 1}, {1, NAN}, {2, 3}}) + "plot $d with points title 'a'\n"};
  const auto drawn = draw_plots({plot, plot});
  ASSERT_TRUE(drawn) << drawn.error().message;
  ASSERT_EQ(drawn->size(), 2U);
  EXPECT_THAT((*drawn)[0], testing::StartsWith("<svg"));
  EXPECT_THAT((*drawn)[0], testing::EndsWith("</svg>"));
  EXPECT_THAT((*drawn)[0], HasSubstr("'plot1-gpPt"));
  EXPECT_THAT((*drawn)[1], Not(HasSubstr("plot1-")));
  EXPECT_EQ(draw_plots({plot, plot}).value(), *drawn);
}

TEST(Gnuplot, TextCannotLeaveItsQuotes) {
  const std::string text = "it's `echo run` \"\\n\" $(x)\nset output";
  const auto drawn = draw_plots({{300, 200, "set label " + gnuplot_text(text) + " at 0,0\nplot x\n"}});
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_THAT(drawn->front(), HasSubstr("it's `echo run` "));
}

TEST(Gnuplot, SaysWhatItDidNotUnderstand) {
  const auto drawn = draw_plots({{300, 200, "plott x\n"}});
  ASSERT_FALSE(drawn);
  EXPECT_THAT(drawn.error().message, HasSubstr("invalid command"));
}

TEST(Gnuplot, WhereItIsNotInstalledThatIsSaid) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const auto drawn = draw_plots({{300, 200, "plot x\n"}});
  setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(drawn);
  EXPECT_THAT(drawn.error().message, HasSubstr("gnuplot-nox"));
}

}  // namespace
}  // namespace crumple
