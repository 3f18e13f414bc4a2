#include "bodyschema/core/background_worker.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <thread>
#include <vector>

namespace bodyschema {
namespace {

TEST(BackgroundWorker, IsOneThreadForAllWork) {
  BackgroundWorker worker;
  const auto first = worker.begin([] { return std::this_thread::get_id(); }).get();
  EXPECT_NE(first, std::this_thread::get_id());
  for (int i = 0; i < 100; ++i) EXPECT_EQ(worker.begin([] { return std::this_thread::get_id(); }).get(), first);
}

/// The paper's filter gives it none.
TEST(BackgroundWorker, IsNoThreadBeforeItHasWork) {
  const auto threads = [] { return std::distance(std::filesystem::directory_iterator("/proc/self/task"), {}); };
  const auto before = threads();
  BackgroundWorker worker;
  EXPECT_EQ(threads(), before);
  worker.begin([] {}).get();
  EXPECT_EQ(threads(), before + 1);
}

TEST(BackgroundWorker, GivesBackWhatWasReturnedOrThrown) {
  BackgroundWorker worker;
  auto failing = worker.begin([]() -> int { throw std::runtime_error("broken"); });
  auto good = worker.begin([] { return 7; });
  EXPECT_THROW(failing.get(), std::runtime_error);
  EXPECT_EQ(good.get(), 7);
}

TEST(BackgroundWorker, SharesTwoPiecesOfWork) {
  BackgroundWorker worker;
  std::thread::id first, second;
  worker.share([&] { first = std::this_thread::get_id(); }, [&] { second = std::this_thread::get_id(); });
  EXPECT_EQ(first, std::this_thread::get_id());
  EXPECT_NE(second, first);
}

TEST(BackgroundWorker, WaitsForTheOtherPieceWhateverOneThrows) {
  BackgroundWorker worker;
  bool done = false;
  const auto slow = [&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    done = true;
  };
  const auto fail = [] { throw std::runtime_error("broken"); };
  EXPECT_THROW(worker.share(fail, slow), std::runtime_error);
  EXPECT_TRUE(done);
  done = false;
  EXPECT_THROW(worker.share(slow, fail), std::runtime_error);
  EXPECT_TRUE(done);
}

TEST(BackgroundWorker, DoesAllInOrderBeforeItEnds) {
  std::vector<int> done;
  {
    BackgroundWorker worker;
    for (int i = 0; i < 50; ++i) worker.begin([&done, i] { done.push_back(i); });
  }
  ASSERT_EQ(done.size(), 50u);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

}  // namespace
}  // namespace bodyschema
