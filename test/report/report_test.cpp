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

TEST(Report, AChartHoldsItsNumbersAndNothingEndsItsScript) {
  Report report("charts");
  Chart chart;
  chart.title = "</script><script>alert(1)</script>";
  chart.series = {{"error", {0, 1, 2}, {1.5, std::numeric_limits<double>::quiet_NaN(), 2.5}}};
  report.chart(chart);
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr("2.5"));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert(1)")));
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
