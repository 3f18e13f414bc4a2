#include "contour_kernel_impl.hpp"

namespace bodyschema::contour {

const Kernel& baseline_kernel() {
  static constexpr Kernel kernel{find, accumulate, resolve, "baseline"};
  return kernel;
}

}  // namespace bodyschema::contour
