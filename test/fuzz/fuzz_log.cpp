// A log file: damaged, cut short, or something else altogether.
#include "bodyschema/bus/log.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = fuzz::as_file(data, size, "fuzz.log");
  fuzz::refuse_or_accept([&] {
    LogReader reader(file);
    LogEvent event;
    while (reader.next(event)) {
    }
  });
  return 0;
}
