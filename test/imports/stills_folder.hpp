#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "temporary_folder.hpp"

namespace bodyschema {

/// A folder of stills of the seven-joint arm, 8x6 px: two postures, two cameras, everything sound.
class SmallStills {
 public:
  SmallStills() {
    folder_.write("joints.csv",
                  "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n"
                  "0,0.1,0.2,0.3,0.4,0.5,0.6,0.7\n"
                  "1,-0.1,-0.2,-0.3,-0.4,-0.5,-0.6,-0.7\n");
    for (const std::string camera : {"left", "right"}) {
      for (int i = 0; i < 2; ++i) {
        picture("images/" + camera + "/0" + std::to_string(i) + ".png", cv::Mat(6, 8, CV_8UC3, cv::Scalar(1, 2, 3)));
      }
    }
  }
  void picture(const std::string& name, const cv::Mat& bgr) const {
    std::filesystem::create_directories((path() / name).parent_path());
    cv::imwrite((path() / name).string(), bgr);
  }
  void mask(const std::string& name, std::uint8_t level, int width = 8, int height = 6) const {
    picture("masks/" + name, cv::Mat(height, width, CV_8UC1, cv::Scalar(level)));
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }

 private:
  TemporaryFolder folder_;
};

}  // namespace bodyschema
