// A mesh file; the first byte picks the format.
#include "../../src/robot/mesh_file.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr const char* kNames[] = {"mesh.obj", "mesh.stl", "mesh.dae"};
  if (size == 0) return 0;
  const auto file = fuzz::as_file(data + 1, size - 1, kNames[data[0] % 3]);
  fuzz::refuse_or_accept([&] { (void)read_mesh_file(file); });
  return 0;
}
