#include "raw_pictures.hpp"

#include <gtest/gtest.h>

#include <initializer_list>

namespace bodyschema {
namespace {

std::vector<Observation> at(std::initializer_list<double> times_s) {
  std::vector<Observation> list;
  for (const double time_s : times_s) list.emplace_back().utime = microseconds(time_s);
  return list;
}

using Recordings = std::vector<std::size_t>;

TEST(RawPictures, APauseBeginsAnotherRecording) {
  EXPECT_EQ(recordings_of(at({0, 1, 2, 3, 13, 14, 15})), (Recordings{0, 0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(recordings_of(at({0, 1, 2, 3, 4, 5})), (Recordings{0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(recordings_of({}), Recordings{});
}

TEST(RawPictures, StillsThatTakeTheirTimeAreOneRecording) {
  EXPECT_EQ(recordings_of(at({0, 20, 45, 60, 100, 130})), (Recordings{0, 0, 0, 0, 0, 0}));
}

/// Of fewer nothing can be said of what stands still.
TEST(RawPictures, ARecordingHasThreePicturesAtLeast) {
  EXPECT_EQ(recordings_of(at({0, 1, 2, 12, 13, 23, 24, 25})), (Recordings{0, 0, 0, 1, 1, 1, 1, 1}));
}

}  // namespace
}  // namespace bodyschema
