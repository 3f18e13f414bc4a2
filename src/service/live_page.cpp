#include "bodyschema/service/live_page.hpp"

#include "bodyschema/core/error.hpp"

#ifdef BODYSCHEMA_HAS_HTTPLIB

#include <httplib.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "bodyschema/core/clock.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/service/health.hpp"
#include "page_assets.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kHistoryPeriod_us = 400'000;
constexpr std::size_t kHistoryLength = 600;  // four minutes
constexpr std::int64_t kPicturePeriod_us = 200'000;
constexpr std::int64_t kPictureDue_us = 1'000'000;  // even when the estimator is never idle
constexpr std::int64_t kWatched_us = 3'000'000;     // since the last question of a viewer
constexpr std::size_t kThreads = 6;
constexpr int kJpegQuality = 85;
constexpr int kEnlargement = 2;
constexpr int kNice = 19;  // the least important, whatever the service itself was given

/// One row of the charts.
struct Moment {
  std::uint64_t sequence = 0;
  std::int64_t at_us = 0;  ///< monotonic
  std::string state{};     ///< of the estimator
  std::vector<double> offset_deg;
  std::vector<double> sd_deg;
  double contour_rms_px = 0.0;
  double likelihood = 0.0;
  double hand_sd_mm = 0.0;
};

struct Shown {
  std::string name;
  std::uint64_t sequence = 0;  ///< 0: no picture yet
  std::int64_t at_us = -1;
  CameraPicture picture{};
  std::uint64_t encoded_sequence = 0;
  std::string jpeg{};
};

/// A request that a browser sends on behalf of another site carries that site's name, and so does
/// one that was led here by a forged name (DNS rebinding).
bool from_this_machine(const httplib::Request& request) {
  std::string host = request.get_header_value("Host");
  if (const auto colon = host.rfind(':'); colon != std::string::npos && host.back() != ']') host.resize(colon);
  return host == "localhost" || host == "127.0.0.1" || host == "[::1]";
}

}  // namespace

struct LivePage::Impl {
  httplib::Server server;
  int port = 0;
  std::atomic<std::int64_t> asked_us{-kWatched_us};

  mutable std::mutex mutex;  ///< guards what follows; held for copies only, never while encoding
  std::vector<std::string> joints;
  std::deque<Moment> history;
  std::uint64_t next_sequence = 1;
  std::vector<Shown> cameras;
  std::int64_t pictures_us = -kPictureDue_us;
  offsets_status_t status{};
  std::int64_t status_us = -1;

  std::mutex encoding;  ///< one thread encodes, the others then find the result
  std::thread thread;   ///< last: everything else is there when it starts

