#pragma once

#include <cstddef>
#include <functional>

namespace bodyschema {

/// @param threads  as asked for; 0: one per core
int thread_count(int threads);

/// Calls work(i) for every i below `count`, on so many threads. Rethrows the first failure, after which none begins.
void in_parallel(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

}  // namespace bodyschema
