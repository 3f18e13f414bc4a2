// Packets of the network, cut out of the input: each begins with its length (two bytes) and its sender.
#include <algorithm>

#include "bodyschema/bus/udpm_assembler.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  UdpmAssembler assembler({.message_bytes = 1 << 20, .pending_bytes = 4 << 20, .senders = 4});
  Bytes rest(data, size);
  while (rest.size() > 3) {
    const std::size_t length = std::min<std::size_t>(rest[0] << 8 | rest[1], rest.size() - 3);
    (void)assembler.take(rest.subspan(3, length), {1, rest[2]});
    rest = rest.subspan(3 + length);
  }
  return 0;
}
