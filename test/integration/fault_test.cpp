#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <Eigen/Core>
#include <cmath>
#include <deque>
#include <limits>
#include <nlohmann/json.hpp>
#include <fstream>
#include <random>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/service/health.hpp"
#include "harness.hpp"

/// Faults of the world, each provoked on the real daemon: what the status says, how long it takes
/// to say it, how long after the fault all is well again, and whether the estimates published
/// meanwhile were honest: close to the truth by their own account, or marked as not to be relied on.
namespace bodyschema::integration {
namespace {

using bot_core::images_t;
using bot_core::joint_state_t;
using Clock = std::chrono::steady_clock;

constexpr Seconds kStart{60};
constexpr double kSpeed = 0.5;  // of real time: fifteen frames a second, for slow machines

/// Offsets hidden in the reach's encoders, rad by joint.
std::map<std::string, double> true_offsets() {
  std::map<std::string, double> offsets;
  const auto json = nlohmann::json::parse(std::ifstream(reach_truth()));
  for (const auto& [name, value] : json.at("offsets_deg").items()) offsets[name] = radians(value.get<double>());
  return offsets;
}

struct Fault {
  std::string name;
  Robot::Faults faults;
  std::string words;  ///< of the status sentence, while it lasts
  HealthLevel level = HealthLevel::kWarn;
  double notice_s = 5.0;    ///< the sentence must come within
  double recover_s = 10.0;  ///< estimates must be good again within, after the end of the fault
};

class World : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string reason = why_no_lcm();
    if (!reason.empty()) GTEST_SKIP() << reason;
    reach_log();
  }

  static bool good(const offsets_status_t& status) {
    return status.state == "converged" && status.level <= offsets_status_t::WARN && status.frame_rate_hz > 1.0;
  }

  /// Frames shed because the machine is too busy say nothing about a fault, and hide what does.
  static bool too_slow(const Listener& listener) {
    for (const auto& status : listener.statuses()) {
      for (std::size_t i = 0; i < status.counter_name.size(); ++i) {
        if (status.counter_name[i] == "shed.queue" && status.counter_value[i] > 0) return true;
      }
    }
    return false;
  }
  static constexpr const char* kTooSlow = "this machine is too slow or too busy: frames are shed without any fault";

  /// Starts daemon and robot, waits for good estimates, provokes, heals.
  void suffer(const Fault& fault, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"bodyschemad", "--config", reach_configuration(), "-l", url_};
    command.insert(command.end(), more.begin(), more.end());
    Process service(command, scratch_.folder());
    ASSERT_TRUE(service.said("waiting for", kStart)) << service.err();
    Listener listener(url_);
    Robot robot(url_, reach_log(), kSpeed);
    const bool going = listener.wait_status(good, Seconds(30)).has_value();
    if (too_slow(listener)) GTEST_SKIP() << kTooSlow;
    ASSERT_TRUE(going) << "never got going";

    robot.set_faults(fault.faults);
    const auto begin = Clock::now();
    const auto noticed = listener.wait_status(
        [&](const offsets_status_t& status) {
          return status.sentence.find(fault.words) != std::string::npos &&
                 status.level == static_cast<int>(fault.level);
        },
        Seconds(fault.notice_s));
    const double notice_s = Seconds(Clock::now() - begin).count();
    std::string said;
    for (const auto& status : listener.statuses()) {
      said += std::string("\n  ") + to_string(static_cast<HealthLevel>(status.level)) + ": " + status.sentence;
    }
    if (!noticed && too_slow(listener)) GTEST_SKIP() << kTooSlow;
    ASSERT_TRUE(noticed) << "expected \"" << fault.words << "\", the status said:" << said;

