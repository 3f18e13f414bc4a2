#include "bodyschema/calibration/calibrate.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "bodyschema/calibration/camera_search.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/evidence/outline_distance.hpp"
#include "bodyschema/pipeline/watched_log.hpp"
#include "arm_geometry.hpp"
#include "believed_outline.hpp"
#include "beyond_model.hpp"
#include "calibrated_cameras.hpp"
#include "calibration_files.hpp"
#include "calibration_verdict.hpp"
#include "left_as_it_is.hpp"
#include "limits.hpp"
#include "loose_fingers.hpp"
#include "next_posture.hpp"
#include "raw_pictures.hpp"
#include "section_spread.hpp"

namespace bodyschema {
namespace {

namespace limits = calibration::limits;

constexpr const char* kAdvice =
    " in at least five postures that differ in every joint, held still or moved slowly, the arm in view of all cameras";

int threads_of(const CalibrationOptions& options) {
  return options.threads > 0 ? options.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

bool to_be_searched(const CameraModel& camera) {
  return camera.mount.knowledge == PlaceKnowledge::kUnknown;
}

/// Throws ConfigurationError where a file that is read would be written over.
void refuse_to_replace(const std::filesystem::path& read, const std::filesystem::path& written) {
  std::error_code not_there;
  if (!std::filesystem::equivalent(read, written, not_there)) return;
  throw ConfigurationError(written.string() + " is what is calibrated, and would be replaced; expected another folder");
}

class Calibrator {
 public:
  /// @param method  instead of the configured one
  Calibrator(const Configuration& configuration, const CalibrationOptions& options,
             std::optional<SegmentationMethod> method = std::nullopt)
      : configuration_(configuration), options_(options), pipeline_(configuration, method), rig_(pipeline_.rig()) {
    configuration.reject_unknown_keys();
    refuse_to_replace(options.configuration, options.out / "estimator.yaml");
    refuse_to_replace(pipeline_.setup().model.urdf, options.out / "corrected.urdf");
    make_folder(options.out);
    if (method) result_.remarks.push_back(kReadWithoutBackground);
  }

  /// @return none where a camera turned, and the learned background with it
  std::optional<Calibration> run() {
    WatchedLog watched = watch_log(pipeline_,
                                   {.log = options_.log,
                                    .picture_rate_hz = options_.picture_rate_hz,
                                    .kept = raw()     ? limits::kRawKept
                                            : given() ? limits::kReadAgain
                                                      : limits::kShown,
                                    .quiet = options_.quiet},
                                   estimator_can_begin());
    if (watched.background_turned) return std::nullopt;
    refuse_unusable(watched, options_.log, pipeline_.bus().channels(), kAdvice);
    log_ = &watched.pictures;
    watched_ = &watched;
    if (!options_.quiet) bar_.emplace("calibration", 100);
    std::optional<RawPictures> masks;
    if (raw()) masks.emplace(*log_, pipeline_.vision(), watched.kept);
    believe_what_is_configured();
    loose_ = loose_fingers(*log_, beliefs_);
    if (masks) believed_px_ = believed_px();
    const bool rough = believed_px_ > limits::kRough_px || hardly_known();
    bool still = masks && rough && masks->cameras_stood_still();
    if (still) {
      masks->by_what_moved();
      still = most_moved();
    }
    find_cameras(still);
    LogFit fit(*log_, threads_of(options_));
    fit.leave_out(loose_);
    std::optional<BatchFit> best;
    if (masks && !still) {
      with_better_masks(*masks, fit, best);
    } else {
      best.emplace(best_place(masks, fit));
    }
    if (masks && rough) settle(*masks, fit, best);
    if (masks || !pipeline_.learns_background()) without_strangers(fit, best);
    progress(0.6);
    if (auto more = with_effects(fit, *best)) best.emplace(std::move(*more));
    if (auto more = with_arm_geometry(fit, *best)) best.emplace(std::move(*more));
    progress(0.7);
    leave_out_sections(fit, *best);
    const Eigen::VectorXd fitted = best->state().x();
    if (given()) read_once_more(watched.kept, fit, *best);
    judge_left_out();
    describe_joints(*best);
    if (doubts_.helps && !options_.all_parameters) leave_untold(fit, fitted, *best);
    describe(fit, *best);
    progress(0.9);
    doubts_.own_masks = raw();
    doubts_.found = found_outlines(fit, *best, some_pictures(), loose_);
    judge(*best, doubts_, picture_unit(rig_.cameras.front().intrinsics), result_);
    suggest(fit, *best);
    write_calibration(result_, *best, *log_, watched.kept, pipeline_, configuration_, options_);
    progress(1.0);
    return std::move(result_);
  }

 private:
  void progress(double share) {
    if (bar_) bar_->set(static_cast<std::uint64_t>(100.0 * share));
  }

  // --- cameras ----------------------------------------------------------------------------------

  /// Where cameras of which nothing is known may be: several places of the first, the best one of the second.
  /// @param moved  masks were made of what moved before them
  void find_cameras(bool moved) {
    starts_ = {rig_};
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      if (!to_be_searched(rig_.cameras[c])) continue;
      if (raw() && !moved) {
        throw DataError(
            fmt::format("{}: camera '{}' is to be found, which takes masks of the robot, and none are to be had "
                        "before it is known where the robot is, as no background stands still in the pictures; give "
                        "masks (vision.method: given) or say roughly where the camera is (cameras.{}.pose: roughly)",
                        options_.log.string(), rig_.cameras[c].name, rig_.cameras[c].name));
      }
      const auto places = find_camera(*log_, c, limits::kPlaces, threads_of(options_));
      if (places.empty()) {
        throw DataError(
            fmt::format("{}: camera '{}' is to be found, and saw the robot in fewer than three postures; "
                        "record the arm{}",
                        options_.log.string(), rig_.cameras[c].name, kAdvice));
      }
      std::vector<StereoRig> rigs;
      for (const auto& place : places) {
        // Without a second camera to agree with, every good place of the first is tried.
        if (place.distance > limits::kOnly * limits::kOnly * places.front().distance) break;
        for (const auto& rig : starts_) {
          rigs.push_back(rig);
          auto& mount = rigs.back().cameras[c].mount;
          mount.X_PC = mount.X_PC * place.X_PC;
        }
        if (c > 0) break;
      }
      starts_ = std::move(rigs);
      progress(0.3);
    }
  }

  /// Whether the running estimator, whose particles find the way from afar, can look for the robot.
  [[nodiscard]] bool estimator_can_begin() const {
    return !raw() && std::none_of(rig_.cameras.begin(), rig_.cameras.end(), to_be_searched);
  }

  // --- pictures without masks -------------------------------------------------------------------

  [[nodiscard]] bool raw() const { return pipeline_.masks_need_estimates(); }

  /// Whether what moved is most of the robot: of an arm that rests the whole time it shows nothing.
  [[nodiscard]] bool most_moved() const {
    const auto shown = log_->parts_shown();
    return static_cast<double>(std::count(shown.begin(), shown.end(), true)) >=
           limits::kLeastSeen * static_cast<double>(shown.size());
  }

  /// How far off the robot's outlines may be by what is configured; anything where a camera is to be found.
  [[nodiscard]] double believed_px() {
    if (std::any_of(rig_.cameras.begin(), rig_.cameras.end(), to_be_searched)) return limits::kAnywhere_px;
    LogFit fit(*log_, 1);
    return believed_outline_sd_px(fit, State(log_->roles(), beliefs_.state), loose_);
  }

  /// Masks and fit by turns, masks ever nearer to what the fit of all postures says.
  void with_better_masks(RawPictures& masks, LogFit& fit, std::optional<BatchFit>& best) {
    const auto& reaches = best ? limits::kReachesMoved : limits::kReaches;
    for (std::size_t i = 0; i < reaches.size(); ++i) {
      if (i + 1 < reaches.size() && reaches[i + 1] > believed_px_) continue;  // the next one looks far enough
      if (best && reaches[i] < limits::kWithin_sd * best->noise().front().sd_px()) break;
      with_masks_anew(masks, fit, best, reaches[i]);
    }
  }

  /// Whether some camera may be turned by more than a few degrees.
  [[nodiscard]] bool hardly_known() const {
    return std::any_of(rig_.cameras.begin(), rig_.cameras.end(), [](const CameraModel& camera) {
      return camera.mount.knowledge == PlaceKnowledge::kRoughly &&
             camera.mount.sd_rad.maxCoeff() > limits::kHardlyKnown_rad;
    });
  }

  /// Until it makes no difference how far masks look: those that are made about a prediction follow it, right or wrong,
  /// but the wider they look the less.
  void settle(RawPictures& masks, LogFit& fit, std::optional<BatchFit>& best) {
    for (int again = 0; again < limits::kMostChecks; ++again) {
      PictureLog near = masks.about(best->at().corrections, limits::kWide_px);
      fit.refresh();
      BatchFit wide = started(fit, best->state().x());
      wide.run(limits::kWide_px, {});
      doubts_.unsettled = moved_joint(best->state(), best->estimate(), wide.estimate());
      if (doubts_.unsettled.empty()) {
        *log_ = std::move(near);
        fit.refresh();
        return;
      }
      best.emplace(std::move(wide));
      for (const double reach_px : limits::kReachesAgain) with_masks_anew(masks, fit, best, reach_px);
    }
  }

  /// @return the log as it was
  PictureLog with_masks_anew(RawPictures& masks, LogFit& fit, std::optional<BatchFit>& best, double reach_px) {
    PictureLog before = masks.about(best ? best->at().corrections : nominal(fit), reach_px);
    fit.refresh();
    BatchFit next = best ? about_the_same(fit, *best) : started(fit, {});
    next.run(reach_px, {});
    best.emplace(std::move(next));
    return before;
  }

  /// A joint that two answers about one state place further apart than either claims to know it; empty: none.
  static std::string moved_joint(const State& state, const MemoryEstimate& a, const MemoryEstimate& b) {
    for (Eigen::Index k = 0; k < state.joints(); ++k) {
      const double sd = std::sqrt(std::max(a.covariance(k, k), b.covariance(k, k)));
      if (std::abs(a.x[k] - b.x[k]) > limits::kSettled_sd * sd)
        return state.parameters()[static_cast<std::size_t>(k)].name;
    }
    return {};
  }

  /// What the masks show beyond the model is left out: a tool, somebody's arm.
  void without_strangers(LogFit& fit, std::optional<BatchFit>& best) {
    if (!is_near(*best)) return;
    const auto beyond = beyond_model(*log_, best->at().corrections);
    if (beyond.pictures == 0) return;
    leave_out(*log_, beyond);
    fit.refresh();
    const Eigen::VectorXd x = best->state().x();
    best.emplace(started(fit, x));
    best->run(0.0, {});
    if (beyond.on_link.empty()) return;
    result_.remarks.push_back("something is on " + beyond.on_link +
                              " that the robot's model does not have: what the masks show of it is left out");
  }

  [[nodiscard]] static bool is_near(const BatchFit& batch) { return batch.noise().front().sd_px() < limits::kNear_px; }

  [[nodiscard]] BatchFit started(LogFit& fit, const Eigen::VectorXd& x) const {
    BatchFit batch(fit, State(log_->roles(), beliefs_.state), beliefs_.tolerances, settings());
    if (x.size() > 0) batch.start_at(x);
    return batch;
  }

  /// A fit that has still to run, of the state that another one has come to: what was found besides is in it.
  [[nodiscard]] BatchFit about_the_same(LogFit& fit, const BatchFit& batch) const {
    return {fit, batch.state(), beliefs_.tolerances, settings()};
  }

  /// Encoders and cameras as they are configured.
  std::vector<Corrections> nominal(LogFit& fit) const { return fit.predict(ErrorModel(log_->roles()), {}).corrections; }

  // --- masks that were given ----------------------------------------------------------------------

  [[nodiscard]] bool given() const { return pipeline_.vision().method == SegmentationMethod::kGiven; }

  /// Masks that somebody made are one reading of the pictures. What all of them get wrong alike, postures do not show;
  /// the pictures read once more, by colours and edges about the answer, do.
  void read_once_more(const std::vector<Observation>& kept, LogFit& fit, BatchFit& best) {
    const bool pictures = std::any_of(kept.begin(), kept.end(), [](const Observation& o) {
      return std::any_of(o.cameras.begin(), o.cameras.end(), [](const auto& c) { return c && !c->image.empty(); });
    });
    const bool credible =
        doubts_.implausible.empty() && beyond_belief(best).empty();  // what is not, is not to be applied
    if (!pictures || !credible || !is_near(best)) return;
    RawPictures masks(*log_, pipeline_.vision(), kept);
    std::optional<PictureLog> given;
    std::optional<BatchFit> own(best);
    for (const double reach_px : limits::kReachesAgain) {
      PictureLog before = with_masks_anew(masks, fit, own, reach_px);
      if (!given) given.emplace(std::move(before));
    }
    *log_ = std::move(*given);
    fit.refresh();
    if (!is_near(*own)) {
      result_.remarks.push_back("colours and edges of the pictures do not show the robot: masks are as good as given");
      return;
    }
    const auto joint = moved_joint(best.state(), best.estimate(), own->estimate());
    best.meet(own->memory().estimate());
    if (joint.empty()) return;
    result_.remarks.push_back("masks and the pictures' own edges disagree about " + joint +
                              ": the answer lies between them, and by so much it is uncertain");
  }

  // --- fit --------------------------------------------------------------------------------------

  [[nodiscard]] BatchSettings settings() const {
    BatchSettings s;
    s.noise = pipeline_.options().noise;
    s.memory = pipeline_.options().memory;
    s.spacing_px = pipeline_.options().outline_spacing_px;
    return s;
  }

  [[nodiscard]] BatchFit from(LogFit& fit, const std::vector<std::size_t>& pictures, double from_px) {
    BatchFit batch = started(fit, {});
    batch.run(from_px, pictures);
    return batch;
  }

  /// From where the running estimator had come to.
  [[nodiscard]] BatchFit from_the_estimator(LogFit& fit, const std::vector<std::size_t>& pictures) {
    BatchFit batch = started(fit, {});
    batch.start_at(at_start(*watched_, batch.state()));
    batch.run(0.0, pictures);
    return batch;
  }

  /// What a start ends at.
  struct Answer {
    StereoRig rig;
    std::unique_ptr<BatchFit> fit;
    std::vector<CalibratedView> views;
  };

  /// Starts that are compared: places where cameras may be, and where the estimator had the robot.
  [[nodiscard]] std::size_t start_count() const {
    return starts_.size() + (watched_->offsets_at_start.empty() ? 0 : 1);
  }

  /// Whether some pictures tell which start is the best.
  [[nodiscard]] bool some_tell() const { return start_count() > 1 && log_->pictures().size() > limits::kEnough; }

  /// What the starts end at, each once, the best first. Which that is, some pictures tell.
  std::vector<Answer> answers(LogFit& fit) {
    const auto some = some_tell() ? some_pictures() : std::vector<std::size_t>{};
    std::vector<Answer> list;
    const auto add = [&](const StereoRig& rig, BatchFit batch) {
      auto places = views(fit, batch);
      list.push_back({rig, std::make_unique<BatchFit>(std::move(batch)), std::move(places)});
    };
    for (const auto& rig : starts_) {
      use(fit, rig);
      add(rig, from(fit, some, limits::kFrom_px));
    }
    if (!watched_->offsets_at_start.empty()) add(rig_, from_the_estimator(fit, some));
    return once_each(std::move(list));
  }

  /// The fit of the best place of the cameras, which are there then.
  /// @param masks  of pictures that come without
  BatchFit best_place(std::optional<RawPictures>& masks, LogFit& fit) {
    auto answers = this->answers(fit);
    bool last = true;  // whether masks and cameras are those of the best answer
    if (masks) last = judge_by_own_masks(*masks, fit, answers);
    if (answers.size() > 1) doubts_.rival = answers[1].fit->misfit() / std::max(1e-9, answers[0].fit->misfit());
    use(fit, answers.front().rig);
    std::optional<BatchFit> best(std::move(*answers.front().fit));
    if (!last) with_masks_anew(*masks, fit, best, limits::kReachesMoved.back());
    if (!masks && some_tell()) best->run(0.0, {});
    return std::move(*best);
  }

  /// Masks of what moved tell places apart that are far apart. Those that are nearly as good are judged by masks about
  /// each of them: a fit that the rough masks held back is a rival no longer, and a wrong place finds no outline.
  /// @return whether the masks are about the best of them now
  bool judge_by_own_masks(RawPictures& masks, LogFit& fit, std::vector<Answer>& answers) {
    const double most = limits::kOnly * answers.front().fit->misfit();
    std::erase_if(answers, [&](const Answer& a) { return a.fit->misfit() >= most; });
    for (auto& answer : answers) {
      use(fit, answer.rig);
      std::optional<BatchFit> best(std::move(*answer.fit));
      with_better_masks(masks, fit, best);
      answer.views = views(fit, *best);
      answer.fit = std::make_unique<BatchFit>(std::move(*best));
    }
    const auto* last = answers.back().fit.get();
    answers = once_each(std::move(answers));
    return answers.front().fit.get() == last;
  }

  /// Sorted by misfit. Two starts that end at one answer are no rivals.
  static std::vector<Answer> once_each(std::vector<Answer> list) {
    std::stable_sort(list.begin(), list.end(),
                     [](const Answer& a, const Answer& b) { return a.fit->misfit() < b.fit->misfit(); });
    std::vector<Answer> distinct;
    for (auto& answer : list) {
      const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Answer& other) {
        return apart(answer.views, other.views) < limits::kSameAnswer_m;
      });
      if (!known) distinct.push_back(std::move(answer));
    }
    return distinct;
  }

