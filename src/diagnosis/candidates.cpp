#include "candidates.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "bodyschema/effects/catalogue.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr double kDeg = kPi / 180.0;
constexpr double kHeadStill = 5.0 * kDeg;
constexpr double kLeastAcceleration = 5.0 * kDeg;  ///< rad/s^2 rms

std::string number(double value, int decimals) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(decimals);
  text << value;
  return text.str();
}

/// Zero mean and unit deviation, times one degree: a feature as a joint correction in radians.
std::vector<double> normalised(std::vector<double> value) {
  double mean = 0.0, square = 0.0;
  for (const double x : value) mean += x;
  mean /= static_cast<double>(std::max<std::size_t>(1, value.size()));
  for (double& x : value) {
    x -= mean;
    square += x * x;
  }
  const double deviation = std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, value.size())));
  for (double& x : value) x = deviation > 1e-12 ? x / deviation * kDeg : 0.0;
  return value;
}

double root_mean_square(const std::vector<double>& x) {
  double square = 0.0;
  for (const double value : x) square += value * value;
  return std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, x.size())));
}

/// Generic features of one joint, added to the set as candidates named "unexplained".
class GenericFeatures {
 public:
  GenericFeatures(CandidateSet& set, const CoordinateLayout& layout, const std::string& name, Eigen::Index joint)
      : set_(set), layout_(layout), name_(name), joint_(joint) {}

  void add(const std::string& variable, const std::vector<std::vector<double>>& values) {
    Candidate candidate;
    candidate.name = "unexplained";
    candidate.target.joint = name_;
    candidate.variable = variable;
    for (const auto& value : values) {
      candidate.columns.push_back({static_cast<Eigen::Index>(set_.columns.size()), 0});
      set_.columns.push_back(joint_column(layout_, joint_, normalised(value)));
    }
    set_.candidates.push_back(std::move(candidate));
  }

  /// A free curve: hat functions over the range of x, but for one, which the offset makes up for.
  void add_curve(const std::string& variable, const std::vector<double>& x, int knots) {
    auto sorted = x;
    std::sort(sorted.begin(), sorted.end());
    const double low = sorted[sorted.size() / 50], high = sorted[sorted.size() - 1 - sorted.size() / 50];
    if (high - low < 1e-6) return;
    std::vector<std::vector<double>> hats;
    for (int k = 1; k < knots; ++k) {
      const double centre = low + (high - low) * k / (knots - 1);
      const double width = (high - low) / (knots - 1);
      std::vector<double> hat(x.size());
      for (std::size_t v = 0; v < x.size(); ++v) {
        const double at = std::clamp(x[v], low, high);
        hat[v] = std::max(0.0, 1.0 - std::abs(at - centre) / width);
      }
      hats.push_back(std::move(hat));
    }
    add(variable, hats);
  }

 private:
  CandidateSet& set_;
  const CoordinateLayout& layout_;
  std::string name_;
  Eigen::Index joint_;
};

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct ArmReadings {
  /// How often the arm's joints come: messages of head and arm may come at different rates, and a joint says
  /// something new only when it moves. The quicker quarter of the times between changes; the mean period of
  /// all messages while nothing changes.
  double period_s = 1e9;
  double step_rad = 0.0;  ///< from one change to the next, of the joint that moved most; median
};

ArmReadings arm_readings(std::span<const JointSample> stream, const JointRoles& roles) {
  if (stream.size() < 2) return {};
  std::vector<double> periods, steps;
  std::size_t last = 0;
  for (std::size_t i = 1; i < stream.size(); ++i) {
    double step = 0.0;
    for (const auto joint : roles.arm) step = std::max(step, std::abs(stream[i].q[joint] - stream[last].q[joint]));
    if (step == 0.0) continue;
    periods.push_back(seconds(stream[i].utime - stream[last].utime));
    steps.push_back(step);
    last = i;
  }
  if (periods.size() < 4) {
    return {seconds(stream.back().utime - stream.front().utime) / static_cast<double>(stream.size() - 1), 0.0};
  }
  return {quantile(periods, 0.25), quantile(steps, 0.5)};
}

