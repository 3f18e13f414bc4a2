#include "bodyschema/pipeline/replay.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/camera/require_places.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/pipeline/hand_errors.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/pipeline/truth.hpp"
#include "bodyschema/pipeline/watched_log.hpp"
#include "bodyschema/vision/mask_picture.hpp"
#include "cameras_json.hpp"
#include "estimate_json.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

/// Mean over frames of one quantity, before and after correction.
struct BeforeAfter {
  double before = 0.0;
  double after = 0.0;
  std::size_t n = 0;
  void add(double b, double a) {
    before += b;
    after += a;
    ++n;
  }
  [[nodiscard]] Json json() const {
    if (n == 0) return nullptr;
    return {{"before", before / static_cast<double>(n)}, {"after", after / static_cast<double>(n)}};
  }
};

struct ErrorTotals {
  BeforeAfter position_mm, rotation_deg, tip_mm, tip_px;
  void add(const HandError& before, const HandError& after) {
    position_mm.add(1e3 * before.position_m, 1e3 * after.position_m);
    rotation_deg.add(degrees(before.rotation_rad), degrees(after.rotation_rad));
    tip_mm.add(1e3 * before.fingertip_m, 1e3 * after.fingertip_m);
    tip_px.add(before.fingertip_px, after.fingertip_px);
  }
  [[nodiscard]] Json json() const {
    return {{"frames", position_mm.n},
            {"position_mm", position_mm.json()},
            {"orientation_deg", rotation_deg.json()},
            {"fingertip_mm", tip_mm.json()},
            {"fingertip_px", tip_px.json()}};
  }
};

Json error_json(const HandError& error) {
  return {{"position_mm", 1e3 * error.position_m},
          {"orientation_deg", degrees(error.rotation_rad)},
          {"fingertip_mm", 1e3 * error.fingertip_m},
          {"fingertip_px", error.fingertip_px}};
}

/// What every frame was predicted from, to judge the final estimate over the whole log.
struct SeenFrame {
  std::array<Microseconds, 2> utime{-1, -1};
  std::array<Exposure, 2> exposure;
};

void write_overlay(Pipeline& pipeline, const Observation& observation, const Estimate& estimate,
                   const std::filesystem::path& file, const std::string& caption) {
  auto views = overlay_views(pipeline, observation, estimate);
  crop_to_arm(views);
  if (!views.empty()) write_png(file, draw_overlay(views, caption));
}

class Replay {
 public:
  Replay(const Configuration& configuration, const ReplayOptions& options)
      : options_(options), pipeline_(configuration, std::nullopt, PictureReading::kAsNeeded) {
    configuration.reject_unknown_keys();
    require_places(pipeline_.rig(), "a replay");
    make_folder(options.out);
    estimates_ = open_to_write(options.out / "estimates.jsonl");
    if (!options.truth) return;
    std::vector<std::string> cameras;
    for (const auto& camera : pipeline_.rig().cameras) cameras.push_back(camera.name);
    truth_ = Truth::load(*options.truth, cameras);
  }