  /// So many pictures, all over the log, that any start's fit of them tells how good it is.
  [[nodiscard]] std::vector<std::size_t> some_pictures() const {
    const auto count = log_->pictures().size(), some = std::min(count, limits::kEnough);
    std::vector<std::size_t> list;
    for (std::size_t i = 0; i < some; ++i) list.push_back(some < 2 ? i : i * (count - 1) / (some - 1));
    return list;
  }

  /// Where the answer has the hand in each picture: all that is seen of an answer, whatever it is made of.
  std::vector<CalibratedView> views(LogFit& fit, const BatchFit& batch) const {
    auto& projection = fit.measurement().projection();
    std::vector<CalibratedView> list;
    for (std::size_t p = 0; p < log_->pictures().size(); ++p) {
      const auto& picture = log_->pictures()[p];
      projection.place(picture.joints.q, batch.at().corrections[p], picture.camera);
      list.push_back({picture.joints.utime, picture.camera, projection.hand()});
    }
    return list;
  }
  static double apart(const std::vector<CalibratedView>& a, const std::vector<CalibratedView>& b) {
    double sum = 0.0;
    for (std::size_t p = 0; p < a.size(); ++p) {
      sum += (a[p].X_camera_hand.translation() - b[p].X_camera_hand.translation()).norm();
    }
    return sum / static_cast<double>(std::max<std::size_t>(1, a.size()));
  }

