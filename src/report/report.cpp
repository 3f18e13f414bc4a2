#include "bodyschema/report/report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bodyschema/core/base64.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "chart_js.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

const char* const kColours[] = {"#1f6fb4", "#d1495b", "#3a9d5d", "#c98a1b", "#7a4fb0", "#3aa6a6", "#8a6d5a", "#5c677d"};

const char* const kStyle = R"css(
:root { color-scheme: light dark; --line: #8884; --ink: #1b1f24; --paper: #fff; --soft: #5a6572; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8eb; --paper: #15181c; --soft: #9aa4af; } }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
       max-width: 62rem; margin: 0 auto; padding: 1.2rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
.verdict { font-size: 1.15rem; border-left: 4px solid #1f6fb4; padding: .4rem 0 .4rem 1rem; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; margin: .8rem 0; }
th, td { padding: .3rem .7rem; border-bottom: 1px solid var(--line); text-align: left; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
pre { overflow-x: auto; font-size: .85rem; } figure { margin: 1.2rem 0; }
figure img { max-width: 100%; image-rendering: auto; } figcaption { color: var(--soft); font-size: .9rem; }
.chart { position: relative; height: 22rem; margin: 1.2rem 0; min-width: 0; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(26rem, 100%), 1fr)); gap: 0 1.5rem; }
.grid .chart { height: 18rem; } summary { cursor: pointer; color: #1f6fb4; margin: .8rem 0; }
li { margin: .3rem 0; } @media (max-width: 40rem) { th, td { padding: .3rem .4rem; font-size: .9rem; } }
)css";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

/// JSON that may stand inside a <script>: without '<' nothing in it can end or begin an element.
std::string script_json(const Json& json) {
  std::string out;
  for (const char c : json.dump(-1, ' ', true, Json::error_handler_t::replace)) {
    if (c == '<') {
      out += "\\u003c";
    } else {
      out += c;
    }
  }
  return out;
}

bool looks_like_a_number(const std::string& cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789+-.eE %") == std::string::npos &&
         cell.find_first_of("0123456789") != std::string::npos;
}

Json points(const std::vector<double>& x, const std::vector<double>& y) {
  Json data = Json::array();
  for (std::size_t i = 0; i < y.size() && i < x.size(); ++i) {
    if (std::isfinite(x[i]) && std::isfinite(y[i])) data.push_back({{"x", x[i]}, {"y", y[i]}});
  }
  return data;
}

/// Two nameless lines with the space between them filled; the legend leaves out what has no name.
void add_band(Json& datasets, const ChartSeries& series, const char* colour) {
  for (const bool upper : {false, true}) {
    datasets.push_back({{"label", ""},
                        {"data", points(series.x, upper ? series.high : series.low)},
                        {"borderWidth", 0},
                        {"pointRadius", 0},
                        {"fill", upper ? Json("-1") : Json(false)},
                        {"backgroundColor", std::string(colour) + "30"}});
  }
}

const char* colour_of(const ChartSeries& series, std::size_t position) {
  return kColours[(series.colour >= 0 ? static_cast<std::size_t>(series.colour) : position) % std::size(kColours)];
}

Json dataset(const ChartSeries& series, Chart::Kind kind, const char* colour) {
  Json data = Json::array();
  if (kind == Chart::Kind::kBar) {
    for (const double y : series.y) data.push_back(std::isfinite(y) ? Json(y) : Json(nullptr));
  } else {
    data = points(series.x, series.y);
  }
  return {{"label", series.name},
          {"data", data},
          {"borderColor", colour},
          {"backgroundColor", kind == Chart::Kind::kLine ? "transparent" : colour},
          {"borderWidth", kind == Chart::Kind::kScatter ? 0 : 2},
          {"pointRadius", kind == Chart::Kind::kScatter ? 2 : 0},
          {"tension", 0}};
}

}  // namespace

Report::Report(std::string title) : title_(std::move(title)) {}

void Report::heading(const std::string& text) {
  body_ += "<h2>" + escaped(text) + "</h2>\n";
}
void Report::paragraph(const std::string& text) {
  body_ += "<p>" + escaped(text) + "</p>\n";
}
void Report::verdict(const std::string& text) {
  body_ += "<p class=\"verdict\">" + escaped(text) + "</p>\n";
}

void Report::figures_first(const std::string& text, const std::string& note) {
  first_ = "<pre>" + escaped(text) + "</pre>\n<p>" + escaped(note) + "</p>\n";
}

void Report::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const auto& item : items) body_ += "<li>" + escaped(item) + "</li>\n";
  body_ += "</ul>\n";
}

void Report::begin_grid() {
  body_ += "<div class=\"grid\">\n";
  open_.push_back("</div>\n");
}

void Report::begin_details(const std::string& summary) {
  body_ += "<details><summary>" + escaped(summary) + "</summary>\n";
  open_.push_back("</details>\n");
}

void Report::end() {
  if (open_.empty()) return;
  body_ += open_.back();
  open_.pop_back();
}

