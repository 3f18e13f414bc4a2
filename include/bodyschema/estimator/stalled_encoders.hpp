#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace bodyschema {

/// Notices an encoder that keeps one and the same reading while the pictures show its joint move: it
/// stalls. To the estimate such a joint has an offset that changes again and again; the offset of a
/// joint that is held still stays where it is, and a slip changes it once. One thread.
class StalledEncoders {
 public:
  explicit StalledEncoders(Eigen::Index joints)
      : tracks_(static_cast<std::size_t>(joints)), drift_rad_(Eigen::VectorXd::Zero(joints)) {}

  /// Frames in order of time.
  /// @param time_s  of the frame
  /// @param reading_rad  encoders of the estimated joints
  /// @param offset_rad  their offsets as known with this frame, and one sigma
  /// @param fits  whether those offsets explain the frame's pictures; otherwise it says nothing
  /// @param settled  whether the offsets are a memory of several frames, not that of a new search
  /// @param remembers  whether there is such a memory, be it doubted at the moment
  void look(double time_s, const Eigen::VectorXd& reading_rad, const Eigen::VectorXd& offset_rad,
            const Eigen::VectorXd& sd_rad, bool fits, bool settled, bool remembers);
  /// Whether a reading that stood under suspicion has moved again: its joint was seen to move meanwhile, or
  /// a memory was dropped in its last 300 frames while other joints moved. What has been learned since is
  /// wrong then.
  /// Asked with a frame's readings before `look` sees the frame.
  [[nodiscard]] bool ends(const Eigen::VectorXd& reading_rad) const;
  /// How far each offset has run in 30 frames (a second at 30 Hz) under a reading that stands, radians; zero
  /// for joints whose reading moves. A memory of frames lags behind a moving arm by about as much, which
  /// its own covariance does not tell. Of a reading that stops dead at least how far its joint would have gone
  /// on as it slowed down, for ten frames or 3 deg: by then the pictures contradict the memory or the estimate
  /// runs after them, if the joint did not stop.
  [[nodiscard]] const Eigen::VectorXd& drift_rad() const { return drift_rad_; }
  /// Whether a joint has been seen to move under a reading that stands, in the last 30 frames: a slip of an
  /// arm at rest, or the beginning of a stall.
  [[nodiscard]] bool doubtful() const { return doubtful_; }
  /// Whether a memory had to be dropped in the last 30 frames while a reading stood. If its encoder stalls, a
  /// young memory holds frames that no one set of offsets explains, and the other joints make up for it.
  [[nodiscard]] bool dropped_while_standing() const { return dropped_while_standing_; }
  /// Whether an encoder stalls or may be about to be found out.
  [[nodiscard]] bool suspected() const { return doubtful_ || joint_ >= 0; }
  /// The joint that stalls, -1 if none; of several, the one seen to move most.
  [[nodiscard]] Eigen::Index joint() const { return joint_; }
  /// How far it has been seen to move under its reading, to and fro added up, radians.
  [[nodiscard]] double moved_rad() const {
    return joint_ < 0 ? 0.0 : tracks_[static_cast<std::size_t>(joint_)].moved_rad;
  }

 private:
  static constexpr std::size_t kRecent = 30;   ///< frames
  static constexpr std::size_t kBriefly = 5;   ///< frames; enough where a memory was dropped besides
  static constexpr std::size_t kTaught = 300;  ///< frames for which a dropped memory casts doubt on the next
  /// Since the reading last changed.
  struct Track {
    double reading_rad = 0.0;
    bool known = false;       ///< whether there is an offset to compare with
    double offset_rad = 0.0;  ///< at the last move
    double sd_rad = 0.0;      ///< of that
    int away = 0;             ///< frames in a row that saw it elsewhere
    int moves = 0;
    std::size_t stood = 0;         ///< frames; 0: there has been none
    std::size_t frames_since = 0;  ///< the last move
    double moved_rad = 0.0;
    std::array<double, kRecent> recent_rad{};  ///< settled offsets, round and round
    std::size_t recent = 0;                    ///< how many there were
    double since_s = 0.0;                      ///< the first frame with this reading
    double step_rad_s = 0.0;                   ///< from the reading before to this one
    double deceleration_rad_s2 = 0.0;          ///< from step to step, 0 while it gets faster
    double run_rad = 0.0;                      ///< of all steps the same way
    [[nodiscard]] bool moved_to(double reading_rad) const;
    /// The track of the reading that follows upon this one.
    [[nodiscard]] Track moved_on(double time_s, double reading_rad) const;
    /// How far the joint has come by now if its encoder, and not it, has stopped.
    [[nodiscard]] double gone_on_rad(double time_s) const;
    [[nodiscard]] double drift_rad() const;
  };
  std::vector<Track> tracks_;
  Eigen::VectorXd drift_rad_;
  bool doubtful_ = false;
  bool dropped_while_standing_ = false;
  bool remembered_ = false;  ///< there has been a memory
  std::size_t frames_since_drop_ = kTaught;
  Eigen::Index joint_ = -1;
};

}  // namespace bodyschema
