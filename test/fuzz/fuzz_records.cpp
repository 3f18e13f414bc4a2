// What a reader of recordings writes: records of a bag or of a LeRobot data set, turned into a log. The input is the
// stream itself.
#include <cstring>

#include "bodyschema/imports/lerobot.hpp"
#include "bodyschema/imports/ros_bag.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

namespace {

class Input : public ByteSource {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::size_t read(std::span<std::uint8_t> bytes) override {
    const std::size_t count = std::min(bytes.size(), size_ - at_);
    if (count > 0) std::memcpy(bytes.data(), data_ + at_, count);
    at_ += count;
    return count;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

constexpr std::string_view kUrdf =
    "<robot name='r'><link name='base'/><link name='hand'/><joint name='elbow' type='continuous'><parent link='base'/>"
    "<child link='hand'/><axis xyz='0 0 1'/></joint></robot>";
constexpr std::string_view kRobot =
    "robot: {urdf: robot.urdf, rendered_links: [hand], hand_link: hand, estimated_joints: [elbow]}\n"
    "cameras: {left: {link: base, pose: unknown, width: 4, height: 2, fx: 4, fy: 4, cx: 1.5, cy: 0.5}}\n";

std::filesystem::path put(std::string_view text, const char* name) {
  return fuzz::as_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), name);
}

ImportTarget make_target() {
  put(kUrdf, "records/robot.urdf");
  return ImportTarget::from(Configuration::load(put(kRobot, "records/robot.yaml")));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ImportTarget target = make_target();
  const BagSelection selection{{"/j"}, {"/l"}, {"/m"}, {"/i"}, {}};
  fuzz::refuse_or_accept([&] {
    Input records(data, size);
    (void)read_bag_topics(records, "bag");
  });
  fuzz::refuse_or_accept([&] {
    Input records(data, size);
    (void)import_bag_records(records, "bag", selection, target, "/dev/null");
  });
  static const LerobotSet set{"2.1", 9, {0}, {"elbow"}, {"cam"}};
  static const std::vector<std::string> cameras = {"cam"};
  fuzz::refuse_or_accept([&] {
    Input records(data, size);
    (void)LerobotSet::read(records, "set");
  });
  fuzz::refuse_or_accept([&] {
    Input records(data, size);
    (void)import_lerobot_records(records, "set", set, cameras, target, {}, {"/dev/null", true});
  });
  return 0;
}
