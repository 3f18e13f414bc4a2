// Every LCM message the programs take, and the pictures and masks inside. The first byte picks the message.
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/logging.hpp"
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

/// Masks of others, each with a picture that waits for it.
void receive_masks(Bytes bytes) {
  static const std::vector<CameraModel> cameras = [] {
    std::vector<CameraModel> both(2);
    for (auto& camera : both) {
      camera.intrinsics.width = 32;
      camera.intrinsics.height = 24;
    }
    both[0].name = "left";
    both[1].name = "right";
    both[1].image_type = 1;
    return both;
  }();
  static const bool quiet = [] { return set_up_logging("off"), true; }();
  (void)quiet;
  BusOptions options;
  options.synchroniser.masks = true;
  ObservationStream stream({"elbow"}, {{"elbow", 0.0}}, cameras, options);
  stream.receive(stream.channels().cameras, bytes);
  stream.receive(stream.channels().masks, bytes);
  stream.finish();
  while (stream.next()) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes bytes(data + 1, size - 1);
  switch (data[0] % 6) {
    case 0: read<JointStateMessage>(bytes); break;
    case 1: read_pictures(bytes); break;
    case 2: read<joint_offsets_t>(bytes); break;
    case 3: read<offsets_status_t>(bytes); break;
    case 4: read<findings_t>(bytes); break;
    case 5: receive_masks(bytes); break;
  }
  return 0;
}
