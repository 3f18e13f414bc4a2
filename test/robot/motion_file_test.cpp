#include "bodyschema/robot/motion_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;

class MotionOnDisk : public testing::Test {
 protected:
  MotionOnDisk()
      : file_(std::filesystem::temp_directory_path() / ("bodyschema_motion_" + std::to_string(getpid()) + ".csv")) {}
  ~MotionOnDisk() override {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }
  void put(const std::string& text) { std::ofstream(file_) << text; }
  static bool slides(const std::string& joint) { return joint == "rail"; }
  [[nodiscard]] MotionFile read() const { return MotionFile::read(file_, slides); }
  std::filesystem::path file_;
};

TEST_F(MotionOnDisk, IsReadAsItWasWritten) {
  MotionFile motion;
  motion.joints = {"elbow", "rail"};
  motion.slides = {false, true};
  motion.remark = "two lines\nof remarks";
  motion.postures = {{0.0, Eigen::Vector2d(radians(30.0), 0.1)}, {2.5, Eigen::Vector2d(radians(-12.25), 0.2)}};
  motion.write(file_);
  const auto again = read();
  EXPECT_EQ(again.joints, motion.joints);
  ASSERT_EQ(again.postures.size(), 2u);
  EXPECT_NEAR(again.postures[1].time_s, 2.5, 1e-9);
  EXPECT_NEAR(again.postures[1].q[0], radians(-12.25), 1e-9);
  EXPECT_NEAR(again.postures[1].q[1], 0.2, 1e-9);
}

TEST_F(MotionOnDisk, SaysWhichLineIsWrong) {
  const auto error = [&](const std::string& text) {
    put(text);
    try {
      (void)read();
    } catch (const FileError& e) {
      return std::string(e.what());
    }
    return std::string("none");
  };
  EXPECT_THAT(error("seconds,elbow\n"), HasSubstr(":1: expected 'time_s' and names of joints"));
  EXPECT_THAT(error("time_s,elbow\n0,1\n1,2,3\n"), HasSubstr(":3: 3 values, expected 2"));
  EXPECT_THAT(error("time_s,elbow\n0,1\n1,x\n"), HasSubstr(":3: 'x', expected a number"));
  EXPECT_THAT(error("time_s,elbow\n1,1\n1,2\n"), HasSubstr("expected one after that of the line before"));
  EXPECT_THAT(error("time_s,elbow\n1,1\n"), HasSubstr("two postures or more"));
  std::filesystem::remove(file_);
  EXPECT_THROW((void)read(), FileError);
}

}  // namespace
}  // namespace bodyschema
