#include "bodyschema/pipeline/starter_configuration.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include "bodyschema/camera/camera_info.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/core/yaml_name.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/imports/stills.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "camera_axes.hpp"
#include "urdf_outline.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kGuessedFieldOfView_rad = 1.05;       // 60 deg across, a common camera
constexpr double kPairSd_deg = 0.1, kPairSd_mm = 1.0;  // of a stereo pair that was calibrated as one
/// Of a camera's place by a hand-eye calibration, a drawing or a tape measure: wide enough for each, as pictures tell
/// it far better.
constexpr double kPlace_sd_deg = 1.0, kPlace_sd_mm = 10.0;
/// Of an arm that comes with a URDF, and of a camera's calibration.
constexpr double kBeside_sd_mm = 0.5, kTilted_sd_deg = 0.1, kFocal_sd_percent = 0.5;
/// Physical: joined by arrival, pictures come late by some frames; a lens that nobody measured bends by as much.
constexpr double kLag_sd_ms = 60.0;
/// Of a camera's principal point, share of the width: by which calibrations of one camera differ.
constexpr double kCentre_share = 0.005;
/// px. Masks made from the pixels themselves err by as many in pictures of any size (config/estimator.yaml). A network
/// resolves no more of a larger picture, so its masks lie outside or inside all around by so many of a 320x240 picture.
constexpr double kBias_sd_px = 0.15;
/// Of a lens of which nobody says anything: fields of view from 40 to 90 deg, sensors that are 2 % off the axis.
constexpr double kGuessedFocal_sd_percent = 25.0;
constexpr double kGuessedCentre_share = 0.02;

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string list(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  for (const auto& name : names) quoted.push_back(yaml_name(name));
  return fmt::format("[{}]", fmt::join(quoted, ", "));
}

/// What of a robot matters here.
struct Parts {
  std::vector<std::string> arm, head, others, rendered;
  std::vector<std::string> others_m;  ///< those of the others that slide
};

Parts parts_of(const UrdfOutline& urdf, const std::string& hand_link, const std::vector<std::string>& camera_links) {
  std::vector<std::string> camera_joints;
  for (const auto& camera : camera_links) {
    for (const auto& joint : urdf.chain(camera)) {
      if (joint.movable) camera_joints.push_back(joint.name);
    }
  }
  Parts parts;
  std::vector<std::string> links;
  std::vector<std::string> shared;
  const auto arm = urdf.chain(hand_link);
  for (const auto& joint : arm) {
    if (joint.movable) (among(camera_joints, joint.name) ? shared : parts.arm).push_back(joint.name);
    std::vector<std::string> none;
    if (!parts.arm.empty()) urdf.collect(joint.child, true, links, none);
  }
  // What hangs on the hand comes last, whether it is fixed there or moves.
  std::vector<std::string> hand;
  urdf.collect(hand_link, false, hand, parts.others);
  std::erase_if(links, [&](const auto& link) { return among(hand, link); });
  links.insert(links.end(), hand.begin(), hand.end());
  std::set<std::string> seen;
  for (const auto& link : links) {
    if (urdf.has_shape(link) && seen.insert(link).second) parts.rendered.push_back(link);
  }
  for (const auto& joint : camera_joints) {
    if (!among(shared, joint) && !among(parts.head, joint)) parts.head.push_back(joint);
  }
  parts.others.insert(parts.others.begin(), shared.begin(), shared.end());
  const auto slides = [&](const std::string& joint) { return urdf.slides(joint); };
  // Published like any other, but no offset of them is estimated.
  std::erase_if(parts.arm, slides);
  std::erase_if(parts.head, slides);
  std::copy_if(parts.others.begin(), parts.others.end(), std::back_inserter(parts.others_m), slides);
  std::erase_if(parts.others, slides);
  return parts;
}

/// One camera as it will stand in the configuration.
struct StarterCamera {
  std::string name;
  std::string link;            ///< with OpenCV axes; empty: none is known
  std::optional<Pose> X_base;  ///< on `link`, where it was given
  PinholeIntrinsics k;
  std::array<double, 5> distortion{};
  std::string source;           ///< of the intrinsics; empty: guessed
  std::optional<Pose> X_first;  ///< in the first camera, where a calibration of the pair says so
  [[nodiscard]] bool unknown() const { return link.empty(); }
};

