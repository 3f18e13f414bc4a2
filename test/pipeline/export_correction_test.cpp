#include "bodyschema/pipeline/export_correction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <random>

#include "../../src/pipeline/cameras_json.hpp"
#include "../../src/pipeline/model_hash.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "effects/own_effect.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

class ExportCorrection : public ::testing::Test {
 protected:
  ExportCorrection() : folder_(fs::temp_directory_path() / ("export_test_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    const Configuration configuration =
        Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/robot.yaml");
    setup_ = RobotSetup::from(configuration.section("robot"));
    setup_.model.rendered_links.clear();
    rig_ = StereoRig::from(configuration.section("cameras"));
  }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream stream(folder_ / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write_summary(const std::string& more = "") const {
    std::ofstream(folder_ / "summary.json")
        << R"({"estimate": {"state": "converged", "offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1},
          "told": ["r_elbow"]})"
        << more << "}";
  }
  /// Exports a replay that ended so, with a well and a badly known joint and what stood beside them.
  std::string export_of(const std::string& state, bool anyway = false) const {
    std::ofstream(folder_ / "summary.json")
        << R"({"estimate": {"state": ")" << state << R"(", "offset_deg": {"r_elbow": -2.0, "r_wrist_yaw": 3.0},
          "stddev_deg": {"r_elbow": 0.1, "r_wrist_yaw": 1.234},
          "told": ["r_elbow"], "effects": [
            {"name": "head_offset", "joint": "neck_pitch", "parameter": "angle", "unit": "deg", "value": -2.8648,
             "stddev": 0.3, "prior_stddev": 3.0},
            {"name": "head_offset", "joint": "neck_yaw", "parameter": "angle", "unit": "deg", "value": -0.5,
             "stddev": 0.75, "prior_stddev": 3.0},
            {"name": "mesh_scale", "parameter": "scale", "unit": "%", "value": 1.0, "stddev": 0.2, "prior_stddev": 0.35},
            {"name": "silhouette_bias", "parameter": "dilation", "unit": "px", "value": 0.2, "stddev": 0.1,
             "prior_stddev": 0.15}]}})";
    return export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out", anyway);
  }
  ~ExportCorrection() override { fs::remove_all(folder_); }
  fs::path folder_;
  RobotSetup setup_;
  StereoRig rig_;
};

