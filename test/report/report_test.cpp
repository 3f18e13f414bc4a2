#include "bodyschema/report/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Report, EscapesEveryText) {
  Report report("<b>title</b>");
  report.heading("a < b");
  report.paragraph("<script>alert(1)</script>");
  report.table({"x & y"}, {{"<i>"}});
  const std::string html = report.html();
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, HasSubstr("a &lt; b"));
  EXPECT_THAT(html, HasSubstr("x &amp; y"));
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;title"));
}

/// Names of robots, files and joints are somebody else's.
TEST(Report, AChartsTitleMayBeNoUtf8) {
  Report report("charts");
  Chart chart;
  chart.title = "m\xfcnchen";
  chart.series = {{"a", {0.0, 1.0}, {1.0, 2.0}}};
  EXPECT_NO_THROW(report.chart(chart));
}

TEST(Report, FiguresKnownLastStandFirst) {
  Report report("figures");
  report.heading("charts");
  report.figures_first("best < paper", "of 3 trials");
  const std::string html = report.html();
  EXPECT_LT(html.find("best &lt; paper"), html.find("of 3 trials"));
  EXPECT_LT(html.find("of 3 trials"), html.find("charts"));
}

TEST(Report, AChartHoldsItsNumbersAndNothingEndsItsScript) {
  Report report("charts");
  Chart chart;
  chart.title = "</script><script>alert(1)</script>";
  chart.series = {{"error", {0, 1, 2}, {1.5, std::numeric_limits<double>::quiet_NaN(), 2.5}, {}, {}}};
  report.chart(chart);
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr("2.5"));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert(1)")));
}

TEST(Report, BarsLieWithTheirThresholdAndBandsHaveNoNameInTheLegend) {
  Report report("bars");
  Chart bars;
  bars.kind = Chart::Kind::kBar;
  bars.horizontal = true;
  bars.labels = {"backlash", "latency"};
  bars.series = {{"z", {}, {1.0, 9.0}, {}, {}}};
  bars.threshold = 4.5;
  bars.threshold_name = "threshold";
  report.chart(bars);
  Chart line;
  line.series = {{"median", {0, 1}, {2, 3}, {1, 2}, {3, 4}}};
  report.chart(line);
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr(R"("indexAxis":"y")"));
  EXPECT_THAT(html, HasSubstr(R"({"x":4.5,"y":"latency"})"));
  EXPECT_THAT(html, HasSubstr(R"("fill":"-1")"));
  EXPECT_THAT(html, HasSubstr(R"("data":[{"x":0.0,"y":3.0},{"x":1.0,"y":4.0}])"));
}

TEST(Report, OpenPartsAreClosed) {
  Report report("parts");
  report.begin_grid();
  report.begin_details("<more>");
  report.list({"a & b"});
  report.end();
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr("<summary>&lt;more&gt;</summary>"));
  EXPECT_LT(html.find("a &amp; b"), html.find("</details>"));
  EXPECT_LT(html.find("</details>"), html.rfind("</div>"));
}

TEST(Report, PicturesStandInsideThePage) {
  Report report("pictures");
  report.picture(Image(8, 6, 3), "black");
  EXPECT_THAT(report.html(), HasSubstr("data:image/jpeg;base64,/9j/"));
  EXPECT_THROW(report.picture(Image(), "none"), DataError);
}

TEST(Report, UnwritableFileIsAnError) {
  EXPECT_THROW(Report("x").write("/proc/none/report.html"), FileError);
}

}  // namespace
}  // namespace bodyschema
