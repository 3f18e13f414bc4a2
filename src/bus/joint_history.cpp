#include "bodyschema/bus/joint_history.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

namespace {
constexpr double kShortestStep_s = 0.010;
/// Readings this close are the same: a joint at rest.
constexpr double kStill_rad = 2e-4;
constexpr Microseconds kRestless = 100'000;
// Velocities that nobody publishes are slopes over so long, for encoders' steps, which would be fast motion between
// neighbours; what moved by no more than some steps of them stands.
constexpr Microseconds kSlope = 100'000;
constexpr double kMoved_rad = 5e-3;
}  // namespace

JointHistory::JointHistory(std::vector<std::string> joint_names, const std::map<std::string, double>& fixed_rad,
                           const JointHistoryOptions& options)
    : names_(std::move(joint_names)), options_(options), rings_(names_.size()) {
  for (std::size_t j = 0; j < names_.size(); ++j) {
    index_[names_[j]] = static_cast<Eigen::Index>(j);
    Ring& ring = rings_[j];
    ring.buffer.resize(static_cast<std::size_t>(std::max(options_.samples, 2)));
    if (const auto fixed = fixed_rad.find(names_[j]); fixed != fixed_rad.end()) {
      ring.is_fixed = true;
      ring.fixed_rad = fixed->second;
    }
    ring.is_idle = options_.idle_joints.contains(names_[j]);
  }
}

void JointHistory::Ring::push(const Sample& sample) {
  buffer[(first + count) % buffer.size()] = sample;
  if (count < buffer.size()) {
    ++count;
  } else {
    first = (first + 1) % buffer.size();
  }
}

std::size_t JointHistory::Ring::first_from(Microseconds utime) const {
  std::size_t low = 0;
  std::size_t high = count;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (at(middle).utime < utime) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

void JointHistory::map_names(const std::vector<std::string>& names) {
  if (names == mapped_names_) return;
  mapped_names_ = names;
  mapping_.assign(names.size(), -1);
  std::vector<bool> seen(names_.size(), false);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto known = index_.find(names[i]);
    if (known == index_.end() || seen[static_cast<std::size_t>(known->second)]) continue;
    seen[static_cast<std::size_t>(known->second)] = true;  // the first of a repeated name counts
    mapping_[i] = known->second;
  }
}

JointHistory::Arrival JointHistory::add(const JointStateMessage& message) {
  map_names(message.names);
  bool any = false;
  Microseconds last = -1;
  for (const Eigen::Index j : mapping_) {
    if (j < 0) continue;
    any = true;
    last = std::max(last, newest(j));
  }
  if (!any) return Arrival::kNoKnownJoint;
  if (message.utime <= last) return message.utime == last ? Arrival::kDuplicate : Arrival::kOlder;
  for (std::size_t i = 0; i < mapping_.size(); ++i) {
    if (mapping_[i] < 0) continue;
    velocities_published_ = velocities_published_ || message.velocity_rad_s[i] != 0.0f;
    rings_[static_cast<std::size_t>(mapping_[i])].push(
        {message.utime, static_cast<double>(message.position_rad[i]), static_cast<double>(message.velocity_rad_s[i])});
  }
  newest_ = std::max(newest_, message.utime);
  return Arrival::kFresh;
}

bool JointHistory::too_far(double way_rad, const Sample& before, const Sample& after) const {
  const double step_s = seconds(after.utime - before.utime);
  return std::abs(way_rad) > options_.max_speed_rad_s * std::max(step_s, kShortestStep_s);
}

/// Whether readings up to sample `last` have jumped to and fro shortly before the instant: then none of them
/// is to be relied on, however smooth the two next to it are. A full turn is no jump here: the arm is the
/// same, and a joint may hover about the place where its encoder wraps.
bool JointHistory::is_restless(const Ring& ring, std::size_t last, Microseconds utime) const {
  bool to = false, fro = false;
  for (std::size_t i = last; i > 0 && ring.at(i - 1).utime > utime - kRestless; --i) {
    const Sample &before = ring.at(i - 1), &after = ring.at(i);
    const double way_rad = std::remainder(after.q - before.q, 2.0 * kPi);
    if (too_far(way_rad, before, after)) (way_rad > 0.0 ? to : fro) = true;
  }
  return to && fro;
}

