#include "bodyschema/geometry/binary_mask.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

/// Wider than a word, and no multiple of one.
BinaryMask columns(int first, int last) {
  BinaryMask mask(70, 2);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = first; u <= last; ++u) mask.set(u, v);
  }
  return mask;
}

TEST(BinaryMask, IsWhatIsInBothInEitherOrInTheFirstAlone) {
  const BinaryMask left = columns(0, 66), right = columns(60, 69);
  BinaryMask both = left, either = left, alone = left;
  both &= right;
  either |= right;
  alone -= right;
  EXPECT_EQ(both, columns(60, 66));
  EXPECT_EQ(either, columns(0, 69));
  EXPECT_EQ(alone, columns(0, 59));
}

TEST(BinaryMask, ShowsThePixelThatAPlaceIsNearestToAndNothingOutside) {
  const BinaryMask mask = columns(0, 66);
  EXPECT_TRUE(mask.shows(66.4, 0.6));
  EXPECT_FALSE(mask.shows(66.6, 0.0));
  EXPECT_TRUE(mask.shows(-0.4, 0.0));
  EXPECT_FALSE(mask.shows(-0.6, 0.0));
  EXPECT_FALSE(mask.shows(3.0, 1.6));
  EXPECT_FALSE(BinaryMask().shows(0.0, 0.0));
}

TEST(BinaryMask, CountsNoPixelBeyondTheRow) {
  BinaryMask all(70, 2);
  all.fill(true);
  EXPECT_EQ(all.count(), 140u);
  all -= columns(0, 68);
  EXPECT_EQ(all.count(), 2u);
}

}  // namespace
}  // namespace bodyschema