  /// What the log asks for besides: causes that a diagnosis of it names become part of the state.
  std::optional<BatchFit> with_effects(LogFit& fit, const BatchFit& best) {
    if (best.postures() < DiagnosisOptions{}.fewest_postures) return std::nullopt;
    DiagnosisOptions options;
    options.noise = pipeline_.options().noise;
    options.spacing_px = pipeline_.options().outline_spacing_px;
    options.starts = {best.state().x()};
    DiagnosisReport report;
    try {
      report = diagnose(fit, beliefs_.state, beliefs_.tolerances, options);
    } catch (const DataError& error) {
      result_.remarks.push_back(std::string("no further causes were looked for: ") + error.what());
      return std::nullopt;
    }
    auto more = beliefs_;
    for (const auto& cause : report.causes) {
      if (cause.implausible && doubts_.implausible.empty()) doubts_.implausible = cause.sentence;
      CalibratedEffect effect{cause.cause.name, cause.cause.joint, cause.cause.source, cause.sentence, {}};
      for (const auto& p : cause.parameters) {
        effect.parameters.push_back({p.parameter, p.unit, p.estimate, p.sd, 0.0});
      }
      const bool named = report.verdict == "named" || report.verdict == "class";
      if (named && effect_kind_of(cause) != nullptr && effect_kind_of(cause)->timing == EffectTiming::kAlways) {
        more.state.push_back(wide_belief(cause.cause, log_->roles()));
      }
      result_.effects.push_back(std::move(effect));
    }
    if (report.verdict == "unexplained") result_.remarks.push_back(report.sentence);
    if (more.state.size() == beliefs_.state.size()) return std::nullopt;
    more.state = without_doubles(more.state);
    auto extended = extended_by(fit, best, more);
    if (extended.misfit() >= best.misfit()) return std::nullopt;
    beliefs_ = more;
    return extended;
  }