    robot.set_faults({});
    const auto end = Clock::now();
    // A status that was composed during the fault may still be on its way: two good ones in a row.
    int good_in_a_row = 0;
    const auto recovered = listener.wait_status(
        [&](const offsets_status_t& status) {
          const bool clear = good(status) && status.sentence.find(fault.words) == std::string::npos;
          good_in_a_row = clear ? good_in_a_row + 1 : 0;
          return good_in_a_row == 2;
        },
        Seconds(fault.recover_s + 2.0));
    const double recovery_s = std::max(0.0, Seconds(Clock::now() - end).count() - 1.0);
    if (!recovered && too_slow(listener)) GTEST_SKIP() << kTooSlow;
    ASSERT_TRUE(recovered) << "no good estimates " << fault.recover_s << " s after the fault; last: "
                           << listener.statuses().back().sentence;
    EXPECT_LE(recovery_s, fault.recover_s);
    EXPECT_TRUE(service.running());
    check_honest(listener.offsets());
    service.signal(SIGTERM);
    EXPECT_EQ(service.wait(Seconds(10)), 0);
    RecordProperty("notice_s", std::to_string(notice_s));
    RecordProperty("recovery_s", std::to_string(recovery_s));
    std::printf("%-28s noticed %4.1f s  right again %4.1f s  worst error of a converged estimate %.1f sd  \"%s\"\n",
                fault.name.c_str(), notice_s, recovery_s, worst_sd_, noticed->sentence.c_str());
  }

  /// Every estimate that says it has converged is near the truth: within 1 deg or five of its own sd
  /// in every joint.
  void check_honest(const std::vector<joint_offsets_t>& published) {
    const auto truth = true_offsets();
    for (const auto& message : published) {
      for (const double value : message.mean_rad) ASSERT_TRUE(std::isfinite(value));
      if (message.state != "converged") continue;
      for (std::size_t k = 0; k < message.mean_rad.size(); ++k) {
        const auto it = truth.find(message.joint_name[k]);
        const double error = std::abs(message.mean_rad[k] - (it == truth.end() ? 0.0 : it->second));
        const double sd = std::sqrt(message.covariance_rad2[k][k]);
        worst_sd_ = std::max(worst_sd_, error / sd);
        ASSERT_LE(error, std::max(5.0 * sd, radians(1.0)))
            << message.joint_name[k] << " at " << message.utime << ": " << degrees(error) << " deg off, says "
            << degrees(sd);
      }
    }
  }

  const std::string url_ = private_lcm_url();
  Scratch scratch_;
  double worst_sd_ = 0.0;
};

void keep_only(images_t& pictures, std::size_t which) {
  pictures.images = {pictures.images.at(which)};
  pictures.image_types = {pictures.image_types.at(which)};
  pictures.n_images = 1;
}

// --- cameras ---------------------------------------------------------------------------------------

TEST_F(World, CameraDiesAndReturns) {
  suffer({.name = "right camera dies",
          .faults = {.pictures = [](images_t& p, LcmLink&) { keep_only(p, 0); return true; }, .joints = {}},
          .words = "nothing from the right camera for"});
}

TEST_F(World, BothCamerasDie) {
  suffer({.name = "both cameras die",
          .faults = {.pictures = [](images_t&, LcmLink&) { return false; }, .joints = {}},
          .words = "no pictures on ICUB_CAMERAS for", .level = HealthLevel::kStale});
}

TEST_F(World, CameraFreezes) {
  std::vector<std::uint8_t> frozen;
  suffer({.name = "left camera freezes",
          .faults = {.pictures = [frozen](images_t& p, LcmLink&) mutable {
                       if (frozen.empty()) frozen = p.images[0].data;
                       p.images[0].data = frozen;
                       return true;
                     }, .joints = {}},
          .words = "the left camera has shown the same picture for", .notice_s = 15.0});
}

TEST_F(World, CamerasSwapped) {
  suffer({.name = "left and right swapped",
          .faults = {.pictures = [](images_t& p, LcmLink&) {
                       std::swap(p.images[0].data, p.images[1].data);
                       return true;
                     }, .joints = {}},
          .words = "diverged", .level = HealthLevel::kError, .notice_s = 10.0});
}

TEST_F(World, PicturesDoubled) {
  suffer({.name = "pictures twice",
          .faults = {.pictures = [](images_t& p, LcmLink& link) {
                       link.publish_message("ICUB_CAMERAS", 0, p);
                       return true;
                     }, .joints = {}},
          .words = "is there a second publisher on ICUB_CAMERAS?"});
}

