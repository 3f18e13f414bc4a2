#include "bodyschema/core/configuration.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class Action>
std::string error_of(Action action) {
  try {
    action();
  } catch (const ConfigurationError& e) {
    return e.what();
  }
  return "";
}

class ConfigurationFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() / ("bodyschema_configuration_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(directory_ / name) << text;
    return directory_ / name;
  }
  std::filesystem::path directory_;
};

TEST(Configuration, ReadsTypesAndDefaults) {
  const auto c =
      Configuration::parse("filter: {particles: 200, spread_deg: 3.5, on: yes}\nnames: [a, b]\nk: [1, 2.5]\n");
  EXPECT_EQ(c.section("filter").integer("particles", 1, 1000), 200);
  EXPECT_DOUBLE_EQ(c.section("filter").number("spread_deg"), 3.5);
  EXPECT_TRUE(c.section("filter").boolean("on"));
  EXPECT_EQ(c.texts("names"), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(c.numbers("k"), (std::vector<double>{1.0, 2.5}));
  EXPECT_DOUBLE_EQ(c.section("absent").number_or("x", 0.25), 0.25);
  EXPECT_EQ(c.choice_or("engine", "auto", {"auto", "atlas"}), "auto");
  c.reject_unknown_keys();
  EXPECT_THAT(c.print(), AllOf(HasSubstr("x: 0.25"), HasSubstr("particles: 200")));
}

TEST(Configuration, UnknownKeyNamesTheNearestValidOne) {
  const auto c = Configuration::parse("filter:\n  particels: 200\n");
  (void)c.section("filter").integer_or("particles", 100, 1, 1000);
  (void)c.section("filter").number_or("alpha", 500);
  EXPECT_THAT(error_of([&] { c.reject_unknown_keys(); }),
              AllOf(HasSubstr("configuration.yaml:2"), HasSubstr("'filter.particels'"),
                    HasSubstr("did you mean 'filter.particles'?")));
}

TEST(Configuration, UnknownSectionIsNamedItself) {
  const auto c = Configuration::parse("filtr:\n  particles: 200\n");
  (void)c.section("filter").integer_or("particles", 100, 1, 1000);
  EXPECT_THAT(error_of([&] { c.reject_unknown_keys(); }),
              AllOf(HasSubstr("'filtr'"), HasSubstr("did you mean 'filter'?")));
}

TEST(Configuration, WrongTypeAndRangeSayWhatWasExpected) {
  const auto c = Configuration::parse("a: {n: abc, r: 7, e: maybe, l: 3, s: [x], inf: .inf}\n");
  const auto a = c.section("a");
  EXPECT_THAT(error_of([&] { (void)a.integer("n", 1, 10); }),
              AllOf(HasSubstr("'a.n' is 'abc'"), HasSubstr("a whole number from 1 to 10")));
  EXPECT_THAT(error_of([&] { (void)a.number("r", 0, 5); }), AllOf(HasSubstr("'7'"), HasSubstr("a number from 0 to 5")));
  EXPECT_THAT(error_of([&] {
                (void)a.choice("e", {"atlas", "contour", "auto"});
              }),
              HasSubstr("expected atlas, contour or auto"));
  EXPECT_THAT(error_of([&] { (void)a.numbers("l"); }), HasSubstr("a list of numbers"));
  EXPECT_THAT(error_of([&] { (void)a.number("s"); }), HasSubstr("is a list"));
  EXPECT_THAT(error_of([&] { (void)a.number("inf"); }), HasSubstr("expected a number"));
  EXPECT_THAT(error_of([&] { (void)a.number("gone"); }), HasSubstr("'a.gone' is missing"));
}

// A joint may be called finger.1.
TEST(Configuration, EveryNameOfAMappingIsReadWhole) {
  const auto c = Configuration::parse(
      "robot:\n  fixed: {finger.1: 1, finger: 2, 1: 3, a..b: 4, .x.: 5, '': 6}\n  folders: {left.eye: {state.o: 7}}\n");
  const auto robot = c.section("robot");
  const auto fixed = robot.section("fixed");
  EXPECT_THAT(fixed.keys(), ElementsAre("finger.1", "finger", "1", "a..b", ".x.", ""));
  double expected = 1.0;
  for (const auto& name : fixed.keys()) EXPECT_EQ(fixed.number(name), expected++) << name;
  EXPECT_EQ(robot.section("folders").section("left.eye").number("state.o"), 7.0);
  EXPECT_EQ(fixed.number_or("thumb.1", 8.0), 8.0);
  EXPECT_THAT(c.print(), HasSubstr("thumb.1: 8"));
  EXPECT_NO_THROW(c.reject_unknown_keys());
  EXPECT_THAT(error_of([&] { (void)fixed.number("finger.2"); }), HasSubstr("'robot.fixed.finger.2' is missing"));
}

TEST_F(ConfigurationFiles, AnOverrideMeansTheLongestNameThatIsThere) {
  const auto file = write("a.yaml", "fixed: {finger.1: 1, finger.1.tip: 2, finger: {1: 3}}\n");
  const auto fixed =
      Configuration::load(file, {"fixed.finger.1=4", "fixed.finger.1.tip=5", "fixed.thumb.1=6"}).section("fixed");
  EXPECT_EQ(fixed.number("finger.1"), 4.0);
  EXPECT_EQ(fixed.number("finger.1.tip"), 5.0);
  EXPECT_EQ(fixed.section("finger").number("1"), 3.0);
  EXPECT_EQ(fixed.section("thumb").number("1"), 6.0);
}

TEST_F(ConfigurationFiles, AKeysPlaceIsItsFileAndLine) {
  write("robot.yaml", "robot:\n  hand: a\n");
  const auto file = write("top.yaml", "include: robot.yaml\n");
  const auto robot = Configuration::load(file, {"robot.head=b"}).section("robot");
  EXPECT_EQ(robot.place("hand"), (directory_ / "robot.yaml").string() + ":2: key 'robot.hand'");
  EXPECT_EQ(robot.place("head"), "--set robot.head=b: key 'robot.head'");
  EXPECT_EQ(robot.place("none"), file.string() + ": key 'robot.none'");
}

TEST(Configuration, SectionsThatNoProgramReadsAreRefusedByName) {
  EXPECT_NO_THROW(Configuration::parse("version: 1\nrobot: {a: 1}\nsimulator: {b: 2}\n").reject_unknown_sections());
  EXPECT_THAT(error_of([] { Configuration::parse("robot: {}\nbuss: {x: 1}\n").reject_unknown_sections(); }),
              HasSubstr("configuration.yaml:2: unknown key 'buss'; did you mean 'bus'?"));
}

TEST(Configuration, OfEveryShippedFileTheSectionsAreKnown) {
  int files = 0;
  const auto folder = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    EXPECT_NO_THROW(Configuration::load(entry.path()).reject_unknown_sections()) << entry.path();
  }
  EXPECT_GT(files, 10);
}

