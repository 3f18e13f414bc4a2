#include "bodyschema/effects/error_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "effects/roles.hpp"

namespace bodyschema {
namespace {

using test::instant;
using test::roles;
using testing::HasSubstr;
using testing::ThrowsMessage;

ErrorModel full_model() {
  ErrorModel model(roles());
  int n = 0;
  for (const auto& name : effect_names()) {
    auto& effect = model.add(name, effect_targets(name, model.roles()).back());
    for (auto& p : effect.parameters()) p.value = p.si_per_unit * (0.1 + 0.37 * ++n);
  }
  return model;
}

TEST(ErrorModel, ReadsBackWhatItWrote) {
  const auto model = full_model();
  const auto again = ErrorModel::parse(model.to_yaml(), roles());
  ASSERT_EQ(again.size(), model.size());
  for (std::size_t i = 0; i < model.size(); ++i) {
    EXPECT_EQ(again[i].description(), model[i].description());
    for (std::size_t p = 0; p < model[i].parameters().size(); ++p) {
      EXPECT_NEAR(again[i].parameters()[p].value, model[i].parameters()[p].value, 1e-13);
    }
  }
}

TEST(ErrorModel, ReadsBackHowWellItIsKnown) {
  ErrorModel model(roles());
  model.add("joint_offset", {"elbow", ""});
  model.add("latency", {}).parameters()[0].value = 0.05;
  model.add("focal_length", {});
  Eigen::Matrix3d covariance;
  covariance << 4e-4, 1e-5, 0.0, 1e-5, 1e-6, -2e-6, 0.0, -2e-6, 9e-6;
  model.set_uncertainty(
      {{{"focal_length", {}, 0}, {"latency", {}, 0}, {"joint_offset", {"elbow", ""}, 0}}, covariance});
  const auto text = model.to_yaml();
  EXPECT_THAT(text, HasSubstr("sd:\n      delay_ms: 1\n"));
  const auto again = ErrorModel::parse(text, roles()).uncertainty();
  ASSERT_EQ(again.parameters.size(), 3u);
  EXPECT_EQ(again.parameters[0].effect, "joint_offset") << "in the order of the file";
  EXPECT_EQ(again.parameters[2].effect, "focal_length");
  const Eigen::Matrix3d reversed = covariance.reverse();
  EXPECT_LT((again.covariance - reversed).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_TRUE(full_model().uncertainty().parameters.empty()) << "who names none takes it for exact";
}

TEST(ErrorModel, RefusesAnUncertaintyThatIsNone) {
  const std::string head = "version: 1\neffects:\n  - name: latency\n    parameters: {delay_ms: 1}\n    sd: ";
  const auto refused = [](const std::string& yaml, const char* what) {
    EXPECT_THAT([&] { ErrorModel::parse(yaml, roles()); }, ThrowsMessage<ConfigurationError>(HasSubstr(what))) << yaml;
  };
  refused(head + "{delay_ms: -1}\n", "expected 0 or more");
  refused(head + "{delay: 1}\n", "did you mean 'delay_ms'?");
  refused(head + "1\n", "expected a mapping");
  const std::string two = head + "{delay_ms: 1}\n  - name: focal_length\n    parameters: {scale_percent: 0}\n" +
                          "    sd: {scale_percent: 1}\ncorrelations: ";
  EXPECT_NO_THROW(ErrorModel::parse(two + "[[0.5]]\n", roles()));
  for (const char* wrong : {"1\n", "[]\n", "[[0.1, 0.2]]\n", "[[1.5]]\n", "[[a]]\n"}) {
    refused(two + wrong, wrong == std::string("[[a]]\n") ? "expected a finite number" : "expected 1 rows");
  }
  const std::string three = two.substr(0, two.find("correlations")) +
                            "  - name: mesh_scale\n    parameters: {scale_percent: 0}\n    sd: {scale_percent: 1}\n";
  refused(three + "correlations: [[0.9], [0.9, -0.9]]\n", "contradict each other");
  EXPECT_NO_THROW(ErrorModel::parse(head + "{delay_ms: 1}\ncorrelations: []\n", roles())) << "nothing is uncertain";
}

TEST(ErrorModel, CopiesAreIndependent) {
  auto model = full_model();
  auto copy = model;
  copy[0].parameters()[0].value = 42.0;
  EXPECT_NE(model[0].parameters()[0].value, 42.0);
  copy.remove("backlash", copy.find("backlash", {"w_yaw", ""})->target());
  EXPECT_EQ(copy.size() + 1, model.size());
}

TEST(ErrorModel, SumsEffectsAndOffsets) {
  ErrorModel model(roles());
  model.add("joint_offset", {"elbow", ""}).parameters()[0].value = radians(3.0);
  model.add("encoder_gain", {"elbow", ""}).parameters()[0].value = 0.02;
  auto at = instant(model.roles());
  at.q[9] = radians(50.0);
  Corrections c = model.roles().no_corrections();
  model.corrections(at, c);
  EXPECT_NEAR(degrees(c.dq[9]), -2.0, 1e-12);
  EXPECT_NEAR(degrees(model.offsets()[9]), 3.0, 1e-12);
}

TEST(ErrorModel, CorrectsIntrinsics) {
  ErrorModel model(roles());
  model.add("focal_length", {}).parameters()[0].value = 0.01;
  model.add("principal_point", {"", "right"}).parameters()[1].value = 2.0;
  model.add("distortion", {}).parameters()[0].value = 0.04;
  StereoRig rig;
  rig.cameras.resize(2);
  for (auto& camera : rig.cameras) camera.intrinsics = {320, 240, 257.0, 258.0, 159.5, 119.5};
  const auto corrected = model.corrected(rig);
  EXPECT_NEAR(corrected.cameras[0].intrinsics.fx, 259.57, 1e-9);
  EXPECT_NEAR(corrected.cameras[0].intrinsics.cy, 119.5, 1e-9);
  EXPECT_NEAR(corrected.cameras[1].intrinsics.cy, 121.5, 1e-9);
  EXPECT_NEAR(corrected.cameras[1].distortion[0], 0.04, 1e-12);
}

TEST(ErrorModel, SaysWhatIsWrongWithAFile) {
  const auto r = roles();
  const auto parse = [&](const std::string& text) { return [&r, text] { ErrorModel::parse(text, r, "x.yaml"); }; };
  EXPECT_THAT(parse("effects: []"), ThrowsMessage<ConfigurationError>(HasSubstr("version")));
  EXPECT_THAT(parse("version: 2"), ThrowsMessage<ConfigurationError>(HasSubstr("'2', expected 1")));
  EXPECT_THAT(parse("version: 1\nefects: []"),
              ThrowsMessage<ConfigurationError>(HasSubstr("x.yaml:2: unknown key 'efects'; did you mean 'effects'")));
  EXPECT_THAT(parse("[1, 2"), ThrowsMessage<ConfigurationError>(HasSubstr("not YAML")));
  const std::string head = "version: 1\neffects:\n- {name: backlash, joint: ";
  EXPECT_THAT(parse(head + "elbw, parameters: {width_deg: 1}}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("did you mean 'elbow'")));
  EXPECT_THAT(parse(head + "elbow, parameters: {width: 1}}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("did you mean 'width_deg'")));
  EXPECT_THAT(parse(head + "elbow, parameters: {}}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("expected parameter 'width_deg'")));
  EXPECT_THAT(parse(head + "elbow, parameters: {width_deg: .nan}}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("finite")));
  EXPECT_THAT(parse(head + "elbow}"), ThrowsMessage<ConfigurationError>(HasSubstr("parameters")));
  EXPECT_THAT(parse(head + "elbow, parameters: {width_deg: 1}}\n- {name: backlash, joint: elbow, "
                           "parameters: {width_deg: 1}}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("twice")));
  // A joint that the effect does not act on, and a source where there is none.
  const auto entry = [&](const std::string& what) { return parse("version: 1\neffects:\n- {" + what + "}"); };
  EXPECT_THAT(entry("name: link_length, joint: elbow, parameters: {change_mm: 2}"),
              ThrowsMessage<ConfigurationError>(
                  HasSubstr("x.yaml:3: link_length: joint is 'elbow', expected s_yaw or prosup")));
  EXPECT_THAT(entry("name: backlash, joint: index, parameters: {width_deg: 1}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("joint is 'index', expected s_pitch, s_roll, ")));
  EXPECT_THAT(entry("name: head_offset, joint: elbow, parameters: {angle_deg: 1}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("joint is 'elbow', expected neck_pitch, neck_roll, ")));
  EXPECT_THAT(entry("name: latency, source: x, parameters: {delay_ms: 40}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("x.yaml:3: latency: source is 'x', expected none")));
  EXPECT_THAT(entry("name: backlash, joint: elbow, source: s_yaw, parameters: {width_deg: 1}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("backlash: source is 's_yaw', expected none")));
  EXPECT_THAT(entry("name: joint_coupling, joint: elbow, source: thumb, parameters: {ratio_percent: 1}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("source is 'thumb', expected s_roll, s_yaw, ")));
  EXPECT_THAT(entry("name: joint_coupling, joint: elbow, parameters: {ratio_percent: 1}"),
              ThrowsMessage<ConfigurationError>(HasSubstr("source is '', expected s_roll, s_yaw, ")));
  // Of a coupling any two joints of the arm, though the diagnosis looks at near ones only.
  EXPECT_NO_THROW(entry("name: joint_coupling, joint: s_pitch, source: w_yaw, parameters: {ratio_percent: 1}")());
  EXPECT_THROW(ErrorModel::load("/nonexistent/x.yaml", r), ConfigurationError);
  const auto large = std::filesystem::temp_directory_path() / ("model_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(large) << "version: 1\n";
  std::filesystem::resize_file(large, std::uintmax_t{4} << 30);  // without a byte on the disk
  EXPECT_THAT([&] { ErrorModel::load(large, r); }, ThrowsMessage<FileError>(HasSubstr("at most 1048576 expected")));
  std::filesystem::remove(large);
}

}  // namespace
}  // namespace bodyschema
