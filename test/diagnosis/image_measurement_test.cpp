#include "bodyschema/diagnosis/image_measurement.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/effects/corrected_kinematics.hpp"
#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema {
namespace {

using test::robot;

/// Silhouettes of the robot in postures before its eyes, as masks that an ideal vision would give.
class Pictures : public testing::Test {
 protected:
  /// @param copies  of each observation, 30 ms apart
  static std::unique_ptr<ImageMeasurement> measurement(int threads = 1, int copies = 1) {
    const auto& r = robot();
    auto result = std::make_unique<ImageMeasurement>(r.model, r.setup, r.rig, threads);
    const auto postures = make_synthetic_log(r, {}, 1);
    SilhouetteModel silhouettes;
    silhouettes.culling = r.setup.culling;
    for (const auto& part : r.model->meshes()) silhouettes.parts.push_back(part.mesh);
    SilhouetteOptions options;
    options.engine = "contour";
    options.threads = 1;
    const auto scorer = make_silhouette_scorer(silhouettes, r.rig.intrinsics(), options);
    CorrectedKinematics kinematics(r.model, r.setup.model.rendered_links,
                                   {r.rig.cameras[0].link, r.rig.cameras[1].link});
    std::vector<Pose> poses(r.setup.model.rendered_links.size());
    for (std::size_t v = 0; v < 400; v += 40) {
      const auto& joints = postures->views()[v].joints;
      Observation seen;
      seen.utime = joints.utime;
      for (std::size_t c = 0; c < 2; ++c) {
        kinematics.compute(joints.q, Corrections(joints.q.size()), c, poses);
        std::vector<Eigen::Isometry3f> X_CB;
        for (const auto& X : poses) X_CB.push_back(X.cast<float>());
        CameraObservation camera;
        camera.utime = joints.utime;
        camera.joints = joints;
        camera.mask = scorer->render(X_CB, c);
        seen.cameras.push_back(std::move(camera));
      }
      for (int copy = 0; copy < copies; ++copy) {
        result->add(seen);
        for (auto& camera : seen.cameras) camera->utime += 30'000;
      }
    }
    return result;
  }

  struct Sum {
    double square = 0.0, weight = 0.0, misfit = 0.0, outline = 0.0;
    [[nodiscard]] double rms() const { return std::sqrt(square / weight); }
  };
  /// With the elbow that far from where its encoder says.
  static Sum residuals(ImageMeasurement& measurement, double elbow_deg) {
    Corrections c(static_cast<Eigen::Index>(measurement.roles().names.size()));
    c.dq[measurement.roles().index("r_elbow")] = elbow_deg * EIGEN_PI / 180.0;
    std::vector<CompressedView> views;
    measurement.compress(std::vector<Corrections>(measurement.views().size(), c), views);
    Sum sum;
    for (const auto& view : views) {
      sum.square += view.square;
      sum.weight += view.weight;
      sum.misfit += view.misfit;
      sum.outline += view.outline;
    }
    return sum;
  }
};

TEST_F(Pictures, OutlinesOfTheRightModelLieWithinAPixelsRounding) {
  const auto m = measurement();
  m->set_search(4.0);
  const auto right = residuals(*m, 0.0);
  EXPECT_GT(right.outline, 20 * 40.0);
  EXPECT_LT(right.rms(), 0.45);  // half a pixel's rounding of a binary mask is 0.29
  EXPECT_LT(right.misfit / right.outline, 1.0);
  EXPECT_GT(right.weight, 0.8 * right.outline);
}

TEST_F(Pictures, TheMisfitDoesNotDependOnTheSearch) {
  const auto m = measurement();
  m->set_search(4.0);
  const auto narrow = residuals(*m, 4.0), right = residuals(*m, 0.0);
  m->set_search(20.0);
  const auto wide = residuals(*m, 4.0);
  EXPECT_DOUBLE_EQ(narrow.misfit, wide.misfit);
  EXPECT_LT(narrow.weight, wide.weight);  // the search decides what the regression sees
  EXPECT_GT(narrow.misfit, 3.0 * right.misfit);
}

TEST_F(Pictures, TheMisfitGrowsWithTheError) {
  const auto m = measurement();
  m->set_search(4.0);
  double last = 0.0;
  for (const double error_deg : {0.0, 1.0, 2.0, 4.0, 8.0}) {
    const auto sum = residuals(*m, error_deg);
    EXPECT_GT(sum.misfit / sum.outline, last) << error_deg << " deg";
    last = sum.misfit / sum.outline;
  }
}

TEST_F(Pictures, EveryOtherInstantIsHalfOfThem) {
  const auto m = measurement();
  m->set_search(6.0);
  const auto all = residuals(*m, 1.0);
  m->set_search(6.0, 2);
  const auto half = residuals(*m, 1.0);
  EXPECT_GT(half.outline, 0.3 * all.outline);
  EXPECT_LT(half.outline, 0.7 * all.outline);
  EXPECT_NEAR(half.misfit / half.outline, all.misfit / all.outline, 0.3 * all.misfit / all.outline);
}

TEST_F(Pictures, ThatRepeatTheLastOnesSayNothingNew) {
  const auto once = measurement(), thrice = measurement(1, 3);
  ASSERT_EQ(once->views().size(), thrice->views().size());
  for (std::size_t v = 0; v < once->views().size(); ++v) {
    EXPECT_EQ(once->views()[v].joints.utime, thrice->views()[v].joints.utime);
  }
}

TEST_F(Pictures, ThreadsChangeNothing) {
  const auto one = measurement(1), three = measurement(3);
  one->set_search(6.0);
  three->set_search(6.0);
  const auto a = residuals(*one, 1.0), b = residuals(*three, 1.0);
  EXPECT_EQ(a.square, b.square);
  EXPECT_EQ(a.misfit, b.misfit);
}

}  // namespace
}  // namespace bodyschema
