#include "real_trial.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/imports/csv_table.hpp"
#include "bodyschema/imports/stills.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

/// A copy of a folder of stills, pictures by reference, without anything that would give the answer away.
void copy_hiding(const fs::path& from, const fs::path& to, const Hidden& hidden, bool masks) {
  fs::create_directories(to);
  const std::vector<const char*> folders =
      masks ? std::vector{"images", "camera_info", "masks"} : std::vector{"images", "camera_info"};
  for (const char* folder : folders) {
    if (fs::exists(from / folder)) fs::create_directory_symlink(fs::absolute(from / folder), to / folder);
  }
  const JointTable table = JointTable::read(from);
  std::string text = fmt::format("{}\n", fmt::join(table.columns, ","));
  for (const auto& row : table.rows) {
    const auto number = static_cast<std::int64_t>(row.front());
    if (!hidden.postures.empty() &&
        std::find(hidden.postures.begin(), hidden.postures.end(), number) == hidden.postures.end()) {
      continue;
    }
    for (std::size_t i = 0; i < row.size(); ++i) {
      const auto offset = hidden.offsets_deg.find(table.columns[i]);
      const double value = row[i] + (offset == hidden.offsets_deg.end() ? 0.0 : radians(offset->second));
      text += fmt::format("{}{:.17g}", i > 0 ? "," : "", value);
    }
    text += '\n';
  }
  write_file(to / "joints.csv", text);
}

}  // namespace

JointTable JointTable::read(const fs::path& set) {
  return read_file(set / "joints.csv");
}

JointTable JointTable::read_file(const fs::path& file) {
  const CsvTable csv = CsvTable::read(file);
  if (csv.bad.count > 0) throw FileError(csv.bad.first);
  JointTable table{csv.names, {}};
  for (const auto& row : csv.rows) {
    if (!row.words.empty()) throw csv.not_a_number(row, row.words.begin()->first);
    if (std::any_of(row.values.begin(), row.values.end(), [](double v) { return std::isnan(v); })) {
      throw FileError(csv.where(row) + ": a field is empty");
    }
    table.rows.push_back(row.values);
  }
  return table;
}

std::map<std::string, double> JointTable::row(std::size_t index) const {
  std::map<std::string, double> values;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] != "posture" && columns[i] != "time_s") values[columns[i]] = rows[index][i];
  }
  return values;
}

std::map<std::string, double> draw_offsets(const fs::path& set, std::uint64_t seed, double sd_deg) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, sd_deg);
  std::map<std::string, double> offsets;
  for (const auto& name : StillsColumns::read(set).names) offsets[name] = normal(random);
  return offsets;
}

RealTrial run_real_trial(const RealTrialOptions& options, const fs::path& folder) {
  RealTrial trial;
  trial.hidden = options.hidden;
  copy_hiding(options.set, folder / "stills", options.hidden, options.masks);
  StarterOptions starter;
  starter.urdf = options.urdf;
  starter.stills = folder / "stills";
  starter.out = folder / "robot";
  write_starter_configuration(starter);
  const auto configuration = Configuration::load(folder / "robot" / "estimator.yaml", options.overrides);
  import_stills(folder / "stills", ImportTarget::from(configuration), {}, folder / "log");
  CalibrationOptions calibration;
  calibration.log = folder / "log";
  calibration.out = folder / "calibration";
  calibration.quiet = true;
  trial.calibration =
      calibrate(Configuration::load(folder / "robot" / "estimator.yaml", options.overrides), calibration);
  return trial;
}

}  // namespace bodyschema
