// Packets of the network, cut out of the input: each begins with its length (two bytes) and its sender.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "bodyschema/bus/udpm_assembler.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 64 << 10;
  const auto wanted = [](const std::string& channel, Sender sender) { return (channel.size() + sender.port) % 4 != 0; };
  UdpmAssembler assembler({.message_bytes = 1 << 20, .pending_bytes = kMost, .senders = 4}, wanted);
  Bytes rest(data, size);
  while (rest.size() > 3) {
    const std::size_t length = std::min<std::size_t>(rest[0] << 8 | rest[1], rest.size() - 3);
    (void)assembler.take(rest.subspan(3, length), {1, rest[2]});
    if (assembler.pending_bytes() > kMost) std::abort();
    rest = rest.subspan(3 + length);
  }
  return 0;
}
