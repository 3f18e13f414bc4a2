#include <cstdio>
#include <filesystem>

#include <bodyschema/core/nearest_name.hpp>
#include <bodyschema/geometry/pinhole.hpp>

// Calls into one compiled and one header-only library and looks for the installed data folder.
int main(int, char** argv) {
  const bodyschema::PinholeIntrinsics camera{320, 240, 257.34, 257.34, 159.5, 119.5};
  const Eigen::Vector2d pixel = camera.project({0.0, 0.0, 0.3});
  const std::string nearest = bodyschema::nearest_name("elbwo", {"wrist", "elbow"});
  const bool data_found = std::filesystem::is_directory(argv[1]);
  std::printf("principal point (%.1f, %.1f), nearest name %s, %s %s\n", pixel.x(), pixel.y(),
              nearest.c_str(), argv[1], data_found ? "found" : "missing");
  return pixel.x() == 159.5 && nearest == "elbow" && data_found ? 0 : 1;
}