TEST_F(ExportCorrection, TheCorrectedUrdfGivesTheCorrectedPose) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const RobotSetup& setup = setup_;
  const auto nominal = setup.load();
  Correction correction;
  for (const auto& name : setup.estimated_joints) {
    correction.offsets_rad.emplace_back(name, radians(10.0 * uniform(random)));
  }
  correction.known_offsets_rad = {{"neck_pitch", 0.05}};
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
      << R"({"estimate": {"state": "converged", "offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1},
          "told": []}})";
  export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
  std::ifstream yaml(folder_ / "out/offsets.yaml");
  const std::string text((std::istreambuf_iterator<char>(yaml)), {});
  EXPECT_THAT(text, ::testing::HasSubstr("r_elbow: -2.0000"));
  EXPECT_TRUE(fs::exists(folder_ / "out/calibration_delta.txt"));

  std::ofstream(folder_ / "summary.json")
      << R"({"estimate": {"state": "converged", "offset_deg": {"no_joint": 1.0}, "stddev_deg": {}, "told": []}})";
  EXPECT_THROW(export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out"), FileError);
  std::ofstream(folder_ / "summary.json") << "{}";
  EXPECT_THROW(export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out"), FileError);
}

TEST_F(ExportCorrection, AReplayThatDidNotEndConvergedIsOnlyAppliedAnyway) {
  for (const std::string state : {"diverged", "hand_not_in_view", "converging", "learning_background"}) {
    try {
      export_of(state);
      ADD_FAILURE() << "no error: " << state;
    } catch (const DataError& e) {
      EXPECT_EQ(e.what(), (folder_ / "summary.json").string() + ": the replay ended as '" + state +
                              "'; its offsets are not to be applied (--anyway)");
    }
    EXPECT_FALSE(fs::exists(folder_ / "out/offsets.yaml"));
  }
  const std::string warning = "the replay ended as 'diverged'";
  EXPECT_THAT(export_of("diverged", true), ::testing::HasSubstr(warning));
  for (const char* file : {"out/offsets.yaml", "out/calibration_delta.txt", "out/corrected.urdf"}) {
    EXPECT_THAT(content(file), ::testing::HasSubstr(warning)) << file;
  }
  EXPECT_THAT(export_of("converged"), ::testing::Not(::testing::HasSubstr("ended as")));
}

TEST_F(ExportCorrection, AJointThatTheMotionHardlyToldIsNamedInEveryFile) {
  const std::string warning = "r_wrist_yaw: known to 1.23 deg only (one sigma); this motion hardly told it";
  const std::string printed = export_of("converged");
  EXPECT_THAT(printed, ::testing::HasSubstr(warning));
  EXPECT_THAT(printed, ::testing::Not(::testing::HasSubstr("r_elbow")));
  for (const char* file : {"out/offsets.yaml", "out/calibration_delta.txt", "out/corrected.urdf"}) {
    EXPECT_THAT(content(file), ::testing::HasSubstr(warning)) << file;
  }
  EXPECT_NO_THROW(Configuration::load(folder_ / "out/offsets.yaml"));
  RobotModelOptions options = setup_.model;
  options.urdf = folder_ / "out/corrected.urdf";
  EXPECT_NO_THROW(RobotModel::load(options));
}

TEST_F(ExportCorrection, AResultOfAnotherUrdfIsOnlyAppliedAnyway) {
  const auto hash = [&] { return model_hash_of(setup_, *setup_.load(), std::nullopt); };
  const std::string made_with = hash();
  const fs::path summary = folder_ / "summary.json";
  write_summary(R"(, "model_hash": ")" + made_with + '"');
  export_correction(summary, setup_, rig_, folder_ / "out");
  // Into the URDF that has been corrected by it already: twice.
  setup_.model.urdf = folder_ / "out/corrected.urdf";
  const std::string difference = "made with the robot of model_hash \"" + made_with + "\", but robot.urdf '" +
                                 setup_.model.urdf.string() + "' with its meshes has \"" + hash() + '"';
  try {
    export_correction(summary, setup_, rig_, folder_ / "twice");
    ADD_FAILURE() << "no error";
  } catch (const ConfigurationError& e) {
    EXPECT_EQ(e.what(), summary.string() + ": " + difference + "; expected the URDF of the replay (--anyway)");
  }
  EXPECT_FALSE(fs::exists(folder_ / "twice"));
  EXPECT_THAT(export_correction(summary, setup_, rig_, folder_ / "twice", true), ::testing::HasSubstr(difference));
  EXPECT_THAT(content("twice/offsets.yaml"), ::testing::HasSubstr(difference));
  write_summary();  // older ones do not say
  EXPECT_NO_THROW(export_correction(summary, setup_, rig_, folder_ / "out"));
}

// cameras.yaml and ros/ once held the cameras of whatever configuration was given.
TEST_F(ExportCorrection, AResultOfOtherCamerasIsOnlyAppliedAnyway) {
  const fs::path summary = folder_ / "summary.json";
  write_summary(R"(, "cameras": )" + cameras_json(rig_).dump());
  export_correction(summary, setup_, rig_, folder_ / "out");
  const auto refuse = [&](const StereoRig& rig, const std::string& difference) {
    EXPECT_THAT([&] { export_correction(summary, setup_, rig, folder_ / "other"); },
                ::testing::ThrowsMessage<ConfigurationError>(
                    summary.string() + ": made with " + difference +
                    "; expected the configuration of the replay (--config, or --anyway)"));
    EXPECT_FALSE(fs::exists(folder_ / "other"));
  };
  StereoRig other = rig_;
  other.cameras[0].intrinsics.fx = 500.25;
  const std::string was = nlohmann::json(rig_.cameras[0].intrinsics.fx).dump();
  refuse(other, "cameras.left.fx " + was + ", but the configuration has 500.25");
  StereoRig renamed = rig_;
  renamed.cameras[0].name = "head";
  refuse(renamed, "cameras.left.link \"l_eye_optical\", but the configuration has no such key");
  StereoRig more = rig_;
  write_summary(R"(, "cameras": )" + cameras_json({{rig_.cameras[0]}}).dump());
  refuse(more, "no cameras.right.link, but the configuration has \"r_eye_optical\"");
  write_summary(R"(, "cameras": )" + cameras_json(rig_).dump());
  EXPECT_THAT(export_correction(summary, setup_, other, folder_ / "out", true),
              ::testing::HasSubstr("cameras.left.fx"));
  EXPECT_THAT(content("out/offsets.yaml"), ::testing::HasSubstr("# made with cameras.left.fx"));
}

TEST_F(ExportCorrection, WhatADeviceDoesNotTakeIsAnError) {
  write_summary();
  for (const char* file : {"corrected.urdf", "offsets.yaml", "calibration_delta.txt"}) {
    const fs::path full = folder_ / "out" / file;
    fs::create_directories(folder_ / "out");
    fs::create_symlink("/dev/full", full);
    try {
      export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
      ADD_FAILURE() << "no error: " << file;
    } catch (const DeviceError& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr(full.string()));
    }
    fs::remove_all(folder_ / "out");
  }
}

