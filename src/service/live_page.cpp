#include "bodyschema/service/live_page.hpp"

#include "bodyschema/core/error.hpp"

#ifdef BODYSCHEMA_HAS_PAGE

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "bodyschema/core/clock.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/service/health.hpp"
#include "page_assets.hpp"
#include "page_server.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kHistoryPeriod_us = 400'000;
constexpr std::size_t kHistoryLength = 600;  // four minutes
constexpr std::int64_t kPicturePeriod_us = 200'000;
constexpr std::int64_t kPictureDue_us = 1'000'000;  // even when the estimator is never idle
constexpr std::int64_t kWatched_us = 3'000'000;     // since the last question of a viewer
constexpr int kJpegQuality = 85;
constexpr int kEnlargement = 2;

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
  std::string hidden{};  ///< what other things hide, in words; empty: nothing
};

struct Shown {
  std::string name;
  std::uint64_t sequence = 0;  ///< 0: no picture yet
  std::int64_t at_us = -1;
  std::shared_ptr<const CameraPicture> picture{};
};

/// What the page shows. Large parts are shared, so that a copy takes microseconds.
struct Scene {
  std::vector<std::string> joints;
  std::deque<std::shared_ptr<const Moment>> history;
  std::uint64_t next_sequence = 1;  ///< of moments and pictures; never used twice
  std::vector<Shown> cameras;
  LiveFindings findings;
  std::int64_t pictures_us = -kPictureDue_us;
  offsets_status_t status{};
  std::int64_t status_us = -1;
};

struct Encoded {
  std::uint64_t sequence = 0;
  std::string jpeg;
};

double age_s(std::int64_t now_us, std::int64_t then_us) {
  return then_us < 0 ? -1.0 : 1e-6 * static_cast<double>(now_us - then_us);
}

Json to_json(const Moment& m, std::int64_t now_us) {
  return {{"sequence", m.sequence},     {"age_s", age_s(now_us, m.at_us)},
          {"state", m.state},           {"offset_deg", m.offset_deg},
          {"sd_deg", m.sd_deg},         {"contour_rms_px", m.contour_rms_px},
          {"likelihood", m.likelihood}, {"hand_sd_mm", m.hand_sd_mm},
          {"hidden", m.hidden}};
}

Json to_json(const offsets_status_t& status) {
  return {{"level", to_string(static_cast<HealthLevel>(status.level))},
          {"sentence", status.sentence},
          {"state", status.state},
          {"frame_rate_hz", status.frame_rate_hz},
          {"image_age_ms", status.image_age_ms},
          {"latency_median_ms", status.latency_median_ms},
          {"latency_p99_ms", status.latency_p99_ms},
          {"frames_in", status.frames_in},
          {"frames_estimated", status.frames_estimated},
          {"frames_dropped", status.frames_dropped},
          {"engine", status.renderer},
          {"particles", status.num_particles},
          {"uptime_s", seconds(status.uptime_us)},
          {"memory_mb", 1e-6 * static_cast<double>(status.resident_bytes)},
          {"weakest", status.weakest_direction},
          {"version", status.version},
          {"model_hash", status.model_hash},
          {"config_hash", status.config_hash}};
}

Json to_json(const LiveFindings& findings) {
  Json causes = Json::array();
  for (const auto& f : findings.causes) {
    Json parameters = Json::array();
    for (const auto& p : f.parameters) {
      parameters.push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"stddev", p.sd}});
    }
    causes.push_back({{"sentence", f.sentence},
                      {"parameters", parameters},
                      {"z", f.z},
                      {"hand_mm", f.hand_mm},
                      {"estimated", f.estimated},
                      {"alike", f.alike}});
  }
  return {{"blocks", findings.blocks}, {"span_s", findings.span_s}, {"causes", causes}};
}

/// The newest sequence that a viewer says he has; 0 for what is no number.
std::uint64_t newest_of(std::string_view query) {
  constexpr std::string_view kKey = "since=";
  if (!query.starts_with(kKey)) return 0;
  std::uint64_t newest = 0;
  const std::string_view text = query.substr(kKey.size());
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), newest);
  return error == std::errc{} && end == text.data() + text.size() ? newest : 0;
}

}  // namespace

