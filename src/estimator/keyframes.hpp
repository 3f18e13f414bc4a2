#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "outline_fitter.hpp"

namespace bodyschema {

/// The first frame of every posture that is remembered, kept to be linearised anew where the estimate has moved on. One
/// thread.
class Keyframes {
 public:
  /// Keeps a frame that began a block; those whose blocks are gone go.
  /// @param shown  whether its pictures, which are not kept, showed the robot's outline
  void keep(const Frame& frame, std::uint64_t block, const PostureMemory& memory, bool shown);
  /// Linearises anew what was linearised far from where the estimate is by now, a little in every frame.
  void look_again(PostureMemory& memory, OutlineFitter& fitter);
  void forget();

 private:
  struct Keyframe {
    Frame frame;
    std::vector<CameraObservation> pictures;  ///< per camera: masks, not the pictures themselves
  };
  std::map<std::uint64_t, Keyframe> frames_;  ///< by the memory's blocks
  std::vector<std::uint64_t> not_found_;      ///< blocks whose outlines were not found about the estimate
};

}  // namespace bodyschema
