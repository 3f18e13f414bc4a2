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

/// A disk that stands still: a pipe that nobody reads, which holds 64 KiB.
class StalledDisk {
 public:
  explicit StalledDisk(const std::string& name) : file(scratch_file(name)) {
    std::filesystem::remove(file);
    made_ = mkfifo(file.c_str(), 0600) == 0;
    reader_ = open(file.c_str(), O_RDONLY | O_NONBLOCK);
  }
  ~StalledDisk() {
    close(reader_);
    std::filesystem::remove(file);
  }
  [[nodiscard]] bool ok() const { return made_ && reader_ >= 0; }
  /// The disk works again, until the recorder has done with so many messages.
  void resume(const Recorder& recorder, std::uint64_t messages) const {
    std::vector<char> sink(1 << 16);
    for (int i = 0; i < 500 && recorder.state().written + recorder.state().lost < messages; ++i) {
      (void)!read(reader_, sink.data(), sink.size());
      usleep(1000);
    }
  }
  const std::filesystem::path file;

 private:
  bool made_ = false;
  int reader_ = -1;
};

TEST(Recorder, WhatWaitsIsBounded) {
  const StalledDisk disk("bounded");
  ASSERT_TRUE(disk.ok());
  Recorder recorder(disk.file, 1000);
  const std::vector<std::uint8_t> large(100'000, 7);  // fits neither the bound nor the pipe
  std::uint64_t given = 0;
  const auto taken = [&] { return given - recorder.state().lost; };
  for (; given < 10'000 && taken() < 2; ++given) {
    recorder.record("A", 1, large);
    usleep(1000);
  }
  EXPECT_EQ(taken(), 2u) << "one is being written, one waits";
  for (int i = 0; i < 10; ++i, ++given) recorder.record("A", 2, large);
  EXPECT_EQ(taken(), 2u);
  disk.resume(recorder, given);
}

/// After a reload with larger pictures.
TEST(Recorder, TakesMoreOnceItIsGivenRoom) {
  const StalledDisk disk("room");
  ASSERT_TRUE(disk.ok());
  Recorder recorder(disk.file, 1000);
  const std::vector<std::uint8_t> large(100'000, 7);  // fits neither the bound nor the pipe
  std::uint64_t given = 0;
  const auto taken = [&] { return given - recorder.state().lost; };
  for (; given < 10'000 && taken() < 2; ++given) {
    recorder.record("A", 1, large);
    usleep(1000);
  }
  recorder.set_room(1'000'000);
  for (int i = 0; i < 5; ++i, ++given) recorder.record("A", 2, large);
  EXPECT_EQ(taken(), 7u) << "one is being written, six wait";
  disk.resume(recorder, given);
}

TEST(Recorder, TakesAMessageOfAnySizeWhereNothingWaits) {
  const auto file = scratch_file("large.lcmlog");
  {
    Recorder recorder(file, 1000);
    recorder.record("A", 1, std::vector<std::uint8_t>(200'000, 7));
    EXPECT_EQ(recorder.state().lost, 0u);
  }
  LogReader log(file);
  LogEvent event;
  ASSERT_TRUE(log.next(event));
  EXPECT_EQ(event.data.size(), 200'000u);
  std::filesystem::remove(file);
}

TEST(Recorder, EmptyMessagesTakeRoomToo) {
  const StalledDisk disk("stalled");
  ASSERT_TRUE(disk.ok());
  Recorder recorder(disk.file, 100'000);
  for (int i = 0; i < 20'000; ++i) recorder.record("A", i, {});
  const auto state = recorder.state();
  // The pipe itself holds 64 KiB, a few thousand messages.
  EXPECT_GT(state.lost, 10'000u);
  disk.resume(recorder, 20'000);
}

TEST(Recorder, FileThatCannotBeMade) {
  EXPECT_THROW(Recorder("/nowhere/at/all.lcmlog"), FileError);
}

}  // namespace
}  // namespace bodyschema