struct LivePage::Impl {
  std::atomic<std::int64_t> asked_us{-kWatched_us};
  /// Held for copies of `scene` and changes to it, never while text or pictures are made of them: the
  /// page's thread comes last on a busy machine, and who waits for it comes last too.
  mutable std::mutex mutex;
  Scene scene;
  std::vector<Encoded> encoded;      ///< the page's thread only; by camera
  std::optional<PageServer> server;  ///< last: everything else is there when it starts

  void set_cameras(const std::vector<std::string>& names) {
    scene.cameras.clear();
    for (const auto& name : names) scene.cameras.push_back({.name = name});
  }

  PageAnswer answer(const PageRequest& request) {
    constexpr std::string_view kScript = "text/javascript; charset=utf-8";
    const auto file = [](std::string_view type, std::string_view content) {
      return PageAnswer{200, type, std::string(content)};
    };
    if (request.path == "/") return file("text/html; charset=utf-8", page_assets::kHtml);
    if (request.path == "/page.css") return file("text/css; charset=utf-8", page_assets::kCss);
    if (request.path == "/page.js") return file(kScript, page_assets::kScript);
    if (request.path == "/chart.js") return file(kScript, page_assets::kCharts);
    if (request.path == "/state.json") {
      asked_us = monotonic_us();
      return {200, "application/json", state(newest_of(request.query))};
    }
    constexpr std::string_view kBefore = "/camera/", kAfter = ".jpg";
    if (request.path.size() == kBefore.size() + 1 + kAfter.size() && request.path.starts_with(kBefore) &&
        request.path.ends_with(kAfter)) {
      asked_us = monotonic_us();
      const int camera = request.path[kBefore.size()] - '0';
      std::string jpeg = camera >= 0 && camera <= 9 ? picture(static_cast<std::size_t>(camera)) : "";
      if (!jpeg.empty()) return {200, "image/jpeg", std::move(jpeg)};
    }
    return {404, "text/plain", "nothing here\n"};
  }

  Scene copy() const {
    const std::lock_guard lock(mutex);
    return scene;
  }

