#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/imports/lerobot.hpp"
#include "drawn_outlines.hpp"
#include "experiments.hpp"
#include "humanoid_view.hpp"
#include "real_trial.hpp"
#include "scratch.hpp"

/// A physical humanoid that looks at its own two hands with one camera in its head (Unitree G1): sixteen episodes, each
/// calibrated alone, then half of them together. Nobody knows its true offsets. What is measured: whether the answers
/// agree with each other about where the hand is, and how far the model lies from outlines that were drawn by hand in
/// pictures of other episodes.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kEpisodesAmongAll = 3;  ///< where everything is evaluated, which takes long
constexpr double kLookRate_hz = 3.0;          ///< pictures a second that a calibration looks at
constexpr double kRateTogether_hz = 1.5;      ///< ... where it looks at many episodes
constexpr std::size_t kCommonPostures = 10;
constexpr double kRows_hz = 30.0;  ///< of the recording

/// One episode's answer.
struct Answer {
  std::int64_t episode = 0;
  Calibration calibration;
  HumanoidModel model;
};

/// Root of the mean squared distance from the mean.
double scatter(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v;
  const double mean = sum / static_cast<double>(std::max<std::size_t>(1, values.size()));
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

class HumanoidExperiment {
 public:
  explicit HumanoidExperiment(ExperimentContext& context)
      : context_(context), set_(context.options.data / "real" / "g1") {}

  void run() {
    if (!fs::exists(set_)) return;
    drawn_ = read_drawn_outlines(find_data_file("config/g1/drawn_outlines.txt"));
    std::set<std::int64_t> episodes;
    for (const auto& picture : drawn_) {
      if (context_.options.experiment == "all" && episodes.size() >= kEpisodesAmongAll) break;
      episodes.insert(picture.episode);
    }
    try {
      answer(episodes);
    } catch (const DeviceError& error) {
      context_.table += fmt::format("\nG1: skipped, the recordings cannot be read: {}\n", error.what());
      return;
    }
    if (answers_.empty()) return;
    outlines();
    repeats(answers_, "repeat");
    told();
    if (context_.options.experiment != "all") together(episodes);
  }

 private:
  static Configuration configuration() { return Configuration::load(find_data_file("config/g1/estimator.yaml")); }

  void answer(const std::set<std::int64_t>& episodes) {
    const auto out = LerobotOutput::of(work_.path() / "logs");
    import(episodes, out);
    ProgressBar bar("G1", episodes.size());
    for (const auto episode : episodes) {
      answers_.push_back(answer_of(episode, out.log_of(episode), kLookRate_hz));
      bar.set(answers_.size());
    }
  }

  void import(const std::set<std::int64_t>& episodes, const LerobotOutput& out) const {
    const auto target = ImportTarget::from(configuration(), find_data_file("config/g1/lerobot.yaml"));
    LerobotOptions options;
    options.episodes = fmt::format("{}", fmt::join(episodes, ","));
    import_lerobot(set_, target, options, out, [](const std::string&) {});
  }

  [[nodiscard]] Answer answer_of(std::int64_t episode, const fs::path& log, double rate_hz) const {
    CalibrationOptions options;
    options.log = log;
    options.out = work_.path() / fmt::format("calibration_{}", episode);
    options.picture_rate_hz = rate_hz;
    options.quiet = true;
    Answer answer{episode, calibrate(configuration(), options), view_.nominal()};
    answer.model.take(answer.calibration);
    return answer;
  }

  /// Every second episode in one log, and the others: two answers that share no picture, each asked about the other's.
  void together(const std::set<std::int64_t>& episodes) {
    const std::vector<std::int64_t> all(episodes.begin(), episodes.end());
    std::vector<Answer> halves;
    Distances before, after;
    std::vector<double> by_half;
    std::size_t told = 1000;
    std::string states;
    for (std::size_t half = 0; half < 2; ++half) {
      std::set<std::int64_t> own;
      for (std::size_t i = half; i < all.size(); i += 2) own.insert(all[i]);
      const auto out = LerobotOutput::of(work_.path() / fmt::format("half_{}.lcmlog", half));
      import(own, out);
      const auto& answer =
          halves.emplace_back(answer_of(-1 - static_cast<std::int64_t>(half), out.path, kRateTogether_hz));
      Distances other;
      for (const auto& picture : drawn_) {
        if (own.contains(picture.episode)) continue;
        before.add(distances(picture, view_.nominal()));
        other.add(distances(picture, answer.model));
      }
      by_half.push_back(median(other.all()));
      after.add(other);
      const auto& joints = answer.calibration.joints;
      told = std::min(told, static_cast<std::size_t>(std::count_if(joints.begin(), joints.end(), [](const auto& j) {
                        return j.told && j.name.starts_with("right");
                      })));
      states += fmt::format("{}{}", half > 0 ? ", " : "", to_string(answer.calibration.state));
    }
    context_.table += fmt::format("\n{:<44} {:>9} {:>9} {:>9} {:>9}\n", "G1, half of the episodes together, twice",
                                  "before", "after", "worst", "demanded");
    row("drawn outlines of the other half, px, median", before.all(), after.all(),
        *std::max_element(by_half.begin(), by_half.end()));
    row("  right arm", before.right, after.right, 0.0);
    row("  left arm", before.left, after.left, 0.0);
    context_.table += fmt::format("{:<44} {:>9} {:>9} {:>9} {:>9}\n  states: {}\n",
                                  "joints of the right arm told, fewest", "", told, "", 4, states);
    context_.summary["real"]["g1"]["together"] = {{"before_px", median(before.all())},
                                                  {"after_px", median(after.all())},
                                                  {"right_px", median(after.right)},
                                                  {"left_px", median(after.left)},
                                                  {"after_px_by_half", by_half},
                                                  {"right_told", told},
                                                  {"states", states}};
    repeats(halves, "together_repeat");
  }

  void row(const char* name, const std::vector<double>& a, const std::vector<double>& b, double worst) {
    context_.table += fmt::format("{:<44} {:>9.1f} {:>9.1f} {:>9} {:>9}\n", name, median(a), median(b),
                                  worst > 0.0 ? fmt::format("{:.1f}", worst) : "", worst > 0.0 ? "4" : "");
  }

  // --- outlines drawn by hand -------------------------------------------------------------------

  struct Distances {
    std::vector<double> left, right;
    void add(const Distances& other) {
      left.insert(left.end(), other.left.begin(), other.left.end());
      right.insert(right.end(), other.right.begin(), other.right.end());
    }
    [[nodiscard]] std::vector<double> all() const {
      auto both = left;
      both.insert(both.end(), right.begin(), right.end());
      return both;
    }
  };

  [[nodiscard]] std::map<std::string, double> joints(std::int64_t episode, std::size_t row) {
    auto& table = tables_[episode];
    if (table.rows.empty()) table = JointTable::read_file(set_ / "joints" / fmt::format("episode_{:06}.csv", episode));
    if (row >= table.rows.size()) {
      throw FileError(fmt::format("config/g1/drawn_outlines.txt: episode {} has no row {}", episode, row));
    }
    return table.row(row);
  }

  /// The same as a late picture of that row shows them.
  [[nodiscard]] std::map<std::string, double> joints_shown(const DrawnPicture& picture, const HumanoidModel& model) {
    const double at = std::max(0.0, static_cast<double>(picture.row) - kRows_hz * model.lag_s);
    auto q = joints(picture.episode, static_cast<std::size_t>(at));
    const double share = at - std::floor(at);
    if (share <= 0.0) return q;
    const auto next = joints(picture.episode, static_cast<std::size_t>(at) + 1);
    for (auto& [joint, angle] : q) angle += share * (next.at(joint) - angle);
    return q;
  }

  Distances distances(const DrawnPicture& picture, const HumanoidModel& model) {
    const auto q = joints_shown(picture, model);
    return {distances_to_outline(picture.left, view_.silhouette(model, q, "left")),
            distances_to_outline(picture.right, view_.silhouette(model, q, "right"))};
  }

  void outlines() {
    Distances before, after;
    for (const auto& picture : drawn_) before.add(distances(picture, view_.nominal()));
    std::vector<double> by_answer;
    for (const auto& answer : answers_) {
      Distances own;
      for (const auto& picture : drawn_) {
        if (picture.episode != answer.episode) own.add(distances(picture, answer.model));
      }
      by_answer.push_back(median(own.all()));
      after.add(own);
    }
    context_.table += fmt::format("\n{:<44} {:>9} {:>9} {:>9} {:>9}\n",
                                  fmt::format("G1, head camera, {} episodes alone", answers_.size()), "before", "after",
                                  "worst", "demanded");
    row("drawn outlines of other episodes, px, median", before.all(), after.all(),
        *std::max_element(by_answer.begin(), by_answer.end()));
    row("  right arm", before.right, after.right, 0.0);
    row("  left arm", before.left, after.left, 0.0);
    context_.summary["real"]["g1"]["outlines"] = {{"pictures", drawn_.size()},
                                                  {"before_px", median(before.all())},
                                                  {"after_px", median(after.all())},
                                                  {"right_px", median(after.right)},
                                                  {"left_px", median(after.left)},
                                                  {"right_before_px", median(before.right)},
                                                  {"left_before_px", median(before.left)},
                                                  {"after_px_by_episode", by_answer}};
    figure();
  }

  /// One picture that the drawn episode's answer did not see: outlines, no photograph.
  void figure() {
    const auto picture = std::max_element(drawn_.begin(), drawn_.end(), [](const auto& a, const auto& b) {
      return a.right.size() + a.left.size() < b.right.size() + b.left.size();
    });
    const auto other = std::find_if(answers_.begin(), answers_.end(),
                                    [&](const auto& answer) { return answer.episode != picture->episode; });
    if (other == answers_.end()) return;
    view_.write_figure(*picture, joints_shown(*picture, other->model), other->model,
                       context_.options.out / "g1_outlines.png");
  }

  // --- do the answers agree ---------------------------------------------------------------------

  /// Where each answer has the right hand in the camera, in postures that are the same for all.
  void repeats(const std::vector<Answer>& answers, const char* key) {
    std::vector<double> mm, deg;
    std::vector<double> nominal_mm;
    const std::size_t step = std::max<std::size_t>(1, drawn_.size() / kCommonPostures);
    for (std::size_t i = 0; i < drawn_.size() && mm.size() < kCommonPostures; i += step) {
      const auto q = joints(drawn_[i].episode, drawn_[i].row);
      std::vector<Pose> poses;
      for (const auto& answer : answers) poses.push_back(view_.hand(answer.model, q));
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const auto& pose : poses) middle += pose.translation() / static_cast<double>(poses.size());
      double squares = 0.0, turns = 0.0;
      const Eigen::Matrix3d R = mean_rotation(poses);
      for (const auto& pose : poses) {
        squares += (pose.translation() - middle).squaredNorm();
        turns += std::pow(rotation_distance(pose.linear(), R), 2);
      }
      const auto n = static_cast<double>(poses.size());
      mm.push_back(1e3 * std::sqrt(squares / n));
      deg.push_back(degrees(std::sqrt(turns / n)));
      nominal_mm.push_back(1e3 * (view_.hand(view_.nominal(), q).translation() - middle).norm());
    }
    const auto rms = [](const std::vector<double>& values) {
      double sum = 0.0;
      for (const double v : values) sum += v * v;
      return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
    };
    context_.table += fmt::format("{:<44} {:>9} {:>9.1f} {:>9.1f} {:>9}\n", "right hand in the camera, mm, scatter", "",
                                  rms(mm), *std::max_element(mm.begin(), mm.end()), 5);
    context_.table += fmt::format("{:<44} {:>9} {:>9.2f} {:>9.2f} {:>9}\n", "  deg", "", rms(deg),
                                  *std::max_element(deg.begin(), deg.end()), 1);
    context_.table += fmt::format("{:<44} {:>9.1f}\n", "  nominal model from their mean, mm", rms(nominal_mm));
    context_.summary["real"]["g1"][key] = {{"postures", mm.size()},
                                           {"hand_mm", rms(mm)},
                                           {"hand_deg", rms(deg)},
                                           {"nominal_from_mean_mm", rms(nominal_mm)}};
  }

  static Eigen::Matrix3d mean_rotation(const std::vector<Pose>& poses) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const auto& pose : poses) sum += pose.linear();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
  }

  /// What is told, how that repeats, and how the answers call themselves.
  void told() {
    std::map<std::string, std::vector<double>> offsets;
    std::size_t fewest = 1000, most = 0;
    std::map<std::string, int> states;
    std::map<std::string, std::map<std::string, int>> why;
    std::vector<double> x, y, z, focal;
    for (const auto& answer : answers_) {
      std::size_t count = 0;
      for (const auto& joint : answer.calibration.joints) {
        if (!joint.name.starts_with("right")) continue;
        count += joint.told;
        if (joint.told) {
          offsets[joint.name].push_back(degrees(joint.offset_rad));
        } else {
          ++why[joint.name][joint.untold_why];
        }
      }
      fewest = std::min(fewest, count);
      most = std::max(most, count);
      ++states[to_string(answer.calibration.state)];
      const auto& camera = answer.calibration.cameras.front();
      x.push_back(1e3 * camera.X_link_optical.translation().x());
      y.push_back(1e3 * camera.X_link_optical.translation().y());
      z.push_back(1e3 * camera.X_link_optical.translation().z());
      focal.push_back(camera.intrinsics.fx);
    }
    double worst = 0.0;
    for (const auto& [name, list] : offsets) worst = std::max(worst, scatter(list));
    context_.table += fmt::format("{:<44} {:>9} {:>9} {:>9} {:>9}\n", "joints of the right arm told, fewest and most",
                                  "", fewest, most, 4);
    context_.table += fmt::format("{:<44} {:>9} {:>9.2f} {:>9} {:>9}\n", "their offsets, deg, scatter of the worst", "",
                                  worst, "", 0.5);
    context_.table +=
        fmt::format("{:<44} {:>9} {:>9.1f} {:>9} {:>9}\n", "camera's place, mm, scatter", "",
                    std::sqrt(std::pow(scatter(x), 2) + std::pow(scatter(y), 2) + std::pow(scatter(z), 2)), "", 5);
    context_.table += fmt::format("{:<44} {:>9} {:>9.1f}\n", "focal length, px, scatter", "", scatter(focal));
    for (const auto& [state, count] : states) context_.table += fmt::format("  {}: {}\n", state, count);
    for (const auto& [joint, reasons] : why) {
      const auto usual = std::max_element(reasons.begin(), reasons.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
      context_.table += fmt::format("  {}: {} of {}: {}\n", joint, usual->second, answers_.size(), usual->first);
    }
    auto& entry = context_.summary["real"]["g1"]["told"];
    entry = {{"fewest", fewest}, {"most", most}, {"worst_scatter_deg", worst}};
    for (const auto& [state, count] : states) entry["states"][state] = count;
  }

  ExperimentContext& context_;
  fs::path set_;
  Scratch work_{"g1"};
  HumanoidView view_{configuration()};
  std::vector<DrawnPicture> drawn_;
  std::map<std::int64_t, JointTable> tables_;
  std::vector<Answer> answers_;
};

}  // namespace

void run_humanoid(ExperimentContext& context) {
  if (!fs::exists(context.options.data / "real" / "g1")) return;
  HumanoidExperiment(context).run();
}

}  // namespace bodyschema