/// How often a joint turns round; turning points at least half a degree apart, so that encoder noise is none.
int turning_points(std::span<const JointSample> stream, Eigen::Index joint) {
  constexpr double kReversal = 0.5 * kDeg;
  double extreme = stream.empty() ? 0.0 : stream.front().q[joint];
  int count = 0, direction = 0;
  for (const auto& sample : stream) {
    const double q = sample.q[joint];
    if (direction >= 0 && q < extreme - kReversal) {
      count += direction > 0;
      direction = -1;
      extreme = q;
    } else if (direction <= 0 && q > extreme + kReversal) {
      count += direction < 0;
      direction = 1;
      extreme = q;
    } else if ((direction > 0 && q > extreme) || (direction < 0 && q < extreme)) {
      extreme = q;
    }
  }
  return count;
}

}  // namespace

bool passes_once(const MeasurementSource& source) {
  const auto& arm = source.roles().arm;
  return std::all_of(arm.begin(), arm.end(),
                     [&](const auto joint) { return turning_points(source.stream(), joint) < 2; });
}

bool is_excluded(const std::vector<NotTestable>& excluded, const CauseName& cause) {
  return std::any_of(excluded.begin(), excluded.end(), [&](const auto& e) { return e.cause == cause; });
}

std::vector<const SparseColumn*> CandidateSet::pointers() const {
  std::vector<const SparseColumn*> list;
  list.reserve(columns.size());
  for (const auto& column : columns) list.push_back(&column);
  return list;
}

