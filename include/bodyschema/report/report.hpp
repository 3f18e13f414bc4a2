#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// One line, or one set of bars, of a chart.
struct ChartSeries {
  std::string name;
  std::vector<double> x{};  ///< ignored for bars
  std::vector<double> y{};
  /// Lines: a band about the line (an interval), as long as y; empty: none.
  std::vector<double> low{}, high{};
  /// Which of the report's colours (0 blue, 1 red, 2 green, 3 ochre, ...); -1: by position.
  int colour = -1;
};

/// A chart of a report. Values that are not finite are left out.
struct Chart {
  enum class Kind { kLine, kScatter, kBar };
  std::string title;
  std::string x_label;
  std::string y_label;
  Kind kind = Kind::kLine;
  std::vector<std::string> labels;  ///< names of the bars
  std::vector<ChartSeries> series;
  bool logarithmic_y = false;  ///< the axis of values: x for horizontal bars
  bool horizontal = false;     ///< bars lie, their names beside them; as high as they need
  /// Bars: a line across all of them at this value.
  std::optional<double> threshold{};
  std::string threshold_name{};
};

/// A page in one file: text, tables, charts (drawn by Chart.js, which is put into the page) and
/// pictures. It needs no network and no other file, reads well on a phone, and every text is
/// escaped. Where the build machine had no Chart.js, charts appear as tables of their values.
class Report {
 public:
  explicit Report(std::string title);
  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// A paragraph that stands out: the answer in one sentence.
  void verdict(const std::string& text);
  /// @param rows  as wide as `head`; cells that look like numbers are set right
  void table(const std::vector<std::string>& head, const std::vector<std::vector<std::string>>& rows);
  /// Figures that stand before everything else, whenever they are known, and a note on them.
  void figures_first(const std::string& text, const std::string& note);
  void list(const std::vector<std::string>& items);
  /// What follows until `end` stands side by side where the window is wide enough.
  void begin_grid();
  /// What follows until `end` is shown on a click on `summary`.
  void begin_details(const std::string& summary);
  void end();
  void chart(const Chart& chart);
  /// Throws DataError for an empty picture.
  void picture(const Image& image, const std::string& caption);
  /// Makes the folder too. Throws as write_file (core/write_file.hpp).
  void write(const std::filesystem::path& file) const;
  [[nodiscard]] std::string html() const;

 private:
  std::string title_;
  std::string first_;
  std::string body_;
  std::string script_;
  std::vector<const char*> open_;  ///< closing tags of open parts
  int charts_ = 0;
};

}  // namespace bodyschema
