#include "drawn_outlines.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "bodyschema/core/error.hpp"

namespace bodyschema {

std::vector<DrawnPicture> read_drawn_outlines(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw FileError(file.string() + ": cannot be read");
  std::vector<DrawnPicture> pictures;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fail = [&](const char* expected) {
      throw FileError(fmt::format("{}:{}: expected {}, found '{}'", file.string(), number, expected, line));
    };
    std::istringstream words(line);
    std::string first;
    if (!(words >> first) || first.front() == '#') continue;
    if (first == "frame") {
      auto& picture = pictures.emplace_back();
      if (!(words >> picture.episode >> picture.row)) fail("frame EPISODE ROW");
      continue;
    }
    if ((first != "L" && first != "R") || pictures.empty()) fail("'frame', or 'L' or 'R' and points below a frame");
    auto& points = first == "L" ? pictures.back().left : pictures.back().right;
    for (std::string word; words >> word;) {
      std::istringstream numbers(word);
      Eigen::Vector2d point;
      char comma = 0;
      if (!(numbers >> point.x() >> comma >> point.y()) || comma != ',' || !numbers.eof()) fail("points u,v");
      points.push_back(point);
    }
  }
  return pictures;
}

std::vector<double> distances_to_outline(const std::vector<Eigen::Vector2d>& points, const BinaryMask& mask) {
  std::vector<Eigen::Vector2d> outline;
  for (int v = 1; v + 1 < mask.height(); ++v) {
    for (int u = 1; u + 1 < mask.width(); ++u) {
      if (!mask.at(u, v)) continue;
      if (mask.at(u + 1, v) && mask.at(u - 1, v) && mask.at(u, v + 1) && mask.at(u, v - 1)) continue;
      outline.emplace_back(u, v);
    }
  }
  std::vector<double> distances;
  for (const auto& point : points) {
    double least = static_cast<double>(mask.width()) * mask.width();
    for (const auto& pixel : outline) least = std::min(least, (pixel - point).squaredNorm());
    distances.push_back(std::sqrt(least));
  }
  return distances;
}

}  // namespace bodyschema
