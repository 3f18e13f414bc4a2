#include "bodyschema/pipeline/truth.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bodyschema/core/error.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class TruthFile : public ::testing::Test {
 protected:
  TruthFile() : path_(std::filesystem::temp_directory_path() / ("truth_" + std::to_string(getpid()) + ".json")) {}
  ~TruthFile() override { std::filesystem::remove(path_); }
  Truth load(const std::string& text, const std::vector<std::string>& cameras = {"left", "right"}) {
    std::ofstream(path_) << text;
    return Truth::load(path_, cameras);
  }
  std::string error_of(const std::string& text) {
    try {
      load(text);
    } catch (const FileError& e) {
      return e.what();
    }
    return "";
  }
  std::filesystem::path path_;
};

const char* const kPose = "[[1,0,0,0.1],[0,1,0,0.2],[0,0,1,0.3],[0,0,0,1]]";

TEST_F(TruthFile, ReadsTheSimulatorsFrames) {
  const std::string frame = std::string(R"({"utime": 1000000, "hand_in_left_camera": )") + kPose +
                            R"(, "hand_in_right_camera": )" + kPose + R"(, "fingertips_in_hand_m": [[0,0,0.05]]})";
  const Truth truth = load(R"({"offsets_deg": {"r_elbow": -2}, "frames": [)" + frame + "]}");
  ASSERT_NE(truth.at(1'000'000), nullptr);
  EXPECT_DOUBLE_EQ(truth.at(1'000'000)->X_CP[1].translation().z(), 0.3);
  EXPECT_EQ(truth.at(1'000'000)->fingertips_P.size(), 1u);
  EXPECT_EQ(truth.at(2'000'000), nullptr) << "a second away there is no truth";
  ASSERT_EQ(truth.offsets().size(), 1u);
  EXPECT_DOUBLE_EQ(truth.offsets()[0].second, radians(-2.0));
}

TEST_F(TruthFile, ReadsARobotWithOneCamera) {
  const std::string text = std::string(R"({"frames": [{"utime": 1000000, "hand_in_right_camera": )") + kPose + "}]}";
  const Truth truth = load(text, {"right"});
  ASSERT_NE(truth.at(1'000'000), nullptr);
  ASSERT_EQ(truth.at(1'000'000)->X_CP.size(), 1u);
  EXPECT_DOUBLE_EQ(truth.at(1'000'000)->X_CP[0].translation().z(), 0.3);
  EXPECT_THAT(error_of(text), HasSubstr("hand_in_left_camera")) << "of a robot with two";
}

TEST_F(TruthFile, ErrorsNameTheFile) {
  EXPECT_THAT(error_of("{"), HasSubstr(path_.string()));
  EXPECT_THAT(error_of(R"({"frames": [{"utime": 1}]})"), HasSubstr("not a truth file"));
  EXPECT_THAT(error_of(R"({"frames": []})"), HasSubstr("holds no pose"));
  EXPECT_THROW(Truth::load("/nonexistent/truth.json"), FileError);
  std::filesystem::resize_file(path_, std::uintmax_t{4} << 30);  // without a byte on the disk
  EXPECT_THAT(
      [&] {
        Truth::load(path_, {"left", "right"});
      },
      ThrowsMessage<FileError>(HasSubstr("at most 1073741824 expected")));
}

TEST_F(TruthFile, TimesThatNoClockShows) {
  for (const char* time : {"1.6e+140", "-1e300", "9300000000000000", "18446744073709551615"}) {
    SCOPED_TRACE(time);
    const std::string poses =
        std::string(R"(, "hand_in_left_camera": )") + kPose + R"(, "hand_in_right_camera": )" + kPose;
    EXPECT_THAT(error_of(std::string(R"({"frames": [{"utime": )") + time + poses + "}]}"),
                AllOf(HasSubstr(path_.string()), HasSubstr("utime is "), HasSubstr("expected a time")));
    EXPECT_THAT(error_of(std::string(R"({"poses": [{"time_s": [0, )") + time + "]" + poses + "}]}"),
                HasSubstr("time_s is "));
  }
}

TEST(TruthOfTheRecording, HoldsSeventyThreePoses) {
  SKIP_WITHOUT("eyehand-sim");
  const Truth truth = Truth::load(data_folder() / "eyehand-sim/truth.json");
  EXPECT_EQ(truth.instants().size(), 73u);
  EXPECT_EQ(truth.fingers().size(), 5u);
  EXPECT_EQ(truth.offsets().size(), 7u);
  EXPECT_NEAR(degrees(truth.offsets()[5].second), -20.0, 1e-9);
}

}  // namespace
}  // namespace bodyschema