CandidateSet make_candidates(MeasurementSource& source, const Linearisation& at, const BlockPlan& plan,
                             const CoordinateLayout& layout, const std::vector<CauseName>& nuisances,
                             const std::vector<NotTestable>& excluded) {
  const auto& roles = source.roles();
  const std::size_t views = source.views().size();
  CandidateSet set;
  // Encoder = true + offset.
  for (const auto joint : roles.arm) {
    set.offsets.push_back({static_cast<Eigen::Index>(set.columns.size()), 0});
    set.columns.push_back(joint_column(layout, joint, std::vector<double>(views, -kDeg)));
  }
  const auto [begin, end] = seen_span(source, at);

  std::vector<std::unique_ptr<Effect>> effects;
  for (const auto& name : effect_names()) {
    if (name == "joint_offset" || name == "slip") continue;
    for (const auto& target : effect_targets(name, roles)) {
      const CauseName cause{name, target.joint, target.source};
      if (is_excluded(excluded, cause)) continue;
      auto effect = make_effect(name, target, roles);
      if (name == "drift") {
        effect->parameters()[1].value = begin;
        effect->parameters()[2].value = end - begin;
      }
      Candidate candidate;
      candidate.name = name;
      candidate.target = target;
      candidate.nuisance = std::find(nuisances.begin(), nuisances.end(), cause) != nuisances.end();
      set.candidates.push_back(std::move(candidate));
      effects.push_back(std::move(effect));
    }
  }
  auto columns = effect_columns(source, at, effects, layout);
  std::size_t next = 0;
  for (std::size_t e = 0; e < effects.size(); ++e) {
    std::size_t index = 0;
    for (const auto& parameter : std::as_const(*effects[e]).parameters()) {
      if (!parameter.fitted) continue;
      set.candidates[e].columns.push_back({static_cast<Eigen::Index>(set.columns.size()), 0});
      set.candidates[e].parameters.push_back(index++);
      set.columns.push_back(std::move(columns[next++]));
    }
  }
  // A slip is a joint offset that begins with a cell; its exact time is found in the refit.
  for (std::size_t j = 0; j < roles.arm.size(); ++j) {
    const auto& name = roles.names[static_cast<std::size_t>(roles.arm[j])];
    if (is_excluded(excluded, {"slip", name, ""})) continue;
    for (std::size_t b = 0; b < plan.block_count(); ++b) {
      for (std::size_t cell = b == 0 ? 1 : 0; cell < plan.cell_start_s[b].size(); ++cell) {
        Candidate candidate;
        candidate.name = "slip";
        candidate.target.joint = name;
        candidate.slip = true;
        candidate.columns.push_back({set.offsets[j].index, b, cell});
        set.candidates.push_back(std::move(candidate));
      }
    }
  }

  const int harmonics = std::clamp(static_cast<int>((end - begin) * 0.4), 3, 24);
  for (const auto joint : roles.arm) {
    const auto& name = roles.names[static_cast<std::size_t>(joint)];
    GenericFeatures features(set, layout, name, joint);
    std::vector<double> t(views), q(views), q2(views), q3(views), v(views), v_abs(views), a(views), torque(views, 0.0);
    bool has_torque = false;
    for (std::size_t i = 0; i < views; ++i) {
      t[i] = (seconds(source.views()[i].joints.utime) - begin) / std::max(1e-9, end - begin);
      q[i] = at.instants[i].q[joint];
      v[i] = at.instants[i].qdot[joint];
      v_abs[i] = std::abs(v[i]);
      a[i] = at.instants[i].qddot[joint];
      if (at.instants[i].gravity_torque.size() > 0) {
        torque[i] = at.instants[i].gravity_torque[joint];
        has_torque = true;
      }
    }
    double q_mean = 0.0;
    for (const double x : q) q_mean += x / static_cast<double>(views);
    double q_range = 0.0;
    for (std::size_t i = 0; i < views; ++i) {
      q2[i] = (q[i] - q_mean) * (q[i] - q_mean);
      q3[i] = q2[i] * (q[i] - q_mean);
      q_range = std::max(q_range, std::abs(q[i] - q_mean));
    }
    for (int k = 1; k <= harmonics; ++k) {
      std::vector<double> s(views), c(views);
      for (std::size_t i = 0; i < views; ++i) {
        s[i] = std::sin(2.0 * kPi * k * t[i]);
        c[i] = std::cos(2.0 * kPi * k * t[i]);
      }
      features.add("time", {s, c});
    }
    features.add_curve("time", t, 7);
    features.add("velocity", {v});
    features.add("velocity", {v_abs});
    // Of slower motion little is known but the encoder's steps.
    if (root_mean_square(a) > kLeastAcceleration) features.add("acceleration", {a});
    if (q_range > 1.0 * kDeg) {
      features.add("angle", {q2});
      features.add("angle", {q3});
      features.add("angle", {q2, q3});
      features.add_curve("angle", q, 7);
      features.add_curve("angle", q, 11);
    }
    if (has_torque) features.add_curve("torque", torque, 5);
  }
  return set;
}

std::pair<double, double> seen_span(const MeasurementSource& source, const Linearisation& at) {
  const auto seen = [](const CompressedView& view) { return view.weight > 0.0; };
  const auto first = std::find_if(at.views.begin(), at.views.end(), seen);
  const auto last = std::find_if(at.views.rbegin(), at.views.rend(), seen);
  const auto views = source.views();
  if (first == at.views.end()) return {0.0, 1.0};
  return {seconds(views[static_cast<std::size_t>(first - at.views.begin())].joints.utime),
          seconds(views[static_cast<std::size_t>(at.views.rend() - last) - 1].joints.utime)};
}

void drop_aliased_columns(const BlockStatistics& statistics, CandidateSet& set) {
  for (auto& candidate : set.candidates) {
    if (candidate.generic() || candidate.columns.size() < 2) continue;
    const auto usable = [&](const Columns& columns) {
      auto all = set.offsets;
      all.insert(all.end(), columns.begin(), columns.end());
      return statistics.fit(all).usable;
    };
    if (usable(candidate.columns)) continue;
    Columns kept;
    std::vector<std::size_t> parameters;
    for (std::size_t i = 0; i < candidate.columns.size(); ++i) {
      auto more = kept;
      more.push_back(candidate.columns[i]);
      if (!usable(more)) continue;
      kept = more;
      parameters.push_back(candidate.parameters[i]);
    }
    if (kept.empty()) continue;  // reported as not testable
    candidate.columns = kept;
    candidate.parameters = parameters;
  }
}