  std::string run() {
    std::error_code none;
    if (options_.looks && std::filesystem::exists(*options_.looks, none)) {
      pipeline_.know_looks(read_looks(*options_.looks, pipeline_.model_hash()));
    }
    if (pipeline_.learns_background() && !options_.learn_background_online) {
      for_each("learning the background", [&](Observation& o, const Observation*) { pipeline_.learn_from(o); });
      pipeline_.finish_learning();
    }
    spdlog::info("silhouettes: {}", pipeline_.estimator().engine_description());
    if (pipeline_.error_model()) spdlog::info("extended model: {}", describe(*pipeline_.error_model()));
    if (options_.watcher) watcher_ = options_.watcher(pipeline_);
    std::size_t expected = count_frames();
    for_each("replay", [&](Observation& o, const Observation* next) { take(o, next, expected); });
    if (frames_.empty()) throw DataError(options_.log.string() + ": " + why_nothing_was_seen());
    for (std::size_t c = 0; c < pipeline_.rig().cameras.size(); ++c) {
      const bool seen =
          std::any_of(frames_.begin(), frames_.end(), [&](const SeenFrame& frame) { return frame.utime[c] >= 0; });
      if (seen) continue;
      const auto& camera = pipeline_.rig().cameras[c];
      if (statistics_.faults[static_cast<std::size_t>(MessageFault::kWrongSize)] > 0) {
        throw DataError(
            fmt::format("{}: no picture of camera '{}' has the configured size {}x{} (cameras.{}.width, .height)",
                        options_.log.string(), camera.name, camera.intrinsics.width * camera.intrinsics.reduction,
                        camera.intrinsics.height * camera.intrinsics.reduction, camera.name));
      }
      spdlog::warn("{}: no usable picture of camera '{}'; estimated from the other one", options_.log.string(),
                   camera.name);
    }
    estimates_.flush();
    if (!estimates_) throw DeviceError(options_.out.string() + ": disk full? estimates.jsonl is cut short");
    if (options_.looks) write_looks(*options_.looks, pipeline_.model_hash(), pipeline_.looks());
    end_where_it_converged();
    if (last_view_) {
      write_overlay(pipeline_, *last_view_, last_, options_.out / "overlay_final.png", "last frame");
    }
    return finish();
  }

 private:
  /// `action` gets each observation and the one after it; null: it was the last.
  template <class Action>
  void for_each(const std::string& label, Action action) {
    LogReader log(options_.log);
    ObservationStream stream = pipeline_.make_stream();
    ProgressBar bar(label, log.size());
    LogEvent event;
    std::set<std::string> channels;
    std::optional<ArrivedObservation> held;  // until it is known what comes after it
    const auto drain = [&] {
      while (auto arrived = stream.next()) {
        if (held) action(held->observation, &arrived->observation);
        held = std::move(arrived);
      }
    };
    while (log.next(event)) {
      channels.insert(event.channel);
      if (stream.receive(event.channel, event.data, event.time_us)) drain();
      bar.set(log.position());
    }
    stream.finish();
    drain();
    if (held) action(held->observation, nullptr);
    statistics_ = stream.statistics();
    complaint_ = fmt::format("{} messages on {} and {}", statistics_.messages, stream.channels().joint_state,
                             stream.channels().cameras);
    if (statistics_.messages == 0) {
      complaint_ += fmt::format("; it holds {} (bus.channel_prefix)", fmt::join(channels, ", "));
    }
  }

  /// Of a log without a single instant: which part is missing, or what is wrong with its pictures.
  [[nodiscard]] std::string why_nothing_was_seen() const {
    const std::string lost = why_no_picture(statistics_, pipeline_.rig(), pipeline_.bus().channels());
    return lost.empty() ? "no synchronised pictures and encoders in this log; " + complaint_ : lost;
  }

  std::size_t count_frames() {
    if (options_.overlays <= 0) return 0;
    LogReader log(options_.log);
    LogEvent event;
    std::size_t pictures = 0;
    const std::string cameras = pipeline_.bus().channels().cameras;
    while (log.next(event)) pictures += event.channel == cameras ? 1 : 0;
    return pictures;
  }

