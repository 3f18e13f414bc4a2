#include "bodyschema/core/thread_priority.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

#include <thread>

namespace bodyschema {
namespace {

struct Priority {
  int policy = -1, nice = -1;
};

/// Of a thread that gave way.
Priority after_giving_way(bool real_time, bool& allowed) {
  Priority priority;
  std::thread([&] {
    const sched_param wanted{.sched_priority = 5};
    allowed = !real_time || sched_setscheduler(0, SCHED_RR, &wanted) == 0;
    give_way(7);
    priority = {sched_getscheduler(0), getpriority(PRIO_PROCESS, 0)};
  }).join();
  return priority;
}

TEST(GiveWay, MakesOnlyTheCallingThreadNice) {
  const int before = getpriority(PRIO_PROCESS, 0);
  bool allowed = false;
  EXPECT_EQ(after_giving_way(false, allowed).nice, 7);
  EXPECT_EQ(getpriority(PRIO_PROCESS, 0), before);
}

TEST(GiveWay, LeavesTheRealTimeSchedulingOfTheService) {
  bool allowed = false;
  const Priority priority = after_giving_way(true, allowed);
  if (!allowed) GTEST_SKIP() << "this user may not use real-time scheduling";
  EXPECT_EQ(priority.policy, SCHED_OTHER);
  EXPECT_EQ(priority.nice, 7);
}

}  // namespace
}  // namespace bodyschema
