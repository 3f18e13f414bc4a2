#include "bodyschema/robot/motion_file.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

constexpr double kMm = 1e-3;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  for (std::istringstream text(line); std::getline(text, cell, ',');) {
    const auto from = cell.find_first_not_of(" \t\r"), to = cell.find_last_not_of(" \t\r");
    cells.push_back(from == std::string::npos ? "" : cell.substr(from, to - from + 1));
  }
  return cells;
}

}  // namespace

MotionFile MotionFile::parse(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw FileError(file.string() + ": no such file, expected a motion");
  MotionFile motion;
  std::size_t number = 0;
  const auto fail = [&](const std::string& what) {
    throw FileError(file.string() + ":" + std::to_string(number) + ": " + what);
  };
  for (std::string line; std::getline(in, line);) {
    ++number;
    const auto cells = cells_of(line);
    if (cells.empty() || cells[0].empty() || cells[0][0] == '#') continue;
    if (motion.joints.empty()) {
      if (cells[0] != "time_s" || cells.size() < 2) fail("expected 'time_s' and names of joints");
      motion.joints.assign(cells.begin() + 1, cells.end());
      continue;
    }
    if (cells.size() != motion.joints.size() + 1) {
      fail(std::to_string(cells.size()) + " values, expected " + std::to_string(motion.joints.size() + 1));
    }
    Posture posture{.q = Eigen::VectorXd(static_cast<Eigen::Index>(motion.joints.size()))};
    for (std::size_t i = 0; i < cells.size(); ++i) {
      char* end = nullptr;
      const double value = std::strtod(cells[i].c_str(), &end);
      if (cells[i].empty() || *end != '\0' || !std::isfinite(value)) fail("'" + cells[i] + "', expected a number");
      (i == 0 ? posture.time_s : posture.q[static_cast<Eigen::Index>(i) - 1]) = value;
    }
    if (!motion.postures.empty() && posture.time_s <= motion.postures.back().time_s) {
      fail("time_s " + cells[0] + ", expected one after that of the line before");
    }
    motion.postures.push_back(std::move(posture));
  }
  if (motion.postures.size() < 2) throw FileError(file.string() + ": expected two postures or more");
  return motion;
}

void MotionFile::to_si() {
  for (auto& posture : postures) {
    for (std::size_t i = 0; i < joints.size(); ++i) {
      posture.q[static_cast<Eigen::Index>(i)] *= slides[i] ? kMm : radians(1.0);
    }
  }
}

void MotionFile::write(const std::filesystem::path& file) const {
  std::ostringstream out;
  std::istringstream remarks(remark);
  for (std::string line; std::getline(remarks, line);) out << "# " << line << '\n';
  out << "time_s";
  for (const auto& joint : joints) out << ',' << joint;
  out << '\n';
  out.setf(std::ios::fixed);
  for (const auto& posture : postures) {
    out.precision(2);
    out << posture.time_s;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      out << ',' << posture.q[static_cast<Eigen::Index>(i)] / (slides[i] ? kMm : radians(1.0));
    }
    out << '\n';
  }
  write_file(file, out.str());
}

}  // namespace bodyschema
