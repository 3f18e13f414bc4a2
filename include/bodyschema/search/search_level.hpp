#pragma once

#include <span>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// What hypotheses are scored with where the best of them is refined on the outline afterwards: a level of the
/// pictures' pyramid, and meshes as coarse as that level allows. The cost then depends neither on how large pictures
/// are nor much on how fine meshes are.
///
/// A level holds every step-th pixel of every step-th row, beginning with pixel step / 2: the same rays, fewer of them,
/// so that counts are those of the full picture by step^2, but for chance.
struct SearchLevel {
  int step = 1;
  double mesh_bound_m = 0.0;  ///< of simplified_mesh; see search_mesh_bound_m
  SilhouetteModel model;
  std::vector<PinholeIntrinsics> cameras;
};

/// @param cameras  of the full pictures. All get the same step: the largest that leaves the least of their shorter
/// sides
///   120 rows.
SearchLevel search_level(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras);

/// Meshes for outlines that decide: moved by a quarter of what a search's level of the pictures' size would allow
/// (search_mesh_bound_m), 0.025 px, which changes offsets by a few hundredths of their standard deviations. Of pictures
/// with more than 240 rows, as much as of 240: 0.02 mm at 0.3 m before a common lens. No robot is as true to its
/// meshes.
/// @param cameras  of the full pictures
SilhouetteModel outline_level(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras);

/// How far outlines may be moved, in metres: 0.1 px of the level's pictures at the nearest distance at which the robot
/// can be seen. That is where its largest part alone, of bounding radius r, fills the shorter side of s px, at the
/// depth z = f * 2 r / s: any nearer, no picture shows an outline of it all round. 0.1 px are 0.1 z / f there, so that
/// the bound is 0.2 r / s whatever the focal length.
double search_mesh_bound_m(const SilhouetteModel& model, std::span<const PinholeIntrinsics> level_cameras);

/// Every step-th pixel; an empty mask stays empty.
BinaryMask every_nth_pixel(const BinaryMask& mask, int step);
/// The camera of such a picture.
PinholeIntrinsics every_nth_pixel(const PinholeIntrinsics& camera, int step);

}  // namespace bodyschema