  void start(int wanted_port) {
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    server.set_socket_options([](socket_t socket) {
      // Not SO_REUSEPORT, the library's default, with which two services share a port unnoticed.
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server.set_payload_max_length(1024);
    server.set_read_timeout(2, 0);
    server.set_write_timeout(2, 0);
    server.set_keep_alive_max_count(1);  // a thread belongs to nobody
    server.set_default_headers({{"X-Content-Type-Options", "nosniff"},
                                {"X-Frame-Options", "DENY"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cross-Origin-Resource-Policy", "same-origin"},
                                {"Cache-Control", "no-store"},
                                {"Content-Security-Policy",
                                 "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
                                 "img-src 'self' data: blob:; connect-src 'self'"}});
    server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
      if (request.method != "GET" && request.method != "HEAD") {
        response.status = 405;
        return httplib::Server::HandlerResponse::Handled;
      }
      if (!from_this_machine(request)) {
        response.status = 403;
        response.set_content("this page is for this machine only\n", "text/plain");
        return httplib::Server::HandlerResponse::Handled;
      }
      return httplib::Server::HandlerResponse::Unhandled;
    });
    server.set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      response.status = 500;
    });
    serve("/", page_assets::kHtml, "text/html; charset=utf-8");
    serve("/page.css", page_assets::kCss, "text/css; charset=utf-8");
    serve("/page.js", page_assets::kScript, "text/javascript; charset=utf-8");
    serve("/chart.js", page_assets::kCharts, "text/javascript; charset=utf-8");
    server.Get("/state.json", [this](const httplib::Request& request, httplib::Response& response) {
      asked_us = monotonic_us();
      response.set_content(state(request.get_param_value("since")), "application/json");
    });
    server.Get(R"(/camera/([0-9])\.jpg)", [this](const httplib::Request& request, httplib::Response& response) {
      asked_us = monotonic_us();
      const std::string jpeg = picture(static_cast<std::size_t>(request.matches[1].str()[0] - '0'));
      if (jpeg.empty()) {
        response.status = 404;
      } else {
        response.set_content(jpeg, "image/jpeg");
      }
    });
    port = wanted_port;
    const bool bound = wanted_port == 0 ? (port = server.bind_to_any_port("127.0.0.1")) > 0
                                        : server.bind_to_port("127.0.0.1", wanted_port);
    if (!bound) {
      throw DeviceError("the live page cannot have port " + std::to_string(wanted_port) +
                        " on localhost; is it in use?");
    }
    thread = std::thread([this] {
      // Of this thread and of those it makes: drawing pictures must not take time from the estimator.
      setpriority(PRIO_PROCESS, 0, kNice);
      server.listen_after_bind();
    });
    // stop() only stops a server that runs.
    while (!server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  void serve(const char* path, std::string_view content, const char* type) {
    server.Get(path, [content, type](const httplib::Request&, httplib::Response& response) {
      response.set_content(content.data(), content.size(), type);
    });
  }

  void set_cameras(const std::vector<std::string>& names) {
    cameras.clear();
    for (const auto& name : names) cameras.push_back({.name = name});
  }

  /// Everything but the pictures. `since`: newest sequence the viewer has.
  std::string state(const std::string& since) {
    std::uint64_t newest = 0;
    if (!since.empty() && since.size() < 18 && since.find_first_not_of("0123456789") == std::string::npos) {
      newest = std::stoull(since);
    }
    const std::int64_t now = monotonic_us();
    const auto age_s = [now](std::int64_t then) { return then < 0 ? -1.0 : 1e-6 * static_cast<double>(now - then); };
    Json json;
    {
      const std::lock_guard lock(mutex);
      json["joints"] = joints;
      Json& moments = json["history"] = Json::array();
      for (const Moment& m : history) {
        if (m.sequence <= newest && newest < next_sequence) continue;
        moments.push_back({{"sequence", m.sequence},
                           {"age_s", age_s(m.at_us)},
                           {"state", m.state},
                           {"offset_deg", m.offset_deg},
                           {"sd_deg", m.sd_deg},
                           {"contour_rms_px", m.contour_rms_px},
                           {"likelihood", m.likelihood},
                           {"hand_sd_mm", m.hand_sd_mm}});
      }
      Json& pictures = json["cameras"] = Json::array();
      for (const Shown& camera : cameras) {
        pictures.push_back({{"name", camera.name}, {"sequence", camera.sequence}, {"age_s", age_s(camera.at_us)},
                            {"frozen", camera.picture.frozen}});
      }
      json["status_age_s"] = age_s(status_us);
      if (status_us >= 0) {
        Json& s = json["status"];
        s["level"] = to_string(static_cast<HealthLevel>(status.level));
        s["sentence"] = status.sentence;
        s["state"] = status.state;
        s["frame_rate_hz"] = status.frame_rate_hz;
        s["image_age_ms"] = status.image_age_ms;
        s["latency_median_ms"] = status.latency_median_ms;
        s["latency_p99_ms"] = status.latency_p99_ms;
        s["frames_in"] = status.frames_in;
        s["frames_estimated"] = status.frames_estimated;
        s["frames_dropped"] = status.frames_dropped;
        s["engine"] = status.renderer;
        s["particles"] = status.num_particles;
        s["uptime_s"] = seconds(status.uptime_us);
        s["memory_mb"] = 1e-6 * static_cast<double>(status.resident_bytes);
        s["weakest"] = status.weakest_direction;
        s["version"] = status.version;
        s["model_hash"] = status.model_hash;
        s["config_hash"] = status.config_hash;
      }
    }
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

  /// The newest picture of one camera with its outlines, JPEG; empty: none.
  std::string picture(std::size_t camera) {
    const std::lock_guard one_at_a_time(encoding);
    CameraPicture copy;
    std::uint64_t sequence = 0;
    {
      const std::lock_guard lock(mutex);
      if (camera >= cameras.size() || cameras[camera].sequence == 0) return {};
      const Shown& shown = cameras[camera];
      if (shown.encoded_sequence == shown.sequence) return shown.jpeg;
      copy = shown.picture;
      sequence = shown.sequence;
    }
    const Image drawn = draw_overlay({{&copy.image, copy.nominal, copy.corrected, {}}}, "", kEnlargement);
    const auto message = to_jpeg_message(drawn, 0, kJpegQuality);
    std::string jpeg(message.data.begin(), message.data.end());
    const std::lock_guard lock(mutex);
    if (camera < cameras.size() && cameras[camera].sequence >= sequence) {
      cameras[camera].jpeg = jpeg;
      cameras[camera].encoded_sequence = sequence;
    }
    return jpeg;
  }
};

LivePage::LivePage(int port, std::vector<std::string> camera_names) : impl_(std::make_unique<Impl>()) {
  impl_->set_cameras(camera_names);
  impl_->start(port);
}

LivePage::~LivePage() {
  impl_->server.stop();
  impl_->thread.join();
}

int LivePage::port() const { return impl_->port; }
std::string LivePage::url() const { return "http://localhost:" + std::to_string(impl_->port) + "/"; }

void LivePage::start_anew(std::vector<std::string> camera_names) {
  const std::lock_guard lock(impl_->mutex);
  impl_->set_cameras(camera_names);
  impl_->history.clear();
}

void LivePage::add(const Estimate& estimate) {
  const std::int64_t now = monotonic_us();
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->history.empty() && now - impl_->history.back().at_us < kHistoryPeriod_us) return;
  Moment moment;
  moment.sequence = impl_->next_sequence++;
  moment.at_us = now;
  moment.state = to_string(estimate.state);
  for (Eigen::Index k = 0; k < estimate.offset_rad.size(); ++k) {
    moment.offset_deg.push_back(degrees(estimate.offset_rad(k)));
    moment.sd_deg.push_back(degrees(std::sqrt(std::max(0.0, estimate.covariance_rad2(k, k)))));
  }
  moment.contour_rms_px = estimate.contour_rms_px;
  moment.likelihood = estimate.best_likelihood;
  moment.hand_sd_mm = 1e3 * estimate.hand_sd_m;
  impl_->joints = estimate.joint_names;
  impl_->history.push_back(std::move(moment));
  if (impl_->history.size() > kHistoryLength) impl_->history.pop_front();
}

void LivePage::set_status(const offsets_status_t& status) {
  const std::lock_guard lock(impl_->mutex);
  impl_->status = status;
  impl_->status_us = monotonic_us();
}

bool LivePage::wants_pictures(bool idle) const {
  const std::int64_t now = monotonic_us();
  if (now - impl_->asked_us > kWatched_us) return false;
  const std::lock_guard lock(impl_->mutex);
  return now - impl_->pictures_us >= (idle ? kPicturePeriod_us : kPictureDue_us);
}

void LivePage::set_pictures(std::vector<CameraPicture> pictures) {
  const std::int64_t now = monotonic_us();
  const std::lock_guard lock(impl_->mutex);
  impl_->pictures_us = now;
  for (auto& picture : pictures) {
    if (picture.camera >= impl_->cameras.size()) continue;
    Shown& shown = impl_->cameras[picture.camera];
    shown.picture = std::move(picture);
    shown.at_us = now;
    shown.sequence = impl_->next_sequence++;
  }
}

}  // namespace bodyschema

#else  // without cpp-httplib

namespace bodyschema {

struct LivePage::Impl {};
LivePage::LivePage(int, std::vector<std::string>) {
  throw DeviceError("this program was built without the live page (cpp-httplib or Chart.js were missing)");
}
LivePage::~LivePage() = default;
int LivePage::port() const { return 0; }
std::string LivePage::url() const { return {}; }
void LivePage::start_anew(std::vector<std::string>) {}
void LivePage::add(const Estimate&) {}
void LivePage::set_status(const offsets_status_t&) {}
bool LivePage::wants_pictures(bool) const { return false; }
void LivePage::set_pictures(std::vector<CameraPicture>) {}

}  // namespace bodyschema

#endif