  /// A fit of a state that holds more, from where another one has come to.
  [[nodiscard]] BatchFit extended_by(LogFit& fit, const BatchFit& best, const Beliefs& beliefs) const {
    State state(log_->roles(), beliefs.state);
    BatchFit extended(fit, state, beliefs.tolerances, settings());
    extended.start_at(joined(state, best.state()));
    extended.run(0.0, {});
    return extended;
  }

  /// An arm that is built otherwise than its URDF says in so many ways that none can be named: how far, is measured.
  /// Where the pictures ask for it, joints' places and axes are estimated, otherwise what may be wrong is considered.
  std::optional<BatchFit> with_arm_geometry(LogFit& fit, const BatchFit& best) {
    if (best.postures() <= limits::kFewestPostures || !is_near(best)) return std::nullopt;
    const ArmGeometry geometry(log_->roles(), best.state(), beliefs_.tolerances);
    const auto with = [](std::vector<Belief> list, const std::vector<Belief>& more) {
      list.insert(list.end(), more.begin(), more.end());
      return list;
    };
    BatchFit probe(fit, best.state(), with(beliefs_.tolerances, geometry.probe()), settings());
    probe.run(0.0, {});
    const auto found = geometry.measure(probe);
    if (geometry.of_every_joint()) {
      result_.arm_build = ArmBuild{found.beside_sd_m, found.tilted_sd_rad, found.asked_for};
    }
    if (!found.asked_for) {
      beliefs_.tolerances = with(beliefs_.tolerances, found.beliefs);
      BatchFit considered = about_the_same(fit, best);
      considered.run(0.0, {});
      return considered;
    }
    beliefs_.state = with(beliefs_.state, found.beliefs);
    result_.remarks.push_back(
        fmt::format("the arm is not built quite as its URDF says: joints lie about {:.1f} mm beside where it has them, "
                    "axes are tilted by about {:.2f} deg; offsets are uncertain by what that leaves open",
                    1e3 * found.beside_sd_m, degrees(found.tilted_sd_rad)));
    return extended_by(fit, best, beliefs_);
  }

