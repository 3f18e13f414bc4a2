#include "bodyschema/imports/camera_pose_file.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxPoseBytes = 1 << 20;

Pose pose_of(const nlohmann::json& rows, const std::string& where) {
  const std::string expected = where + ": expected a rigid transform as four rows of four numbers, m";
  if (!rows.is_array() || rows.size() != 4) throw FileError(expected);
  Eigen::Matrix4d M;
  for (std::size_t r = 0; r < 4; ++r) {
    if (!rows[r].is_array() || rows[r].size() != 4) throw FileError(expected);
    for (std::size_t c = 0; c < 4; ++c) {
      if (!rows[r][c].is_number()) throw FileError(expected);
      M(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = rows[r][c].get<double>();
    }
  }
  constexpr double kRigid = 1e-3, kFar_m = 1e3;
  const Eigen::Matrix3d R = M.topLeftCorner<3, 3>();
  const Eigen::Vector3d t = M.topRightCorner<3, 1>();
  const bool rigid = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigid &&
                     R.determinant() > 0.0 && M.row(3) == Eigen::RowVector4d(0, 0, 0, 1) &&
                     t.cwiseAbs().maxCoeff() < kFar_m;
  if (!rigid) throw FileError(expected);
  Pose X = Pose::Identity();
  X.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  X.translation() = t;
  return X;
}

}  // namespace

CameraPoses CameraPoses::read(const std::filesystem::path& file, const std::string& method) {
  std::ifstream stream(file);
  if (!stream) throw FileError(file.string() + ": no such file");
  file_size_at_most(file, kMaxPoseBytes);
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(stream);
  } catch (const nlohmann::json::exception& error) {
    throw FileError(file.string() + ": not JSON: " + error.what());
  }
  const auto poses = json.is_object() ? json.find("X_base_optical") : json.end();
  if (!json.is_object() || poses == json.end() || !poses->is_object() || poses->empty()) {
    throw FileError(file.string() + ": no 'X_base_optical'; expected {METHOD: {CAMERA: 4x4}}");
  }
  CameraPoses result;
  if (const auto base = json.find("base_link"); base != json.end() && base->is_string()) {
    result.base_link = base->get<std::string>();
  } else {
    throw FileError(file.string() + ": no 'base_link', the link that the poses refer to");
  }
  std::vector<std::string> methods;
  for (const auto& [name, unused] : poses->items()) methods.push_back(name);
  if (method.empty() && methods.size() > 1) {
    throw FileError(fmt::format("{}: poses by {} methods, {}: name one (--camera-pose FILE:METHOD)", file.string(),
                                methods.size(), fmt::join(methods, ", ")));
  }
  result.method = method.empty() ? methods.front() : method;
  const auto chosen = poses->find(result.method);
  if (chosen == poses->end()) {
    throw FileError(fmt::format("{}: no poses by '{}'; it has {}", file.string(), method, fmt::join(methods, ", ")));
  }
  if (!chosen->is_object()) throw FileError(file.string() + ": " + result.method + ": expected {CAMERA: 4x4}");
  for (const auto& [camera, rows] : chosen->items()) {
    result.X_base_optical[camera] = pose_of(rows, fmt::format("{}: {}.{}", file.string(), result.method, camera));
  }
  return result;
}

CameraPoses CameraPoses::from_argument(const std::string& argument) {
  std::error_code none;
  const auto colon = argument.rfind(':');
  if (std::filesystem::exists(argument, none) || colon == std::string::npos) return read(argument);
  return read(argument.substr(0, colon), argument.substr(colon + 1));
}

std::string pose_yaml(const Pose& X) {
  std::string text = "[";
  for (int r = 0; r < 3; ++r) {
    const auto row = X.matrix().row(r);
    text += fmt::format("[{:.9g}, {:.9g}, {:.9g}, {:.9g}], ", row(0), row(1), row(2), row(3));
  }
  return text + "[0, 0, 0, 1]]";
}

}  // namespace bodyschema
