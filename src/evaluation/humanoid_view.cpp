#include "humanoid_view.hpp"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {
namespace {

/// Links of one arm without its fingers: "left_elbow_link", "L_hand_base_link".
bool of_arm(const std::string& link, const std::string& side) {
  return link.starts_with(side + "_") || link == (side == "left" ? "L_hand_base_link" : "R_hand_base_link");
}

void draw_outline(cv::Mat& picture, const BinaryMask& mask, const cv::Vec3b& colour) {
  for (int v = 1; v + 1 < mask.height(); ++v) {
    for (int u = 1; u + 1 < mask.width(); ++u) {
      const bool here = mask.at(u, v);
      if (here != mask.at(u + 1, v) || here != mask.at(u, v + 1)) picture.at<cv::Vec3b>(v, u) = colour;
    }
  }
}

}  // namespace

void HumanoidModel::take(const Calibration& calibration) {
  found = calibration.model;
  X_link_optical = calibration.cameras.front().X_link_optical;
  intrinsics = calibration.cameras.front().intrinsics;
  for (const auto& parameter : calibration.parameters) {
    if (parameter.name == "latency") lag_s = 1e-3 * parameter.value;
  }
}

HumanoidView::HumanoidView(const Configuration& configuration) : pipeline_(configuration) {
  const auto& camera = pipeline_.rig().cameras.front();
  carrier_ = camera.mount.parent.empty() ? camera.link : camera.mount.parent;
  nominal_.intrinsics = camera.intrinsics;
  const auto q = pipeline_.setup().default_joints(pipeline_.robot());
  ForwardKinematics kinematics(pipeline_.shared_robot(), {carrier_, camera.link});
  std::vector<Pose> X_WL(2);
  kinematics.compute(q, X_WL);
  nominal_.X_link_optical = X_WL[0].inverse(Eigen::Isometry) * X_WL[1];
}

Eigen::VectorXd HumanoidView::readings(const std::map<std::string, double>& encoders) const {
  Eigen::VectorXd q = pipeline_.setup().default_joints(pipeline_.robot());
  for (const auto& [joint, angle] : encoders) {
    const auto at = pipeline_.robot().find_joint(joint);
    if (at) q[static_cast<Eigen::Index>(*at)] = angle;  // not: number of the frame, readings of what is not drawn
  }
  return q;
}

BinaryMask HumanoidView::silhouette(const HumanoidModel& model, const std::map<std::string, double>& encoders,
                                    const std::string& side) {
  std::vector<simulator::PaintedPart> parts;
  std::vector<std::string> links;
  for (const auto& mesh : pipeline_.robot().meshes()) {
    if (!of_arm(mesh.link, side)) continue;
    parts.push_back({.mesh = mesh.mesh});
    links.push_back(mesh.link);
  }
  std::vector<Eigen::Isometry3f> X_CB;
  for (const auto& X : places(model, encoders, links)) X_CB.emplace_back(X.cast<float>());
  simulator::Rasterizer rasterizer(std::move(parts), model.intrinsics.width, model.intrinsics.height, 1);
  CameraModel camera;
  camera.intrinsics = model.intrinsics;
  rasterizer.draw(X_CB, camera, {});
  return rasterizer.mask();
}

Pose HumanoidView::hand(const HumanoidModel& model, const std::map<std::string, double>& encoders) const {
  return places(model, encoders, {pipeline_.setup().hand_link}).front();
}

std::vector<Pose> HumanoidView::places(const HumanoidModel& model, const std::map<std::string, double>& encoders,
                                       const std::vector<std::string>& links) const {
  CorrectedKinematics kinematics(pipeline_.shared_robot(), links, {carrier_});
  Corrections corrections(pipeline_.robot().joint_count());
  for (std::size_t e = 0; model.found && e < model.found->size(); ++e) {
    const Effect& effect = (*model.found)[e];
    // What moves with time is in the encoders already.
    if (effect_kind(effect.name()).home == EffectHome::kUrdf) effect.apply({}, corrections);
  }
  corrections.camera = {};  // X_link_optical has it
  std::vector<Pose> X(links.size());
  kinematics.compute(readings(encoders), corrections, 0, X);  // in the carrier of the camera
  for (auto& pose : X) pose = model.X_link_optical.inverse(Eigen::Isometry) * pose;
  return X;
}

void HumanoidView::write_figure(const DrawnPicture& drawn, const std::map<std::string, double>& encoders,
                                const HumanoidModel& model, const std::filesystem::path& png) {
  const auto& k = nominal_.intrinsics;
  cv::Mat picture(k.height, k.width, CV_8UC3, cv::Vec3b(255, 255, 255));
  for (const char* side : {"left", "right"}) {
    draw_outline(picture, silhouette(nominal_, encoders, side), {40, 40, 220});
    draw_outline(picture, silhouette(model, encoders, side), {60, 160, 0});
  }
  for (const auto* points : {&drawn.left, &drawn.right}) {
    for (std::size_t i = 0; i + 1 < points->size(); ++i) {
      const Eigen::Vector2d& a = (*points)[i];
      const Eigen::Vector2d& b = (*points)[i + 1];
      constexpr double kGap_px = 14.0;  // edges are drawn in steps of 8; what is farther is the next edge
      if ((b - a).norm() > kGap_px) continue;
      for (int s = 0; s <= 8; ++s) {
        const Eigen::Vector2d p = a + (b - a) * s / 8.0;
        const int u = static_cast<int>(std::lround(p.x())), v = static_cast<int>(std::lround(p.y()));
        if (u >= 0 && v >= 0 && u < k.width && v < k.height) picture.at<cv::Vec3b>(v, u) = {0, 0, 0};
      }
    }
  }
  if (!cv::imwrite(png.string(), picture)) throw FileError(png.string() + ": cannot be written");
}

}  // namespace bodyschema