  void take(Observation& observation, const Observation* next, std::size_t expected) {
    Estimate estimate = pipeline_.process(observation, next);
    if (watcher_) watcher_(observation, estimate);
    Json json = estimate_json(estimate, pipeline_.rig());
    SeenFrame frame;
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (!observation.cameras[c]) continue;
      frame.utime[c] = observation.cameras[c]->utime;
      frame.exposure[c] = pipeline_.estimator().exposure(c);
      if (truth_ && c < estimate.X_CP.size()) {
        if (const TruthInstant* truth = truth_->at(frame.utime[c])) {
          json["error_" + pipeline_.rig().cameras[c].name] =
              error_json(hand_error(estimate.X_CP[c], *truth, c, pipeline_.rig().cameras[c].intrinsics));
        }
      }
    }
    estimates_ << json.dump() << '\n';
    ++state_counts_[to_string(estimate.state)];
    swapped_frames_ += estimate.cameras_swapped;
    const std::size_t every =
        options_.overlays > 0 ? std::max<std::size_t>(1, expected / static_cast<std::size_t>(options_.overlays)) : 0;
    if (every > 0 && frames_.size() % every == every / 2) {
      const std::string name = fmt::format("overlay_{:05d}.png", frames_.size());
      write_overlay(pipeline_, observation, estimate, options_.out / name, fmt::format("frame {}", frames_.size()));
    }
    if (options_.masks) {
      for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
        const auto& seen = observation.cameras[c];
        if (!seen || seen->mask.empty()) continue;
        const auto& camera = pipeline_.rig().cameras[c];
        write_mask_png(options_.out / "masks" / fmt::format("{}_{:05d}.png", camera.name, frames_.size()), seen->mask,
                       seen->valid, camera.intrinsics.reduction);
      }
    }
    const bool complete =
        estimate.state != EstimatorState::kHandNotInView && estimate.state != EstimatorState::kLearningBackground;
    frames_.push_back(std::move(frame));
    last_ = estimate;
    remember_convergence();
    if (complete) last_view_ = std::move(observation);
    if (truth_) online_error(estimate);
  }

  /// Whether the hand is told to a millimetre is a matter of the frame as well: at the edge of the picture the
  /// offsets are as well known as before, the hand is not.
  void remember_convergence() {
    if (last_.state == EstimatorState::kConverged) {
      converged_ = last_;
      frames_since_ = 0;
    } else if (last_.state == EstimatorState::kConverging || last_.state == EstimatorState::kOccluded) {
      ++frames_since_;
    } else if (last_.state == EstimatorState::kDiverged || last_.state == EstimatorState::kModelMisfit) {
      converged_.reset();
    }
  }
  /// A log that ends so has converged: with the offsets of the last frame that said so.
  void end_where_it_converged() {
    constexpr std::size_t kFew_frames = 30;
    constexpr double kSame_rad = 0.25 * kPi / 180.0, kSame_sd = 2.0;
    if (last_.state == EstimatorState::kConverged || !converged_ || frames_since_ > kFew_frames) return;
    // What was hardly told then may be told better by now.
    const Eigen::ArrayXd same =
        (kSame_sd * converged_->covariance_rad2.diagonal().array().max(0.0).sqrt()).max(kSame_rad);
    if (((last_.offset_rad - converged_->offset_rad).array().abs() > same).any()) return;
    ended_after_ = last_.state;
    last_ = *converged_;
  }

  /// Error of the estimate each frame had at its time; of which frames it is reported, finish() says.
  void online_error(const Estimate& estimate) {
    std::array<std::optional<std::pair<HandError, HandError>>, 2> both;
    for (std::size_t c = 0; c < pipeline_.rig().cameras.size(); ++c) {
      if (c >= estimate.X_CP.size() || frames_.back().utime[c] < 0) continue;
      if (const TruthInstant* truth = truth_->at(frames_.back().utime[c])) {
        const auto& intrinsics = pipeline_.rig().cameras[c].intrinsics;
        both[c] = {hand_error(estimate.X_CP_nominal[c], *truth, c, intrinsics),
                   hand_error(estimate.X_CP[c], *truth, c, intrinsics)};
      }
    }
    online_.push_back(both);
  }

  std::string finish() {
    Json summary;
    summary["log"] = options_.log.filename().string();
    summary["frames"] = frames_.size();
    summary["states"] = state_counts_;
    for (const auto& [name, count] : statistics_.counters()) {
      if (count > 0) summary["not_used"][name] = count;
    }
    summary["engine"] = pipeline_.estimator().engine_description();
    summary["configuration_hash"] = pipeline_.configuration_hash();
    summary["model_hash"] = pipeline_.model_hash();
    if (pipeline_.error_model()) summary["extended_model"] = error_model_json(*pipeline_.error_model());
    summary["cameras"] = cameras_json(pipeline_.configured_rig());
    summary["estimate"] = estimate_json(last_, pipeline_.rig());
    summary["weakest_direction"] = last_.weakest.text;

    std::string table = fmt::format("{:<20} {:>10} {:>8}", "joint", "offset deg", "sd deg");
    if (truth_ && !truth_->offsets().empty()) table += fmt::format(" {:>9} {:>9}", "true deg", "error deg");
    table += '\n';
    for (std::size_t k = 0; k < last_.joint_names.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      table += fmt::format("{:<20} {:>10.2f} {:>8.2f}", last_.joint_names[k], degrees(last_.offset_rad(i)),
                           degrees(std::sqrt(std::max(0.0, last_.covariance_rad2(i, i)))));
      if (truth_) {
        for (const auto& [name, offset] : truth_->offsets()) {
          if (name != last_.joint_names[k]) continue;
          table += fmt::format(" {:>9.2f} {:>9.2f}", degrees(offset), degrees(last_.offset_rad(i) - offset));
          summary["offset_error_deg"][name] = degrees(last_.offset_rad(i) - offset);
        }
      }
      table += '\n';
    }
    table += effects_table();
    table += "weakest direction: " + last_.weakest.text + '\n';
    if (truth_) table += truth_table(summary);
    table += closing_lines(summary);
    write_file(options_.out / "summary.json", summary.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
    return table;
  }

  /// What else is estimated and told by the pictures to be there: a head's offsets, a latency.
  [[nodiscard]] std::string effects_table() const {
    constexpr double kSurely_sd = 2.0;
    std::string rows;
    for (const auto& p : last_.effects) {
      if (!p.told() || std::abs(p.value) < kSurely_sd * p.sd) continue;
      rows +=
          fmt::format("{:<34} {:>10.3g} {:>8.2g} {}\n", p.name, p.value / p.si_per_unit, p.sd / p.si_per_unit, p.unit);
    }
    return rows.empty() ? rows : fmt::format("{:<34} {:>10} {:>8}\n", "found besides", "value", "sd") + rows;
  }

  /// How it ended, and what is wrong with the log as a whole.
  std::string closing_lines(Json& summary) const {
    std::string lines;
    if (last_.state != EstimatorState::kConverged) {
      lines = fmt::format("\nNOT CONVERGED: the log ended in state '{}': {}\n", to_string(last_.state),
                          why_not_converged());
    } else if (ended_after_) {
      lines = fmt::format(
          "\nThe last frames ({}) tell the hand less well: these are the offsets at {:.3f} s, the last "
          "that were 'converged'.\n",
          to_string(*ended_after_), seconds(last_.utime));
    }
    const auto warn = [&](const std::string& text) {
      if (text.empty()) return;
      lines += "\nWARNING: " + text + '\n';
      summary["warnings"].push_back(text);
    };
    warn(describe(pipeline_.background_turn()));
    if (swapped_frames_ > 0) {
      warn(fmt::format("the left and right pictures are swapped in {} of {} frames; nothing was learned from these",
                       swapped_frames_, frames_.size()));
    }
    return lines;
  }

  [[nodiscard]] std::string why_not_converged() const {
    switch (last_.state) {
      case EstimatorState::kDiverged:
        if (last_.cameras_swapped) return "each picture shows what the other eye sees";
        return fmt::format("the best prediction does not fit the pictures (likelihood {:.2f}); do not use the offsets",
                           last_.best_likelihood);
      case EstimatorState::kHandNotInView:
        return last_view_ ? "the arm had left the pictures; the offsets are of before" : "the arm is in no picture";
      case EstimatorState::kModelMisfit: return last_.misfit;
      case EstimatorState::kOccluded: return "something hides too much of the hand";
      case EstimatorState::kLearningBackground: return "it holds too few pictures to learn the background from";
      default: return "the offsets have not settled: " + missed_limits() + "; do not use them yet";
    }
  }

  /// What `converged` needs and the last estimate lacks, with figures.
  [[nodiscard]] std::string missed_limits() const {
    if (last_.hand_sd_limit_m <= 0.0) return fmt::format("the hand is known to {:.1f} mm", 1e3 * last_.hand_sd_m);
    std::vector<std::string> missed;
    const std::size_t least = pipeline_.options().least_postures;
    if (last_.postures < least) {
      missed.push_back(fmt::format("they rest on {} distinct postures, {} are needed", last_.postures, least));
    }
    if (last_.hand_sd_m >= last_.hand_sd_limit_m) {
      missed.push_back(fmt::format("the hand is known to {:.3g} mm, {:.3g} mm are needed", 1e3 * last_.hand_sd_m,
                                   1e3 * last_.hand_sd_limit_m));
    }
    if (last_.verdict != FrameVerdict::kAgrees) missed.push_back("the last pictures do not agree with those before");
    return missed.empty() ? "they still move from picture to picture" : fmt::format("{}", fmt::join(missed, "; "));
  }

  std::string truth_table(Json& summary) {
    // The last tenth of the frames, at most 30, as the estimate was then; and the final estimate
    // applied to every frame of the log.
    const std::size_t tail = std::clamp<std::size_t>(online_.size() / 10, 1, 30);
    std::string table = fmt::format("\n{:<34} {:>16} {:>16} {:>18} {:>18}\n", "error, before -> after", "position mm",
                                    "rotation deg", "fingertips mm", "fingertips px");
    const bool tips = !pipeline_.setup().fingertip_links.empty();
    const auto row = [&](const std::string& name, const ErrorTotals& t) {
      const auto cell = [](const BeforeAfter& v) {
        const double n = static_cast<double>(std::max<std::size_t>(v.n, 1));
        return fmt::format("{:.2f} -> {:.2f}", v.before / n, v.after / n);
      };
      table += fmt::format("{:<34} {:>16} {:>16} {:>18} {:>18}\n", name, cell(t.position_mm), cell(t.rotation_deg),
                           tips ? cell(t.tip_mm) : "-", tips ? cell(t.tip_px) : "-");
    };
    for (std::size_t c = 0; c < pipeline_.rig().cameras.size(); ++c) {
      const std::string& name = pipeline_.rig().cameras[c].name;
      ErrorTotals last_frames;
      for (std::size_t i = online_.size() - tail; i < online_.size(); ++i) {
        if (online_[i][c]) last_frames.add(online_[i][c]->first, online_[i][c]->second);
      }
      ErrorTotals all;
      for (const auto& frame : frames_) {
        if (frame.utime[c] < 0) continue;
        const TruthInstant* truth = truth_->at(frame.utime[c]);
        if (truth == nullptr) continue;
        const auto& intrinsics = pipeline_.rig().cameras[c].intrinsics;
        all.add(hand_error(pipeline_.estimator().hand_pose(frame.exposure[c], false), *truth, c, intrinsics),
                hand_error(pipeline_.estimator().hand_pose(frame.exposure[c], last_), *truth, c, intrinsics));
      }
      row(fmt::format("{} eye, last {} frames", name, tail), last_frames);
      row(fmt::format("{} eye, final offsets, all frames", name), all);
      summary["errors"][name] = {{"last_frames", last_frames.json()}, {"final_on_all_frames", all.json()}};
    }
    return table;
  }

  ReplayOptions options_;
  Pipeline pipeline_;
  ReplayOptions::Watcher watcher_;
  std::optional<Truth> truth_;
  std::ofstream estimates_;
  std::vector<SeenFrame> frames_;
  std::vector<std::array<std::optional<std::pair<HandError, HandError>>, 2>> online_;
  std::map<std::string, std::size_t> state_counts_;
  std::size_t swapped_frames_ = 0;
  std::optional<Observation> last_view_;
  Estimate last_;
  std::optional<Estimate> converged_;  ///< the last that was, nothing having contradicted it since
  std::size_t frames_since_ = 0;
  std::optional<EstimatorState> ended_after_;  ///< the log's last state, where the offsets are those of before
  BusStatistics statistics_;
  std::string complaint_;
};

}  // namespace

std::string replay(const Configuration& configuration, const ReplayOptions& options) {
  return Replay(configuration, options).run();
}

}  // namespace bodyschema