TEST(Configuration, AnotherVersionIsRefused) {
  EXPECT_NO_THROW(Configuration::parse("version: 1\n").reject_unknown_keys());
  EXPECT_THAT(error_of([] { Configuration::parse("version: 2\n"); }),
              AllOf(HasSubstr("'version' is '2'"), HasSubstr("expected 1")));
}

TEST_F(ConfigurationFiles, AnotherVersionIsRefusedInAnIncludedFileToo) {
  write("old.yaml", "version: 2\nrobot: {hand: a}\n");
  write("middle.yaml", "include: old.yaml\nversion: 1\n");
  const auto top = write("top.yaml", "include: middle.yaml\nversion: 1\n");
  EXPECT_THAT(error_of([&] { Configuration::load(top); }),
              AllOf(HasSubstr("old.yaml:1: key 'version' is '2'"), HasSubstr("expected 1")));
}

TEST(Configuration, DuplicateKeysAndBrokenYamlAreErrorsWithLines) {
  EXPECT_THAT(error_of([] { Configuration::parse("a: 1\nb: 2\na: 3\n"); }),
              AllOf(HasSubstr(":3"), HasSubstr("given twice")));
  EXPECT_THAT(error_of([] { Configuration::parse("a: [1, 2\n"); }), HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of([] { Configuration::parse("- a\n"); }), HasSubstr("expected a mapping"));
}

// Found by fuzz_yaml: yaml-cpp's own exception escaped.
TEST(Configuration, AMappingWithinAListIsOneClearError) {
  for (const char* text : {"a: [b, {c: d}]", "a: [b: c]", "a: [[{b: {c: [d]}}]]"}) {
    const Configuration c = Configuration::parse(text);
    EXPECT_NE(error_of([&] { (void)c.texts("a"); }).find("expected a list of texts"), std::string::npos) << text;
  }
}

