#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

struct JointHistoryOptions {
  /// Samples kept per joint; at 100 Hz 1024 are ten seconds.
  int samples = 1024;
  /// Neighbouring samples further apart than this are not interpolated across,
  Microseconds max_gap = 100'000;
  /// unless the joint reads the same on both sides and they are no further apart than this.
  Microseconds max_still_gap = 1'000'000;
  /// Neighbouring samples that differ by more than this speed allows (taken over at least 10 ms, for
  /// the noise of closely spaced samples) are a jump, across which nothing is interpolated either; after
  /// one to and one fro nothing is for 100 ms.
  double max_speed_rad_s = 20.0;
  /// Where joint velocities come from: the messages, or the slope between the two neighbours. As long as no message has
  /// a velocity other than zero, they are the slope over the last 100 ms.
  bool velocity_from_differences = false;
  /// Joints that move nothing that is seen or sees: whatever their readings do, they stand in nobody's way.
  std::set<std::string> idle_joints;
};

/// Encoder readings of the recent past, joint by joint, and what they were at a given instant.
///
/// Joints are matched by name, so that one message may carry all of them, some, or others besides;
/// head and arm may be published separately. Joint vectors are in the order of `joint_names`.
/// A joint in `fixed_rad` holds that value before its first reading, and its last reading after it, unless
/// its readings come often enough that one must be awaited: a message gone astray makes no publisher. One thread.
class JointHistory {
 public:
  JointHistory(std::vector<std::string> joint_names, const std::map<std::string, double>& fixed_rad,
               const JointHistoryOptions& options);

  enum class Arrival { kFresh, kDuplicate, kOlder, kNoKnownJoint };
  /// `kFresh` when the sample was taken in; any other leaves the history as it was.
  Arrival add(const JointStateMessage& message);

  enum class Verdict {
    kReady,
    kNotYet,  ///< a joint has no sample at or after the instant, yet
    kTooOld,  ///< a joint's samples begin after the instant
    kGap,     ///< silence around the instant
    kJump,    ///< a jump around the instant
  };
  struct Answer {
    Verdict verdict = Verdict::kReady;
    Eigen::Index joint = -1;  ///< the first joint that stands in the way
  };
  /// Encoders at `utime`, linear between neighbours. Allocates nothing once `out` has its size.
  Answer interpolate(Microseconds utime, JointSample& out) const;

  /// Forgets all samples (clock step).
  void clear();
  /// Newest stamp of any joint and of one joint; -1: none.
  [[nodiscard]] Microseconds newest() const { return newest_; }
  [[nodiscard]] Microseconds newest(Eigen::Index joint) const;
  [[nodiscard]] const std::vector<std::string>& joint_names() const { return names_; }
  /// Neither published so far nor fixed.
  [[nodiscard]] std::vector<std::string> missing_joints() const;

 private:
  struct Sample {
    Microseconds utime;
    double q;
    double qdot;
  };
  /// The last `samples` readings of one joint; index 0 is the oldest.
  struct Ring {
    std::vector<Sample> buffer;
    std::size_t first = 0;
    std::size_t count = 0;
    double fixed_rad = 0.0;
    bool is_fixed = false;
    bool is_idle = false;
    [[nodiscard]] const Sample& at(std::size_t i) const { return buffer[(first + i) % buffer.size()]; }
    void push(const Sample& sample);
    /// The first sample at or after the instant; count: none.
    [[nodiscard]] std::size_t first_from(Microseconds utime) const;
  };
  void map_names(const std::vector<std::string>& names);
  Verdict interpolate(const Ring& ring, Microseconds utime, double& q, double& qdot) const;
  [[nodiscard]] bool may_hold(const Ring& ring, Verdict verdict, Microseconds utime) const;
  [[nodiscard]] bool too_far(double way_rad, const Sample& before, const Sample& after) const;
  [[nodiscard]] double slope(const Ring& ring, std::size_t last) const;
  [[nodiscard]] bool is_restless(const Ring& ring, std::size_t last, Microseconds utime) const;

  std::vector<std::string> names_;
  std::map<std::string, Eigen::Index> index_;
  JointHistoryOptions options_;
  std::vector<Ring> rings_;
  Microseconds newest_ = -1;
  bool velocities_published_ = false;  ///< one that is not zero, by any joint
  /// Index of each name of the last message (-1: not ours), kept while the names stay the same.
  std::vector<std::string> mapped_names_;
  std::vector<Eigen::Index> mapping_;
};

}  // namespace bodyschema
