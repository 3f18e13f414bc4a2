#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/pipeline/starter_configuration.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_new_robot(CLI::App& app) {
  struct Arguments {
    StarterOptions options;
    std::string size = "640x480";
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("new-robot", "Write a configuration for another robot, from its URDF");
  command->footer(
      "Example:\n"
      "  bodyschema new-robot arm.urdf --hand hand --camera camera_left_optical --camera "
      "camera_right_optical \\\n"
      "    --size 640x480 --focal 600 --prefix ARM --out my_arm\n"
      "docs/calibrate_my_robot.md leads through the rest.");
  command->add_option("urdf", a->options.urdf, "URDF of the robot")->required();
  command->add_option("--hand", a->options.hand_link, "Link at the end of the arm, whose pose is reported")->required();
  command
      ->add_option("--camera", a->options.camera_links,
                   "Link of a camera, OpenCV axes; the left one first (once or twice)")
      ->required()
      ->expected(1)
      ->take_all();
  command->add_option("--size", a->size, "Size of the pictures in px, WIDTHxHEIGHT (default 640x480)");
  command->add_option("--focal", a->options.focal_px, "Focal length in px; a guess without it")
      ->check(number_in(1.0, 1e5));
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
    std::fputs(write_starter_configuration(o).c_str(), stdout);
  });
}

}  // namespace bodyschema::apps
