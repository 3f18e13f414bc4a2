#include "bodyschema/bus/log.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <random>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using Content = std::vector<std::uint8_t>;

class LogFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() / ("bodyschema_log_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
    file_ = directory_ / "a.log";
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  static Content content(int i) {
    Content bytes(static_cast<std::size_t>(i * 7 % 50));
    for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k] = static_cast<std::uint8_t>(i + static_cast<int>(k));
    return bytes;
  }
  void write_log(int events) {
    LogWriter writer(file_);
    for (int i = 0; i < events; ++i) writer.publish(i % 2 == 0 ? "EVEN" : "ODD_CHANNEL", 1000 + i, content(i));
  }
  Content slurp() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void spit(const Content& bytes) const {
    std::ofstream(file_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  /// Every event that can be read; checks that each is one that was written.
  std::vector<std::int64_t> readable() const {
    LogReader reader(file_);
    LogEvent event;
    std::vector<std::int64_t> numbers;
    while (reader.next(event)) {
      const int i = static_cast<int>(event.number);
      EXPECT_EQ(event.data, content(i));
      EXPECT_EQ(event.time_us, 1000 + i);
      EXPECT_EQ(event.channel, i % 2 == 0 ? "EVEN" : "ODD_CHANNEL");
      numbers.push_back(event.number);
    }
    EXPECT_EQ(reader.position(), reader.size());
    return numbers;
  }
  /// Another process writes one message after the other and is killed once it has said so of message `wait_for`.
  /// Returns the last one of which it said so; negative where it could not be started.
  int last_before_kill(int wait_for, const std::function<void(LogWriter&, int)>& publish) const {
    int pipe_ends[2];
    if (pipe(pipe_ends) != 0) return -1;
    const pid_t child = fork();
    if (child < 0) return -1;
    if (child == 0) {
      close(pipe_ends[0]);
      LogWriter writer(file_);
      for (int i = 0; i < 200; ++i) {  // no more than a disk has room for, however late the kill comes
        publish(writer, i);
        if (write(pipe_ends[1], &i, sizeof i) != ssize_t{sizeof i}) _exit(1);
      }
      while (true) pause();
    }
    close(pipe_ends[1]);
    int last = -1;
    const auto said = [&](int& i) { return read(pipe_ends[0], &i, sizeof i) == ssize_t{sizeof i}; };
    while (last < wait_for && said(last)) {
    }
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    for (int i = 0; said(i);) last = i;
    close(pipe_ends[0]);
    return last;
  }
  static std::string error_of(const std::filesystem::path& file) {
    try {
      LogReader reader(file);
    } catch (const FileError& e) {
      return e.what();
    }
    return "";
  }
  std::filesystem::path directory_;
  std::filesystem::path file_;
};

TEST_F(LogFiles, ComeBackWhole) {
  write_log(100);
  EXPECT_EQ(readable().size(), 100u);
  LogReader reader(file_);
  LogEvent event;
  while (reader.next(event)) {
  }
  EXPECT_EQ(reader.damaged_places(), 0u);
}

TEST_F(LogFiles, AreReadByLcmsOwnReader) {
  write_log(20);
  lcm::LogFile log(file_, "r");
  ASSERT_TRUE(log.good());
  for (int i = 0; i < 20; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr) << i;
    EXPECT_EQ(event->eventnum, i);
    EXPECT_EQ(event->timestamp, 1000 + i);
    EXPECT_EQ(event->channel, i % 2 == 0 ? "EVEN" : "ODD_CHANNEL");
    const auto* data = static_cast<const std::uint8_t*>(event->data);
    EXPECT_EQ(Content(data, data + event->datalen), content(i));
  }
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST_F(LogFiles, OfLcmsOwnWriterAreRead) {
  {
    lcm::LogFile log(file_, "w");
    for (int i = 0; i < 20; ++i) {
      auto bytes = content(i);
      lcm::LogEvent event{};
      event.timestamp = 1000 + i;
      event.channel = i % 2 == 0 ? "EVEN" : "ODD_CHANNEL";
      event.datalen = static_cast<std::int32_t>(bytes.size());
      event.data = bytes.data();
      ASSERT_EQ(log.writeEvent(&event), 0);
    }
  }
  EXPECT_EQ(readable().size(), 20u);
}

TEST_F(LogFiles, CutAnywhereKeepTheirWholeEvents) {
  write_log(12);
  const Content whole = slurp();
  std::vector<std::size_t> ends;  // of events
  {
    LogReader reader(file_);
    LogEvent event;
    while (reader.next(event)) ends.push_back(reader.position());
  }
  for (std::size_t n = ends[0]; n < whole.size(); ++n) {
    spit(Content(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)));
    const auto expected =
        static_cast<std::size_t>(std::count_if(ends.begin(), ends.end(), [&](auto e) { return e <= n; }));
    EXPECT_EQ(readable().size(), expected) << "cut at " << n;
  }
}

