#pragma once

#include <Eigen/Core>
#include <vector>

namespace bodyschema {

/// Notices an encoder that keeps one and the same reading while the pictures show its joint move: it stalls. A slip is
/// one step of the offset; a joint that goes on moving under a reading that stands goes where its encoder does not say.
///
/// From the first step on the joint is suspected until its reading moves. What the pictures said of it since the
/// reading began to stand is in doubt: it may have begun to move long before that was seen. One thread.
class StalledEncoders {
 public:
  explicit StalledEncoders(Eigen::Index joints) : tracks_(static_cast<std::size_t>(joints)) {}

  /// A suspected joint whose reading moves again.
  struct Resumed {
    Eigen::Index joint = -1;
    double stepped_s = 0.0;   ///< when it was first seen to step
    double before_rad = 0.0;  ///< its offset before that
    bool went_on = false;     ///< it moved on after that step: what was learned of it since holds no longer
  };
  /// Every frame's encoders of the estimated joints.
  std::vector<Resumed> look(const Eigen::VectorXd& reading_rad, double time_s);
  /// In the frame last looked at, a joint was seen to have stepped.
  /// @param offset_rad  its offset after the step
  void stepped(Eigen::Index joint, double step_rad, double offset_rad, double time_s);
  /// Offsets of all joints as the frame last looked at shows them, with their standard deviations in it.
  void seen(const Eigen::VectorXd& offset_rad, const Eigen::VectorXd& sd_rad);
  /// The joint that stalls, -1 if none; of several, the one seen to move most.
  [[nodiscard]] Eigen::Index joint() const;
  /// How far it has been seen to move under its reading, radians.
  [[nodiscard]] double moved_rad() const;
  /// Joints that have stepped under the reading that they have still: a slip, or the beginning of a stall.
  [[nodiscard]] std::vector<Eigen::Index> suspects() const;
  [[nodiscard]] bool suspected() const { return !suspects().empty(); }
  /// When a joint's reading last changed, s.
  [[nodiscard]] double standing_since_s(Eigen::Index joint) const;
  /// Joints whose reading stands although others have moved since it does: nothing is wrong with that, but so does a
  /// stall begin.
  [[nodiscard]] std::vector<Eigen::Index> standing_while_others_move() const;

 private:
  /// Since the reading last changed.
  struct Track {
    double reading_rad = 0.0, since_s = 0.0;
    bool known = false;
    bool others_moved = false;
    int steps = 0;
    double stepped_s = 0.0, before_rad = 0.0;
    double step_rad = 0.0;                       ///< of all steps, to and fro added up
    double least_rad = 0.0, greatest_rad = 0.0;  ///< offset since the first step, as far as pictures are sure of it
    [[nodiscard]] double went_on_rad() const { return greatest_rad - least_rad; }
    [[nodiscard]] double moved_rad() const { return step_rad + went_on_rad(); }
    [[nodiscard]] bool goes_on() const;
  };
  std::vector<Track> tracks_;
};

}  // namespace bodyschema
