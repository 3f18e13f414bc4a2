#pragma once

namespace bodyschema {

/// Surfaces nearer to a camera than this along its axis are not drawn, by any engine.
constexpr float kNearPlane_m = 0.01f;

}  // namespace bodyschema
