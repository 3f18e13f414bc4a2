#pragma once

#include <Eigen/Core>
#include <vector>

namespace bodyschema {

/// Notices an encoder that keeps one and the same reading while the pictures show its joint move: it stalls. A slip is
/// one step of the offset; a joint that steps again and again under a reading that stands goes where its encoder does
/// not say. One thread.
class StalledEncoders {
 public:
  explicit StalledEncoders(Eigen::Index joints) : tracks_(static_cast<std::size_t>(joints)) {}

  /// Every frame's encoders of the estimated joints.
  /// @return joints whose reading moves again after the pictures had shown them move under it: what was learned of
  ///   them meanwhile holds no longer
  std::vector<Eigen::Index> look(const Eigen::VectorXd& reading_rad);
  /// In the frame last looked at, a joint was seen to have stepped.
  void stepped(Eigen::Index joint, double step_rad);
  /// The joint that stalls, -1 if none; of several, the one seen to move most.
  [[nodiscard]] Eigen::Index joint() const;
  /// How far it has been seen to move under its reading, to and fro added up, radians.
  [[nodiscard]] double moved_rad() const;
  /// Whether some joint has stepped under the reading that it has still: a slip, or the beginning of a stall.
  [[nodiscard]] bool suspected() const;

 private:
  /// Since the reading last changed.
  struct Track {
    double reading_rad = 0.0;
    bool known = false;
    int steps = 0;
    double moved_rad = 0.0;
  };
  std::vector<Track> tracks_;
};

}  // namespace bodyschema