std::vector<NotTestable> untestable(const MeasurementSource& source, const Linearisation& at) {
  constexpr double kLeastRange = 5.0 * kDeg;  ///< for causes that follow a joint's angle
  constexpr double kLeastSpeed = 3.0 * kDeg;  ///< rad/s rms, for causes of timing
  constexpr double kLeastTorque = 0.05;       ///< Nm, change of torque for compliance
  constexpr double kSparseEncoders_s = 0.025;
  constexpr double kJump = 8.0 * kDeg;  ///< between readings 100 ms apart even a fast arm moves less
  const auto& roles = source.roles();
  const auto views = source.views();
  const auto stream = source.stream();
  std::vector<NotTestable> list;
  const auto exclude_joint = [&](const std::string& effect, const std::string& joint, const std::string& reason) {
    for (const auto& target : effect_targets(effect, roles)) {
      const CauseName cause{effect, target.joint, target.source};
      if ((target.joint == joint || target.source == joint) && !is_excluded(list, cause)) {
        list.push_back({cause, reason});
      }
    }
  };
  const auto exclude_all = [&](const std::string& effect, const std::string& reason) {
    for (const auto& target : effect_targets(effect, roles)) {
      const CauseName cause{effect, target.joint, target.source};
      if (!is_excluded(list, cause)) list.push_back({cause, reason});
    }
  };

  bool left = false, right = false;
  for (const auto& view : views) (view.camera == 0 ? left : right) = true;
  if (!left || !right) {
    for (const char* effect : {"camera_skew", "vergence", "baseline"}) {
      exclude_all(effect, "the log has one camera");
    }
    for (const char* source_name : {"difference", "left", "right"}) {
      list.push_back({{"principal_point", "", source_name}, "the log has one camera"});
    }
  }
  if (roles.head.empty()) {
    exclude_all("base_shift",
                "the cameras do not move against the base: a shifted base looks like errors of their place");
  } else if (const double range = largest_range(source.views(), roles.neck); range < kHeadStill) {
    exclude_all("base_shift", "the neck moved " + number(range / kDeg, 1) +
                                  " deg: a shifted base looks like errors of neck and eyes");
  }
  const bool masses = !at.instants.empty() && at.instants.front().gravity_torque.size() > 0;
  if (!masses) {
    exclude_all("compliance", "the robot's URDF has no masses");
    exclude_all("payload", "the robot's URDF has no masses, so the arm's compliance is unknown");
  }
  if (const auto readings = arm_readings(stream, roles); readings.period_s > kSparseEncoders_s) {
    // Of an arm that is read from one posture to the next it does not matter how often.
    exclude_all("backlash", readings.step_rad > kJump
                                ? "the arm's readings jump from posture to posture, by " +
                                      number(readings.step_rad / kDeg, 0) +
                                      " deg (median); how the joints moved "
                                      "between them, and in which direction last, was not seen"
                                : "the arm's encoders come every " + number(1e3 * readings.period_s, 0) +
                                      " ms; the direction of motion needs 100 Hz or more");
  }
  double speed_square = 0.0;
  for (const auto joint : roles.arm) {
    const auto& name = roles.names[static_cast<std::size_t>(joint)];
    double low = 1e9, high = -1e9, torque_low = 1e9, torque_high = -1e9;
    double square = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const double q = at.instants[v].encoder[joint];
      low = std::min(low, q);
      high = std::max(high, q);
      square += std::pow(at.instants[v].qdot[joint], 2);
      if (masses) {
        torque_low = std::min(torque_low, at.instants[v].gravity_torque[joint]);
        torque_high = std::max(torque_high, at.instants[v].gravity_torque[joint]);
      }
    }
    speed_square += square / static_cast<double>(std::max<std::size_t>(1, views.size()));
    const double range = high - low;
    if (range < kLeastRange) {
      const auto reason = name + " moved " + number(range / kDeg, 1) + " deg";
      for (const char* effect : {"encoder_gain", "eccentricity", "axis_tilt", "joint_coupling", "backlash"}) {
        exclude_joint(effect, name, reason);
      }
    }
    if (masses && torque_high - torque_low < kLeastTorque) {
      exclude_joint("compliance", name,
                    "gravity's torque on " + name + " changed by " + number(torque_high - torque_low, 3) + " Nm");
    }
    // Backlash shows where a joint passes the same angles in both directions.
    const int reversals = turning_points(stream, joint);
    if (reversals < 2) {
      exclude_joint("backlash", name,
                    name + " turned round " + (reversals == 0 ? "never" : std::string("once")) +
                        "; both directions through the same postures are needed");
    }
  }
  if (std::sqrt(speed_square) < kLeastSpeed) {
    const auto reason = "the arm moved at " + number(std::sqrt(speed_square) / kDeg, 1) + " deg/s";
    exclude_all("latency", reason);
    exclude_all("camera_skew", reason);
  }
  return list;
}

