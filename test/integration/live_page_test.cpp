#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <regex>

#include "harness.hpp"

/// The live page as a viewer sees it: the daemon fed over LCM, a real browser without a screen.
namespace bodyschema::integration {
namespace {

using testing::HasSubstr;

constexpr Seconds kStart{60};

std::string browser() {
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    if (std::system((std::string("command -v ") + name + " >/dev/null 2>&1").c_str()) == 0) return name;
  }
  return "";
}

class LivePageInBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (browser().empty()) GTEST_SKIP() << "no Chromium is installed";
    static const std::string reason = why_no_lcm();
    if (!reason.empty()) GTEST_SKIP() << reason;
  }

  /// The page after two seconds of the browser's own time; a screenshot goes to `picture`.
  std::string look(const std::string& size, const std::string& picture = "") const {
    std::vector<std::string> command = {browser(), "--headless", "--no-sandbox", "--disable-gpu",
                                        "--disable-dev-shm-usage", "--virtual-time-budget=2000",
                                        "--window-size=" + size,
                                        "--user-data-dir=" + (scratch_ / "profile").string()};
    if (picture.empty()) {
      command.push_back("--dump-dom");
    } else {
      command.push_back("--screenshot=" + picture);
    }
    command.push_back("http://localhost:" + std::to_string(port_) + "/");
    Process chromium(command, scratch_.folder());
    EXPECT_EQ(chromium.wait(Seconds(120)), 0) << chromium.err();
    return chromium.out();
  }

  static int number(const std::string& dom, const std::string& before) {
    std::smatch match;
    return std::regex_search(dom, match, std::regex(before + "(-?[0-9]+)")) ? std::stoi(match[1]) : -1;
  }

  const std::string url_ = private_lcm_url();
  const int port_ = 33'000 + getpid() % 10'000;
  Scratch scratch_;
};

TEST_F(LivePageInBrowser, LoadsUpdatesAndShowsADeadCameraAsDead) {
  Process service({"bodyschemad", "--config", reach_configuration(), "-l", url_, "--page", std::to_string(port_)},
                  scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart)) << service.err();
  if (service.err().find("built without the live page") != std::string::npos) GTEST_SKIP() << service.err();
  const std::string nothing_yet = look("1200,900");
  EXPECT_THAT(nothing_yet, HasSubstr("no pictures yet on ICUB_CAMERAS"));
  EXPECT_THAT(nothing_yet, HasSubstr("left: no picture yet"));

  Robot robot(url_, reach_log());
  Listener listener(url_);
  EXPECT_TRUE(listener.wait_offsets(30, Seconds(60)));
  const std::string first = look("1200,900");
  const std::string second = look("1200,900");
  EXPECT_GT(number(first, "data-updates=\""), 3) << "the page asks again and again";
  EXPECT_GT(number(first, "data-sequence=\""), 0) << "there is a picture";
  EXPECT_GT(number(second, "data-sequence=\""), number(first, "data-sequence=\"")) << "and it changes";
  EXPECT_THAT(first, HasSubstr("r_wrist_prosup"));
  EXPECT_THAT(first, testing::Not(HasSubstr("class=\"camera dead\"")));

  robot.set_faults({.pictures = [](bot_core::images_t& pictures, LcmLink&) {
                      pictures.images.resize(1);  // the left one
                      pictures.image_types.resize(1);
                      pictures.n_images = 1;
                      return true;
                    },
                    .joints = {}});
  std::this_thread::sleep_for(std::chrono::seconds(4));
  const std::string dead = look("1200,900");
  EXPECT_THAT(dead, HasSubstr("class=\"camera dead\""));
  EXPECT_THAT(dead, HasSubstr("right: no picture for"));
  EXPECT_THAT(dead, testing::Not(HasSubstr("left: no picture")));

  // For people to judge, where a folder is named.
  if (const char* folder = std::getenv("BODYSCHEMA_SCREENSHOTS")) {
    look("1200,1500", std::string(folder) + "/dead_camera.png");
    robot.set_faults({});
    std::this_thread::sleep_for(std::chrono::seconds(5));
    look("1200,1500", std::string(folder) + "/wide.png");
    look("500,2400", std::string(folder) + "/phone.png");
  }
  service.signal(SIGTERM);
  EXPECT_EQ(service.wait(Seconds(10)), 0);
}

TEST_F(LivePageInBrowser, PortInUseIsOneClearError) {
  Process first({"bodyschemad", "--config", reach_configuration(), "-l", url_, "--page", std::to_string(port_)},
                scratch_.folder());
  ASSERT_TRUE(first.said("waiting for", kStart));
  Process second({"bodyschemad", "--config", reach_configuration(), "-l", url_, "--page", std::to_string(port_)},
                 scratch_.folder());
  EXPECT_EQ(second.wait(kStart), 1);
  EXPECT_THAT(second.err(), HasSubstr("the live page cannot have port " + std::to_string(port_)));
}

}  // namespace
}  // namespace bodyschema::integration
