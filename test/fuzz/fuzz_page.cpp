// Requests to the live page, as raw bytes on its socket. The page must answer a good request after.
#include <cstdio>
#include <cstdlib>

#include "bodyschema/service/live_page.hpp"
#include "fuzz.hpp"
#include "service/page_client.hpp"

using namespace bodyschema;

/// Whatever is answered; hangs up after asking.
static std::string ask(int port, std::string_view request) {
  return test::talk(port, request, std::chrono::milliseconds(300), test::Afterwards::kHangUp);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static LivePage page(0, {"left", "right"});
  ask(page.port(), fuzz::as_text(data, size));
  static int count = 0;
  if (++count % 100 == 0 &&
      ask(page.port(), "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n").find("200 OK") ==
          std::string::npos) {
    std::fputs("the page no longer answers\n", stderr);
    std::abort();
  }
  return 0;
}
