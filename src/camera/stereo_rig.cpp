#include "bodyschema/camera/stereo_rig.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bodyschema/camera/lens_knowledge.hpp"
#include "bodyschema/camera/shutter.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kMostCameras = 2;
// Physical: nobody measures the place of a camera on a robot better.
constexpr double kKnown_m = 1e-3;
constexpr double kKnown_rad = radians(0.1);
constexpr double kRigid = 1e-3;  // poses are written with few digits: a row of 4 digits is off by less

/// Names stand in file names, in JSON keys and on pages.
bool is_plain(const std::string& name) {
  const auto plain = [](unsigned char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-';
  };
  return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), plain);
}

Eigen::Vector3d three(const Configuration& section, const std::string& key) {
  const std::vector<double> values = section.numbers(key);
  if (values.size() != 3) section.fail(key, "three numbers");
  return {values[0], values[1], values[2]};
}

/// A pose as `{xyz_m: [...], rpy_rad: [...]}` as in a URDF, or as the four rows of its 4x4 matrix.
Pose read_pose(const Configuration& section, const std::string& key) {
  Pose X = Pose::Identity();
  if (section.is_mapping(key)) {
    const Configuration pose = section.section(key);
    X.translation() = three(pose, "xyz_m");
    const Eigen::Vector3d rpy = pose.has("rpy_rad") ? three(pose, "rpy_rad") : Eigen::Vector3d::Zero();
    X.linear() =
        (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    return X;
  }
  const auto rows = section.rows(key);
  if (rows.size() != 4 || rows.front().size() != 4) section.fail(key, "four rows of four numbers");
  Eigen::Matrix4d M;
  for (Eigen::Index r = 0; r < 4; ++r) {
    for (Eigen::Index c = 0; c < 4; ++c) M(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }
  const Eigen::Matrix3d R = M.topLeftCorner<3, 3>();
  const bool rigid = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigid &&
                     R.determinant() > 0.0 && (M.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() == 0.0;
  if (!rigid) section.fail(key, "a rigid transform: a rotation, a translation in m and the row 0 0 0 1");
  X.linear() = Eigen::Quaterniond(R).normalized().toRotationMatrix();
  X.translation() = M.topRightCorner<3, 1>();
  return X;
}

/// One number for all of the camera's axes, or one for each: x, y, z.
Eigen::Vector3d of_each_axis(const Configuration& section, const std::string& key, double least, double most) {
  if (!section.is_list(key)) return Eigen::Vector3d::Constant(section.number(key, least, most));
  const Eigen::Vector3d values = three(section, key);
  if (values.minCoeff() < least || values.maxCoeff() > most) {
    section.fail(key, fmt::format("a number from {} to {}, or three, for the camera's x, y and z", least, most));
  }
  return values;
}

CameraMount read_mount(const Configuration& section) {
  CameraMount mount;
  // A file that includes another takes keys of it out again with null; so all are looked for.
  for (const char* key : {"link", "X_link_optical", "beside", "X_beside_optical", "pose_sd_deg", "pose_sd_mm"}) {
    (void)section.has(key);
  }
  mount.relative = section.has("beside");
  const char* pose_key = mount.relative ? "X_beside_optical" : "X_link_optical";
  mount.parent = section.text(mount.relative ? "beside" : "link");
  if (mount.relative && section.has("link")) section.fail("link", "either 'link' or 'beside'");
  const std::string knowledge = section.choice_or("pose", "exact", {"exact", "known", "roughly", "unknown"});
  mount.knowledge = knowledge == "exact"     ? PlaceKnowledge::kExact
                    : knowledge == "known"   ? PlaceKnowledge::kKnown
                    : knowledge == "roughly" ? PlaceKnowledge::kRoughly
                                             : PlaceKnowledge::kUnknown;
  if (section.has(pose_key)) {
    mount.X_PC = read_pose(section, pose_key);
  } else if (mount.relative && mount.knowledge != PlaceKnowledge::kUnknown) {
    section.fail(pose_key, "the camera's pose in the other one, or 'pose: unknown'");
  }
  for (const char* sd : {"pose_sd_deg", "pose_sd_mm"}) {
    if (section.has(sd) && mount.knowledge != PlaceKnowledge::kRoughly)
      section.fail(sd, "it only with 'pose: roughly'");
  }
  if (mount.knowledge == PlaceKnowledge::kKnown) {
    mount.sd_rad.setConstant(kKnown_rad);
    mount.sd_m.setConstant(kKnown_m);
  }
  if (mount.knowledge == PlaceKnowledge::kRoughly) {
    mount.sd_rad = radians(1.0) * of_each_axis(section, "pose_sd_deg", 1e-3, 90.0);
    mount.sd_m = 1e-3 * of_each_axis(section, "pose_sd_mm", 1e-2, 1e4);
  }
  return mount;
}

CameraModel read_camera(const Configuration& section, const std::string& name) {
  CameraModel camera;
  camera.name = name;
  camera.mount = read_mount(section);
  camera.place = section.place(camera.mount.relative ? "beside" : "link");
  const bool is_link =
      !camera.mount.relative && !section.has("X_link_optical") && camera.mount.knowledge != PlaceKnowledge::kUnknown;
  camera.link = is_link ? camera.mount.parent : "camera:" + name;
  camera.image_type = static_cast<int>(section.has("image_type") ? section.integer("image_type", 0, 32'767) : -1);
  PinholeIntrinsics& k = camera.intrinsics;
  constexpr int kMaxSide = 8192;
  k.width = static_cast<int>(section.integer("width", 1, kMaxSide));
  k.height = static_cast<int>(section.integer("height", 1, kMaxSide));
  constexpr double kMinFocal = 1.0, kMaxFocal = 1e5;
  k.fx = section.number("fx", kMinFocal, kMaxFocal);
  k.fy = section.number("fy", kMinFocal, kMaxFocal);
  k.cx = section.number("cx", -kMaxSide, 2 * kMaxSide);
  k.cy = section.number("cy", -kMaxSide, 2 * kMaxSide);
  static_cast<void>(readout_s(section));  // checked with the rest; what moves while rows are read out is a belief
  if (lens_knowledge(section) == LensKnowledge::kCalibrated) {
    const auto distortion = section.numbers("distortion");
    std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  }
  return camera;
}

/// Left is 0, right is 1; cameras of other names take what is free, in their order.
void number_cameras(const Configuration& section, std::vector<CameraModel>& cameras) {
  std::set<int> taken;
  const auto take = [&](CameraModel& camera, int number) {
    camera.image_type = number;
    if (taken.insert(number).second) return;
    section.section(camera.name).fail("image_type", "another number than that of the other camera");
  };
  for (CameraModel& camera : cameras) {
    if (camera.image_type >= 0) {
      take(camera, camera.image_type);
    } else if (camera.name == "left" || camera.name == "right") {
      take(camera, camera.name == "left" ? 0 : 1);
    }
  }
  for (CameraModel& camera : cameras) {
    for (int number = 0; camera.image_type < 0; ++number) {
      if (!taken.contains(number)) take(camera, number);
    }
  }
  std::sort(cameras.begin(), cameras.end(),
            [](const CameraModel& a, const CameraModel& b) { return a.image_type < b.image_type; });
}

/// A camera beside another is so beside the first of the rig, whose own place is not relative.
void resolve_relative(const Configuration& section, std::vector<CameraModel>& cameras) {
  for (CameraModel& camera : cameras) {
    if (!camera.mount.relative) continue;
    const CameraModel& first = cameras.front();
    if (&camera == &first || camera.mount.parent != first.name || first.mount.relative) {
      section.section(camera.name)
          .fail("beside",
                "the name of the other camera, the one with the smaller number in messages, which has a "
                "'link' of its own");
    }
    camera.mount.parent = first.link;
  }
}

}  // namespace

bool CameraModel::has_distortion() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double d) { return d != 0.0; });
}

int CameraModel::number() const {
  if (image_type >= 0) return image_type;
  return name == "right" ? 1 : 0;
}

StereoRig StereoRig::from(const Configuration& cameras) {
  StereoRig rig;
  for (const std::string& name : cameras.keys()) {
    if (!cameras.has(name)) continue;  // null: taken out again
    if (!is_plain(name)) cameras.fail(name, "a camera's name of 1 to 32 letters, digits, '_' or '-'");
    if (rig.cameras.size() == kMostCameras) cameras.fail(name, "one camera or two");
    rig.cameras.push_back(read_camera(cameras.section(name), name));
  }
  if (rig.cameras.empty()) cameras.fail("left", "a camera, or two, each under its name");
  number_cameras(cameras, rig.cameras);
  resolve_relative(cameras, rig.cameras);
  return rig;
}

std::vector<PinholeIntrinsics> StereoRig::intrinsics() const {
  std::vector<PinholeIntrinsics> all;
  for (const auto& camera : cameras) all.push_back(camera.intrinsics);
  return all;
}

std::vector<std::string> StereoRig::links() const {
  std::vector<std::string> all;
  for (const auto& camera : cameras) all.push_back(camera.link);
  return all;
}

std::shared_ptr<const RobotModel> load_robot(const RobotSetup& setup, const StereoRig& rig) {
  // The URDF first: its links are what a wrong name is compared with.
  RobotModelOptions links_alone = setup.model;
  links_alone.rendered_links.clear();
  const auto urdf = RobotModel::load(links_alone);
  RobotSetup with_frames = setup;
  for (const CameraModel& camera : rig.cameras) {
    const std::string& carrier = camera.mount.parent.empty() ? camera.link : camera.mount.parent;
    if (!camera.mount.relative && !urdf->has_link(carrier)) {
      throw ConfigurationError(camera.place + " is '" + carrier + "'; expected a link of robot '" + urdf->name() +
                               "'; did you mean '" + nearest_name(carrier, urdf->link_names()) + "'?");
    }
    if (camera.link == carrier) continue;
    with_frames.model.added_frames.push_back({camera.link, camera.mount.parent, camera.mount.X_PC});
  }
  return with_frames.load();
}

}  // namespace bodyschema
