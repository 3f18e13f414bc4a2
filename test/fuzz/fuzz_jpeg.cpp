// A JPEG inside a message that otherwise is in order.
#include "bodyschema/bus/messages.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ImageView view;
  view.utime = 1;
  view.width = 32;
  view.height = 24;
  view.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  view.data = Bytes(data, size);
  Image image;
  for (const int reduction : {1, 2, 4, 8}) (void)unpack(view, image, {}, reduction);
  return 0;
}
