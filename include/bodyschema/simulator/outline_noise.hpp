#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bodyschema/simulator/simulator_settings.hpp"

namespace bodyschema::simulator {

/// Puts the outlines of a mask a little beside their place, as OutlineNoise says: along their normal, by a Gaussian
/// field that is smooth in the picture and in time. The two sides of a finger err independently of each other, so
/// that it is neither moved nor thickened as a whole. Pictures may come in any order. One thread.
class OutlineDisplacer {
 public:
  /// @param purpose  another one for every camera, for independent noise
  OutlineDisplacer(int width, int height, const OutlineNoise& noise, std::uint64_t seed, const std::string& purpose);

  /// @param t_s  time of the picture; @param index  its number, for noise without memory
  /// @param coverage  share of each pixel that is covered, 0 to 1, row order; changed
  void displace(double t_s, std::int64_t index, std::vector<float>& coverage);

 private:
  /// Fields are sums of waves in the plane whose numbers are drawn such that the sums correlate as asked.
  struct Wave {
    float kx, ky;         // rad/px
    double omega, phase;  // rad/s, rad
    float now;            // phase at the picture's time
  };
  static constexpr int kWaves = 24;  // a field
  static constexpr int kFields = 3;  // right, down, outwards

  int width_, height_;
  OutlineNoise noise_;
  std::uint64_t seed_;
  std::string purpose_;
  std::vector<Wave> waves_;
  std::vector<float> kernel_, soft_, scratch_, moved_;
};

}  // namespace bodyschema::simulator
