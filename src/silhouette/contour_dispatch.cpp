#include <cstdlib>
#include <string_view>

#include "contour_kernel.hpp"

namespace bodyschema::contour {

const Kernel& best_kernel() {
  const char* wish = std::getenv("BODYSCHEMA_CONTOUR_KERNEL");
  const bool plain = wish != nullptr && std::string_view(wish) == "baseline";
#if defined(BODYSCHEMA_HAVE_AVX2_KERNEL)
  if (!plain && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("popcnt")) {
    return avx2_kernel();
  }
#endif
  (void)plain;
  return baseline_kernel();
}

}  // namespace bodyschema::contour
