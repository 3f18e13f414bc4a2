#include "bodyschema/camera/camera_info.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

/// One matrix of the file under the name that this way of writing it uses.
class Reader {
 public:
  explicit Reader(const Configuration& file) : file_(file), calibration_(file.has("camera_matrix")) {}

  [[nodiscard]] std::vector<double> numbers(const char* message_key, const char* calibration_key) const {
    if (calibration_) return file_.has(calibration_key) ? file_.section(calibration_key).numbers("data") : none();
    const std::string key = key_of(message_key);
    return file_.has(key) ? file_.numbers(key) : none();
  }
  [[noreturn]] void fail(const char* message_key, const char* calibration_key, const std::string& expected) const {
    if (calibration_) {
      if (file_.has(calibration_key)) file_.section(calibration_key).fail("data", expected);
      file_.fail(calibration_key, expected);
    }
    file_.fail(key_of(message_key), expected);
  }
  [[nodiscard]] int side(const char* message_key, const char* calibration_key) const {
    constexpr int kMaxSide = 8192;
    return static_cast<int>(file_.integer(calibration_ ? calibration_key : message_key, 1, kMaxSide));
  }

 private:
  static std::vector<double> none() { return {}; }
  /// ROS 1 has capital letters.
  [[nodiscard]] std::string key_of(const char* message_key) const {
    const std::string capital(1, static_cast<char>(message_key[0] - 'a' + 'A'));
    return !file_.has(message_key) && file_.has(capital) ? capital : message_key;
  }
  const Configuration& file_;
  bool calibration_;
};

PinholeIntrinsics pinhole(int width, int height, const std::vector<double>& row_major, std::size_t columns) {
  return {width, height, row_major[0], row_major[columns + 1], row_major[2], row_major[columns + 2]};
}

bool usable(const PinholeIntrinsics& k) {
  constexpr double kMinFocal = 1.0, kMaxFocal = 1e5, kFar = 16384.0;
  return k.fx >= kMinFocal && k.fy >= kMinFocal && k.fx <= kMaxFocal && k.fy <= kMaxFocal && std::abs(k.cx) <= kFar &&
         std::abs(k.cy) <= kFar;
}

}  // namespace

bool CameraInfo::is_rectified() const {
  constexpr double kSame_px = 1e-3, kSame = 1e-6;
  const auto& a = intrinsics;
  const auto& b = rectified;
  const double moved =
      std::max({std::abs(a.fx - b.fx), std::abs(a.fy - b.fy), std::abs(a.cx - b.cx), std::abs(a.cy - b.cy)});
  const bool bends = std::any_of(distortion.begin(), distortion.end(), [](double d) { return d != 0.0; });
  return !bends && moved < kSame_px && (R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kSame;
}

CameraInfo CameraInfo::read(const std::filesystem::path& path) {
  return from(Configuration::load(path), path.string());
}

CameraInfo CameraInfo::from(const Configuration& file, const std::string& where) {
  const Reader reader(file);
  CameraInfo info;
  const int width = reader.side("width", "image_width"), height = reader.side("height", "image_height");

  const auto k = reader.numbers("k", "camera_matrix");
  constexpr const char* kMatrix = "nine numbers, row by row: [fx, 0, cx, 0, fy, cy, 0, 0, 1] in px";
  if (k.size() != 9) reader.fail("k", "camera_matrix", kMatrix);
  info.intrinsics = pinhole(width, height, k, 3);
  if (!usable(info.intrinsics)) reader.fail("k", "camera_matrix", std::string(kMatrix) + " of a calibrated camera");
  constexpr double kSkew_px = 1e-3;
  if (std::abs(k[1]) > kSkew_px) reader.fail("k", "camera_matrix", "pixels without skew (its second number 0)");

  const auto d = reader.numbers("d", "distortion_coefficients");
  const std::string model = file.text_or("distortion_model", "plumb_bob");
  const auto bends = [](double coefficient) { return coefficient != 0.0; };
  const bool fisheye = model == "equidistant" || model == "fisheye";
  if (std::any_of(d.begin(), d.end(), bends)) {
    if (fisheye || std::any_of(d.begin() + std::min<std::ptrdiff_t>(5, std::ssize(d)), d.end(), bends)) {
      throw FileError(where + ": distortion of model '" + model +
                      "' is not one of k1 k2 p1 p2 k3 alone; rectify the pictures first (image_proc) and give the "
                      "camera_info of these");
    }
    std::copy_n(d.begin(), std::min<std::size_t>(d.size(), info.distortion.size()), info.distortion.begin());
  }

  const auto r = reader.numbers("r", "rectification_matrix");
  if (!r.empty()) {
    if (r.size() != 9) reader.fail("r", "rectification_matrix", "nine numbers, row by row");
    info.R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
    constexpr double kRigid = 1e-3;
    const bool absent = info.R.isZero();  // a driver that was never calibrated
    if (absent) info.R.setIdentity();
    if ((info.R.transpose() * info.R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRigid ||
        info.R.determinant() < 0.0) {
      reader.fail("r", "rectification_matrix", "a rotation");
    }
  }
  info.rectified = info.intrinsics;
  const auto p = reader.numbers("p", "projection_matrix");
  if (!p.empty()) {
    if (p.size() != 12) reader.fail("p", "projection_matrix", "twelve numbers, row by row");
    if (p[0] != 0.0) {
      info.rectified = pinhole(width, height, p, 4);
      if (!usable(info.rectified)) reader.fail("p", "projection_matrix", "the projection of a calibrated camera");
      info.baseline_m = -p[3] / p[0];
      constexpr double kFarApart_m = 10.0;
      if (!(std::abs(info.baseline_m) < kFarApart_m)) {
        reader.fail("p", "projection_matrix", "a fourth number of -fx times the baseline in m, below 10 m");
      }
    }
  }
  return info;
}

Pose stereo_pose(const CameraInfo& left, const CameraInfo& right, bool rectified) {
  Pose X_LR = Pose::Identity();
  const Eigen::Vector3d apart(right.baseline_m - left.baseline_m, 0.0, 0.0);
  if (rectified) {
    X_LR.translation() = apart;
  } else {
    // In rectified axes the two differ by `apart` alone: R_L p_L = R_R p_R + apart.
    X_LR.linear() = left.R.transpose() * right.R;
    X_LR.translation() = left.R.transpose() * apart;
  }
  return X_LR;
}

}  // namespace bodyschema
