#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// The `yarp_import` section: which columns of a YARP dataplayer recording are which joints.
/// config/icub_unity/import.yaml explains every key.
struct YarpImportOptions {
  /// One encoder port's folder and the name of each of its columns; "-" is a column not used.
  struct Encoders {
    std::string folder;
    std::vector<std::string> columns;
    /// Rows may end before this column, all of them, as of an arm without fingers; joints made of what is
    /// missing are then not in the log. Equal to the number of columns: they may not.
    std::size_t fewest = columns.size();
  };
  /// A joint that is a sum of columns of one folder, each times a factor.
  struct CombinedJoint {
    std::string joint;
    std::map<std::string, double> factor_of_column;
  };
  std::vector<Encoders> encoders;
  /// Columns that occur here are no joints by themselves, all others are.
  std::vector<CombinedJoint> combined_joints;
  std::string left_images;  ///< folder; empty: no such camera
  std::string right_images;
  bool encoders_in_degrees = true;

  /// Throws ConfigurationError.
  static YarpImportOptions from(const Configuration& yarp_import);
};

struct YarpImportSummary {
  std::uint64_t encoder_rows = 0;
  std::uint64_t left_pictures = 0;
  std::uint64_t right_pictures = 0;
  std::uint64_t rows_out_of_order = 0;  ///< left out, because their stamp is not after the one before
  std::uint64_t bad_lines = 0;          ///< left out: cut, not numbers, another number of columns ...
  std::uint64_t bad_pictures = 0;       ///< left out: missing, broken, of another size
  std::string first_bad;                ///< what is wrong with the first of either
  std::vector<std::string> warnings;    ///< what to look at before the log is used, one sentence each
  double duration_s = 0.0;
};

/// Turns a YARP recording (folders with data.log, info.log and PPM, PGM, PNG or JPEG pictures, as
/// yarpdatadumper writes them) into an LCM log: one joint state per encoder row, one message per picture,
/// each with its own stamp, in order of time. Of two stamps in a line the sender's counts, unless it is 0.
/// Velocities are differences to the neighbouring rows, the smaller of the two.
///
/// The log appears under its name only when it is complete.
///
/// @param progress  called with messages written and in all; may be empty
/// Throws FileError for a folder that is missing, and naming file and line of the first that is no number,
/// has another number of columns or another picture size than before, where these are more than kMostBadLines.
YarpImportSummary import_yarp(const std::filesystem::path& recording, const YarpImportOptions& options,
                              const Channels& channels, const std::filesystem::path& log,
                              const std::function<void(std::uint64_t done, std::uint64_t total)>& progress = {});

}  // namespace bodyschema