class Starter {
 public:
  explicit Starter(const StarterOptions& options) : o_(options), urdf_(options.urdf) {
    if (!o_.stills.empty()) {
      stills_ = StillsFolder::list(o_.stills);
      columns_ = StillsColumns::read(o_.stills);
      leave_notes_out();
    }
    find_hand();
    find_cameras();
    std::vector<std::string> links;
    for (const auto& camera : cameras_) links.push_back(camera.link.empty() ? urdf_.root() : camera.link);
    parts_ = parts_of(urdf_, hand_, links);
    if (parts_.arm.empty()) {
      throw ConfigurationError(fmt::format("--hand '{}': no joint moves it against the cameras", hand_));
    }
    if (parts_.rendered.empty()) throw FileError(o_.urdf.string() + ": no link of the arm has a <visual> shape");
    look_for_cameras();
    masks_ = o_.masks.value_or(stills_ && !stills_->masks.empty());
    const bool moving = columns_ && columns_->moving;
    learned_ = !masks_ && moving;
    moving_ = moving;
    // What never moves is learned as background, the robot's base like the rest.
    if (!learned_) add_base(links);
    look_at_columns();
    look_at_masks();
  }

  StarterReport write() {
    make_folder(o_.out);
    write_new(o_.out / "robot.yaml", robot_yaml());
    write_new(o_.out / "estimator.yaml", estimator_yaml());
    const bool simulator = std::none_of(cameras_.begin(), cameras_.end(), [](const auto& c) { return c.unknown(); });
    if (simulator) write_new(o_.out / "simulator.yaml", simulator_yaml());
    StarterReport report{told(simulator), true};
    try {
      const Configuration configuration = Configuration::load(o_.out / "estimator.yaml");
      const Pipeline pipeline(configuration);
      report.text += "robot and meshes load\n" + doubts_about_axes(pipeline);
    } catch (const Error& e) {
      report.text += fmt::format("to be put right: {}\n", e.what());
      report.usable = false;
    }
    for (const auto& wrong : wrong_) {
      report.text += fmt::format("to be put right: {}\n", wrong);
      report.usable = false;
    }
    return report;
  }

