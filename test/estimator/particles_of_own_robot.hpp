#pragma once

#include <memory>
#include <vector>

#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"
#include "particle_search.hpp"

namespace bodyschema {

/// Particles about our own robot's offsets, and the hypotheses that are made of them, in one frame of a reach.
class ParticlesOfOwnRobot : public OwnRobot {
 protected:
  ParticlesOfOwnRobot() : reach_(robot_, setup_, rig_, paper_offsets_rad()), seen_(reach_.observe(pose(0.5), 0)) {
    options_.silhouette.engine = "contour";
    std::vector<Belief> beliefs;
    for (const auto& target : effect_targets("joint_offset", reach_.roles())) {
      beliefs.push_back({"joint_offset", target, {options_.filter.initial_sd_rad}});
    }
    const ErrorModel nothing(reach_.roles());
    model_ =
        std::make_unique<FrameModel>(robot_, setup_, rig_, reach_.roles(), State(reach_.roles(), beliefs), nothing);
    scorer_ = std::make_unique<HypothesisScorer>(*model_, silhouette_model(*robot_, setup_), nullptr, rig_.intrinsics(),
                                                 options_.silhouette, options_.filter.particles);
    particles_ = std::make_unique<ParticleSearch>(*model_, *scorer_, options_);
    frame_ = model_->take(seen_, nothing_);
    scorer_->observe(frame_, options_.min_mask_share);
  }
  [[nodiscard]] double distance(const Eigen::VectorXd& x) { return scorer_->distance(x); }

  EstimatorOptions options_;
  SyntheticReach reach_;
  Observation seen_;
  std::unique_ptr<FrameModel> model_;
  std::unique_ptr<HypothesisScorer> scorer_;
  std::unique_ptr<ParticleSearch> particles_;
  Frame frame_;
  const Eigen::VectorXd nothing_ = Eigen::VectorXd::Zero(7);
};

}  // namespace bodyschema
