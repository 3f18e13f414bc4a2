// A robot description, with a mesh beside it that is in order.
#include "bodyschema/robot/robot_model.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr char kMesh[] = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  fuzz::as_file(reinterpret_cast<const std::uint8_t*>(kMesh), sizeof kMesh - 1, "urdf/a.obj");
  RobotModelOptions options;
  options.urdf = fuzz::as_file(data, size, "urdf/robot.urdf");
  options.rendered_links = {"hand"};
  fuzz::refuse_or_accept([&] { (void)RobotModel::load(options); });
  return 0;
}
