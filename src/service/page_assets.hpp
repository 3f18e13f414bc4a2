#pragma once

#include <string_view>

/// Files of the live page, built into the program (cmake/PageAssets.cmake).
namespace bodyschema::page_assets {

extern const std::string_view kHtml;
extern const std::string_view kCss;
extern const std::string_view kScript;
extern const std::string_view kCharts;  ///< Chart.js, of the build machine's libjs-chart.js

}  // namespace bodyschema::page_assets
