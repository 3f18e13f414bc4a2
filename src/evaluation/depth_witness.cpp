#include "depth_witness.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/simulator/rasterizer.hpp"

namespace bodyschema {
namespace {

cv::Mat read(const std::filesystem::path& file, int flags, int type, const PinholeIntrinsics& k) {
  cv::Mat picture = cv::imread(file.string(), flags);
  if (picture.type() != type || picture.cols != k.width || picture.rows != k.height) {
    throw FileError(file.string() + ": expected one channel, " + std::to_string(k.width) + "x" +
                    std::to_string(k.height) + " px");
  }
  return picture;
}

}  // namespace

double median_depth_distance_mm(const Pipeline& robot, const PinholeIntrinsics& k, const Pose& X_root_optical,
                                const std::vector<DepthView>& views) {
  std::vector<simulator::PaintedPart> parts;
  for (const auto& mesh : robot.robot().meshes()) parts.push_back({.mesh = mesh.mesh});
  simulator::Rasterizer rasterizer(std::move(parts), k.width, k.height, 1);
  CameraModel camera;
  camera.intrinsics = k;
  ForwardKinematics kinematics(robot.shared_robot(), robot.setup().model.rendered_links);
  std::vector<Pose> X_WB(robot.setup().model.rendered_links.size());
  std::vector<Eigen::Isometry3f> X_CB(X_WB.size());
  std::vector<double> distances;
  for (const auto& view : views) {
    const cv::Mat depth = read(view.depth, cv::IMREAD_UNCHANGED, CV_16UC1, k);
    const cv::Mat mask = read(view.mask, cv::IMREAD_GRAYSCALE, CV_8UC1, k);
    kinematics.compute(view.q, X_WB);
    const Pose X_CW = X_root_optical.inverse(Eigen::Isometry);
    for (std::size_t b = 0; b < X_WB.size(); ++b) X_CB[b] = (X_CW * X_WB[b]).cast<float>();
    rasterizer.draw(X_CB, camera, {});
    const auto& inverse_depth = rasterizer.inverse_depth();
    for (int v = 0; v < k.height; ++v) {
      for (int u = 0; u < k.width; ++u) {
        const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width) + static_cast<std::size_t>(u);
        if (mask.at<std::uint8_t>(v, u) < 128 || depth.at<std::uint16_t>(v, u) == 0 || inverse_depth[i] <= 0.0f) {
          continue;
        }
        distances.push_back(std::abs(depth.at<std::uint16_t>(v, u) - 1e3 / static_cast<double>(inverse_depth[i])));
      }
    }
  }
  if (distances.empty()) throw DataError("no pixel that shows the model has a depth");
  return median(std::move(distances));
}

}  // namespace bodyschema
