// Requests to the live page, as raw bytes on its socket. The page must answer a good request after.
#include <cstdio>
#include <cstdlib>

#include "bodyschema/service/live_page.hpp"
#include "fuzz.hpp"
#include "service/page_client.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static LivePage page(0, {"left", "right"});
  test::talk(page.port(), fuzz::as_text(data, size), std::chrono::milliseconds(300), test::Afterwards::kHangUp);
  static int count = 0;
  if (++count % 50 == 0) {
    // The page's thread comes last on a busy machine: slow is not dead. Who has hung up gets no answer, and who
    // was himself kept from sending for two seconds neither: asked again.
    std::string answer;
    for (int attempt = 0; attempt < 3 && answer.find("200 OK") == std::string::npos; ++attempt) {
      answer = test::talk(page.port(), "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n",
                          std::chrono::seconds(15));
    }
    if (answer.find("200 OK") == std::string::npos) {
      std::fprintf(stderr, "the page no longer answers a good request, but: '%s'\n", answer.substr(0, 500).c_str());
      std::abort();
    }
  }
  return 0;
}
