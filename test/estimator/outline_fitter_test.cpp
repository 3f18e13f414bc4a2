#include "outline_fitter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "outlines_of_own_robot.hpp"

namespace bodyschema {
namespace {

/// With the cameras' place in the state, of which more is believed than of the joints.
class OutlinesBeforeMountedCameras : public OutlinesOfOwnRobot {
 protected:
  OutlinesBeforeMountedCameras() {
    std::vector<Belief> beliefs;
    for (const auto& target : effect_targets("joint_offset", reach_.roles())) {
      beliefs.push_back({"joint_offset", target, {options_.filter.initial_sd_rad}});
    }
    const double deg = radians(1.0);
    beliefs.push_back({"camera_pose", {}, {0.01, 0.01, 0.01, deg, deg, deg}});
    const ErrorModel nothing(reach_.roles());
    model_ =
        std::make_unique<FrameModel>(robot_, setup_, rig_, reach_.roles(), State(reach_.roles(), beliefs), nothing);
    scorer_ = std::make_unique<HypothesisScorer>(*model_, silhouette_model(*robot_, setup_), nullptr, rig_.intrinsics(),
                                                 options_.silhouette, options_.filter.particles);
  }
  [[nodiscard]] OutlineFitter fitter() { return {*model_, *scorer_, options_, rig_.cameras.size(), kAllRenders}; }
  [[nodiscard]] PostureMemory memory() const {
    const Eigen::VectorXd sd = model_->state().prior_sd();
    std::vector<bool> joints(static_cast<std::size_t>(sd.size()), false);
    std::fill_n(joints.begin(), truth_.size(), true);
    return {MemoryLayout{model_->state().prior_mean(), sd, joints, {}}, {}};
  }
  /// A picture whose masks show the arm where it is and with these offsets.
  [[nodiscard]] Frame about(const Eigen::VectorXd& predicted) {
    seen_ = reach_.observe(pose(0.5), 1'000'000);
    for (std::size_t c = 0; c < seen_.cameras.size(); ++c) {
      Eigen::VectorXd q = seen_.cameras[c]->joints.q;
      for (Eigen::Index k = 0; k < truth_.size(); ++k) {
        q(model_->state().parameters()[static_cast<std::size_t>(k)].joint) -= predicted[k];
      }
      const BinaryMask there = reach_.draw(q, reach_.roles().no_corrections(), c).mask;
      seen_.cameras[c]->mask |= there;
    }
    Frame frame = model_->take(seen_, predicted);
    scorer_->observe(frame, options_.min_mask_share);
    return frame;
  }
};

/// Masks that are made about a prediction show the arm there as well as where it is. An arm that is found from a wrong
/// prediction may stay there, but nothing else has to move for it: of a camera's place more is believed than that.
TEST_F(OutlinesBeforeMountedCameras, AnArmThatIsLookedForFromAfarDoesNotMoveTheCameras) {
  constexpr unsigned kStarts = 12;
  const Eigen::VectorXd sd = model_->state().prior_sd();
  int found = 0;
  for (unsigned i = 0; i < kStarts; ++i) {
    std::mt19937_64 random(i);
    std::normal_distribution<double> normal(0.0, radians(4.0));
    Eigen::VectorXd start = model_->state().prior_mean();
    for (Eigen::Index k = 0; k < truth_.size(); ++k) start[k] = truth_[k] + normal(random);
    const Frame frame = about(start);
    const OutlineFit fit = fitter().follow_from(frame, start, memory());
    const Eigen::VectorXd cameras = fit.x.tail(6).cwiseQuotient(sd.tail(6));
    EXPECT_LT(cameras.cwiseAbs().maxCoeff(), 2.0) << "start " << i << ": " << cameras.transpose();
    found += (fit.x.head(truth_.size()) - truth_).cwiseAbs().maxCoeff() < radians(1.0);
  }
  EXPECT_GE(found, 6);
}

}  // namespace
}  // namespace bodyschema
