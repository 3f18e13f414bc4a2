#include "bodyschema/core/logging.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <sstream>
#include <string>

namespace bodyschema {
namespace {

/// What a program of its own logs to a pipe; `journal`: and systemd has said that it is the journal's.
std::string logged(bool journal) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDERR_FILENO);
    struct stat status {};
    fstat(STDERR_FILENO, &status);
    const std::string name = std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
    setenv("JOURNAL_STREAM", journal ? name.c_str() : "1:2", 1);
    set_up_logging("info");
    spdlog::warn("no light");
    spdlog::info("going on");
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t n; (n = read(ends[0], buffer.data(), buffer.size())) > 0;)
    text.append(buffer.data(), static_cast<std::size_t>(n));
  waitpid(child, nullptr, 0);
  close(ends[0]);
  return text;
}

TEST(Logging, TheJournalGetsPrioritiesAndKeepsTheTimeItself) {
  EXPECT_EQ(logged(true), "<4>no light\n<6>going on\n");
}

TEST(Logging, OtherStreamsGetTimeAndLevel) {
  EXPECT_THAT(logged(false), testing::MatchesRegex("[0-9:]+ warning no light\n[0-9:]+ info going on\n"));
}

/// A calibration that reads its configuration for every start said the same each time.
TEST(Logging, WhatAConfigurationLacksIsSaidOnce) {
  std::ostringstream said;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(said)));
  for (int i = 0; i < 3; ++i) warn_once("camera 'left' has no lens");
  warn_once("camera 'right' has no lens");
  spdlog::set_default_logger(before);
  const std::string text = said.str();
  EXPECT_EQ(text.find("'left'"), text.rfind("'left'"));
  EXPECT_NE(text.find("'right'"), std::string::npos);
}

}  // namespace
}  // namespace bodyschema
