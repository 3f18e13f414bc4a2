#include "mesh_file.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "collada_guard.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxMeshBytes = 256u << 20;
constexpr std::size_t kMaxTriangles = 4'000'000;
constexpr int kMaxNodeDepth = 256;

/// Opens one file and pretends that no other exists.
class SingleFile : public Assimp::DefaultIOSystem {
 public:
  explicit SingleFile(std::string file) : file_(std::move(file)) {}
  bool Exists(const char* path) const override { return file_ == path && DefaultIOSystem::Exists(path); }
  Assimp::IOStream* Open(const char* path, const char* mode) override {
    return file_ == path ? DefaultIOSystem::Open(path, mode) : nullptr;
  }

 private:
  std::string file_;
};

struct PlacedNode {
  const aiNode* node;
  aiMatrix4x4 X_FN;  // node in file
  int depth;
};

void append(const aiMesh& source, const aiMatrix4x4& X_FN, const fs::path& file, TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D p = X_FN * source.mVertices[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw FileError(file.string() + ": vertex " + std::to_string(i) + " is not finite");
    }
    mesh.vertices.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
  }
  const bool mirrored = X_FN.Determinant() < 0;
  for (unsigned f = 0; f < source.mNumFaces; ++f) {
    const aiFace& face = source.mFaces[f];
    if (face.mNumIndices != 3) continue;
    std::array<std::uint32_t, 3> t{first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]};
    if (mirrored) std::swap(t[1], t[2]);
    mesh.triangles.push_back(t);
  }
}

}  // namespace

TriangleMesh read_mesh_file(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".dae" && extension != ".stl" && extension != ".obj") {
    throw FileError(file.string() + ": mesh format '" + extension + "', expected .dae, .stl or .obj");
  }
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error) throw FileError(file.string() + ": mesh cannot be read: " + error.message());
  if (size > kMaxMeshBytes) {
    throw FileError(file.string() + ": mesh of " + std::to_string(size) + " bytes, at most " +
                    std::to_string(kMaxMeshBytes) + " expected");
  }

  if (extension == ".dae") {
    std::string text(size, '\0');
    std::ifstream(file, std::ios::binary).read(text.data(), static_cast<std::streamsize>(size));
    if (const std::string danger = collada_danger(text); !danger.empty()) {
      throw FileError(file.string() + ": mesh cannot be read: " + danger);
    }
  }

  Assimp::Importer importer;
  importer.SetIOHandler(new SingleFile(file.string()));  // the importer owns it
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = nullptr;
  std::string reason;
  try {
    scene = importer.ReadFile(file.string(), aiProcess_Triangulate);
    reason = importer.GetErrorString();
  } catch (const std::exception& e) {
    reason = e.what();
  }
  if (scene == nullptr || scene->mRootNode == nullptr) {
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    throw FileError(file.string() + ": mesh cannot be read: " + reason);
  }

  TriangleMesh mesh;
  mesh.name = file.filename().string();
  std::vector<PlacedNode> open{{scene->mRootNode, scene->mRootNode->mTransformation, 0}};
  std::size_t budget = kMaxTriangles;
  while (!open.empty()) {
    const PlacedNode at = open.back();
    open.pop_back();
    if (at.depth > kMaxNodeDepth) throw FileError(file.string() + ": nodes nest too deep");
    for (unsigned i = 0; i < at.node->mNumMeshes; ++i) {
      const aiMesh& part = *scene->mMeshes[at.node->mMeshes[i]];
      if (part.mNumFaces > budget || part.mNumVertices > 3 * kMaxTriangles) {
        throw FileError(file.string() + ": more than " + std::to_string(kMaxTriangles) + " triangles");
      }
      budget -= part.mNumFaces;
      append(part, at.X_FN, file, mesh);
    }
    for (unsigned i = 0; i < at.node->mNumChildren; ++i) {
      const aiNode* child = at.node->mChildren[i];
      open.push_back({child, at.X_FN * child->mTransformation, at.depth + 1});
    }
  }
  if (mesh.triangles.empty()) throw FileError(file.string() + ": mesh has no triangles");
  return mesh;
}

}  // namespace bodyschema
