#pragma once

#include <string_view>

namespace bodyschema::report_assets {

/// Chart.js as installed on the build machine (Debian: libjs-chart.js); empty when it was not.
extern const std::string_view kChartJs;

}  // namespace bodyschema::report_assets
