// A truth file of the simulator or of a recording.
#include "bodyschema/pipeline/truth.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = fuzz::as_file(data, size, "truth.json");
  fuzz::refuse_or_accept([&] { (void)Truth::load(file); });
  return 0;
}