  static const EffectKind* effect_kind_of(const DiagnosedCause& cause) {
    return cause.cause.name == "unexplained" ? nullptr : &effect_kind(cause.cause.name);
  }

  /// Of two beliefs about one effect the later one.
  static std::vector<Belief> without_doubles(const std::vector<Belief>& beliefs) {
    std::vector<Belief> list;
    for (const auto& belief : beliefs) {
      std::erase_if(list, [&](const Belief& b) { return b.effect == belief.effect && b.target == belief.target; });
      list.push_back(belief);
    }
    return list;
  }

  /// Values of another state for the parameters that both have.
  static Eigen::VectorXd joined(const State& state, const State& known) {
    Eigen::VectorXd x = state.x();
    for (Eigen::Index i = 0; i < known.size(); ++i) {
      const auto& ref = known.parameters()[static_cast<std::size_t>(i)].ref;
      const auto& effect = known.model()[ref.effect];
      if (const auto at = state.find(effect.name(), effect.target(), ref.parameter); at >= 0) x[at] = known.x()[i];
    }
    return x;
  }

  void use(LogFit& fit, const StereoRig& rig) {
    rig_ = rig;
    log_->replace_rig(load_robot(pipeline_.setup(), rig), rig);
    fit.refresh();
    believe_what_is_configured();
  }