 private:
  /// A link of the URDF that somebody took for the camera's own.
  [[nodiscard]] std::string doubts_about_axes(const Pipeline& pipeline) const {
    std::string text;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (cameras_[c].unknown() || cameras_[c].X_base) continue;
      if (!has_body_axes(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), c)) continue;
      text += fmt::format(
          "camera {}: the axes of {} look like a body's (x forward, z up), not a camera's (x right, y down, z into the "
          "picture): name its optical link, or set in robot.yaml, below link,\n    X_link_optical: {}\n",
          cameras_[c].name, cameras_[c].link, pose_yaml(Pose(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5))));
    }
    return text;
  }

  void find_hand() {
    hand_ = o_.hand_link;
    if (!hand_.empty()) return urdf_.require(hand_, "--hand");
    // A jaw that is a finger, and whose joint nobody recorded, is no hand. Columns of other names may be any joint.
    const auto movable = urdf_.movable_joints();
    const bool all_known = columns_ && std::all_of(columns_->names.begin(), columns_->names.end(),
                                                   [&](const auto& name) { return among(movable, name); });
    const auto guess = urdf_.guess_hand(all_known ? columns_->names : std::vector<std::string>{});
    hand_ = guess.link;
    notes_.push_back(fmt::format(
        "hand: a guess, {}{}", hand_,
        guess.others.empty() ? "" : fmt::format("; it could be {} as well (--hand)", fmt::join(guess.others, " or "))));
  }

  [[nodiscard]] std::vector<std::string> folders_of_pictures() const {
    std::vector<std::string> names;
    for (const auto& [name, pictures] : stills_->images) names.push_back(name);
    return names;
  }

  void say_whose_pictures_are_used() {
    std::vector<std::string> used, others;
    for (const auto& camera : cameras_) used.push_back(camera.name);
    for (const auto& name : folders_of_pictures()) {
      if (!among(used, name)) others.push_back(name);
    }
    if (others.empty()) return;
    notes_.push_back(
        fmt::format("cameras: {}; not used: images/{}", fmt::join(used, ", "), fmt::join(others, ", images/")));
  }

  void find_cameras() {
    std::vector<std::string> names;
    if (stills_) {
      names = folders_of_pictures();
      if (names.size() > 2) {
        // Those that are named are meant.
        std::erase_if(names, [&](const std::string& name) {
          return std::none_of(o_.camera_links.begin(), o_.camera_links.end(),
                              [&](const std::string& camera) { return camera.starts_with(name + "="); });
        });
        if (names.empty()) {
          throw ConfigurationError(fmt::format(
              "{}/images: {} cameras ({}), one or two can be used; move the others' folders out of images/, or name "
              "those that are links of the robot (--camera NAME=LINK)",
              o_.stills.string(), stills_->images.size(), fmt::join(folders_of_pictures(), ", ")));
        }
      }
    }
    std::size_t unnamed = 0;
    for (const std::string& given : o_.camera_links) {
      const auto equals = given.find('=');
      StarterCamera camera;
      camera.link = given.substr(equals == std::string::npos ? 0 : equals + 1);
      if (equals != std::string::npos) {
        camera.name = given.substr(0, equals);
      } else if (!names.empty()) {
        camera.name = unnamed < names.size() ? names[unnamed] : "";
      } else {
        camera.name = unnamed == 0 ? "left" : "right";
      }
      ++unnamed;
      urdf_.require(camera.link, "--camera");
      if (stills_ && !stills_->images.contains(camera.name)) {
        throw ConfigurationError(fmt::format("--camera {}: {}/images has no folder of that camera; it has {}", given,
                                             o_.stills.string(), fmt::join(names, ", ")));
      }
      cameras_.push_back(camera);
    }
    if (cameras_.empty()) {
      if (names.empty()) names = names_with_poses();
      if (names.empty() && o_.camera_infos.size() == 2) names = {"left", "right"};
      if (names.empty()) names.push_back("camera");
      for (const auto& name : names) cameras_.emplace_back().name = name;
    }
    if (o_.camera_infos.size() > cameras_.size()) {
      throw ConfigurationError(
          fmt::format("--camera-info: {} files for {} cameras", o_.camera_infos.size(), cameras_.size()));
    }
    if (stills_) say_whose_pictures_are_used();
    std::vector<std::optional<CameraInfo>> infos;
    for (std::size_t c = 0; c < cameras_.size(); ++c) infos.push_back(find_intrinsics(c));
    find_poses();
    if (cameras_.size() == 2 && cameras_[1].unknown() && infos[0] && infos[1]) {
      const Pose X = stereo_pose(*infos[0], *infos[1], o_.rectified);
      constexpr double kApart_m = 1e-3;
      if (X.translation().norm() > kApart_m) cameras_[1].X_first = X;
    }
    for (const auto& camera : cameras_) {
      if (camera.unknown()) {
        notes_.push_back(fmt::format("camera {}: its pose is to be found (robot.yaml: pose: unknown)", camera.name));
      }
    }
  }

  /// A camera of which nothing is said is taken to stand before the robot's base: one in a head that moves would never
  /// be found.
  void look_for_cameras() {
    if (std::none_of(cameras_.begin(), cameras_.end(), [](const auto& camera) { return camera.unknown(); })) return;
    std::map<std::vector<std::string>, std::vector<std::string>> by_joints;
    for (const auto& link : urdf_.named_like_cameras()) {
      std::vector<std::string> joints;
      std::size_t of_arm = 0;
      for (const auto& joint : urdf_.chain(link)) {
        if (!joint.movable) continue;
        joints.push_back(joint.name);
        of_arm += among(parts_.arm, joint.name);
      }
      const bool at_hand = 2 * of_arm > parts_.arm.size();
      if (!at_hand) by_joints[joints].push_back(link);
    }
    if (by_joints.empty()) return;
    std::vector<std::string> groups;
    for (const auto& [joints, links] : by_joints) {
      groups.push_back(fmt::format("{} ({})", fmt::join(links, ", "),
                                   joints.empty() ? "still" : fmt::format("moved by {}", fmt::join(joints, ", "))));
    }
    notes_.push_back(
        fmt::format("cameras are taken to stand before the robot's base; if one is a link of the robot, say "
                    "so (--camera LINK); named like cameras: {}",
                    fmt::join(groups, "; ")));
  }

  /// What --camera-pose calls the cameras: those of the files of --camera-info, or the only one.
  [[nodiscard]] std::vector<std::string> names_with_poses() const {
    if (o_.camera_pose.empty()) return {};
    const auto poses = CameraPoses::from_argument(o_.camera_pose).X_base_optical;
    std::vector<std::string> names;
    for (const fs::path& file : o_.camera_infos) {
      if (poses.contains(file.stem())) names.push_back(file.stem());
    }
    const std::set<std::string> different(names.begin(), names.end());
    if (!names.empty() && different.size() == o_.camera_infos.size()) return names;
    if (poses.size() == 1 && o_.camera_infos.size() < 2) return {poses.begin()->first};
    return {};
  }

  std::optional<CameraInfo> find_intrinsics(std::size_t c) {
    StarterCamera& camera = cameras_[c];
    const auto picture = picture_size_of(camera.name);
    fs::path file = c < o_.camera_infos.size() ? o_.camera_infos[c] : fs::path();
    if (file.empty() && stills_) {
      const auto found = stills_->camera_infos.find(camera.name);
      if (found != stills_->camera_infos.end()) file = found->second;
    }
    if (file.empty()) {
      camera.k.width = picture ? picture->width : o_.width;
      camera.k.height = picture ? picture->height : o_.height;
      camera.k.fx = camera.k.fy =
          o_.focal_px > 0.0 ? o_.focal_px : 0.5 * camera.k.width / std::tan(0.5 * kGuessedFieldOfView_rad);
      camera.k.cx = 0.5 * (camera.k.width - 1);
      camera.k.cy = 0.5 * (camera.k.height - 1);
      if (o_.focal_px <= 0.0) {
        notes_.push_back(
            fmt::format("camera {}: focal length: a guess, {:.0f} px, and to be found (estimator.yaml); better "
                        "give --camera-info, or fill in your cameras' in robot.yaml",
                        camera.name, camera.k.fx));
      }
      notes_.push_back(fmt::format("camera {}: principal point: a guess, the picture's middle", camera.name));
      return std::nullopt;
    }
    const CameraInfo info = CameraInfo::read(file);
    camera.source = file.filename().string();
    camera.k = o_.rectified ? info.rectified : info.intrinsics;
    if (!o_.rectified) camera.distortion = info.distortion;
    if (!o_.rectified && !info.is_rectified()) {
      notes_.push_back(
          fmt::format("camera {}: its pictures are taken for those that the lens makes, not for rectified "
                      "ones (--rectified)",
                      camera.name));
    } else if (!o_.rectified && !bends(camera)) {
      notes_.push_back(
          fmt::format("camera {}: {} has no distortion: how its lens bends pictures is to be found; --rectified says "
                      "that they come straightened",
                      camera.name, camera.source));
    }
    if (picture && *picture != PictureSize{camera.k.width, camera.k.height}) {
      wrong_.push_back(
          fmt::format("{} is of pictures of {}x{} px, those of camera {} are {}x{}: calibrate at this size, "
                      "or scale the numbers in robot.yaml",
                      file.string(), camera.k.width, camera.k.height, camera.name, picture->width, picture->height));
    }
    return info;
  }

  /// Whether nobody said anything of a camera's lens.
  [[nodiscard]] bool focal_guessed() const {
    return o_.focal_px <= 0.0 &&
           std::any_of(cameras_.begin(), cameras_.end(), [](const auto& camera) { return camera.source.empty(); });
  }

  [[nodiscard]] std::optional<PictureSize> picture_size_of(const std::string& camera) const {
    if (!stills_) return std::nullopt;
    const auto pictures = stills_->images.find(camera);
    if (pictures == stills_->images.end()) return std::nullopt;
    return picture_size_in(pictures->second.begin()->second);
  }

  void find_poses() {
    if (o_.camera_pose.empty()) return;
    const CameraPoses poses = CameraPoses::from_argument(o_.camera_pose);
    urdf_.require(poses.base_link, o_.camera_pose + ": base_link");
    for (StarterCamera& camera : cameras_) {
      const auto pose = poses.X_base_optical.find(camera.name);
      if (pose == poses.X_base_optical.end()) {
        std::vector<std::string> there;
        for (const auto& [name, X] : poses.X_base_optical) there.push_back(name);
        throw FileError(fmt::format("{}: no pose of camera '{}'; it has {} (name cameras with --camera NAME=LINK)",
                                    o_.camera_pose, camera.name, fmt::join(there, ", ")));
      }
      camera.link = poses.base_link;
      camera.X_base = pose->second;
    }
  }

  /// What does not move against the cameras but has a shape: seen, where it stands in their view.
  void add_base(const std::vector<std::string>& camera_links) {
    for (const auto& link : camera_links) {
      const auto joints = urdf_.chain(link);
      if (std::any_of(joints.begin(), joints.end(), [](const auto& joint) { return !joint.fixed; })) return;
    }
    std::vector<std::string> base, unused;
    urdf_.collect(urdf_.root(), true, base, unused);
    std::erase_if(base, [&](const auto& link) { return !urdf_.has_shape(link) || among(parts_.rendered, link); });
    if (base.empty() || !in_view(base)) return;
    parts_.rendered.insert(parts_.rendered.begin(), base.begin(), base.end());
    base_ = base;
  }

  /// Whether any vertex of these links is in any picture; of a camera whose pose is not known it may be.
  [[nodiscard]] bool in_view(const std::vector<std::string>& links) const {
    if (std::any_of(cameras_.begin(), cameras_.end(), [](const auto& c) { return c.unknown(); })) return true;
    try {
      const auto robot = RobotModel::load({o_.urdf, urdf_.mesh_roots(links), links});
      std::vector<std::string> frames = links;
      for (const auto& camera : cameras_) frames.push_back(camera.link);
      ForwardKinematics kinematics(robot, frames);
      std::vector<Pose> X_WB(frames.size());
      kinematics.compute(Eigen::VectorXd::Zero(robot->joint_count()), X_WB);
      for (std::size_t c = 0; c < cameras_.size(); ++c) {
        const Pose X_CW = (X_WB[links.size() + c] * cameras_[c].X_base.value_or(Pose::Identity())).inverse();
        for (std::size_t l = 0; l < links.size(); ++l) {
          for (const auto& vertex : robot->meshes()[l].mesh.vertices) {
            const Eigen::Vector3d p_C = X_CW * (X_WB[l] * vertex.cast<double>());
            if (p_C.z() <= 0.0) continue;
            const Eigen::Vector2d px = cameras_[c].k.project(p_C);
            if (px.x() >= 0.0 && px.y() >= 0.0 && px.x() < cameras_[c].k.width && px.y() < cameras_[c].k.height) {
              return true;
            }
          }
        }
      }
      return false;
    } catch (const Error&) {
      return false;  // what is wrong with its meshes is said where they are needed
    }
  }

  /// A column that is no joint and holds text is somebody's notes; a joint's must hold numbers.
  void leave_notes_out() {
    const auto joints = urdf_.movable_joints();
    for (std::size_t i = columns_->names.size(); i-- > 0;) {
      const LeftOut& words = columns_->words[i];
      if (words.count == 0) continue;
      if (among(joints, columns_->names[i])) {
        words.check(columns_->rows, "rows");
        continue;
      }
      notes_.push_back(
          fmt::format("column '{}' of joints.csv is no joint and holds text; it is not read", columns_->names[i]));
      const auto at = static_cast<std::ptrdiff_t>(i);
      columns_->names.erase(columns_->names.begin() + at);
      columns_->largest.erase(columns_->largest.begin() + at);
      columns_->words.erase(columns_->words.begin() + at);
    }
  }

  /// Joints that joints.csv has need no fixed value; columns that are no joints are what must be said.
  void look_at_columns() {
    if (!columns_) return;
    const auto recorded = [&](const std::string& joint) { return among(columns_->names, joint); };
    std::erase_if(parts_.others, recorded);
    std::erase_if(parts_.others_m, recorded);
    const auto joints = urdf_.movable_joints();
    for (const auto& name : columns_->names) {
      if (!among(joints, name)) strangers_.push_back(name);
    }
    std::vector<std::string> missing;
    for (const auto* some : {&parts_.arm, &parts_.head}) {
      for (const auto& joint : *some) {
        if (!recorded(joint)) missing.push_back(joint);
      }
    }
    if (!missing.empty()) {
      wrong_.push_back(fmt::format(
          "joints.csv has no column of {}; {}", fmt::join(missing, ", "),
          strangers_.empty()
              ? "a joint that was not recorded needs a value under robot.fixed_joints_deg"
              : fmt::format("say which of {} is which in estimator.yaml, import.joints", fmt::join(strangers_, ", "))));
    } else if (!strangers_.empty()) {
      notes_.push_back(fmt::format("columns of joints.csv that are no joints: {}", fmt::join(strangers_, ", ")));
    }
    constexpr double kMostRadians = 4.0 * kPi;  // a joint that turns for ever was turned by no more
    double largest = 0.0;
    for (std::size_t i = 0; i < columns_->names.size(); ++i) {
      const auto& name = columns_->names[i];
      const bool no_joint = missing.empty() && among(strangers_, name);
      if (!no_joint && !urdf_.slides(name)) largest = std::max(largest, columns_->largest[i]);
    }
    in_degrees_ = largest > kMostRadians;
    if (in_degrees_) {
      notes_.push_back(
          fmt::format("joints.csv goes up to {:.4g} and is taken for deg (estimator.yaml: import.unit)", largest));
    }
  }

  /// Masks that belong to no picture would be missed where masks are asked for, and never where they are not.
  void look_at_masks() {
    if (!stills_ || !o_.masks.value_or(true)) return;
    std::vector<std::string> lost;
    for (const std::string& folder : stills_->mask_folders()) {
      const auto some = stills_->masks_without_picture(folder, folder);
      lost.insert(lost.end(), some.begin(), some.end());
    }
    if (lost.empty()) return;
    const std::string said =
        fmt::format("{}{}", lost.front(),
                    lost.size() > 1 ? fmt::format(" (the first of {} masks without a picture)", lost.size()) : "");
    (stills_->masks.empty() ? wrong_ : notes_).push_back(said);
  }

  [[nodiscard]] std::string from_here(const fs::path& path) const {
    return fs::proximate(fs::absolute(path), fs::absolute(o_.out)).string();
  }

  [[nodiscard]] std::string robot_yaml() const {
    std::vector<std::string> roots;
    for (const auto& root : urdf_.mesh_roots(parts_.rendered)) roots.push_back(from_here(root));
    std::string text = fmt::format(
        "# Written from {}; every key is explained in config/icub_right/robot.yaml.\n"
        "version: 1\n\nrobot:\n  urdf: {}\n"
        "  mesh_search_roots: {}             # folders in which package://... is looked for\n"
        "  # What the cameras see of the robot; leave out what is always hidden.\n",
        yaml_name(o_.urdf.filename().string()), yaml_name(from_here(o_.urdf)), list(roots));
    if (!base_.empty()) {
      text += fmt::format(
          "  # {} and the cameras do not move against each other: with vision.method learned_background or\n"
          "  # background_picture it belongs to the background and must be taken out.\n",
          fmt::join(base_, ", "));
    }
    text += fmt::format(
        "  rendered_links: {}\n  hand_link: {}\n"
        "  fingertip_links: []               # links at the fingertips, for errors there\n"
        "  estimated_joints: {}\n",
        list(parts_.rendered), yaml_name(hand_), list(parts_.arm));
    if (!parts_.head.empty()) text += fmt::format("  head_joints: {}\n", list(parts_.head));
    const auto fix = [&](const char* unit, const std::vector<std::string>& joints) {
      if (joints.empty()) return;
      text += fmt::format("  # {0}; take out the joints that the robot publishes.\n  fixed_joints_{0}:\n", unit);
      for (const auto& joint : joints) text += fmt::format("    {}: 0\n", yaml_name(joint));
    };
    fix("deg", parts_.others);
    fix("m", parts_.others_m);
    text +=
        "  gravity_m_s2: [0, 0, -9.81]       # root frame\n\n"
        "# Focal lengths fx, fy and principal point cx, cy in px; distortion k1 k2 p1 p2 k3: "
        "OpenCV's calibration.\n"
        "cameras:\n";
    for (std::size_t c = 0; c < cameras_.size(); ++c) text += camera_yaml(c);
    return text;
  }

  [[nodiscard]] static bool bends(const StarterCamera& camera) {
    return std::any_of(camera.distortion.begin(), camera.distortion.end(), [](double d) { return d != 0.0; });
  }

  /// A calibration that found nothing is rarely one: k1 is estimated then, unless pictures are said to come straight.
  [[nodiscard]] std::string lens_of(const StarterCamera& camera) const {
    if (bends(camera)) return fmt::format("[{:.8g}]", fmt::join(camera.distortion, ", "));
    return o_.rectified ? "[0, 0, 0, 0, 0]"
                        : "unknown             # k1 is estimated; zeros: pictures come straightened";
  }

  /// What a file says of a camera's place is some day's measurement, or a drawing.
  [[nodiscard]] static std::string roughly() {
    return fmt::format(
        "    pose: roughly                   # or exact (a simulator's), known (to 1 mm and 0.1 deg) or unknown\n"
        "    pose_sd_deg: {}                  # what is believed possible, about each axis\n"
        "    pose_sd_mm: {}                  # ... and along each\n",
        kPlace_sd_deg, kPlace_sd_mm);
  }

  [[nodiscard]] std::string camera_yaml(std::size_t c) const {
    const StarterCamera& camera = cameras_[c];
    std::string text = fmt::format("  {}:\n", yaml_name(camera.name));
    if (camera.X_base) {
      text += fmt::format("    link: {}\n    X_link_optical: {}\n{}", yaml_name(camera.link), pose_yaml(*camera.X_base),
                          roughly());
    } else if (!camera.unknown()) {
      text += fmt::format("    link: {}\n{}", yaml_name(camera.link), roughly());
    } else if (camera.X_first) {
      text += fmt::format(
          "    beside: {}                    # as their calibration says; x right, y down, z forward\n"
          "    X_beside_optical: {}\n    pose: roughly\n    pose_sd_deg: {}\n    pose_sd_mm: {}\n",
          yaml_name(cameras_.front().name), pose_yaml(*camera.X_first), kPairSd_deg, kPairSd_mm);
    } else {
      text += fmt::format(
          "    link: {}                    # what carries the camera; where on it, is to be found:\n"
          "    pose: unknown                   # or exact, known, or roughly: X_link_optical, pose_sd_deg, "
          "pose_sd_mm\n",
          yaml_name(urdf_.root()));
    }
    const auto& k = camera.k;
    text += fmt::format(
        "    width: {}\n    height: {}\n    fx: {:.8g}{}\n    fy: {:.8g}\n    cx: {:.8g}\n    cy: {:.8g}\n"
        "    distortion: {}\n    readout_ms: unknown             # of a rolling shutter; 0: all rows at once\n",
        k.width, k.height, k.fx,
        camera.source.empty() ? o_.focal_px > 0.0 ? "" : "                   # a guess" : "  # " + camera.source, k.fy,
        k.cx, k.cy, lens_of(camera));
    return text;
  }

  [[nodiscard]] std::string estimator_yaml() const {
    std::string text = fmt::format(
        "# The included files of config/ are the installed ones and explain every key.\n"
        "include: [config/estimator.yaml, config/bus.yaml, config/vision.yaml, "
        "robot.yaml]\n"
        "vision:\n"
        "  method: {}                # or {}: docs/masks.md\n"
        "  looks_file: looks.json      # the robot's colours, which a service keeps for its next start (auto)\n"
        "bus:\n"
        "  channel_prefix: {}\n",
        masks_     ? "given"
        : learned_ ? "learned_background"
                   : "auto",
        masks_     ? "auto, without masks"
        : learned_ ? "auto, where the cameras move"
                   : "single_colour, learned_background",
        yaml_name(o_.channel_prefix));
    text += state_yaml();
    if (!in_degrees_ && strangers_.empty()) return text;
    text += "# Which column of a recording is which joint; docs/import_recordings.md.\nimport:\n";
    if (in_degrees_) text += "  unit: deg\n";
    if (strangers_.empty()) return text;
    text += "  joints:\n";
    for (const auto& name : strangers_) {
      text += fmt::format("    {}: \"-\"   # a joint of {}; \"-\": left out\n", yaml_name(name),
                          o_.urdf.filename().string());
    }
    return text;
  }

  /// What arms and cameras are wrong by as a rule, and what may be wrong in this recording besides.
  [[nodiscard]] std::string state_yaml() const {
    std::string text;
    if (!stills_) {
      text += fmt::format(
          "    # What a real arm and camera are wrong by as a rule (standard deviations); what turns out to be wronger "
          "is\n"
          "    # found all the same, and said. 0 leaves one out, for a simulator's.\n"
          "    joint_place: {{sd_mm: {}}}       # each joint beside where the URDF has it\n"
          "    axis_tilt: {{sd_deg: {}}}        # each axis\n",
          kBeside_sd_mm, kTilted_sd_deg);
      if (!focal_guessed()) text += fmt::format("    focal_length: {{sd_percent: {}}}\n", kFocal_sd_percent);
    }
    if (moving_ || !stills_) {
      text += fmt::format("    latency: {{sd_ms: {}}}             # pictures against encoders\n", kLag_sd_ms);
    }
    if (focal_guessed()) {
      text +=
          fmt::format("    focal_length: {{sd_percent: {}}}       # a guess; take this out with your cameras' own\n",
                      kGuessedFocal_sd_percent);
    }
    double width = 0.0, unit_px = 1.0;
    for (const auto& camera : cameras_) {
      width = std::max(width, static_cast<double>(camera.k.width));
      unit_px = std::max(unit_px, picture_unit(camera.k));
    }
    if (masks_ && unit_px > 1.0) {
      text += fmt::format("    silhouette_bias: {{sd_px: {:.2f}}}   # as {} of a picture of 320x240\n",
                          kBias_sd_px * unit_px, kBias_sd_px);
    }
    if (focal_guessed() || stills_) {
      const double sd_px = (focal_guessed() ? kGuessedCentre_share : kCentre_share) * width;
      text += fmt::format("    principal_point common: {{sd_px: {:.1f}}} # {}\n", sd_px,
                          focal_guessed() ? "a guess as well" : "of calibrations of one camera after the other");
      if (focal_guessed() && cameras_.size() == 2) {
        text += fmt::format("    principal_point difference: {{sd_px: {:.1f}}}\n", std::sqrt(2.0) * sd_px);
      }
    }
    return text.empty() ? text : "estimator:\n  state:\n" + text;
  }

  /// The distances of the motion are left out: the simulator finds them.
  [[nodiscard]] std::string simulator_yaml() const {
    return fmt::format(
        "# A stand-in for the robot, played by bodyschema-sim; every key is explained in\n"
        "# config/icub_right/simulator.yaml.\n"
        "include: [config/bus.yaml, robot.yaml]\n"
        "bus:\n"
        "  channel_prefix: {}\n"
        "simulator:\n"
        "  cameras:\n"
        "    rate_hz: 30\n"
        "  motion:\n"
        "    posture_deg: {{}}                 # of head and fingers; left out: robot.fixed_joints_deg, else 0\n"
        "    hand_radius_m: 0.1              # m; kept inside the pictures around the hand\n",
        yaml_name(o_.channel_prefix));
  }

  static void write_new(const fs::path& file, const std::string& text) {
    std::error_code ignored;
    if (fs::exists(file, ignored)) throw FileError(file.string() + ": is there already and is not replaced");
    replace_file(file, text);  // on a full disk nothing half done stands in the way of the next try
  }

  [[nodiscard]] std::string told(bool simulator) const {
    std::string text = fmt::format("arm: {}\n", fmt::join(parts_.arm, ", "));
    if (!parts_.head.empty()) text += fmt::format("head: {}\n", fmt::join(parts_.head, ", "));
    auto fixed = parts_.others;
    fixed.insert(fixed.end(), parts_.others_m.begin(), parts_.others_m.end());
    if (!fixed.empty()) {
      text += fmt::format("taken as fixed at 0 unless you take them out: {}\n", fmt::join(fixed, ", "));
    }
    text += fmt::format("seen: {}\n", fmt::join(parts_.rendered, ", "));
    for (const auto& note : notes_) text += note + '\n';
    return text + fmt::format("wrote robot.yaml{} estimator.yaml{} in {}\n", simulator ? "," : " and",
                              simulator ? " and simulator.yaml" : "", o_.out.string());
  }

  const StarterOptions& o_;
  UrdfOutline urdf_;
  std::optional<StillsFolder> stills_;
  std::optional<StillsColumns> columns_;
  std::string hand_;
  std::vector<StarterCamera> cameras_;
  Parts parts_;
  std::vector<std::string> base_;       ///< links without motion against the cameras that may be seen
  std::vector<std::string> strangers_;  ///< columns of joints.csv that are no joints
  bool masks_ = false, in_degrees_ = false;
  bool moving_ = false;             ///< the stills are a recording of a moving arm
  bool learned_ = false;            ///< masks come of a learned background
  std::vector<std::string> notes_;  ///< what was guessed
  std::vector<std::string> wrong_;  ///< what must be put right
};

}  // namespace

StarterReport write_starter_configuration(const StarterOptions& options) {
  return Starter(options).write();
}

}  // namespace bodyschema