void Report::table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows) {
  body_ += "<div class=\"scroll\"><table><thead><tr>";
  for (const auto& cell : head) body_ += "<th>" + escaped(cell) + "</th>";
  body_ += "</tr></thead><tbody>\n";
  for (const auto& row : rows) {
    body_ += "<tr>";
    for (const auto& cell : row) {
      body_ += (looks_like_a_number(cell) ? "<td class=\"number\">" : "<td>") + escaped(cell) + "</td>";
    }
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void Report::chart(const Chart& chart) {
  if (report_assets::kChartJs.empty()) {
    heading(chart.title);
    std::vector<std::vector<std::string>> rows;
    for (const auto& series : chart.series) {
      for (std::size_t i = 0; i < series.y.size(); ++i) {
        const bool named = chart.kind == Chart::Kind::kBar && i < chart.labels.size();
        rows.push_back({series.name,
                        named                 ? chart.labels[i]
                        : i < series.x.size() ? std::to_string(series.x[i])
                                              : "",
                        std::to_string(series.y[i])});
      }
    }
    table({"", chart.x_label, chart.y_label}, rows);
    return;
  }
  Json datasets = Json::array();
  const bool bars = chart.kind == Chart::Kind::kBar;
  std::size_t names = 0;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const auto& series = chart.series[i];
    names += !series.name.empty();
    if (chart.kind == Chart::Kind::kLine && !series.low.empty()) {
      add_band(datasets, series, colour_of(series, i));
    }
    datasets.push_back(dataset(series, chart.kind, colour_of(series, i)));
  }
  const bool lying = bars && chart.horizontal;
  if (bars && chart.threshold && !chart.labels.empty()) {
    Json line = Json::array();
    for (const auto& label : chart.labels) {
      line.push_back(lying ? Json{{"x", *chart.threshold}, {"y", label}} : Json{{"x", label}, {"y", *chart.threshold}});
    }
    names += 1;
    datasets.push_back({{"type", "line"},
                        {"label", chart.threshold_name},
                        {"data", line},
                        {"borderColor", "#8a8f98"},
                        {"borderDash", {6, 4}},
                        {"borderWidth", 2},
                        {"pointRadius", 0},
                        {"backgroundColor", "transparent"}});
  }
  Json data = {{"datasets", datasets}};
  if (bars) data["labels"] = chart.labels;
  const auto axis = [](const std::string& label, const char* type) {
    Json json = {{"title", {{"display", !label.empty()}, {"text", label}}}};
    if (type != nullptr) json["type"] = type;
    return json;
  };
  Json names_axis = axis(chart.x_label, bars ? nullptr : "linear");
  if (lying) names_axis["ticks"] = {{"autoSkip", false}};
  const Json values_axis = axis(chart.y_label, chart.logarithmic_y ? "logarithmic" : nullptr);
  const Json config = {
      {"type", bars                                  ? "bar"
               : chart.kind == Chart::Kind::kScatter ? "scatter"
                                                     : "line"},
      {"data", data},
      {"options",
       {{"animation", false},
        {"maintainAspectRatio", false},
        {"plugins", {{"title", {{"display", true}, {"text", chart.title}}}, {"legend", {{"display", names > 1}}}}},
        {"indexAxis", lying ? "y" : "x"},
        {"scales", {{lying ? "y" : "x", names_axis}, {lying ? "x" : "y", values_axis}}}}}};
  const std::string id = "chart" + std::to_string(charts_++);
  std::string height;
  if (lying) {
    const auto rows = chart.labels.size() * std::max<std::size_t>(1, chart.series.size());
    height = " style=\"height:" + std::to_string(7 + rows * 9 / 10) + "rem\"";
  }
  body_ += "<div class=\"chart\"" + height + "><canvas id=\"" + id + "\" role=\"img\" aria-label=\"" +
           escaped(chart.title) + "\"></canvas></div>\n";
  script_ += "new Chart(document.getElementById('" + id + "')," + script_json(config) + ");\n";
}

void Report::picture(const Image& image, const std::string& caption) {
  if (image.empty()) throw DataError("a report's picture is empty: " + caption);
  const cv::Mat view(image.height, image.width, image.channels == 3 ? CV_8UC3 : CV_8UC1,
                     const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat bgr = view.clone();
  if (image.channels == 3) {
    constexpr int kSwapped[] = {0, 2, 1, 1, 2, 0};
    cv::mixChannels(&view, 1, &bgr, 1, kSwapped, 3);
  }
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
  body_ += "<figure><img alt=\"" + escaped(caption) + "\" src=\"data:image/jpeg;base64," + base64(jpeg) +
           "\"><figcaption>" + escaped(caption) + "</figcaption></figure>\n";
}

std::string Report::html() const {
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      escaped(title_) + "</title>\n<style>" + kStyle + "</style></head><body>\n<h1>" + escaped(title_) + "</h1>\n" +
      first_ + body_;
  for (auto tag = open_.rbegin(); tag != open_.rend(); ++tag) page += *tag;
  if (!script_.empty()) {
    page += "<script>";
    page += report_assets::kChartJs;
    page +=
        "</script>\n<script>\n"
        "Chart.defaults.plugins.legend.labels.filter = (item) => item.text !== '';\n"
        "if (matchMedia('(prefers-color-scheme: dark)').matches) {\n"
        "  Chart.defaults.color = '#b8c0c8'; Chart.defaults.borderColor = '#ffffff22';\n}\n" +
        script_ + "</script>\n";
  }
  return page + "</body></html>\n";
}

void Report::write(const std::filesystem::path& file) const {
  if (file.has_parent_path()) make_folder(file.parent_path());
  write_file(file, html());
}

}  // namespace bodyschema
