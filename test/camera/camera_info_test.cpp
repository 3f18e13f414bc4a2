#include "bodyschema/camera/camera_info.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// As `ros2 topic echo` prints it, dashes and all.
constexpr const char* kEcho = R"(header:
  stamp: {sec: 1, nanosec: 2}
  frame_id: eye
height: 480
width: 640
distortion_model: plumb_bob
d: [0.1, -0.2, 0.001, 0.002, 0.05]
k: [600.0, 0.0, 321.0, 0.0, 601.0, 241.0, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [590.0, 0.0, 322.0, -70.8, 0.0, 591.0, 242.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
roi: {x_offset: 0, do_rectify: false}
---
)";

CameraInfo read(const std::string& text) {
  const TemporaryFolder folder;
  return CameraInfo::read(folder.write("camera.yaml", text));
}

std::string error_of(const std::string& text) {
  try {
    (void)read(text);
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was wrong";
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, from.size(), to);
}

TEST(CameraInfo, AsTheMessageIsPrinted) {
  const CameraInfo info = read(kEcho);
  EXPECT_EQ(info.intrinsics, (PinholeIntrinsics{640, 480, 600, 601, 321, 241}));
  EXPECT_THAT(info.distortion, ElementsAre(0.1, -0.2, 0.001, 0.002, 0.05));
  EXPECT_EQ(info.rectified, (PinholeIntrinsics{640, 480, 590, 591, 322, 242}));
  EXPECT_DOUBLE_EQ(info.baseline_m, 0.12);
  EXPECT_FALSE(info.is_rectified());
}

TEST(CameraInfo, OfRos1) {
  std::string text = kEcho;
  for (const auto& [small, capital] :
       {std::pair{"\nd:", "\nD:"}, {"\nk:", "\nK:"}, {"\nr:", "\nR:"}, {"\np:", "\nP:"}}) {
    text = with(text, small, capital);
  }
  EXPECT_EQ(read(text).intrinsics, (PinholeIntrinsics{640, 480, 600, 601, 321, 241}));
}

TEST(CameraInfo, AsCalibrationWritesIt) {
  const CameraInfo info = read(R"(image_width: 640
image_height: 480
camera_name: eye
camera_matrix: {rows: 3, cols: 3, data: [600, 0, 321, 0, 601, 241, 0, 0, 1]}
distortion_model: rational_polynomial
distortion_coefficients: {rows: 1, cols: 8, data: [0.1, 0, 0, 0, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [600, 0, 321, 0, 0, 601, 241, 0, 0, 0, 1, 0]}
)");
  EXPECT_EQ(info.intrinsics, info.rectified);
  EXPECT_EQ(info.distortion[0], 0.1);
}

TEST(CameraInfo, OfRectifiedPictures) {
  const CameraInfo info =
      read("width: 64\nheight: 48\nk: [60, 0, 32, 0, 60, 24, 0, 0, 1]\nd: [0, 0, 0, 0, 0, 0, 0, 0]\n");
  EXPECT_TRUE(info.is_rectified());
  EXPECT_EQ(info.intrinsics, info.rectified);
}

/// The pair's frames by hand: rectified axes are parallel, the right one `baseline` to the right.
TEST(CameraInfo, OfAPairTellsWhereTheSecondCameraIs) {
  CameraInfo left, right;
  right.baseline_m = 0.12;
  EXPECT_TRUE(stereo_pose(left, right, true).translation().isApprox(Eigen::Vector3d(0.12, 0, 0)));
  left.R = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  right.R = Eigen::AngleAxisd(-0.05, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Pose X_LR = stereo_pose(left, right, false);
  const Eigen::Vector3d p_R(0.3, -0.2, 1.5);
  const Eigen::Vector3d p_L = X_LR * p_R;
  EXPECT_TRUE((left.R * p_L).isApprox(right.R * p_R + Eigen::Vector3d(0.12, 0, 0), 1e-12));
  EXPECT_TRUE(stereo_pose(left, right, true).linear().isIdentity());
}

TEST(CameraInfo, BadInputIsNamed) {
  EXPECT_THAT(error_of(with(kEcho, "k: [600.0", "k: [0.0")), HasSubstr("of a calibrated camera"));
  EXPECT_THAT(error_of(with(kEcho, "k: [600.0, 0.0", "k: [600.0, 5.0")), HasSubstr("without skew"));
  EXPECT_THAT(error_of(with(kEcho, "k: [600.0, ", "k: [")), HasSubstr("nine numbers"));
  EXPECT_THAT(error_of(with(kEcho, "k: [600.0", "k: [.nan")), HasSubstr("a list of numbers"));
  EXPECT_THAT(error_of(with(kEcho, "p: [590.0, ", "p: [")), HasSubstr("twelve numbers"));
  EXPECT_THAT(error_of(with(kEcho, "-70.8", "-70800")), HasSubstr("below 10 m"));
  EXPECT_THAT(error_of(with(kEcho, "r: [1.0", "r: [3.0")), HasSubstr("a rotation"));
  EXPECT_THAT(error_of(with(kEcho, "width: 640", "width: 0")), HasSubstr("key 'width' is '0'"));
  EXPECT_THAT(error_of(with(kEcho, "plumb_bob", "equidistant")), HasSubstr("rectify the pictures first"));
  EXPECT_THAT(error_of(with(kEcho, "0.05]", "0.05, 0.1, 0, 0]")), HasSubstr("rectify the pictures first"));
  EXPECT_THAT(error_of("width: 640\nheight: 480\n"), HasSubstr("key 'k' is missing"));
  EXPECT_THAT(error_of("k: ["), HasSubstr("not valid YAML"));
}

}  // namespace
}  // namespace bodyschema
