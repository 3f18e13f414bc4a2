#pragma once

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// How well the configuration knows how a lens bends its pictures.
enum class LensKnowledge {
  kNone,        ///< `distortion: none`: it does not bend them at all, as of a simulator
  kCalibrated,  ///< five numbers that somebody measured; zeros, where pictures come straightened
  kUnknown,     ///< `distortion: unknown`, or left out: nobody calibrated it
};

/// Of a camera's section. Throws ConfigurationError for anything else than those.
LensKnowledge lens_knowledge(const Configuration& camera);

/// Standard deviation that is believed of k1, which the distortion of the configuration lacks: of a lens nobody
/// calibrated, wide enough for those of 90 degrees; of a calibrated one, what calibrations of one camera differ by.
double lens_sd(LensKnowledge knowledge);

}  // namespace bodyschema
