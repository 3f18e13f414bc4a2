#include "model_hash.hpp"

#include <fstream>
#include <iterator>

#include "bodyschema/core/digest.hpp"

namespace bodyschema {
std::string model_hash_of(const RobotSetup& setup, const RobotModel& robot,
                          const std::optional<ErrorModel>& error_model) {
  Digest digest;
  std::ifstream file(setup.model.urdf, std::ios::binary);
  const std::string urdf((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  digest.add(urdf);
  for (const auto& part : robot.meshes()) {
    digest.add(part.link);
    digest.add(part.mesh.vertices.data(), part.mesh.vertices.size() * sizeof(part.mesh.vertices[0]));
    digest.add(part.mesh.triangles.data(), part.mesh.triangles.size() * sizeof(part.mesh.triangles[0]));
  }
  if (error_model) digest.add(error_model->to_yaml());
  return digest.text();
}

}  // namespace bodyschema