TEST_F(ExportCorrection, AFullDiskIsAnErrorAndLeavesWhatWasThereWhole) {
  export_of("converged");
  const std::string before = content("out/corrected.urdf");
  constexpr rlim_t kRoom_bytes = 4096;
  ASSERT_GT(before.size(), kRoom_bytes);
  write_summary();
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit little{kRoom_bytes, limit.rlim_max};
  const auto usual = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &little);
  std::string message;
  try {
    export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
  } catch (const DeviceError& e) {
    message = e.what();
  }
  setrlimit(RLIMIT_FSIZE, &limit);
  std::signal(SIGXFSZ, usual);
  EXPECT_EQ(message, (folder_ / "out/corrected.urdf").string() + ": cannot be written: File too large");
  EXPECT_EQ(content("out/corrected.urdf"), before);
  EXPECT_FALSE(fs::exists(folder_ / "out/corrected.urdf.part"));
}

TEST_F(ExportCorrection, AHeadJointHasDegreesADeviationAndTheWarningOfAnyJoint) {
  const std::string warning = "neck_yaw: known to 0.75 deg only (one sigma); this motion hardly told it";
  EXPECT_THAT(export_of("converged"), ::testing::HasSubstr(warning));
  for (const char* file : {"out/offsets.yaml", "out/calibration_delta.txt", "out/corrected.urdf"}) {
    EXPECT_THAT(content(file), ::testing::HasSubstr(warning)) << file;
  }
  const Configuration yaml = Configuration::load(folder_ / "out/offsets.yaml");
  EXPECT_DOUBLE_EQ(yaml.section("head_offset_deg").number("neck_pitch"), 2.8648);
  EXPECT_DOUBLE_EQ(yaml.section("head_stddev_deg").number("neck_yaw"), 0.75);
  const auto bias = yaml.section("effects").section("silhouette_bias dilation");
  EXPECT_DOUBLE_EQ(bias.number("value"), 0.2);
  EXPECT_DOUBLE_EQ(bias.number("stddev"), 0.1);
  EXPECT_EQ(bias.text("unit"), "px");
}

// Before: "[json.exception.out_of_range.403] key 'estimate' not found".
TEST_F(ExportCorrection, TheResultOfACalibrationIsAnErrorThatSaysWhereItsFilesAre) {
  std::ofstream(folder_ / "calibration.json") << R"({"state": "good", "outline_px": {"before": 2.0, "after": 0.8}})";
  EXPECT_THAT([&] { export_correction(folder_ / "calibration.json", setup_, rig_, folder_ / "out"); },
              ::testing::ThrowsMessage<FileError>(
                  ::testing::AllOf(::testing::HasSubstr("calibration.json: that of a calibration"),
                                   ::testing::HasSubstr("bodyschema calibrate --out"))));
  std::ofstream(folder_ / "list.json") << "[1]";
  EXPECT_THROW(export_correction(folder_ / "list.json", setup_, rig_, folder_ / "out"), FileError);
}

TEST_F(ExportCorrection, ASummaryOfAnOlderVersionIsRefused) {
  for (const char* older : {R"("nuisance": {"neck_pitch": 0.05, "mesh_scale": 0.01})",
                            R"("told": [], "nuisance": {"mesh_scale": 0.01})", R"("effective_sample_size": 3)"}) {
    std::ofstream(folder_ / "summary.json")
        << R"({"estimate": {"state": "converged", "offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1}, )"
        << older << "}}";
    try {
      export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
      ADD_FAILURE() << "no error: " << older;
    } catch (const FileError& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr("summary.json: the estimate is that of an older version"));
      EXPECT_THAT(e.what(), ::testing::HasSubstr("replay the log again"));
    }
  }
}