TEST_F(LogFiles, DamagedAnywhereLoseAtMostThreeEvents) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  write_log(30);
  const Content whole = slurp();
  for (int round = 0; round < 300; ++round) {
    Content damaged = whole;
    // Ten bytes in a row overwritten: at most two events hit, and the one before them, whose end
    // can no longer be verified. A byte of content alone cannot be noticed by this format.
    const std::size_t at = random() % (whole.size() - 10);
    for (std::size_t i = 0; i < 10; ++i) damaged[at + i] = static_cast<std::uint8_t>(random());
    spit(damaged);
    LogReader reader(file_);
    LogEvent event;
    std::size_t n = 0;
    while (reader.next(event)) ++n;
    EXPECT_GE(n, 27u) << "at " << at;
    EXPECT_LE(n, 30u);
    EXPECT_EQ(reader.position(), reader.size());
  }
}

TEST_F(LogFiles, DamageIsCounted) {
  write_log(10);
  Content bytes = slurp();
  std::size_t end_of_third = 0;
  {
    LogReader reader(file_);
    LogEvent event;
    for (int i = 0; i < 3; ++i) reader.next(event);
    end_of_third = reader.position();
  }
  bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(end_of_third), 1000, 0xED);
  spit(bytes);
  LogReader reader(file_);
  LogEvent event;
  std::size_t n = 0;
  while (reader.next(event)) ++n;
  EXPECT_GE(n, 9u);
  EXPECT_EQ(reader.damaged_places(), 1u);
  EXPECT_GE(reader.skipped_bytes(), 1000u);
}

TEST_F(LogFiles, WithAHugeLengthDoNotTakeMemory) {
  write_log(3);
  Content bytes = slurp();
  bytes[24] = 0x7f;  // data length of the first event becomes two gigabytes
  spit(bytes);
  EXPECT_EQ(readable().size(), 2u);
}