std::vector<CauseName> lookalikes(const MeasurementSource& source, const CauseName& cause) {
  const auto& roles = source.roles();
  std::vector<CauseName> list;
  // Eyes that pan move within the head: they tell nothing about what lies below it.
  const bool head_moved = largest_range(source.views(), roles.neck) >= kHeadStill;
  if (cause.name != "base_shift" || head_moved) return list;
  for (const auto& target : effect_targets("head_offset", roles)) {
    list.push_back({"head_offset", target.joint, target.source});
  }
  list.push_back({"principal_point", "", "common"});
  return list;
}

std::string splitting_motion(const std::vector<CauseName>& same) {
  std::set<std::string> names;
  for (const auto& cause : same) names.insert(cause.name);
  const auto has = [&](const char* name) { return names.count(name) > 0; };
  std::string advice;
  const auto say = [&](const std::string& sentence) { advice += (advice.empty() ? "" : " ") + sentence; };
  const auto named = std::find_if(same.begin(), same.end(), [](const auto& cause) { return !cause.joint.empty(); });
  const std::string joint = named == same.end() ? "" : named->joint;
  if (names == std::set<std::string>{"axis_shift", "link_length"}) {
    return "No motion tells them apart: both say how long the link is.";
  }
  if (has("encoder_gain") && has("eccentricity")) {
    say("Sweep " + joint + " through more than 90 deg.");
  }
  if (has("payload") && has("compliance")) say("Record one log with and one without the load.");
  if ((has("slip") || has("drift")) && (has("slip") + has("drift") + has("unexplained") > 1)) {
    say("Revisit the first postures in the middle and at the end of the log.");
  }
  if (has("axis_tilt") || has("axis_shift") || has("joint_coupling")) {
    say("Move " + joint + " and its neighbours one at a time through their full ranges.");
  }
  if (has("head_offset") || has("base_shift") || (has("principal_point") && !has("vergence"))) {
    say("Move the head by 20 to 30 deg with the arm still.");
  }
  if (has("vergence") || has("baseline") || has("focal_length") || has("distortion")) {
    say("Show the hand at depths from 0.2 to 0.6 m and in the corners of the picture, or a "
        "checkerboard.");
  }
  if (has("latency") || has("camera_skew") || has("backlash")) {
    say("Repeat the same path at two speeds and in both directions.");
  }
  if (has("link_length") || has("mesh_scale") || has("silhouette_bias") || has("finger_posture")) {
    say("Show the hand near and far, and from palm and back.");
  }
  if (advice.empty()) say("Move each of these joints alone through its full range, in both directions.");
  return advice;
}

}  // namespace bodyschema::diagnosis
