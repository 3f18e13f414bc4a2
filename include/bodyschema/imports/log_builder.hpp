#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/imports/joint_mapping.hpp"

namespace bodyschema {

/// What of one kind was left out of a log, and why the first was.
struct LeftOut {
  std::uint64_t count = 0;
  std::string first;
  void add(const std::string& why) {
    if (count++ == 0) first = why;
  }
  void add(const Error& error) { add(std::string(error.what())); }
  /// Throws FileError, the first one's, where more than kMostBadLines of all are bad.
  void check(std::uint64_t all, const char* what) const;
};

/// Of the lines of one folder, or of its pictures, at most this share may be bad and left out.
inline constexpr double kMostBadLines = 0.05;

/// The robot that a recording is imported for, as its configuration has it.
struct ImportTarget {
  std::shared_ptr<const RobotModel> robot;  ///< without meshes
  RobotSetup setup;
  StereoRig rig;
  BusOptions bus;
  JointMapping mapping;
  bool slides(const std::string& joint) const;

  /// Reads `robot`, `cameras`, `bus` and `import`; refuses keys that are unknown there. Throws Error.
  /// @param mapping  a file whose `import` section counts instead; empty: none
  static ImportTarget from(const Configuration& configuration, const std::filesystem::path& mapping = {});
};

struct ImportSummary {
  struct Camera {
    std::string name;
    std::uint64_t pictures = 0;
    std::uint64_t masks = 0;
  };
  std::uint64_t joint_messages = 0;
  std::vector<Camera> cameras;              ///< as in the rig
  std::vector<std::string> joints;          ///< of the URDF, that have readings
  std::vector<std::string> names_ignored;   ///< of the source: no joints of the robot, or left out as asked
  double duration_s = 0.0;                  ///< by stamps
  std::map<std::string, LeftOut> left_out;  ///< by what it is: "pictures of camera left", "rows"
  std::vector<std::string> notes;           ///< to look at before the log is used, one sentence each

  /// For people: what is in the log, what is not, what to look at. Lines end in a newline.
  [[nodiscard]] std::string text(const std::filesystem::path& log) const;
};

/// Writes what any source holds as an LCM log: names become joints, pictures are checked against the configured
/// cameras. What cannot be used is left out and counted; what makes the log useless is an error. The log appears under
/// its name only when it is complete. One thread.
class LogBuilder {
 public:
  /// Throws as LogWriter.
  LogBuilder(const ImportTarget& target, const std::filesystem::path& log);

  /// What a value is that is no number.
  enum class Nan { kLeftOut, kNoReading };
  /// @param arrival  where the message stands in the log; messages are to come in that order
  /// @param values   in the source's units, one for each name
  /// @param velocities  the same, or empty: none are known
  /// @param nan  left out and counted; or that joint was not read this time, as an empty field of a table says
  void add_joints(Microseconds arrival, Microseconds utime, std::span<const std::string> names,
                  std::span<const double> values, std::span<const double> velocities = {}, Nan nan = Nan::kLeftOut);
  /// @param camera  position in the rig
  /// @param where   for what is said of a picture that cannot be used
  void add_picture(Microseconds arrival, std::size_t camera, Microseconds utime, const Image& picture,
                   const std::string& where);
  /// A JPEG file, which is kept as it is.
  void add_jpeg(Microseconds arrival, std::size_t camera, Microseconds utime, Bytes file, const std::string& where);
  /// 0 background, 255 robot, 128 not known; see to_mask().
  void add_mask(Microseconds arrival, std::size_t camera, Microseconds utime, Image mask, const std::string& where);

  /// Something that is not in the log.
  void leave_out(const std::string& what, const std::string& why) { summary_.left_out[what].add(why); }
  void note(std::string sentence) { summary_.notes.push_back(std::move(sentence)); }

  /// Throws FileError naming a joint without readings that the robot needs, and where nothing at all, or no picture of
  /// any camera, has been added, or masks were there and not one of them could be used.
  ImportSummary finish();

 private:
  struct Column {
    Eigen::Index joint = -1;  ///< of the robot; -1: left out
    double scale = 1.0;
    double offset = 0.0;
  };
  /// What the names of one message mean.
  struct Columns {
    std::vector<std::string> names;
    std::vector<Column> columns;
    bot_core::joint_state_t message{};
  };
  Columns& columns_of(std::span<const std::string> names);
  Column column_of(const std::string& name);
  void write(const std::string& channel, Microseconds arrival, Microseconds utime, std::size_t camera,
             bot_core::image_t picture);
  [[nodiscard]] bool stamp_is_good(Microseconds utime, const std::string& what, const std::string& where);
  void note_stamp(Microseconds utime);
  void check_joints() const;
  void doubt_unit();

  const ImportTarget& target_;
  Channels channels_;
  std::filesystem::path log_;
  UnfinishedFile unfinished_;
  std::unique_ptr<LogWriter> writer_;
  std::vector<Columns> columns_;
  std::vector<std::uint64_t> readings_;  ///< by joint
  std::vector<double> largest_;          ///< of each joint, absolute, in the source's own unit
  std::vector<int> channels_of_;         ///< of each camera's pictures, once known
  std::vector<std::uint64_t> inverted_;  ///< of each camera's masks: how many look as if they were
  std::set<std::string> ignored_;
  Microseconds first_ = -1, last_ = -1;
  ImportSummary summary_;
};

}  // namespace bodyschema