TEST_F(ExportCorrection, AnEffectThatTheSummaryMakesUpIsRefused) {
  const auto refuse = [&](const std::string& entry, const char* words) {
    std::ofstream(folder_ / "summary.json")
        << R"({"estimate": {"state": "converged", "offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1},
            "told": [], "effects": [)"
        << entry << "]}}";
    try {
      export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
      ADD_FAILURE() << "no error: " << words;
    } catch (const FileError& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr("summary.json"));
      EXPECT_THAT(e.what(), ::testing::HasSubstr(words));
    }
  };
  refuse(R"({"name": "mesh_scail", "parameter": "scale", "unit": "%", "value": 1.0, "stddev": 0.2})", "'mesh_scale'");
  refuse(R"({"name": "mesh_scale", "parameter": "size", "unit": "%", "value": 1.0, "stddev": 0.2})",
         "no parameter 'size'");
  refuse(R"({"name": "mesh_scale", "parameter": "scale", "unit": "%", "stddev": 0.2})", "value");
}

/// An effect that the software does not know: what was estimated of it is written, and what to do about it.
TEST_F(ExportCorrection, HoldsWhatWasEstimatedOfARegisteredEffect) {
  test::register_own_effect();
  std::ofstream(folder_ / "summary.json")
      << R"({"estimate": {"state": "converged", "offset_deg": {"r_elbow": -2.0}, "stddev_deg": {"r_elbow": 0.1},
          "told": ["r_elbow"], "effects": [{"name": ")"
      << test::kOwnEffect
      << R"(", "joint": "r_elbow", "parameter": "ripple", "unit": "deg", "value": 1.5, "stddev": 0.2,
             "prior_stddev": 5.0}]}})";
  export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
  const std::string applied = content("out/what_was_applied.txt");
  EXPECT_LT(applied.find("cannot hold"), applied.find(std::string(test::kOwnEffect) + " of r_elbow ripple 1.5 deg"));
  EXPECT_THAT(applied, ::testing::HasSubstr("correct the reading by the ripple"));
  const Configuration yaml = Configuration::load(folder_ / "out/offsets.yaml");
  const auto effect = yaml.section("effects").section(std::string(test::kOwnEffect) + " of r_elbow ripple");
  EXPECT_DOUBLE_EQ(effect.number("value"), 1.5);
  EXPECT_DOUBLE_EQ(effect.number("stddev"), 0.2);
}

/// What the replay estimated beside the offsets goes where it belongs, and the files say where.
TEST_F(ExportCorrection, WhatElseWasEstimatedIsInTheFilesOrSaidNotToBe) {
  export_of("converged");
  const std::string applied = content("out/what_was_applied.txt");
  EXPECT_THAT(applied, ::testing::HasSubstr("head_offset of neck_pitch angle -2.86 deg: in corrected.urdf"));
  EXPECT_LT(applied.find("cannot hold"), applied.find("mesh_scale scale 1 %"));
  EXPECT_FALSE(fs::exists(folder_ / "out/cameras.yaml"));
  // The head turns in the corrected URDF as the estimate says.
  const auto nominal = setup_.load();
  RobotModelOptions options = setup_.model;
  options.urdf = folder_ / "out/corrected.urdf";
  ForwardKinematics a(nominal, {"l_eye_optical"}), b(RobotModel::load(options), {"l_eye_optical"});
  Eigen::VectorXd encoder = setup_.default_joints(*nominal), q_true = encoder;
  q_true(nominal->joint_index("neck_pitch")) += radians(-2.8648);
  q_true(nominal->joint_index("neck_yaw")) += radians(-0.5);
  std::vector<Pose> X_a(1), X_b(1);
  a.compute(q_true, X_a);
  b.compute(encoder, X_b);
  EXPECT_LT((X_a[0].translation() - X_b[0].translation()).norm(), 1e-6);
  EXPECT_LT(rotation_distance(X_a[0].linear(), X_b[0].linear()), 1e-6);
}

// Arm and head offsets hold together: a calibrator that gets one without the other is wrong.
TEST_F(ExportCorrection, TheCalibrationDeltaHoldsTheHeadJointsToo) {
  export_of("converged");
  const std::string delta = content("out/calibration_delta.txt");
  EXPECT_THAT(delta, ::testing::ContainsRegex("r_elbow +-2.0000"));
  EXPECT_THAT(delta, ::testing::ContainsRegex("neck_pitch +\\+2.8648"));
  EXPECT_THAT(delta, ::testing::Not(::testing::HasSubstr("mesh_scale")));
}