  /// Everything but the pictures. `newest`: sequence of the last moment that the viewer has.
  std::string state(std::uint64_t newest) const {
    const Scene now_shown = copy();
    const std::int64_t now = monotonic_us();
    Json json;
    json["joints"] = now_shown.joints;
    json["findings"] = to_json(now_shown.findings);
    Json& moments = json["history"] = Json::array();
    for (const auto& moment : now_shown.history) {
      if (moment->sequence <= newest && newest < now_shown.next_sequence) continue;
      moments.push_back(to_json(*moment, now));
    }
    Json& pictures = json["cameras"] = Json::array();
    for (const Shown& camera : now_shown.cameras) {
      pictures.push_back({{"name", camera.name},
                          {"sequence", camera.sequence},
                          {"age_s", age_s(now, camera.at_us)},
                          {"frozen", camera.picture && camera.picture->frozen}});
    }
    json["status_age_s"] = age_s(now, now_shown.status_us);
    if (now_shown.status_us >= 0) json["status"] = to_json(now_shown.status);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

  /// The newest picture of one camera with its outlines, JPEG; empty: none.
  std::string picture(std::size_t camera) {
    Shown shown;
    {
      const std::lock_guard lock(mutex);
      if (camera >= scene.cameras.size() || !scene.cameras[camera].picture) return {};
      shown = scene.cameras[camera];
    }
    if (encoded.size() <= camera) encoded.resize(camera + 1);
    Encoded& made = encoded[camera];
    if (made.sequence != shown.sequence) {
      const CameraPicture& p = *shown.picture;
      const Image drawn = draw_overlay({{&p.image, p.nominal, p.corrected, {}}}, "", kEnlargement);
      const auto message = to_jpeg_message(drawn, 0, kJpegQuality);
      made = {shown.sequence, {message.data.begin(), message.data.end()}};
    }
    return made.jpeg;
  }
};

LivePage::LivePage(int port, std::vector<std::string> camera_names) : impl_(std::make_unique<Impl>()) {
  impl_->set_cameras(camera_names);
  impl_->server.emplace(port, [impl = impl_.get()](const PageRequest& request) { return impl->answer(request); });
}

LivePage::~LivePage() = default;

int LivePage::port() const {
  return impl_->server->port();
}
std::string LivePage::url() const {
  return "http://localhost:" + std::to_string(port()) + "/";
}

void LivePage::start_anew(std::vector<std::string> camera_names) {
  const std::lock_guard lock(impl_->mutex);
  impl_->set_cameras(camera_names);
  impl_->scene.history.clear();
  impl_->scene.findings = {};
}

void LivePage::add(const Estimate& estimate) {
  const std::int64_t now = monotonic_us();
  const std::unique_lock lock(impl_->mutex, std::try_to_lock);
  if (!lock) return;  // the next one is as good
  Scene& scene = impl_->scene;
  scene.findings = estimate.findings;
  if (!scene.history.empty() && now - scene.history.back()->at_us < kHistoryPeriod_us) return;
  auto moment = std::make_shared<Moment>();
  moment->sequence = scene.next_sequence++;
  moment->at_us = now;
  moment->state = to_string(estimate.state);
  for (Eigen::Index k = 0; k < estimate.offset_rad.size(); ++k) {
    moment->offset_deg.push_back(degrees(estimate.offset_rad(k)));
    moment->sd_deg.push_back(degrees(std::sqrt(std::max(0.0, estimate.covariance_rad2(k, k)))));
  }
  moment->contour_rms_px = estimate.contour_rms_px;
  moment->likelihood = estimate.best_likelihood;
  moment->hand_sd_mm = 1e3 * estimate.hand_sd_m;
  moment->hidden = estimate.hidden.text();
  scene.joints = estimate.joint_names;
  scene.history.push_back(std::move(moment));
  if (scene.history.size() > kHistoryLength) scene.history.pop_front();
}

void LivePage::set_status(const offsets_status_t& status) {
  const std::lock_guard lock(impl_->mutex);
  impl_->scene.status = status;
  impl_->scene.status_us = monotonic_us();
}

bool LivePage::wants_pictures(bool idle) const {
  const std::int64_t now = monotonic_us();
  if (now - impl_->asked_us > kWatched_us) return false;
  const std::unique_lock lock(impl_->mutex, std::try_to_lock);
  return lock && now - impl_->scene.pictures_us >= (idle ? kPicturePeriod_us : kPictureDue_us);
}

void LivePage::set_pictures(std::vector<CameraPicture> pictures) {
  const std::int64_t now = monotonic_us();
  const std::unique_lock lock(impl_->mutex, std::try_to_lock);
  if (!lock) return;
  Scene& scene = impl_->scene;
  scene.pictures_us = now;
  for (auto& picture : pictures) {
    if (picture.camera >= scene.cameras.size()) continue;
    Shown& shown = scene.cameras[picture.camera];
    shown.picture = std::make_shared<const CameraPicture>(std::move(picture));
    shown.at_us = now;
    shown.sequence = scene.next_sequence++;
  }
}

}  // namespace bodyschema

#else  // without Chart.js

namespace bodyschema {

struct LivePage::Impl {};
LivePage::LivePage(int, std::vector<std::string>) {
  throw DeviceError("this program was built without the live page (Chart.js was missing)");
}
LivePage::~LivePage() = default;
int LivePage::port() const {
  return 0;
}
std::string LivePage::url() const {
  return {};
}
void LivePage::start_anew(std::vector<std::string>) {}
void LivePage::add(const Estimate&) {}
void LivePage::set_status(const offsets_status_t&) {}
bool LivePage::wants_pictures(bool) const {
  return false;
}
void LivePage::set_pictures(std::vector<CameraPicture>) {}

}  // namespace bodyschema

#endif