  void believe_what_is_configured() {
    beliefs_ = Beliefs::from(configuration_, log_->roles(), rig_, pipeline_.options());
  }

  // --- what it says -------------------------------------------------------------------------------

  static Eigen::VectorXd sds_of(const BatchFit& batch) {
    return batch.estimate().covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  }

  /// What the pictures make of each joint.
  void describe_joints(const BatchFit& batch) {
    const auto& state = batch.state();
    const Eigen::VectorXd x = state.x(), sd = sds_of(batch);
    for (Eigen::Index k = 0; k < state.joints(); ++k) {
      CalibratedJoint joint;
      joint.name = state.parameters()[static_cast<std::size_t>(k)].name;
      joint.offset_rad = joint.seen_rad = x[k];
      joint.sd_rad = joint.seen_sd_rad = sd[k];
      joint.told = doubts_.helps && is_told(state, sd, k);
      joint.applied = joint.told || options_.all_parameters;
      if (!joint.told) {
        joint.untold_why =
            doubts_.helps ? why_untold(batch, k) : "postures left out of the fit look further off with it than without";
      }
      result_.joints.push_back(std::move(joint));
    }
  }

  static bool is_told(const State& state, const Eigen::VectorXd& sd, Eigen::Index k) {
    return sd[k] < limits::kTold_rad && sd[k] < limits::kToldShare * state.prior_sd()[k];
  }

  /// Effects of the state that move the robot's joints or hands and that the pictures tell too little of.
  [[nodiscard]] static std::vector<std::size_t> untold_effects(const BatchFit& batch) {
    const auto& state = batch.state();
    const Eigen::VectorXd sd = sds_of(batch);
    std::set<std::size_t> untold;
    for (Eigen::Index k = 0; k < state.size(); ++k) {
      const auto e = state.parameters()[static_cast<std::size_t>(k)].ref.effect;
      const auto& effect = state.model()[e].name();
      const bool joint = effect == "joint_offset" || effect == "head_offset";
      const bool mount_is_told = sd[k] < limits::kToldShare * state.prior_sd()[k];
      if (joint ? !is_told(state, sd, k) : effect == "hand_mount" && !mount_is_told) untold.insert(e);
    }
    return {untold.begin(), untold.end()};
  }

  /// What is told too little stays on the robot as it is: the result becomes what is right together with that.
  /// @param fitted  the state as it was fitted to the pictures that are there now
  void leave_untold(LogFit& fit, const Eigen::VectorXd& fitted, BatchFit& batch) {
    const auto left = left_as_they_are(batch.state(), batch.estimate(), untold_effects(batch));
    for (std::size_t k = 0; k < result_.joints.size(); ++k) {
      const auto effect = batch.state().parameters()[k].ref.effect;
      result_.joints[k].applied = std::find(left.begin(), left.end(), effect) == left.end();
    }
    if (left.empty()) return;
    const State held(log_->roles(), held_as_believed(beliefs_.state, batch.state(), left));
    BatchFit again(fit, held, beliefs_.tolerances, settings());
    // By what the pictures alone say: the estimate's covariance contains by how much the answer may be wrong, and that
    // does not trade as pictures do.
    const auto& seen = batch.memory().estimate();
    again.start_at(fitted + given_as_believed(batch.state(), seen, left) - seen.x);
    again.run(0.0, {});
    batch.move_to(again.state().x() + beside(batch.state(), seen, left, batch.state().x() - fitted));
    const Eigen::VectorXd sd = sds_of(batch);
    for (std::size_t k = 0; k < result_.joints.size(); ++k) {
      auto& joint = result_.joints[k];
      const auto at = static_cast<Eigen::Index>(k);
      joint.offset_rad = joint.applied ? batch.state().x()[at] : batch.state().prior_mean()[at];
      joint.sd_rad = sd[at];
      if (!joint.told || is_told(batch.state(), sd, at)) continue;
      joint.told = false;
      joint.untold_why = "what is left as it is leaves it open";
    }
  }

