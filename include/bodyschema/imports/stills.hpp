#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/core/picture_size.hpp"
#include "bodyschema/imports/log_builder.hpp"

namespace bodyschema {

/// A folder of pictures with joint angles:
///
///     FOLDER/images/CAMERA/NN.png    one picture a posture and camera; NN: the posture's number. PNG, JPEG, PPM, PGM
///     FOLDER/masks/CAMERA/NN.png     optional: 0 background, 255 robot, 128 not known
///     FOLDER/joints.csv              a line of names, then a row a posture: column `posture` (or `frame`; without it
///                                    rows count from 0), optional `time_s`, and one column for each joint, rad
///     FOLDER/camera_info/CAMERA.yaml optional: ROS CameraInfo
///
/// Further folders (depth) are not read.
struct StillsFolder {
  std::filesystem::path folder;
  /// By the folder's name under images/, then by posture.
  std::map<std::string, std::map<std::int64_t, std::filesystem::path>> images, masks;
  std::map<std::string, std::filesystem::path> camera_infos;
  std::vector<std::string> not_read;    ///< other folders that hold something
  std::vector<std::string> unnumbered;  ///< pictures without a number, or with that of another
  std::map<std::string, std::vector<std::string>> unnumbered_masks;  ///< the same of masks, by folder

  /// Lists the folder. Throws FileError when it is none or has no picture under images/.
  static StillsFolder list(const std::filesystem::path& folder);
  /// Those under masks/ that hold pictures, numbered or not.
  [[nodiscard]] std::vector<std::string> mask_folders() const;
  /// Of the folder `masks` under masks/ those that belong to no picture of the folder `images` under images/, each with
  /// the name that was expected.
  [[nodiscard]] std::vector<std::string> masks_without_picture(const std::string& masks,
                                                               const std::string& images) const;
};

/// The columns of a folder's joints.csv that are neither `posture`, `frame` nor `time_s`.
struct StillsColumns {
  std::vector<std::string> names;
  std::vector<double> largest;  ///< absolute value in each, in the file's unit
  std::vector<LeftOut> words;   ///< of each: fields that hold no number
  std::uint64_t rows = 0;
  bool moving = false;  ///< rows have times: a recording of a moving arm, not of postures held still
  /// Throws FileError for a file that is not there or cannot be read (LeftOut::check).
  static StillsColumns read(const std::filesystem::path& folder);
};

/// The size that a picture's header states. Throws FileError for a file that is none.
[[nodiscard]] PictureSize picture_size_in(const std::filesystem::path& file);

/// Postures of a log of stills are this far apart and are held from kStillHold before to kStillHold after their
/// picture; nothing is recorded in between. Whoever reads a log can tell by that that nothing moved.
inline constexpr Microseconds kStillPeriod = 10'000'000;
inline constexpr Microseconds kStillHold = 250'000;

struct StillsImportOptions {
  bool masks = true;             ///< those that are there
  Microseconds recorded_at = 0;  ///< when the first posture was taken, where `joints.csv` has no time_s
};

/// Turns a folder of stills into an LCM log. Each posture is one instant, its encoders held still around it, unless
/// joints.csv has time_s: then it is a moving recording with these stamps, in which rows without a posture's number are
/// readings between pictures.
///
/// Throws FileError naming file and line of what cannot be used where it is more than a few (kMostBadLines), and as
/// LogBuilder.
ImportSummary import_stills(const std::filesystem::path& folder, const ImportTarget& target,
                            const StillsImportOptions& options, const std::filesystem::path& log,
                            const std::function<void(std::uint64_t done, std::uint64_t total)>& progress = {});

}  // namespace bodyschema
