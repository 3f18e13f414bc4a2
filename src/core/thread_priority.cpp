#include "bodyschema/core/thread_priority.hpp"

#include <sched.h>
#include <sys/resource.h>

namespace bodyschema {

void give_way(int nice) {
  constexpr int kThisThread = 0;  // for Linux each thread is a process here
  const sched_param none{};
  sched_setscheduler(kThisThread, SCHED_OTHER, &none);
  setpriority(PRIO_PROCESS, kThisThread, nice);
}

}  // namespace bodyschema