/// Over the readings up to sample `last`; 0 where they are silent or jump meanwhile.
double JointHistory::slope(const Ring& ring, std::size_t last) const {
  std::size_t first = last;
  while (first > 0 && ring.at(last).utime - ring.at(first).utime < kSlope) {
    const Sample &before = ring.at(first - 1), &after = ring.at(first);
    if (after.utime - before.utime > options_.max_gap || too_far(after.q - before.q, before, after)) return 0.0;
    --first;
  }
  const double moved = ring.at(last).q - ring.at(first).q;
  if (std::abs(moved) <= kMoved_rad) return 0.0;
  return moved / seconds(ring.at(last).utime - ring.at(first).utime);
}

JointHistory::Verdict JointHistory::interpolate(const Ring& ring, Microseconds utime, double& q, double& qdot) const {
  if (ring.count == 0) {
    q = ring.fixed_rad;
    qdot = 0.0;
    return ring.is_fixed ? Verdict::kReady : Verdict::kNotYet;
  }
  if (ring.at(ring.count - 1).utime < utime) return Verdict::kNotYet;
  if (ring.at(0).utime > utime) return Verdict::kTooOld;
  const std::size_t low = ring.first_from(utime);
  const Sample& after = ring.at(low);
  const Sample& before = ring.at(low > 0 ? low - 1 : low);
  const double step_s = seconds(after.utime - before.utime);
  const bool still = std::abs(after.q - before.q) <= kStill_rad;
  const bool gap = after.utime - before.utime > (still ? options_.max_still_gap : options_.max_gap);
  const bool jump = too_far(after.q - before.q, before, after);
  if (is_restless(ring, low, utime)) return Verdict::kJump;
  q = after.q;
  qdot = after.qdot;
  if (after.utime != utime) {
    if (gap) return Verdict::kGap;
    if (jump) return Verdict::kJump;
    const double share = seconds(utime - before.utime) / step_s;
    q = before.q + share * (after.q - before.q);
    qdot = before.qdot + share * (after.qdot - before.qdot);
  }
  if (options_.velocity_from_differences) {
    qdot = gap || jump || step_s == 0.0 ? 0.0 : (after.q - before.q) / step_s;
  } else if (!velocities_published_) {
    qdot = slope(ring, low);
  }
  return Verdict::kReady;
}

/// Whether a joint that need not be published may take its last reading, or the fixed value before the first,
/// where there is none around the instant. One that is published may not: that would be a guess.
bool JointHistory::may_hold(const Ring& ring, Verdict verdict, Microseconds utime) const {
  if (ring.is_idle) return true;
  if (!ring.is_fixed) return false;
  const auto seldom = [&](std::size_t i) { return ring.at(i).utime - ring.at(i - 1).utime > options_.max_still_gap; };
  switch (verdict) {
    case Verdict::kNotYet: return ring.count < 2 || seldom(ring.count - 1);
    case Verdict::kTooOld: return ring.count < ring.buffer.size();  // else earlier ones were forgotten
    case Verdict::kGap: return seldom(ring.first_from(utime));
    case Verdict::kReady:
    case Verdict::kJump: break;
  }
  return false;
}

JointHistory::Answer JointHistory::interpolate(Microseconds utime, JointSample& out) const {
  const auto n = static_cast<Eigen::Index>(rings_.size());
  out.utime = utime;
  out.q.resize(n);
  out.qdot.resize(n);
  Answer answer;
  for (Eigen::Index j = 0; j < n; ++j) {
    const Ring& ring = rings_[static_cast<std::size_t>(j)];
    const Verdict verdict = interpolate(ring, utime, out.q[j], out.qdot[j]);
    if (verdict == Verdict::kReady) continue;
    if (may_hold(ring, verdict, utime)) {
      const std::size_t after = ring.first_from(utime);
      out.q[j] = after > 0 ? ring.at(after - 1).q : ring.fixed_rad;
      out.qdot[j] = 0.0;
      continue;
    }
    if (verdict != Verdict::kNotYet) return {verdict, j};  // waiting will not mend it
    if (answer.verdict == Verdict::kReady) answer = {verdict, j};
  }
  return answer;
}

void JointHistory::clear() {
  for (Ring& ring : rings_) ring.count = ring.first = 0;
  newest_ = -1;
  velocities_published_ = false;
}

Microseconds JointHistory::newest(Eigen::Index joint) const {
  const Ring& ring = rings_[static_cast<std::size_t>(joint)];
  return ring.count == 0 ? -1 : ring.at(ring.count - 1).utime;
}

std::vector<std::string> JointHistory::missing_joints() const {
  std::vector<std::string> missing;
  for (std::size_t j = 0; j < rings_.size(); ++j) {
    if (rings_[j].count == 0 && !rings_[j].is_fixed && !rings_[j].is_idle) missing.push_back(names_[j]);
  }
  return missing;
}

}  // namespace bodyschema