  void describe(LogFit& fit, const BatchFit& batch) {
    const auto& state = batch.state();
    const Eigen::VectorXd x = state.x(), sd = sds_of(batch);
    result_.model.emplace(state.model());
    for (Eigen::Index k = state.joints(); k < state.size(); ++k) {
      const auto& p = state.parameters()[static_cast<std::size_t>(k)];
      result_.parameters.push_back(
          {p.name, p.unit, x[k] / p.si_per_unit, sd[k] / p.si_per_unit, p.prior_sd / p.si_per_unit});
    }
    result_.pictures = static_cast<std::size_t>(std::count_if(batch.at().evidence.begin(), batch.at().evidence.end(),
                                                              [](const auto& e) { return e.weight > 0.0; }));
    result_.postures = batch.memory().postures();
    result_.dispersion = batch.memory().dispersion();
    result_.posture_sd_rad = batch.memory().posture_sd_rad();
    result_.outline_sd_px = batch.noise().front().sd_px() * picture_unit(rig_.cameras.front().intrinsics);
    result_.outline_points_alike = batch.noise().front().correlated_points();
    result_.cameras = calibrated_cameras(*log_, batch);
    result_.outline_px.before = median_outline_distance_px(fit, ErrorModel(log_->roles()));
    result_.outline_px.after = median_outline_distance_px(fit, state.model());
    name_lost_postures(fit, batch);
    result_.hand_sd_m = hand_sd_m(fit, batch);
    result_.views = views(fit, batch);
  }

  /// Postures to which the answer does not belong at all, and which it has not heard.
  void name_lost_postures(LogFit& fit, const BatchFit& batch) {
    constexpr std::size_t kMostNamed = 5;
    const double lost_px = limits::kLost_px * picture_unit(rig_.cameras.front().intrinsics);
    const auto pictures = log_->pictures();
    std::size_t lost = 0;
    std::string names;
    for (std::size_t posture = 0; posture < batch.postures(); ++posture) {
      std::vector<std::size_t> own;
      for (std::size_t p = 0; p < pictures.size(); ++p) {
        if (batch.posture_by_picture()[p] == posture) own.push_back(p);
      }
      if (own.empty()) continue;
      const double off_px = median_outline_distance_px(fit, batch.state().model(), own);
      if (off_px < lost_px || ++lost > kMostNamed) continue;
      names += fmt::format("{}{} ({:.1f} s into the log)", names.empty() ? "" : ", ", posture + 1,
                           seconds(pictures[own.front()].joints.utime - pictures.front().joints.utime));
    }
    if (lost == 0) return;
    result_.remarks.push_back(fmt::format(
        "posture{} {}{}, of {}: outlines lie nowhere near the robot's; are the joint angles those of another "
        "picture, or is a mask wrong?",
        lost > 1 ? "s" : "", names, lost > kMostNamed ? fmt::format(" and {} more", lost - kMostNamed) : "",
        batch.postures()));
  }

  /// A joint that moves no outline, or one whose motion something else imitates.
  [[nodiscard]] std::string why_untold(const BatchFit& batch, Eigen::Index joint) const {
    const auto& C = batch.estimate().covariance;
    const auto& state = batch.state();
    constexpr double kHardlyLearned = 0.8, kAlike = 0.7;
    Eigen::Index like = -1;
    double most = kAlike;
    for (Eigen::Index k = 0; k < state.size(); ++k) {
      const double alike = std::abs(C(joint, k)) / std::sqrt(C(joint, joint) * C(k, k));
      if (k == joint || alike <= most) continue;
      most = alike;
      like = k;
    }
    const auto& p = state.parameters()[static_cast<std::size_t>(joint)];
    if (like < 0 && std::sqrt(C(joint, joint)) > kHardlyLearned * p.prior_sd) {
      return "its motion hardly changes the outline: a round link, or one out of view";
    }
    if (like < 0) return "the postures hardly tell it";
    return "no picture tells it from " + state.parameters()[static_cast<std::size_t>(like)].name;
  }

