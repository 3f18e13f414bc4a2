#include "outline_figure.hpp"

#include <opencv2/imgcodecs.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/simulator/rasterizer.hpp"

namespace bodyschema {
namespace {

const cv::Vec3b kWhite(255, 255, 255), kBlack(0, 0, 0), kRed(40, 40, 220), kGreen(60, 160, 0);  // BGR

/// Pixels of a mask beside others, two wide: an outline that is seen at half size, too.
template <class Inside>
void draw_outline(cv::Mat& picture, const Inside& inside, const cv::Vec3b& colour) {
  for (int v = 1; v + 1 < picture.rows; ++v) {
    for (int u = 1; u + 1 < picture.cols; ++u) {
      const bool here = inside(u, v);
      if (here != inside(u + 1, v) || here != inside(u, v + 1) || here != inside(u - 1, v) ||
          here != inside(u, v - 1)) {
        picture.at<cv::Vec3b>(v, u) = colour;
      }
    }
  }
}

}  // namespace

void write_outline_figure(const Pipeline& robot, const PinholeIntrinsics& k, const OutlineView& view,
                          const std::filesystem::path& png) {
  const cv::Mat observed = cv::imread(view.mask.string(), cv::IMREAD_GRAYSCALE);
  if (observed.cols != k.width || observed.rows != k.height) {
    throw FileError(view.mask.string() + ": expected a mask of the camera's size");
  }
  std::vector<simulator::PaintedPart> parts;
  for (const auto& mesh : robot.robot().meshes()) parts.push_back({.mesh = mesh.mesh});
  simulator::Rasterizer rasterizer(std::move(parts), k.width, k.height, 1);
  CameraModel camera;
  camera.intrinsics = k;
  const auto& links = robot.setup().model.rendered_links;
  ForwardKinematics kinematics(robot.shared_robot(), links);
  std::vector<Pose> X_WB(links.size());
  std::vector<Eigen::Isometry3f> X_CB(links.size());
  const Pose X_CW = view.X_root_optical.inverse(Eigen::Isometry);
  cv::Mat picture(k.height, k.width, CV_8UC3, kWhite);
  const auto model = [&](const Eigen::VectorXd& q, const cv::Vec3b& colour) {
    kinematics.compute(q, X_WB);
    for (std::size_t b = 0; b < X_WB.size(); ++b) X_CB[b] = (X_CW * X_WB[b]).cast<float>();
    rasterizer.draw(X_CB, camera, {});
    const BinaryMask mask = rasterizer.mask();
    draw_outline(
        picture, [&](int u, int v) { return mask.at(u, v); }, colour);
  };
  model(view.q_before, kRed);
  draw_outline(
      picture, [&](int u, int v) { return observed.at<std::uint8_t>(v, u) > 127; }, kBlack);
  model(view.q_after, kGreen);
  if (!cv::imwrite(png.string(), picture)) throw FileError(png.string() + ": cannot be written");
}

}  // namespace bodyschema
