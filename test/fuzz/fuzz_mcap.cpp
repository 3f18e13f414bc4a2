// Whatever a log holds, on its way into an MCAP file.
#include "bodyschema/logs/mcap_export.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  McapExportOptions options;
  options.log = fuzz::as_file(data, size, "fuzz.log");
  options.out = options.log.parent_path() / "fuzz.mcap";
  fuzz::refuse_or_accept([&] { (void)export_mcap(options); });
  return 0;
}
