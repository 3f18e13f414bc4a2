#include "bodyschema/pipeline/pipeline.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

Configuration configuration(const std::string& method) {
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml",
                             {"vision.method=" + method, "filter.particles=50", "silhouette.engine=contour"});
}

/// A learned background, then a short reach.
std::vector<Observation> observations() {
  const Configuration c = configuration("learned_background");
  const RobotSetup setup = RobotSetup::from(c.section("robot"));
  simulator::SimulationPlan plan;
  plan.seed = 5;
  plan.frames = 12;
  plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_elbow", -2}};
  simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")),
                                 simulator::SimulatorSettings::from(c.section("simulator")), plan);
  std::vector<Observation> result;
  std::vector<JointSample> history;
  while (auto frame = simulator.next()) {
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    result.push_back(simulator::to_observation(*frame, history));
  }
  return result;
}

class PipelineLooksAhead : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() { seen_ = observations(); }
  static inline std::vector<Observation> seen_;
};

TEST_P(PipelineLooksAhead, WithoutChangingAnyResult) {
  Pipeline one_by_one(configuration(GetParam()));
  Pipeline ahead(configuration(GetParam()));
  auto first = seen_, second = seen_;
  int with_hand = 0;
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const Estimate a = one_by_one.process(first[i]);
    const Estimate b = ahead.process(second[i], i + 1 < second.size() ? &second[i + 1] : nullptr);
    ASSERT_EQ(a.state, b.state) << "observation " << i;
    ASSERT_EQ(a.offset_rad, b.offset_rad) << "observation " << i;
    ASSERT_EQ(a.covariance_rad2, b.covariance_rad2) << "observation " << i;
    for (std::size_t c = 0; c < first[i].cameras.size(); ++c) {
      ASSERT_EQ(first[i].cameras[c]->mask, second[i].cameras[c]->mask);
      ASSERT_EQ(first[i].cameras[c]->coverage, second[i].cameras[c]->coverage);
      with_hand += first[i].cameras[c]->mask.empty() ? 0 : first[i].cameras[c]->mask.count() > 500;
    }
  }
  EXPECT_GT(with_hand, 10) << "nothing was seen, nothing was compared";
}

INSTANTIATE_TEST_SUITE_P(Methods, PipelineLooksAhead,
                         testing::Values("learned_background", "single_colour", "statistics"));

TEST_F(PipelineLooksAhead, AndSaysSoWhenAnotherObservationComes) {
  Pipeline pipeline(configuration("learned_background"));
  auto seen = seen_;
  pipeline.process(seen[0], &seen[1]);
  EXPECT_THROW(pipeline.process(seen[2]), std::logic_error);
}

TEST_F(PipelineLooksAhead, AndComplainsOfAPictureAtItsOwnTurn) {
  Pipeline pipeline(configuration("learned_background"));
  auto seen = seen_;
  seen[1].cameras[0]->image = Image(8, 6, 3);
  EXPECT_NO_THROW(pipeline.process(seen[0], &seen[1]));
  EXPECT_THROW(pipeline.process(seen[1], &seen[2]), DataError);
  EXPECT_NO_THROW(pipeline.process(seen[2]));
}

}  // namespace
}  // namespace bodyschema
