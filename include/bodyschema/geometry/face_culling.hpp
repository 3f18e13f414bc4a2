#pragma once

namespace bodyschema {

/// Which triangles make up the silhouette of an open part. Closed parts look the same with both.
enum class FaceCulling {
  kNone,  ///< every triangle, from either side
  kBack,  ///< only triangles that face the camera (what most game engines draw)
};

}  // namespace bodyschema
