// Every LCM message the programs take, and the pictures inside. The first byte picks the message.
#include "bodyschema/bus/messages.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

namespace {

template <typename Message>
void read(Bytes bytes) {
  Message message;
  (void)decode(bytes, message);
}

void read_pictures(Bytes bytes) {
  ImagesView view;
  if (!decode(bytes, view).ok()) return;
  Image image;
  for (const auto& picture : view.images) (void)unpack(picture, image);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes bytes(data + 1, size - 1);
  switch (data[0] % 5) {
    case 0: read<JointStateMessage>(bytes); break;
    case 1: read_pictures(bytes); break;
    case 2: read<joint_offsets_t>(bytes); break;
    case 3: read<offsets_status_t>(bytes); break;
    case 4: read<findings_t>(bytes); break;
  }
  return 0;
}
