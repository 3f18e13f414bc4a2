#include "bodyschema/service/live_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "bodyschema/core/error.hpp"
#include "page_client.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;
using testing::Not;
using test::body;
using test::get;
using test::talk;
using testing::StartsWith;

class LivePageTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      page_ = std::make_unique<LivePage>(0, std::vector<std::string>{"left", "right"});
    } catch (const DeviceError& e) {
      GTEST_SKIP() << e.what();
    }
  }
  [[nodiscard]] int port() const { return page_->port(); }
  std::unique_ptr<LivePage> page_;
};

TEST_F(LivePageTest, ServesItsOwnFilesAndNothingElse) {
  for (const char* path : {"/", "/page.css", "/page.js", "/chart.js"}) {
    const std::string answer = get(port(), path);
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200")) << path;
    EXPECT_GT(body(answer).size(), 1000u) << path;
    EXPECT_THAT(answer, HasSubstr("Content-Security-Policy")) << path;
    EXPECT_THAT(answer, Not(HasSubstr("Access-Control-Allow-Origin"))) << path;
  }
  for (const char* path : {"/../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/page.js/../../x",
                           "/camera/9.jpg", "/camera/../state.json", "/camera/0.jpg/x", "/index.php", "/%00"}) {
    EXPECT_THAT(get(port(), path), testing::AnyOf(StartsWith("HTTP/1.1 404"), StartsWith("HTTP/1.1 400"))) << path;
  }
}

TEST_F(LivePageTest, RefusesOtherNamesAndOtherMethods) {
  EXPECT_THAT(get(port(), "/", "evil.example"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get(port(), "/state.json", "localhost.evil.example"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get(port(), "/", "127.0.0.1:8080"), StartsWith("HTTP/1.1 200"));
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    EXPECT_THAT(talk(port(), std::string(method) + " /state.json HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n"
                                                       "Connection: close\r\n\r\n"),
                StartsWith("HTTP/1.1 405"))
        << method;
  }
}

TEST_F(LivePageTest, SurvivesRequestsThatAreNone) {
  talk(port(), "\r\n\r\n");
  talk(port(), std::string(100'000, 'A'));
  talk(port(), "GET /" + std::string(100'000, 'a') + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  talk(port(), "POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n");
  talk(port(), "GET /state.json?since=99999999999999999999999 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  talk(port(), "GET /state.json?since=-1;DROP HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(get(port(), "/state.json"), StartsWith("HTTP/1.1 200"));
}

TEST_F(LivePageTest, ShowsEstimateStatusAndPictures) {
  EXPECT_FALSE(page_->wants_pictures(true)) << "nobody has asked yet";
  Estimate estimate;
  estimate.joint_names = {"elbow"};
  estimate.offset_rad = Eigen::VectorXd::Constant(1, 0.1);
  estimate.covariance_rad2 = Eigen::MatrixXd::Constant(1, 1, 1e-4);
  estimate.contour_rms_px = 0.4;
  page_->add(estimate);
  page_->add(estimate);  // too soon after the first
  offsets_status_t status{};
  status.level = offsets_status_t::WARN;
  status.sentence = "hand not in view <script>";
  page_->set_status(status);

  auto json = nlohmann::json::parse(body(get(port(), "/state.json")));
  ASSERT_EQ(json["history"].size(), 1u);
  EXPECT_NEAR(json["history"][0]["offset_deg"][0].get<double>(), 5.7296, 1e-3);
  EXPECT_NEAR(json["history"][0]["sd_deg"][0].get<double>(), 0.57296, 1e-4);
  EXPECT_EQ(json["joints"][0], "elbow");
  EXPECT_EQ(json["history"][0]["state"], "hand_not_in_view");
  EXPECT_EQ(json["status"]["level"], "WARN");
  EXPECT_EQ(json["status"]["sentence"], "hand not in view <script>");
  EXPECT_EQ(json["cameras"][1]["name"], "right");
  EXPECT_LT(json["cameras"][1]["age_s"].get<double>(), 0.0) << "no picture yet";
  const auto newest = json["history"][0]["sequence"].get<int>();
  json = nlohmann::json::parse(body(get(port(), "/state.json?since=" + std::to_string(newest))));
  EXPECT_TRUE(json["history"].empty()) << "the viewer has it already";

  EXPECT_THAT(get(port(), "/camera/0.jpg"), StartsWith("HTTP/1.1 404"));
  EXPECT_TRUE(page_->wants_pictures(true));
  Image image(64, 48, 3);
  BinaryMask mask(64, 48);
  page_->set_pictures({{0, image, mask, mask, true}});
  EXPECT_TRUE(nlohmann::json::parse(body(get(port(), "/state.json")))["cameras"][0]["frozen"].get<bool>());
  EXPECT_FALSE(page_->wants_pictures(true)) << "at a bounded rate";
  const std::string jpeg = body(get(port(), "/camera/0.jpg"));
  EXPECT_THAT(jpeg, StartsWith("\xFF\xD8\xFF"));
  EXPECT_EQ(jpeg, body(get(port(), "/camera/0.jpg")));
}

TEST_F(LivePageTest, ManyViewersAtOnceWhileTheEstimatorWrites) {
  Estimate estimate;
  estimate.joint_names = {"elbow"};
  estimate.offset_rad = Eigen::VectorXd::Zero(1);
  estimate.covariance_rad2 = Eigen::MatrixXd::Zero(1, 1);
  std::atomic<int> good{0};
  {
    std::vector<std::jthread> viewers;
    for (int viewer = 0; viewer < 8; ++viewer) {
      viewers.emplace_back([&] {
        for (int i = 0; i < 10; ++i) {
          good += get(port(), "/state.json").starts_with("HTTP/1.1 200") ? 1 : 0;
          get(port(), "/camera/0.jpg");
        }
      });
    }
    for (int i = 0; i < 100; ++i) {
      page_->add(estimate);
      page_->set_pictures({{0, Image(64, 48, 1), BinaryMask(64, 48), BinaryMask(64, 48), false}});
      page_->set_status(offsets_status_t{});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  EXPECT_EQ(good, 80);
}

TEST_F(LivePageTest, PortInUseIsAClearError) {
  try {
    const LivePage second(port(), {"left"});
    FAIL() << "two pages share a port";
  } catch (const DeviceError& e) {
    EXPECT_THAT(e.what(), HasSubstr("cannot have port " + std::to_string(port())));
  }
}

}  // namespace
}  // namespace bodyschema
