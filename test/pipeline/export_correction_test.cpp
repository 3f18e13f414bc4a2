#include "bodyschema/pipeline/export_correction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

class ExportCorrection : public ::testing::Test {
 protected:
  ExportCorrection() : folder_(fs::temp_directory_path() / ("export_test_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~ExportCorrection() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(ExportCorrection, TheCorrectedUrdfGivesTheCorrectedPose) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Configuration configuration =
      Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/robot.yaml");
  RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  setup.model.rendered_links.clear();
  const auto nominal = setup.load();
  Correction correction;
  for (const auto& name : setup.estimated_joints) {
    correction.offsets_rad.emplace_back(name, radians(10.0 * uniform(random)));
  }
  correction.nuisances = {{"neck_pitch", 0.05}, {"mesh_scale", 0.01}};
  write_corrected_urdf(setup.model.urdf, correction, folder_ / "corrected.urdf");
  RobotModelOptions corrected_options = setup.model;
  corrected_options.urdf = folder_ / "corrected.urdf";
  const auto corrected = RobotModel::load(corrected_options);

  const std::vector<std::string> links = {setup.hand_link, "l_eye_optical"};
  ForwardKinematics fk_nominal(nominal, links);
  ForwardKinematics fk_corrected(corrected, links);
  for (int i = 0; i < 20; ++i) {
    Eigen::VectorXd encoder = setup.default_joints(*nominal);
    for (auto& value : encoder) value += 0.5 * uniform(random);
    Eigen::VectorXd q_true = encoder;
    for (const auto& [name, offset] : correction.offsets_rad) q_true(nominal->joint_index(name)) -= offset;
    q_true(nominal->joint_index("neck_pitch")) -= 0.05;
    std::vector<Pose> a(2), b(2);
    fk_nominal.compute(q_true, a);
    fk_corrected.compute(encoder, b);
    for (const std::size_t link : {0u, 1u}) {
      EXPECT_LT((a[link].translation() - b[link].translation()).norm(), 1e-8);
      EXPECT_LT(rotation_distance(a[link].linear(), b[link].linear()), 1e-7);
    }
  }
  for (const auto& [name, offset] : correction.offsets_rad) {
    const auto j = static_cast<std::size_t>(nominal->joint_index(name));
    EXPECT_NEAR(corrected->joints()[j].lower_rad, nominal->joints()[j].lower_rad + offset, 1e-9);
  }
}

TEST_F(ExportCorrection, WritesThreeFilesAndRefusesWhatDoesNotFit) {
  std::ofstream(folder_ / "summary.json")
      << R"({"estimate": {"offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1}}})";
  const fs::path urdf = fs::path(BODYSCHEMA_SOURCE_DIR) / "meshes/icub_right/icub_right.urdf";
  export_correction(folder_ / "summary.json", urdf, folder_ / "out");
  std::ifstream yaml(folder_ / "out/offsets.yaml");
  const std::string text((std::istreambuf_iterator<char>(yaml)), {});
  EXPECT_THAT(text, ::testing::HasSubstr("r_elbow: -2.0000"));
  EXPECT_TRUE(fs::exists(folder_ / "out/calibration_delta.txt"));

  std::ofstream(folder_ / "summary.json")
      << R"({"estimate": {"offset_deg": {"no_joint": 1.0}, "stddev_deg": {}}})";
  EXPECT_THROW(export_correction(folder_ / "summary.json", urdf, folder_ / "out"), FileError);
  std::ofstream(folder_ / "summary.json") << "{}";
  EXPECT_THROW(export_correction(folder_ / "summary.json", urdf, folder_ / "out"), FileError);
}

}  // namespace
}  // namespace bodyschema
