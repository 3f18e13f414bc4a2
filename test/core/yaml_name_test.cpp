#include "bodyschema/core/yaml_name.hpp"

#include <gtest/gtest.h>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {
namespace {

TEST(YamlName, IsReadBackAsItWas) {
  for (const std::string name :
       {"r_elbow", "a: b", "*j", "-x", "say \"no\"", "back\\slash", "# 1", "7", "two words", "null", "yes", ".5"}) {
    const auto yaml = Configuration::parse("names:\n  " + yaml_name(name) + ": " + yaml_name(name) + "\n");
    EXPECT_EQ(yaml.section("names").text(name), name);
  }
}

TEST(YamlName, StandsPlainWhereItCan) {
  EXPECT_EQ(yaml_name("../meshes/arm-7.urdf"), "../meshes/arm-7.urdf");
  EXPECT_EQ(yaml_name("7"), "\"7\"") << "else others read a number";
  EXPECT_EQ(yaml_name("null"), "\"null\"");
}

}  // namespace
}  // namespace bodyschema