TEST_F(World, SecondPublisherOfOtherPictures) {
  suffer({.name = "second publisher, clock behind",
          .faults = {.pictures = [](images_t& p, LcmLink& link) {
                       images_t other = p;
                       for (auto& image : other.images) {
                         image.utime -= 90'000;
                         std::fill(image.data.begin(), image.data.end(), std::uint8_t{90});
                       }
                       link.publish_message("ICUB_CAMERAS", 0, p);
                       link.publish_message("ICUB_CAMERAS", 0, other);
                       return false;
                     }, .joints = {}},
          .words = "is there a second publisher on ICUB_CAMERAS?"});
}

TEST_F(World, PicturesOutOfOrder) {
  std::optional<images_t> held;
  suffer({.name = "pictures out of order",
          .faults = {.pictures = [held](images_t& p, LcmLink& link) mutable {
                       if (!held) {
                         held = p;
                         return false;
                       }
                       link.publish_message("ICUB_CAMERAS", 0, p);
                       link.publish_message("ICUB_CAMERAS", 0, *held);
                       held.reset();
                       return false;
                     }, .joints = {}},
          .words = "out of order"});
}

TEST_F(World, PictureSizeJumps) {
  suffer({.name = "picture size jumps",
          .faults = {.pictures = [](images_t& p, LcmLink&) {
                       for (auto& image : p.images) {
                         image.width = 640;
                         image.height = 480;
                         image.row_stride = 3 * 640;
                         image.data.assign(3 * 640 * 480, 0);
                         image.size = static_cast<int>(image.data.size());
                       }
                       return true;
                     }, .joints = {}},
          .words = "a picture has not the size", .level = HealthLevel::kError});
}

TEST_F(World, PixelFormatJumps) {
  suffer({.name = "pixel format jumps",
          .faults = {.pictures = [](images_t& p, LcmLink&) {
                       for (auto& image : p.images) image.pixelformat = 0x12345678;
                       return true;
                     }, .joints = {}},
          .words = "the pixel format is not", .level = HealthLevel::kError});
}

TEST_F(World, LightsGoOff) {
  suffer({.name = "lights off",
          .faults = {.pictures = [](images_t& p, LcmLink&) {
                       for (auto& image : p.images) std::fill(image.data.begin(), image.data.end(), std::uint8_t{0});
                       return true;
                     }, .joints = {}},
          .words = "picture is black", .level = HealthLevel::kError});
}

TEST_F(World, HandLeavesTheView) {
  // The first pictures of the log show the background alone.
  LogReader log(reach_log());
  images_t empty;
  for (LogEvent event; log.next(event);) {
    if (event.channel != "ICUB_CAMERAS") continue;
    empty.decode(event.data.data(), 0, static_cast<int>(event.data.size()));
    break;
  }
  suffer({.name = "hand leaves the view",
          .faults = {.pictures = [empty](images_t& p, LcmLink&) {
                       for (std::size_t c = 0; c < p.images.size(); ++c) p.images[c].data = empty.images[c].data;
                       return true;
                     }, .joints = {}},
          .words = "hand not in view"});
}

// --- encoders --------------------------------------------------------------------------------------

TEST_F(World, EncodersStop) {
  suffer({.name = "encoders stop",
          .faults = {.pictures = {}, .joints = [](joint_state_t&, LcmLink&) { return false; }},
          .words = "no encoder readings on ICUB_JOINT_STATE for", .level = HealthLevel::kStale});
}

TEST_F(World, EncodersLate) {
  std::deque<joint_state_t> waiting;
  suffer({.name = "encoders 140 ms late",
          .faults = {.pictures = {}, .joints = [waiting](joint_state_t& j, LcmLink& link) mutable {
                       waiting.push_back(j);
                       while (j.utime - waiting.front().utime >= 140'000) {
                         link.publish_message("ICUB_JOINT_STATE", 0, waiting.front());
                         waiting.pop_front();
                       }
                       return false;
                     }},
          .words = "encoders late by 1"});
}