TEST_F(ExportCorrection, TheUrdfHoldsWhatItCanOfAnExtendedModel) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto robot = setup_.load();
  ErrorModel model(JointRoles::of(robot, setup_, rig_));
  const auto put = [&](const char* name, const EffectTarget& target) {
    for (auto& p : model.add(name, target).parameters()) {
      if (p.fitted) p.value = 3.0 * p.typical * uniform(random);
    }
  };
  put("head_offset", {"neck_pitch", ""});
  put("vergence", {});
  put("link_length", {"r_shoulder_roll", ""});
  put("link_length", {"r_elbow", ""});
  put("link_length", {"r_wrist_pitch", ""});
  put("axis_tilt", {"r_shoulder_yaw", ""});
  put("axis_tilt", {"r_elbow", ""});
  put("axis_shift", {"r_elbow", ""});
  put("axis_shift", {"r_wrist_prosup", ""});
  put("hand_mount", {"r_wrist_yaw", ""});
  put("first_camera", {});
  put("camera_pair", {});  // turned, then moved by the baseline: the order of a file is no matter
  put("baseline", {});
  put("base_shift", {});
  put("focal_length", {});
  put("compliance", {"r_elbow", ""});
  Correction correction;
  correction.offsets_rad = {{"r_shoulder_yaw", 0.1}, {"r_elbow", -0.07}};
  const auto applied = add_effects(model, robot, setup_, rig_, correction);
  ASSERT_EQ(applied.size(), model.size());
  EXPECT_EQ(applied.back().applied, "");
  EXPECT_THAT(applied.back().effect, ::testing::HasSubstr("compliance of r_elbow"));
  EXPECT_NE(applied.back().remark, "");
  write_corrected_urdf(setup_.model.urdf, correction, folder_ / "corrected.urdf");
  RobotModelOptions options = setup_.model;
  options.urdf = folder_ / "corrected.urdf";
  const auto corrected = RobotModel::load(options);

  const std::vector<std::string> cameras = {"l_eye_optical", "r_eye_optical"};
  CorrectedKinematics expected(robot, {setup_.hand_link, "r_forearm"}, cameras);
  ForwardKinematics found(corrected, {setup_.hand_link, "r_forearm", cameras[0], cameras[1]});
  model.remove("compliance", {"r_elbow", ""});  // which no URDF can hold
  InstantBuilder instants(robot, setup_.hand_link, setup_.gravity_W);
  for (int i = 0; i < 20; ++i) {
    JointSample sample;
    sample.q = setup_.default_joints(*robot);
    for (const auto& group : {setup_.estimated_joints, setup_.head_joints}) {
      for (const auto& name : group) sample.q(robot->joint_index(name)) += 0.5 * uniform(random);
    }
    sample.qdot.setZero(sample.q.size());
    std::vector<Pose> X_W(4), X_C(2);
    found.compute(sample.q, X_W);
    for (const std::size_t c : {0u, 1u}) {
      Instant at;
      instants.build(sample, c, Eigen::VectorXd::Zero(sample.q.size()), at);
      Corrections corrections = model.roles().no_corrections();
      model.corrections(at, corrections);
      Eigen::VectorXd q = sample.q;
      for (const auto& [name, offset] : correction.offsets_rad) q(robot->joint_index(name)) -= offset;
      expected.compute(q, corrections, c, X_C);
      for (const std::size_t link : {0u, 1u}) {
        const Pose X = X_W[2 + c].inverse() * X_W[link];
        EXPECT_LT((X.translation() - X_C[link].translation()).norm(), 1e-8);
        EXPECT_LT(rotation_distance(X.linear(), X_C[link].linear()), 1e-7);
      }
    }
  }
}

