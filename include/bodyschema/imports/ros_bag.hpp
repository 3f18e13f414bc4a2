#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/imports/log_builder.hpp"
#include "bodyschema/imports/record_stream.hpp"

namespace bodyschema {

/// What one topic of a bag is, as far as its first message shows.
struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/msg/Image"
  std::int64_t count = 0;
  std::vector<std::string> joints;  ///< of a JointState
  std::string picture;              ///< encoding of an Image, format of a CompressedImage
  int width = 0, height = 0;        ///< of an Image
  std::string camera_info;          ///< of a CameraInfo: JSON of width, height, distortion_model, k, d, r, p
  std::string broken;               ///< why its first message cannot be read

  [[nodiscard]] bool is(const char* short_type) const;  ///< "Image"
  /// For people, one line.
  [[nodiscard]] std::string text() const;
};

struct RosBagOptions {
  std::vector<std::string> joints;              ///< topics of JointState; empty: to be found
  std::map<std::string, std::string> pictures;  ///< topic by camera; one that is not there: import.cameras, or found
  std::map<std::string, std::string> masks;     ///< topic by camera; one that is not there: import.masks, or none
};

/// Which topics of a bag are imported.
struct BagSelection {
  std::vector<std::string> joints;
  std::vector<std::string> pictures;  ///< by camera of the rig; empty: none
  std::vector<std::string> masks;     ///< the same
  std::vector<std::string> infos;     ///< CameraInfo of each camera, the same
  std::vector<std::string> notes;     ///< what was found rather than asked for

  /// Takes what the options name and finds the rest by type: joints among topics that have joints of this robot,
  /// pictures among those that can be read, of several the one that bears the camera's name. Throws ConfigurationError
  /// that lists the topics where none or several fit, or one that is named is not there.
  static BagSelection choose(const std::vector<BagTopic>& topics, const ImportTarget& target,
                             const RosBagOptions& options);
};

/// A sensor_msgs/Image of one of the encodings mono8, rgb8, bgr8, rgba8, bgra8, 8UC1, 8UC3, 8UC4, yuv422, uyvy,
/// yuv422_yuy2, yuyv and bayer_{rggb,bggr,gbrg,grbg}8 as gray or RGB. Throws FileError beginning with `where` for
/// another encoding, a size that is none and data that are not that size's.
[[nodiscard]] Image decode_ros_image(const std::string& encoding, std::int64_t width, std::int64_t height,
                                     std::int64_t step, Bytes data, const std::string& where);
[[nodiscard]] bool reads_ros_image(const std::string& encoding);

/// The topics that import/read_ros_bag.py lists. Throws as RecordStream.
std::vector<BagTopic> read_bag_topics(ByteSource& records, const std::string& bag);
/// The same for a bag, with Python. @param say  hears of Python packages that are set up
std::vector<BagTopic> list_bag(const std::filesystem::path& bag, const std::function<void(const std::string&)>& say);

/// "zed_left.yaml" for the CameraInfo of topic /zed/left/camera_info.
[[nodiscard]] std::string camera_info_file_name(const std::string& topic);

/// Turns the records of import/read_ros_bag.py into an LCM log. Throws as RecordStream and LogBuilder.
ImportSummary import_bag_records(ByteSource& records, const std::string& bag, const BagSelection& selection,
                                 const ImportTarget& target, const std::filesystem::path& log,
                                 const std::function<void(std::uint64_t done)>& progress = {});

/// Turns a ROS bag (ROS 2 MCAP or SQLite, ROS 1) into an LCM log, message by message: each stands where the bag has it
/// and has the stamp of its header, or where that is 0 of its record. Transforms (tf) between a camera and the robot
/// are said, not believed. Throws FileError for a bag that cannot be read or was cut short, DeviceError where Python or
/// its packages cannot be had, and as BagSelection and LogBuilder.
ImportSummary import_ros_bag(const std::filesystem::path& bag, const ImportTarget& target, const RosBagOptions& options,
                             const std::filesystem::path& log, const std::function<void(const std::string&)>& say,
                             const std::function<void(std::uint64_t done, std::uint64_t total)>& progress = {});

}  // namespace bodyschema
