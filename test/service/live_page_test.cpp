#include "bodyschema/service/live_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ifaddrs.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "bodyschema/core/error.hpp"
#include "page_client.hpp"

namespace bodyschema {
namespace {

using namespace std::chrono_literals;
using test::body;
using test::get;
using test::PageClient;
using test::talk;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using Clock = std::chrono::steady_clock;

double resident_mib() {
  std::ifstream pages("/proc/self/statm");
  double size = 0.0, resident = 0.0;
  pages >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

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
  const std::string end = " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  // Refused within the time that a request may take; who sends more than is read may find the
  // connection reset before he sees why.
  const auto refused = [&](const std::string& request, const std::string& status) {
    const auto from = Clock::now();
    const std::string answer = talk(port(), request);
    EXPECT_LT(Clock::now() - from, 4s) << request.substr(0, 40);
    EXPECT_THAT(answer, testing::AnyOf(StartsWith("HTTP/1.1 " + status), "")) << request.substr(0, 40);
    return answer;
  };
  EXPECT_NE(refused("\r\n\r\n", "400"), "");
  EXPECT_NE(refused("GET\r\n\r\n", "400"), "");
  EXPECT_NE(refused("GET / HTTP/9.9\r\nHost: localhost\r\n\r\n", "400"), "");
  EXPECT_NE(refused("GET /\n\nHost: localhost\r\n\r\n", "400"), "");
  EXPECT_NE(refused("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n", "40"), "");
  EXPECT_NE(refused("GET / HTTP/1.1\r\n\r\n", "40"), "");
  EXPECT_NE(refused("GET http://localhost/" + end, "404"), "");
  EXPECT_NE(refused("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n", "405"), "");
  refused(std::string(100'000, 'A'), "431");
  refused("GET /" + std::string(100'000, 'a') + end, "431");
  refused("GET /?" + std::string(8192 - 6 - end.size() + 1, 'a') + end, "431");
  EXPECT_THAT(talk(port(), "GET /?" + std::string(8192 - 6 - end.size(), 'a') + end), StartsWith("HTTP/1.1 200"))
      << "8 KiB are read";
  for (const char* since : {"99999999999999999999999", "-1;DROP", "", "0x10"}) {
    EXPECT_THAT(get(port(), std::string("/state.json?since=") + since), StartsWith("HTTP/1.1 200")) << since;
  }
}

TEST_F(LivePageTest, AnswersHeadWithoutABody) {
  const std::string whole = get(port(), "/page.js");
  const std::string head = talk(port(), "HEAD /page.js HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_THAT(head, HasSubstr("Content-Length: " + std::to_string(body(whole).size())));
  EXPECT_EQ(body(head), "");
}

TEST_F(LivePageTest, ServesLocalhostAndNoOtherAddressOfThisMachine) {
  ASSERT_TRUE(PageClient(port()).is_open());
  std::vector<in_addr_t> others = {inet_addr("127.0.0.2")};
  ifaddrs* interfaces = nullptr;
  ASSERT_EQ(getifaddrs(&interfaces), 0);
  for (const ifaddrs* at = interfaces; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    const in_addr_t address = reinterpret_cast<const sockaddr_in*>(at->ifa_addr)->sin_addr.s_addr;
    if (address != htonl(INADDR_LOOPBACK)) others.push_back(address);
  }
  freeifaddrs(interfaces);
  for (const in_addr_t address : others) {
    EXPECT_FALSE(PageClient(port(), 1s, address).is_open()) << inet_ntoa(in_addr{address});
  }
}

TEST_F(LivePageTest, RangesDoNotMultiplyAnAnswer) {
  const std::string whole = get(port(), "/chart.js");
  std::string ranges = "bytes=0-";
  for (int i = 0; i < 500; ++i) ranges += ",0-";
  const std::string answer = talk(port(), "GET /chart.js HTTP/1.1\r\nHost: localhost\r\nRange: " + ranges + "\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(answer.size(), whole.size());
}

TEST_F(LivePageTest, ALineWithoutEndIsCutEarly) {
  const double before_mib = resident_mib();
  PageClient client(port());
  const std::string megabyte(1 << 20, 'A');
  int taken = 0;
  while (taken < 50 && client.send(megabyte)) ++taken;
  // What is sent waits in the system's socket buffers, read or not.
  EXPECT_LT(taken, 12) << "MiB were taken";
#ifdef __SANITIZE_THREAD__
  constexpr double kBytesForEach = 5.0;  // four of them TSan's own account
#else
  constexpr double kBytesForEach = 1.0;
#endif
  EXPECT_LT(resident_mib() - before_mib, 4.0 * kBytesForEach);
  EXPECT_THAT(get(port(), "/state.json"), StartsWith("HTTP/1.1 200"));
}

TEST_F(LivePageTest, AClientThatDribblesIsCutAndHoldsUpNobody) {
  PageClient slow(port());
  ASSERT_TRUE(slow.send("GET / HTTP/1.1\r\nHost: localhost\r\nX: "));
  const auto from = Clock::now();
  while (Clock::now() - from < 10s && slow.send("a")) {
    EXPECT_THAT(get(port(), "/page.css"), StartsWith("HTTP/1.1 200"));
    std::this_thread::sleep_for(100ms);
  }
  EXPECT_LT(Clock::now() - from, 5s) << "two seconds are allowed";
}

TEST_F(LivePageTest, FiveHundredConnectionsTakeFewDescriptorsAndNoLastingPlace) {
  const auto descriptors = [] { return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}); };
  const auto before = descriptors();
  std::vector<PageClient> idle;
  for (int i = 0; i < 500; ++i) idle.emplace_back(port(), 100ms);
  std::this_thread::sleep_for(200ms);
  EXPECT_LE(descriptors() - before, 500 + 32) << "500 of them are the clients'";
  const auto from = Clock::now();
  bool answered = false;
  while (!answered && Clock::now() - from < 20s) answered = get(port(), "/state.json").starts_with("HTTP/1.1 200");
  EXPECT_TRUE(answered) << "idle ones may stay two seconds";
}

TEST_F(LivePageTest, StopsWithinASecondWhateverItsClientsDo) {
  PageClient idle(port());
  PageClient does_not_read(port());
  does_not_read.send("GET /chart.js HTTP/1.1\r\nHost: localhost\r\n\r\n");
  std::atomic<bool> stopped{false};
  std::jthread dribbling([&stopped, to = port()] {
    PageClient client(to);
    client.send("GET / HTTP/1.1\r\nX: ");
    while (!stopped && client.send("a")) std::this_thread::sleep_for(50ms);
  });
  std::this_thread::sleep_for(200ms);
  const auto from = Clock::now();
  page_.reset();
  EXPECT_LT(Clock::now() - from, 1s);
  stopped = true;
}

TEST_F(LivePageTest, ShowsEstimateStatusAndPictures) {
  EXPECT_FALSE(page_->wants_pictures(true)) << "nobody has asked yet";
  Estimate estimate;
  estimate.joint_names = {"elbow"};
  estimate.offset_rad = Eigen::VectorXd::Constant(1, 0.1);
  estimate.covariance_rad2 = Eigen::MatrixXd::Constant(1, 1, 1e-4);
  estimate.contour_rms_px = 0.4;
  estimate.findings.blocks = 12;
  estimate.findings.causes.push_back({.effect = "latency",
                                      .joint = "",
                                      .source = "",
                                      .sentence = "pictures arrive 58 ms late",
                                      .parameters = {{"delay", "ms", 58.0, 0.5}},
                                      .z = 14.0});
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
  EXPECT_EQ(json["findings"]["blocks"], 12);
  ASSERT_EQ(json["findings"]["causes"].size(), 1u);
  EXPECT_EQ(json["findings"]["causes"][0]["sentence"], "pictures arrive 58 ms late");
  EXPECT_EQ(json["findings"]["causes"][0]["parameters"][0]["unit"], "ms");
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

/// The page's thread comes last on a busy machine: who waited for it would come last too.
TEST_F(LivePageTest, TheEstimatorWaitsForNoViewer) {
  offsets_status_t status{};
  status.sentence = std::string(1 << 20, 'x');  // so that it takes long to copy
  page_->set_status(status);
  Estimate estimate;
  estimate.joint_names = {"elbow"};
  estimate.offset_rad = Eigen::VectorXd::Zero(1);
  estimate.covariance_rad2 = Eigen::MatrixXd::Zero(1, 1);
  std::atomic<bool> seen{false};
  std::jthread viewer([&] {
    for (int i = 0; i < 10; ++i) talk(port(), "HEAD /state.json HTTP/1.1\r\nHost: localhost\r\n\r\n");
    seen = true;
  });
  const auto times_waited = [] {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
  };
  long waited = 0;
  while (!seen) {
    const long before = times_waited();
    page_->add(estimate);
    (void)page_->wants_pictures(true);
    page_->set_pictures({});
    waited += times_waited() - before;
    std::this_thread::sleep_for(100us);
  }
  EXPECT_LE(waited, 2) << "the memory of the process may be held up once";
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
