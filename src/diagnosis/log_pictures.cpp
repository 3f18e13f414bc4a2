#include "log_pictures.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kShown = 3;
constexpr int kHalfPart_px = 75;
constexpr int kEnlargement = 3;

/// Position of the picture of a camera at that time.
std::optional<std::size_t> find(const PictureLog& log, const CameraObservation& seen, std::size_t camera) {
  for (std::size_t p = 0; p < log.pictures().size(); ++p) {
    if (log.pictures()[p].camera == camera && log.pictures()[p].joints.utime == seen.utime) return p;
  }
  return std::nullopt;
}

/// Those that show most of what the extension gains; without causes, spread over the log.
std::vector<std::size_t> choose(const PictureLog& log, const std::vector<Observation>& kept,
                                const DiagnosisReport& report) {
  const bool found = !report.causes.empty();
  std::vector<std::pair<double, std::size_t>> gain;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    double sum = 0.0;
    std::size_t n = 0;
    for (std::size_t c = 0; c < kept[i].cameras.size(); ++c) {
      const auto& seen = kept[i].cameras[c];
      const auto p = seen ? find(log, *seen, c) : std::nullopt;
      if (!p || report.samples[*p].before.rms_px <= 0.0) continue;
      sum += report.samples[*p].before.rms_px - report.samples[*p].after.rms_px;
      ++n;
    }
    if (n > 0) gain.emplace_back(found ? sum / static_cast<double>(n) : 0.0, i);
  }
  std::stable_sort(gain.begin(), gain.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(kShown, gain.size()); ++i) {
    shown.push_back(gain[found ? i : (2 * i + 1) * gain.size() / (2 * kShown)].second);
  }
  std::sort(shown.begin(), shown.end());
  return shown;
}

/// Parts that the causes of an answer move against the others or change in shape: not those that cameras, clocks and
/// offsets move with all the rest.
std::vector<bool> changed_parts(LogFit& fit, const DiagnosisReport& report) {
  const auto& roles = fit.log().roles();
  std::vector<bool> changed(fit.measurement().part_count(), false);
  const auto mark = [&](std::size_t segment) {
    for (const auto part : roles.segments[segment].parts) changed[part] = true;
  };
  for (const auto& cause : report.causes) {
    for (std::size_t s = 0; s < roles.segments.size(); ++s) {
      if (roles.segments[s].name == cause.cause.source) mark(s);
    }
    const auto link = std::find_if(roles.links.begin(), roles.links.end(), [&](const ArmLink& l) {
      return cause.cause.name == "link_length" && roles.names[static_cast<std::size_t>(l.joint)] == cause.cause.joint;
    });
    const auto joint = std::find(roles.names.begin(), roles.names.end(), cause.cause.joint);
    const auto& rendered = fit.log().setup().model.rendered_links;
    for (std::size_t part = 0; part < changed.size(); ++part) {
      if (link != roles.links.end()) {
        if (rendered[part] == link->name) changed[part] = true;
      } else if (joint != roles.names.end()) {
        const auto& info = fit.log().robot()->joints()[static_cast<std::size_t>(joint - roles.names.begin())];
        if (rendered[part] == info.child_link) changed[part] = true;
      }
    }
  }
  return changed;
}

/// The first camera's picture of an observation with the changed parts in orange.
std::optional<std::pair<Image, std::string>> draw_change(LogFit& fit, const std::vector<Observation>& kept,
                                                         const DiagnosisReport& report, const LinearLog& after) {
  const auto parts = changed_parts(fit, report);
  if (std::none_of(parts.begin(), parts.end(), [](bool p) { return p; })) return std::nullopt;
  SilhouettePreview preview(fit.log());
  std::optional<OverlayView> best;
  std::size_t most = 0;
  for (const auto& observation : kept) {
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      const auto& seen = observation.cameras[c];
      const auto p = seen ? find(fit.log(), *seen, c) : std::nullopt;
      if (!p || seen->image.empty()) continue;
      const auto& q = fit.log().pictures()[*p].joints.q;
      auto marked = preview.draw_parts(q, after.corrections[*p], c, parts);
      const auto pixels = marked.count();
      if (pixels <= most) continue;
      most = pixels;
      best = OverlayView{&seen->image, {}, preview.draw(q, after.corrections[*p], c), std::move(marked)};
    }
  }
  if (!best) return std::nullopt;
  return std::pair(draw_overlay({*best}, "", 2), std::string("Orange: the parts that the answer is about. Green: the "
                                                             "robot as the extended model has it."));
}

}  // namespace

std::vector<std::pair<Image, std::string>> draw_pictures(LogFit& fit, const std::vector<Observation>& kept,
                                                         const DiagnosisReport& report) {
  const auto& log = fit.log();
  const bool found = !report.causes.empty();
  const ErrorModel plain(log.roles());
  const OutlineSearch search{.search_px = limits::kSearch_px};
  const auto before = fit.linearise(found ? *report.baseline_model : plain, {}, search);
  const auto after = fit.linearise(*report.extended_model, {}, search);
  SilhouettePreview preview(log);
  const OverlayNames names = {found ? "offsets and nuisances" : "encoders as they are", "extended model"};
  std::vector<std::pair<Image, std::string>> pictures;
  if (auto change = draw_change(fit, kept, report, after)) pictures.push_back(std::move(*change));
  for (const auto i : choose(log, kept, report)) {
    std::vector<OverlayView> views;
    for (std::size_t c = 0; c < kept[i].cameras.size(); ++c) {
      const auto& seen = kept[i].cameras[c];
      const auto p = seen ? find(log, *seen, c) : std::nullopt;
      if (!p || seen->image.empty()) continue;
      const auto& q = log.pictures()[*p].joints.q;
      OverlayView view{&seen->image, preview.draw(q, before.corrections[*p], c),
                       preview.draw(q, after.corrections[*p], c)};
      const auto& k = log.rig().cameras[c].intrinsics;
      const int size = std::min({2 * kHalfPart_px, k.width, k.height});
      if (const Eigen::Vector2d hand = preview.hand(); hand.allFinite()) {
        view.part = {std::clamp(static_cast<int>(hand.x()) - size / 2, 0, k.width - size),
                     std::clamp(static_cast<int>(hand.y()) - size / 2, 0, k.height - size), size, size};
      }
      views.push_back(std::move(view));
    }
    if (views.empty()) continue;
    const double time_s = seconds(kept[i].utime - report.begin_utime);
    pictures.emplace_back(draw_overlay(views, fmt::format("{:.1f} s", time_s), kEnlargement, names),
                          fmt::format("{:.1f} s into the log: outlines of {} (red) and of the extended model (green)",
                                      time_s, found ? "the fit of offsets and nuisances" : "the encoders as they are"));
  }
  return pictures;
}

}  // namespace bodyschema::diagnosis
