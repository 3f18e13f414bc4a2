#include "bodyschema/service/recorder.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

std::filesystem::path scratch_file(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("bodyschema-" + std::to_string(getpid()) + "-" + name);
}

TEST(Recorder, WritesWhatItWasGivenInOrder) {
  const auto file = scratch_file("order.lcmlog");
  {
    Recorder recorder(file);
    for (int i = 0; i < 500; ++i) {
      const std::vector<std::uint8_t> message(static_cast<std::size_t>(i), static_cast<std::uint8_t>(i));
      recorder.record(i % 2 == 0 ? "A" : "B", i, message);
    }
  }
  LogReader log(file);
  LogEvent event;
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(log.next(event)) << i;
    EXPECT_EQ(event.channel, i % 2 == 0 ? "A" : "B");
    EXPECT_EQ(event.time_us, i);
    ASSERT_EQ(event.data.size(), static_cast<std::size_t>(i));
  }
  EXPECT_FALSE(log.next(event));
  std::filesystem::remove(file);
}

TEST(Recorder, FullDiskEndsTheRecordingNotTheProgram) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "this machine has no /dev/full";
  Recorder recorder("/dev/full");
  const std::vector<std::uint8_t> message(1000, 7);
  recorder.record("A", 1, message);
  for (int i = 0; i < 200 && recorder.state().failure.empty(); ++i) usleep(10'000);
  EXPECT_NE(recorder.state().failure, "");
  recorder.record("A", 2, message);
  const auto state = recorder.state();
  EXPECT_EQ(state.written, 0u);
  EXPECT_EQ(state.lost, 2u);
}

TEST(Recorder, WhatWaitsIsBounded) {
  const auto file = scratch_file("bounded.lcmlog");
  Recorder recorder(file, 1000);
  recorder.record("A", 1, std::vector<std::uint8_t>(2000, 7));  // can never fit
  EXPECT_EQ(recorder.state().lost, 1u);
  std::filesystem::remove(file);
}

TEST(Recorder, EmptyMessagesTakeRoomToo) {
  // A disk that stands still: a pipe that nobody reads.
  const auto pipe = scratch_file("stalled");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  {
    Recorder recorder(pipe, 100'000);
    for (int i = 0; i < 20'000; ++i) recorder.record("A", i, {});
    const auto state = recorder.state();
    // The pipe itself holds 64 KiB, a few thousand messages.
    EXPECT_GT(state.lost, 10'000u);
    std::vector<char> sink(1 << 16);
    for (int i = 0; i < 500 && recorder.state().written + recorder.state().lost < 20'000; ++i) {
      (void)!read(reader, sink.data(), sink.size());
      usleep(1000);
    }
  }
  close(reader);
  std::filesystem::remove(pipe);
}

TEST(Recorder, FileThatCannotBeMade) {
  EXPECT_THROW(Recorder("/nowhere/at/all.lcmlog"), FileError);
}

}  // namespace
}  // namespace bodyschema