/// A rig that sits elsewhere as a whole: its first camera by the pose's own axes, the second with it. Eyes that turn by
/// themselves carry it along as they stand by default, which the files say.
TEST_F(ExportCorrection, TheUrdfHoldsWhereTheCamerasSitWhateverTheOrderOfTheEffects) {
  const auto robot = setup_.load();
  const auto roles = JointRoles::of(robot, setup_, rig_);
  const std::vector<std::string> cameras = {"l_eye_optical", "r_eye_optical"};
  for (const bool pose_first : {true, false}) {
    ErrorModel model(roles);
    for (const char* name :
         pose_first ? std::vector{"camera_pose", "camera_pair"} : std::vector{"camera_pair", "camera_pose"}) {
      double sign = 1.0;
      for (auto& p : model.add(name, {}).parameters()) p.value = 5.0 * (sign = -sign) * p.typical;
    }
    Correction correction;
    const auto applied = add_effects(model, robot, setup_, rig_, correction);
    for (const auto& effect : applied) {
      EXPECT_EQ(effect.applied, "corrected.urdf");
      const bool of_the_rig = effect.effect.starts_with("camera_pose");
      EXPECT_EQ(effect.remark, of_the_rig ? "for eyes that stand at their default angles" : "");
    }
    write_corrected_urdf(setup_.model.urdf, correction, folder_ / "corrected.urdf");
    RobotModelOptions options = setup_.model;
    options.urdf = folder_ / "corrected.urdf";
    CorrectedKinematics expected(robot, {setup_.hand_link}, cameras);
    ForwardKinematics found(RobotModel::load(options), {setup_.hand_link, cameras[0], cameras[1]});
    Eigen::VectorXd q = setup_.default_joints(*robot);
    q(robot->joint_index("r_elbow")) += 0.4;
    q(robot->joint_index("neck_yaw")) += 0.3;
    std::vector<Pose> X_W(3), X_C(1);
    found.compute(q, X_W);
    for (const std::size_t c : {0u, 1u}) {
      Instant at;
      at.camera = c;
      at.encoder = at.q = q;
      Corrections corrections = roles.no_corrections();
      model.corrections(at, corrections);
      expected.compute(q, corrections, c, X_C);
      const Pose X = X_W[1 + c].inverse() * X_W[0];
      EXPECT_LT((X.translation() - X_C[0].translation()).norm(), 1e-8) << pose_first << c;
      EXPECT_LT(rotation_distance(X.linear(), X_C[0].linear()), 1e-7) << pose_first << c;
    }
  }
}

TEST_F(ExportCorrection, SaysWhereEachEffectWentAndRefusesAnotherModelsOffsets) {
  std::ofstream(folder_ / "model.yaml") << R"(version: 1
effects:
  - {name: latency, parameters: {delay_ms: 40}}
  - {name: link_length, joint: r_elbow, parameters: {change_mm: 2}}
  - {name: focal_length, parameters: {scale_percent: 1}}
)";
  setup_.extended_model = folder_ / "model.yaml";
  write_summary();
  const auto refuse = [&](const char* words) {
    try {
      export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
      ADD_FAILURE() << "no error: " << words;
    } catch (const ConfigurationError& e) {
      EXPECT_THAT(e.what(), ::testing::HasSubstr(words));
    }
  };
  refuse("made without an extended model");
  const std::string made_with =
      R"(, "extended_model": [{"name": "latency", "parameters": [{"name": "delay", "unit": "ms", "value": 40.0}]},
      {"name": "link_length", "joint": "r_elbow",
       "parameters": [{"name": "change", "unit": "mm", "value": 2.0}]},
      {"name": "focal_length", "parameters": [{"name": "scale", "unit": "%", "value": 1.0}]}])";
  write_summary(made_with);
  export_correction(folder_ / "summary.json", setup_, rig_, folder_ / "out");
  const std::string text = content("out/what_was_applied.txt");
  EXPECT_THAT(text, ::testing::HasSubstr("link_length of r_elbow change 2 mm: in corrected.urdf"));
  EXPECT_THAT(text, ::testing::HasSubstr("focal_length scale 1 %: in cameras.yaml"));
  EXPECT_LT(text.find("cannot hold"), text.find("latency delay 40 ms"));
  // Beside corrected.urdf the extended model would apply the length twice.
  EXPECT_THAT(text, ::testing::HasSubstr("with the original URDF"));
  EXPECT_THAT(content("out/cameras.yaml"), ::testing::HasSubstr("fx: 259.9134"));
  EXPECT_THAT(content("out/offsets.yaml"), ::testing::HasSubstr("what_was_applied.txt"));

  std::ofstream(folder_ / "model.yaml") << "version: 1\neffects: []\n";
  refuse("another extended model");
  setup_.extended_model.clear();
  refuse("expected the same one here");
}

}  // namespace
}  // namespace bodyschema
