#pragma once

#include <vector>

#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/evidence/picture_log.hpp"

namespace bodyschema {

/// Of each rendered link, whether it is part of a finger whose joint angles are not believed to be good enough to say
/// anything of the arm: where `finger_posture` may be so far off that a finger lies beside where it is drawn. Such
/// fingers are drawn, since they hide what is behind them. Empty: none is.
std::vector<bool> loose_fingers(const PictureLog& log, const Beliefs& beliefs);

}  // namespace bodyschema