TEST(Configuration, AliasBombIsRefused) {
  std::string text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 8; ++i) {
    const std::string previous = "*a" + std::to_string(i - 1);
    text += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) text += (k ? ", " : "") + previous;
    text += "]\n";
  }
  EXPECT_THAT(error_of([&] { Configuration::parse(text); }), HasSubstr("too many"));
}

TEST_F(ConfigurationFiles, IncludesOverridesAndPathsResolve) {
  std::filesystem::create_directories(directory_ / "sub");
  write("sub/robot.yaml", "robot: {urdf: a.urdf, scale: 1}\n");
  const auto file = write("top.yaml", "include: [sub/robot.yaml]\nrobot: {scale: 2}\n");
  const auto c = Configuration::load(file, {"robot.scale=3", "new.key=[1, 2]"});
  EXPECT_DOUBLE_EQ(c.section("robot").number("scale"), 3.0);
  EXPECT_EQ(c.section("robot").path("urdf"), directory_ / "sub" / "a.urdf");
  EXPECT_EQ(c.section("new").numbers("key").size(), 2u);
  EXPECT_EQ(Configuration::load(file).section("robot").number("scale"), 2.0);
}

TEST_F(ConfigurationFiles, InstalledFilesCanBeIncludedFromAnywhere) {
  std::filesystem::create_directories(directory_ / "share/config");
  std::filesystem::create_directories(directory_ / "mine/config");
  write("share/config/defaults.yaml", "scale: 3\n");
  write("share/config/both.yaml", "scale: 3\n");
  write("mine/config/both.yaml", "scale: 4\n");
  setenv("BODYSCHEMA_SHARE", (directory_ / "share").c_str(), 1);
  EXPECT_EQ(Configuration::load(write("mine/a.yaml", "include: config/defaults.yaml\n")).number("scale"), 3.0);
  EXPECT_EQ(Configuration::load(write("mine/b.yaml", "include: config/both.yaml\n")).number("scale"), 4.0)
      << "a file beside the including one comes first";
  EXPECT_THAT(error_of([&] { Configuration::load(write("mine/c.yaml", "include: config/none.yaml\n")); }),
              HasSubstr("mine/config/none.yaml: no such configuration file"));
  unsetenv("BODYSCHEMA_SHARE");
}

TEST_F(ConfigurationFiles, IncludeCycleAndMissingFileAreErrors) {
  const auto file = write("a.yaml", "include: b.yaml\n");
  write("b.yaml", "include: a.yaml\n");
  EXPECT_THAT(error_of([&] { Configuration::load(file); }), HasSubstr("includes itself"));
  EXPECT_THAT(error_of([&] { Configuration::load(directory_ / "none.yaml"); }),
              AllOf(HasSubstr("none.yaml"), HasSubstr("no such configuration file")));
  EXPECT_THAT(error_of([&] { Configuration::load(write("c.yaml", "x: 1\n"), {"novalue"}); }),
              HasSubstr("key.key=value"));
}

TEST(Configuration, EnvironmentIsSubstituted) {
  setenv("BODYSCHEMA_TEST_DIRECTORY", "/data", 1);
  const auto c = Configuration::parse(
      "a: ${BODYSCHEMA_TEST_DIRECTORY}/x\nb: ${BODYSCHEMA_TEST_NONE:-y}/z\nc: ${BODYSCHEMA_TEST_NONE}\n");
  EXPECT_EQ(c.text("a"), "/data/x");
  EXPECT_EQ(c.text("b"), "y/z");
  EXPECT_THAT(error_of([&] { (void)c.text("c"); }),
              AllOf(HasSubstr("configuration.yaml:3: key 'c': environment variable BODYSCHEMA_TEST_NONE is not set"),
                    HasSubstr("'${BODYSCHEMA_TEST_NONE}'")));
}

TEST(Configuration, HashFollowsContent) {
  const auto a = Configuration::parse("x: 1\n");
  const auto b = Configuration::parse("x: 2\n");
  EXPECT_NE(a.hash(), b.hash());
  EXPECT_EQ(a.hash(), Configuration::parse("x:   1 # comment\n").hash());
}

}  // namespace
}  // namespace bodyschema
