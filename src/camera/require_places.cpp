#include "bodyschema/camera/require_places.hpp"

#include "bodyschema/core/error.hpp"

namespace bodyschema {

void require_places(const StereoRig& rig, const std::string& what) {
  for (const CameraModel& camera : rig.cameras) {
    if (camera.mount.knowledge != PlaceKnowledge::kUnknown) continue;
    throw ConfigurationError(
        camera.place + ": where camera '" + camera.name + "' is, is not known (pose: unknown), and " + what +
        " needs it: 'bodyschema calibrate' finds it from the same log and writes an estimator.yaml to "
        "go on with");
  }
}

}  // namespace bodyschema
