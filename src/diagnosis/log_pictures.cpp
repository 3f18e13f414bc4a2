#include "log_pictures.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kShown = 3;
constexpr int kHalfPart_px = 75;
constexpr int kEnlargement = 3;

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
      const auto p = seen ? log.find(c, seen->utime) : std::nullopt;
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

/// Parts that the answer is about: the part whose shape it is, the link whose length it is, or all that a joint moves.
/// None for cameras and clocks, which move all the rest.
/// @param moved  what a longer link moves instead of the link, which may be out of sight
std::vector<bool> changed_parts(const PictureLog& log, const DiagnosisReport& report, bool moved) {
  const auto& roles = log.roles();
  const auto& rendered = log.setup().model.rendered_links;
  std::vector<bool> changed(rendered.size(), false);
  const ForwardKinematics kinematics(log.robot(), rendered);
  for (const auto& cause : report.causes) {
    for (const auto& segment : roles.segments) {
      if (segment.name != cause.cause.source) continue;
      for (const auto part : segment.parts) changed[part] = true;
    }
    const auto joint = std::find(roles.names.begin(), roles.names.end(), cause.cause.joint);
    if (joint == roles.names.end()) continue;
    const auto index = static_cast<Eigen::Index>(joint - roles.names.begin());
    const auto link =
        std::find_if(roles.links.begin(), roles.links.end(), [&](const ArmLink& l) { return l.joint == index; });
    const bool length = !moved && cause.cause.name == "link_length" && link != roles.links.end();
    const auto own = std::find(rendered.begin(), rendered.end(), length ? link->name : "");
    if (own != rendered.end()) {
      changed[static_cast<std::size_t>(own - rendered.begin())] = true;
      continue;
    }
    for (std::size_t part = 0; part < rendered.size(); ++part) {
      if (kinematics.moves(index, part)) changed[part] = true;
    }
  }
  return changed;
}

/// The picture in which most of some parts is seen, these in orange.
std::optional<std::pair<Image, std::string>> draw_parts(const PictureLog& log, const std::vector<Observation>& kept,
                                                        const std::vector<bool>& parts, const LinearLog& after) {
  if (std::none_of(parts.begin(), parts.end(), [](bool p) { return p; })) return std::nullopt;
  SilhouettePreview preview(log);
  std::optional<OverlayView> best;
  std::size_t most = 0;
  for (const auto& observation : kept) {
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      const auto& seen = observation.cameras[c];
      const auto p = seen ? log.find(c, seen->utime) : std::nullopt;
      if (!p || seen->image.empty()) continue;
      const auto& q = log.pictures()[*p].joints.q;
      auto marked = preview.draw_parts(q, after.corrections[*p], c, parts);
      const auto pixels = marked.count();
      if (pixels <= most) continue;
      most = pixels;
      best = OverlayView{&seen->image, {}, preview.draw(q, after.corrections[*p], c), std::move(marked)};
    }
  }
  if (!best) return std::nullopt;
  return std::pair(draw_overlay({*best}, "", 2), std::string("Orange: what the answer is about, or moves. Green: the "
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
  for (const bool moved : {false, true}) {
    if (!pictures.empty()) break;
    auto change = draw_parts(log, kept, changed_parts(log, report, moved), after);
    if (change) pictures.push_back(std::move(*change));
  }
  for (const auto i : choose(log, kept, report)) {
    std::vector<OverlayView> views;
    for (std::size_t c = 0; c < kept[i].cameras.size(); ++c) {
      const auto& seen = kept[i].cameras[c];
      const auto p = seen ? log.find(c, seen->utime) : std::nullopt;
      if (!p || seen->image.empty()) continue;
      const auto& q = log.pictures()[*p].joints.q;
      OverlayView view{&seen->image, preview.draw(q, before.corrections[*p], c),
                       preview.draw(q, after.corrections[*p], c)};
      view.px_per_m = preview.hand_px_per_m();
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
