#include "bodyschema/core/progress_bar.hpp"

#include <array>
#include <chrono>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace bodyschema {
namespace {

using testing::HasSubstr;
using testing::Not;

/// What work of `duration` in so many steps writes to a standard error that is this descriptor.
std::string shown_on(int reader, int writer, std::chrono::milliseconds duration, int steps) {
  const pid_t child = fork();
  if (child == 0) {
    dup2(writer, STDERR_FILENO);
    {
      ProgressBar bar("work", static_cast<std::uint64_t>(steps));
      for (int i = 0; i < steps; ++i) {
        std::this_thread::sleep_for(duration / steps);
        bar.advance();
      }
    }
    _exit(0);
  }
  close(writer);
  std::string text;
  std::array<char, 4096> buffer{};
  for (ssize_t n; (n = read(reader, buffer.data(), buffer.size())) > 0;)
    text.append(buffer.data(), static_cast<std::size_t>(n));
  waitpid(child, nullptr, 0);
  close(reader);
  return text;
}

std::string shown_on_pipe(std::chrono::milliseconds duration, int steps = 20) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  return shown_on(ends[0], ends[1], duration, steps);
}

std::string shown_on_terminal(std::chrono::milliseconds duration, int steps = 20) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  EXPECT_GE(terminal, 0);
  EXPECT_EQ(grantpt(terminal), 0);
  EXPECT_EQ(unlockpt(terminal), 0);
  return shown_on(terminal, open(ptsname(terminal), O_RDWR | O_NOCTTY), duration, steps);
}

TEST(ProgressBar, ABarWithTimeLeftOnATerminal) {
  const std::string text = shown_on_terminal(std::chrono::milliseconds(2600));
  EXPECT_THAT(text, HasSubstr("\r\033[Kwork [")) << text;
  EXPECT_THAT(text, HasSubstr("#....")) << text;
  EXPECT_THAT(text, HasSubstr(" left")) << text;
}

TEST(ProgressBar, PlainLinesElsewhere) {
  const std::string text = shown_on_pipe(std::chrono::milliseconds(2600));
  EXPECT_THAT(text, HasSubstr("work: 90 %, 0:0")) << text;
  EXPECT_THAT(text, HasSubstr("work: ended after 0:0")) << text;
  EXPECT_THAT(text, Not(HasSubstr("\r"))) << text;
  EXPECT_THAT(text, Not(HasSubstr("\033"))) << text;
}

TEST(ProgressBar, ShowsThatASingleLongStepIsUnderWay) {
  EXPECT_THAT(shown_on_terminal(std::chrono::milliseconds(3200), 1), HasSubstr("]   0 %, ? left"));
  EXPECT_THAT(shown_on_pipe(std::chrono::milliseconds(3200), 1), HasSubstr("work: 0 %, ? left\n"));
}

TEST(ProgressBar, SilentForShortWork) {
  EXPECT_EQ(shown_on_pipe(std::chrono::milliseconds(200)), "");
  EXPECT_EQ(shown_on_terminal(std::chrono::milliseconds(200)), "");
}

}  // namespace
}  // namespace bodyschema
