#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace bodyschema {

/// A motion that is to be played, by a simulator or in a laboratory: postures at times, gone to one after another. As a
/// file it is CSV: lines that begin with # are remarks; then "time_s" and names of joints, and a line for each posture:
/// s from the beginning, growing, and deg (mm for a sliding joint). Joints that it does not name stay where they are.
struct MotionFile {
  struct Posture {
    double time_s = 0.0;
    Eigen::VectorXd q;  ///< of `joints`, rad (m)
  };
  std::vector<std::string> joints;
  std::vector<bool> slides;  ///< which of them
  std::vector<Posture> postures;
  std::string remark;  ///< without #

  /// @param sliding  whether a joint of that name is a sliding one; throws for one that is not known
  /// Throws FileError naming file, line and what was expected.
  template <class Slides>
  static MotionFile read(const std::filesystem::path& file, Slides sliding) {
    auto motion = parse(file);
    for (const auto& joint : motion.joints) motion.slides.push_back(sliding(joint));
    motion.to_si();
    return motion;
  }
  /// Throws as write_file (core/write_file.hpp).
  void write(const std::filesystem::path& file) const;

 private:
  static MotionFile parse(const std::filesystem::path& file);
  void to_si();
};

}  // namespace bodyschema
