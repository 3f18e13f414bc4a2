#pragma once

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Whether a picture has colour at a lower resolution than brightness, as JPEG and video keep it: beside an outline
/// colours bleed over it, and are no mixtures of both sides.
///
/// How much colour bends, of what brightness does, is compared over one pixel and over four. Where both were taken
/// pixel by pixel it is no less over one, since noise is in both; where colour is interpolated it is a fifth. Says no
/// where there is no colour to be seen.
/// @param every  looks at every so many pixels along each axis
bool colours_bleed(const Image& image, int every);

}  // namespace bodyschema