TEST_F(LogFiles, WithTimesThatCannotBeGiveTimesThatCanBeSubtracted) {
  {
    LogWriter writer(file_);
    writer.publish("C", std::numeric_limits<Microseconds>::min(), content(1));
    writer.publish("C", std::numeric_limits<Microseconds>::max(), content(1));
  }
  LogReader reader(file_);
  LogEvent first, last;
  ASSERT_TRUE(reader.next(first));
  ASSERT_TRUE(reader.next(last));
  EXPECT_EQ(last.time_us - first.time_us, 18'000'000'000'000'000);
}

// Headers every 64 bytes, each of an event of 8 MiB that ends in the middle of something, or that has no name: were
// all of each read, this would take hours.
TEST_F(LogFiles, FullOfEventsThatAreNoneAreReadOnce) {
  for (const bool ends_well : {false, true}) {
    constexpr std::size_t kSize = 16 << 20, kEvery = 64;
    Content bytes(kSize + kEvery, 0);
    const auto put = [&](std::size_t at, std::uint32_t value) {
      for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
    };
    for (std::size_t at = 0; at < kSize; at += kEvery) {
      put(at, 0xEDA1DA01);
      put(at + 20, 1);
      put(at + 24, (8 << 20) - 29 + (ends_well ? 0 : 1));
      bytes[at + 28] = ends_well ? 1 : 'c';
    }
    spit(bytes);
    LogReader reader(file_);
    LogEvent event;
    EXPECT_FALSE(reader.next(event));
    EXPECT_EQ(reader.skipped_bytes(), kSize + kEvery);
  }
}

TEST_F(LogFiles, ThatAreNotLogsAreRefused) {
  EXPECT_NE(error_of(directory_ / "missing.log").find("no such log file"), std::string::npos);
  EXPECT_NE(error_of(directory_).find("not a file"), std::string::npos);
  spit({});
  EXPECT_NE(error_of(file_).find("is empty"), std::string::npos);
  const std::string text(5000, 'x');
  spit(Content(text.begin(), text.end()));
  EXPECT_NE(error_of(file_).find("expected an LCM log"), std::string::npos);
  EXPECT_NE(error_of(file_).find(file_.string()), std::string::npos);
}

TEST_F(LogFiles, OfAKilledWriterHoldEveryPublishedEvent) {
  const int last = last_before_kill(
      50, [](LogWriter& writer, int i) { writer.publish(i % 2 == 0 ? "EVEN" : "ODD_CHANNEL", 1000 + i, content(i)); });
  ASSERT_GE(last, 50);
  EXPECT_GE(readable().size(), static_cast<std::size_t>(last + 1));
}

// The kernel cuts the write that is under way short, page by page: no writer can prevent it, and pictures are long.
TEST_F(LogFiles, OfAWriterKilledAmidAPictureAreWholeUpToIt) {
  constexpr std::size_t kPicture_bytes = 3 * 640 * 480;
  const Content picture(kPicture_bytes, 0x5A);
  int cut_short = 0;
  for (int kill_number = 0; kill_number < 20; ++kill_number) {
    const int last = last_before_kill(3 + kill_number % 5,
                                      [&](LogWriter& writer, int i) { writer.publish("CAMERAS", 1000 + i, picture); });
    ASSERT_GE(last, 3 + kill_number % 5);

    LogReader reader(file_);
    LogEvent event;
    std::uint64_t end_of_last = 0;
    int read_back = 0;
    for (; reader.next(event); ++read_back) {
      EXPECT_EQ(event.number, read_back);
      EXPECT_EQ(event.data, picture);
      end_of_last = reader.position();
    }
    EXPECT_GE(read_back, last + 1) << "every message that was published";
    EXPECT_EQ(reader.skipped_bytes(), reader.size() - end_of_last) << "nothing but the end may be cut short";
    EXPECT_LT(reader.skipped_bytes(), kPicture_bytes + 100);
    cut_short += reader.skipped_bytes() > 0;
  }
  RecordProperty("cut_short", cut_short);
}

TEST_F(LogFiles, OnAFullDiskEndWithAWholeEvent) {
  // A limit on the file's size stands for the disk: the write is cut short the same way.
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    LogWriter writer(file_);
    int failures = 0;
    for (int i = 0; i < 100; ++i) {
      try {
        writer.publish(i % 2 == 0 ? "EVEN" : "ODD_CHANNEL", 1000 + i, content(i));
      } catch (const DeviceError& e) {
        ++failures;
        if (std::string(e.what()).find(file_.string()) == std::string::npos) _exit(2);
      }
    }
    _exit(failures > 0 && writer.bytes_written() <= 1000 ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  LogReader reader(file_);
  LogEvent event;
  int n = 0;
  while (reader.next(event)) ++n;
  EXPECT_GT(n, 5);
  EXPECT_EQ(reader.damaged_places(), 0u);
}

TEST_F(LogFiles, ThatCannotBeCreatedAreRefused) {
  EXPECT_THROW(LogWriter(directory_ / "no" / "such" / "folder.log"), FileError);
  LogWriter writer(file_);
  EXPECT_THROW(writer.publish("", 0, {}), DataError);
  EXPECT_THROW(writer.publish(std::string(64, 'A'), 0, {}), DataError);
  EXPECT_EQ(writer.events_written(), 0);
}

}  // namespace
}  // namespace bodyschema
