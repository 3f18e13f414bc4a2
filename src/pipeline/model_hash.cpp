#include "model_hash.hpp"

#include <spdlog/fmt/fmt.h>

#include <fstream>
#include <iterator>

namespace bodyschema {
namespace {

/// FNV-1a, 64 bit: names a model, protects nothing.
class Digest {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* byte = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) state_ = (state_ ^ byte[i]) * 0x100000001b3ull;
  }
  [[nodiscard]] std::string text() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace

std::string model_hash_of(const RobotSetup& setup, const RobotModel& robot,
                          const std::optional<ErrorModel>& error_model) {
  Digest digest;
  std::ifstream file(setup.model.urdf, std::ios::binary);
  const std::string urdf((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  digest.add(urdf.data(), urdf.size());
  for (const auto& part : robot.meshes()) {
    digest.add(part.link.data(), part.link.size());
    digest.add(part.mesh.vertices.data(), part.mesh.vertices.size() * sizeof(part.mesh.vertices[0]));
    digest.add(part.mesh.triangles.data(), part.mesh.triangles.size() * sizeof(part.mesh.triangles[0]));
  }
  if (error_model) {
    const std::string text = error_model->to_yaml();
    digest.add(text.data(), text.size());
  }
  return digest.text();
}

}  // namespace bodyschema
