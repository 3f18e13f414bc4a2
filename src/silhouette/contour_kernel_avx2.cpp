#include "contour_kernel_impl.hpp"

namespace bodyschema::contour {

const Kernel& avx2_kernel() {
  static constexpr Kernel kernel{find, accumulate, resolve, "AVX2"};
  return kernel;
}

}  // namespace bodyschema::contour
