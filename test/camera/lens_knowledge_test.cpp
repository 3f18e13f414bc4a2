#include "bodyschema/camera/lens_knowledge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

LensKnowledge of(const std::string& yaml) {
  return lens_knowledge(Configuration::parse("left: {link: l" + yaml + "}\n").section("left"));
}

TEST(LensKnowledge, IsWhatTheConfigurationSays) {
  EXPECT_EQ(of(""), LensKnowledge::kUnknown);
  EXPECT_EQ(of(", distortion: unknown"), LensKnowledge::kUnknown);
  EXPECT_EQ(of(", distortion: none"), LensKnowledge::kNone);
  EXPECT_EQ(of(", distortion: [0, 0, 0, 0, 0]"), LensKnowledge::kCalibrated);
  EXPECT_EQ(of(", distortion: [0, 0, 0, 0, 0.01]"), LensKnowledge::kCalibrated);
}

TEST(LensKnowledge, RefusesAnythingElse) {
  for (const char* yaml :
       {", distortion: straight", ", distortion: 0.1", ", distortion: [0, 0, 0, 0]", ", distortion: {k1: 0.1}"}) {
    EXPECT_THAT([&] { of(yaml); },
                testing::ThrowsMessage<ConfigurationError>(
                    testing::AllOf(testing::HasSubstr("left.distortion"), testing::HasSubstr("k1, k2, p1, p2, k3"))))
        << yaml;
  }
}

TEST(LensKnowledge, ALensNobodyCalibratedMayBendAsThoseOfWideViewsDo) {
  EXPECT_EQ(lens_sd(LensKnowledge::kNone), 0.0);
  EXPECT_GT(lens_sd(LensKnowledge::kCalibrated), 0.0);
  EXPECT_GT(2.0 * lens_sd(LensKnowledge::kUnknown), 0.3);
}

}  // namespace
}  // namespace bodyschema