TEST_F(World, EncoderNotANumber) {
  suffer({.name = "encoder reports NaN",
          .faults = {.pictures = {}, .joints = [](joint_state_t& j, LcmLink&) {
                       j.joint_position[0] = std::numeric_limits<float>::quiet_NaN();
                       return true;
                     }},
          .words = "an encoder reports NaN", .level = HealthLevel::kError});
}

TEST_F(World, OneJointMissing) {
  suffer({.name = "one joint missing",
          .faults = {.pictures = {}, .joints = [](joint_state_t& j, LcmLink&) {
                       for (std::size_t k = 0; k < j.joint_name.size(); ++k) {
                         if (j.joint_name[k] == "r_elbow") j.joint_name[k] = "somebody_elses";
                       }
                       return true;
                     }},
          .words = "readings of r_elbow have stopped", .level = HealthLevel::kError});
}

TEST_F(World, EncoderJumpsToAndFro) {
  int n = 0;
  suffer({.name = "encoder jumps by 60 deg",
          .faults = {.pictures = {}, .joints = [n](joint_state_t& j, LcmLink&) mutable {
                       for (std::size_t k = 0; k < j.joint_name.size(); ++k) {
                         if (j.joint_name[k] == "r_elbow" && n++ / 2 % 2 == 0) j.joint_position[k] += 1.05f;
                       }
                       return true;
                     }},
          .words = "the encoder of r_elbow jumped"});
}

// --- the rest --------------------------------------------------------------------------------------

TEST_F(World, ClockStepsBack) {
  const auto back = [](auto& message) { message.utime -= 3'600'000'000; };
  suffer({.name = "clock steps back an hour",
          .faults = {.pictures = [back](images_t& p, LcmLink&) {
                       back(p);
                       for (auto& image : p.images) back(image);
                       return true;
                     },
                     .joints = [back](joint_state_t& j, LcmLink&) {
                       back(j);
                       return true;
                     }},
          .words = "the clock of the time stamps stepped back"});
}

TEST_F(World, EveryFifthPacketLost) {
  auto random = std::make_shared<std::mt19937>(5);
  const auto lost = [random](int packets) {
    for (int i = 0; i < packets; ++i) {
      if ((*random)() % 5 == 0) return true;
    }
    return false;
  };
  // One packet of a message lost is the message lost; pictures travel in several. There is nothing
  // to say about it but what comes of it: estimates go on at a lower rate.
  Process service({"bodyschemad", "--config", reach_configuration(), "-l", url_}, scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Listener listener(url_);
  Robot robot(url_, reach_log(), kSpeed);
  const bool going = listener.wait_status(good, Seconds(30)).has_value();
  if (too_slow(listener)) GTEST_SKIP() << kTooSlow;
  ASSERT_TRUE(going);
  robot.set_faults({.pictures = [lost](images_t&, LcmLink&) { return !lost(8); },
                    .joints = [lost](joint_state_t&, LcmLink&) { return !lost(1); }});
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const std::size_t before = listener.offsets().size();
  EXPECT_TRUE(listener.wait_offsets(before + 8, Seconds(20)));
  EXPECT_TRUE(listener.wait_status(good, Seconds(10)));
  check_honest(listener.offsets());
}

TEST_F(World, DiskFull) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "this machine has no /dev/full";
  Process service({"bodyschemad", "--config", reach_configuration(), "-l", url_, "--record", "/dev/full"},
                  scratch_.folder());
  ASSERT_TRUE(service.said("waiting for", kStart));
  Listener listener(url_);
  Robot robot(url_, reach_log(), kSpeed);
  const auto told = listener.wait_status(
      [](const offsets_status_t& s) { return s.sentence.find("recording has ended: /dev/full") != std::string::npos; },
      Seconds(40));
  if (!told && too_slow(listener)) GTEST_SKIP() << kTooSlow;
  ASSERT_TRUE(told);
  EXPECT_EQ(told->state, "converged") << "estimating goes on";
  EXPECT_EQ(told->level, offsets_status_t::WARN);
}

}  // namespace
}  // namespace bodyschema::integration
