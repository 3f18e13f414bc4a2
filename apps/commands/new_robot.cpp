#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/pipeline/starter_configuration.hpp"
#include "commands.hpp"

namespace bodyschema::apps {
namespace {

/// What is written must be changed before it can be used; what is wrong has been said.
constexpr int kToBePutRight = 2;

}  // namespace

void add_new_robot(CLI::App& app) {
  struct Arguments {
    StarterOptions options;
    std::string size = "640x480";
    std::vector<std::string> camera_infos;
    std::string stills;
    bool masks = false, no_masks = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("new-robot", "Write a configuration for another robot, from its URDF");
  command->footer(
      "Examples:\n"
      "  bodyschema new-robot arm.urdf --stills photographs --out my_arm\n"
      "  bodyschema new-robot arm.urdf --hand hand --camera camera_left_optical --camera "
      "camera_right_optical \\\n"
      "    --size 640x480 --focal 600 --prefix ARM --out my_arm\n"
      "What is not given is found, or guessed and said. Without --camera the cameras' poses are to be found.\n"
      "docs/calibrate_my_robot.md leads through the rest. Exit status 2: something must be put right first.");
  command->add_option("urdf", a->options.urdf, "URDF of the robot")->required();
  command->add_option("--hand", a->options.hand_link,
                      "Link at the end of the arm, whose pose is reported (default: the last one with a shape)");
  command
      ->add_option("--camera", a->options.camera_links,
                   "LINK or CAMERA=LINK: link of a camera, OpenCV axes; the left one first (once or twice)")
      ->expected(1)
      ->take_all();
  command->add_option("--stills", a->stills,
                      "Folder with images/CAMERA/NN.png, joints.csv, camera_info/CAMERA.yaml, masks/CAMERA/NN.png: "
                      "names, sizes and intrinsics of the cameras, joints that are recorded");
  command->add_option("--camera-info", a->camera_infos, "ROS CameraInfo as YAML, one for each camera in their order")
      ->expected(1)
      ->take_all();
  command->add_flag("--rectified", a->options.rectified,
                    "The pictures are rectified: P of the CameraInfo counts, not K");
  command->add_option(
      "--camera-pose", a->options.camera_pose,
      "camera_pose.json, or camera_pose.json:METHOD: poses of the cameras, taken for right to 10 mm and 1 deg");
  command->add_option("--size", a->size, "Size of the pictures in px, WIDTHxHEIGHT (default 640x480)");
  command->add_option("--focal", a->options.focal_px, "Focal length in px; a guess without it")
      ->check(number_in(1.0, 1e5));
  auto* masks = command->add_flag("--masks", a->masks, "Others find the robot and send masks (vision.method: given)");
  command->add_flag("--no-masks", a->no_masks, "Masks of the stills are not used")->excludes(masks);
  command->add_option("--prefix", a->options.channel_prefix,
                      "Messages come on PREFIX_JOINT_STATE and PREFIX_CAMERAS (default ROBOT)");
  command->add_option("-o,--out", a->options.out, "Folder for robot.yaml, estimator.yaml and simulator.yaml")
      ->required();
  command->callback([a] {
    set_up_logging("warn");
    char rest = 0;
    auto& o = a->options;
    if (std::sscanf(a->size.c_str(), "%dx%d%c", &o.width, &o.height, &rest) != 2 || o.width < 16 || o.height < 16 ||
        o.width > 4096 || o.height > 4096) {
      throw CLI::ValidationError("--size", "'" + a->size + "' is not WIDTHxHEIGHT in px, 16x16 to 4096x4096");
    }
    if (o.camera_links.size() > 2) throw CLI::ValidationError("--camera", "one or two cameras");
    o.stills = a->stills;
    o.camera_infos.assign(a->camera_infos.begin(), a->camera_infos.end());
    if (a->masks || a->no_masks) o.masks = a->masks;
    const StarterReport report = write_starter_configuration(o);
    std::fputs(report.text.c_str(), stdout);
    if (!report.usable) throw CLI::RuntimeError(kToBePutRight);
  });
}

}  // namespace bodyschema::apps