  [[nodiscard]] double hand_sd_m(LogFit& fit, const BatchFit& batch) const {
    const auto& state = batch.state();
    const auto directions = fit.directions(batch.at(), state.model(), state.refs());
    double sum = 0.0, n = 0.0;
    auto& measurement = fit.measurement();
    for (std::size_t p = 0; p < log_->pictures().size(); ++p) {
      if (log_->pictures()[p].camera != 0) continue;
      const auto motion = measurement.link_jacobian(log_->pictures()[p].joints.q, batch.at().corrections[p], 0,
                                                    batch.at().coordinates, measurement.projection().hand_link());
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, state.size());
      for (Eigen::Index k = 0; k < state.size(); ++k) {
        for (const auto& step : directions[p][static_cast<std::size_t>(k)]) {
          const auto at = std::find(batch.at().coordinates.begin(), batch.at().coordinates.end(), step.coordinate);
          J.col(k) += step.amount * motion.col(at - batch.at().coordinates.begin()).head<3>();
        }
      }
      sum += (J * batch.estimate().covariance * J.transpose()).trace();
      n += 1.0;
    }
    return n > 0.0 ? std::sqrt(std::max(0.0, sum / n)) : 0.0;
  }

  // --- does it hold -------------------------------------------------------------------------------

  /// Fits without each of up to `limits::kSections` parts of the log in turn: how far off the outlines of the part are
  /// that is left out, and whether the parts agree as well as is claimed. Parts are of postures in a row, for what
  /// lasts a while makes these err alike.
  void leave_out_sections(LogFit& fit, BatchFit& batch) {
    const auto postures = batch.postures();
    if (postures <= limits::kFewestPostures) return;
    const std::size_t sections = std::min(limits::kSections, postures);
    std::vector<Eigen::VectorXd> without;
    for (std::size_t section = 0; section < sections; ++section) {
      std::vector<std::size_t> kept, left_out;
      for (std::size_t p = 0; p < log_->pictures().size(); ++p) {
        (batch.posture_by_picture()[p] * sections / postures == section ? left_out : kept).push_back(p);
      }
      if (kept.empty() || left_out.empty()) continue;
      BatchFit part = about_the_same(fit, batch);
      part.run(0.0, kept);
      without.push_back(part.state().x());
      left_out_.push_back({static_cast<double>(left_out.size()),
                           median_outline_distance_px(fit, ErrorModel(log_->roles()), left_out),
                           median_outline_distance_px(fit, part.state().model(), left_out)});
    }
    const Eigen::VectorXd sd = batch.estimate().covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    std::vector<Eigen::Index> told;
    for (Eigen::Index k = 0; k < batch.state().joints(); ++k) {
      if (sd[k] < limits::kToldShare * batch.state().prior_sd()[k]) told.push_back(k);
    }
    batch.widen(section_spread(without, sd, told, settings().memory.posture_prior));
  }

  void judge_left_out() {
    if (left_out_.empty()) return;
    double before = 0.0, after = 0.0, pictures = 0.0;
    std::vector<double> own;
    for (const auto& section : left_out_) {
      before += section.pictures * section.before_px;
      after += section.pictures * section.after_px;
      pictures += section.pictures;
      own.push_back(section.after_px);
    }
    std::sort(own.begin(), own.end());
    result_.outline_px.heldout = 0.5 * (own[own.size() / 2] + own[(own.size() - 1) / 2]);
    result_.outline_px.heldout_worst = own.back();
    doubts_.heldout_mean_px = after / pictures;
    doubts_.helps =
        after / pictures < before / pictures + limits::kSame_px * picture_unit(rig_.cameras.front().intrinsics);
  }

  /// The posture that would tell most of what is told worst.
  void suggest(LogFit& fit, const BatchFit& batch) {
    if (result_.state == CalibrationState::kNotConverged) return;
    if (auto next = next_posture(fit, batch, pipeline_.setup())) {
      result_.next_posture_rad = std::move(next->joints_rad);
      result_.next_posture_for = std::move(next->tells);
    }
  }

  const Configuration& configuration_;
  CalibrationOptions options_;
  Pipeline pipeline_;
  StereoRig rig_;
  const WatchedLog* watched_ = nullptr;
  PictureLog* log_ = nullptr;  ///< its pictures
  std::vector<StereoRig> starts_;
  Beliefs beliefs_;  ///< those of the configuration, with what was found besides
  double believed_px_ = limits::kAnywhere_px;
  std::vector<bool> loose_;  ///< parts that are drawn and have no say
  struct LeftOut {
    double pictures = 0.0, before_px = 0.0, after_px = 0.0;
  };
  std::vector<LeftOut> left_out_;  ///< sections of the log, each by a fit without it
  Doubts doubts_;
  Calibration result_;
  std::optional<ProgressBar> bar_;
};

}  // namespace

const char* to_string(CalibrationState state) {
  switch (state) {
    case CalibrationState::kGood: return "good";
    case CalibrationState::kModelMisfit: return "model_misfit";
    case CalibrationState::kNotConverged: return "not_converged";
  }
  return "unknown";
}

Calibration calibrate(const Configuration& configuration, const CalibrationOptions& options) {
  if (auto result = Calibrator(configuration, options).run()) return std::move(*result);
  spdlog::warn("{}: once more: {}", options.log.string(), kReadWithoutBackground);
  return std::move(*Calibrator(configuration, options, SegmentationMethod::kStatistics).run());
}

}  // namespace bodyschema
