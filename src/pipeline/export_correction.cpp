#include "bodyschema/pipeline/export_correction.hpp"

#include <spdlog/fmt/fmt.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

using tinyxml2::XMLElement;

Eigen::Vector3d triple(const XMLElement* element, const char* attribute,
                       const Eigen::Vector3d& fallback) {
  const char* text = element != nullptr ? element->Attribute(attribute) : nullptr;
  if (text == nullptr) return fallback;
  Eigen::Vector3d v = fallback;
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  stream >> v.x() >> v.y() >> v.z();
  return v;
}

std::string text_of(const Eigen::Vector3d& v) {
  return fmt::format("{:.12g} {:.12g} {:.12g}", v.x(), v.y(), v.z());
}

/// URDF's fixed-axis roll, pitch, yaw: R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d rpy_of(const Eigen::Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) {  // roll and yaw turn about the same line: roll takes all
    return {std::atan2(-R(1, 2), R(1, 1)), pitch, 0.0};
  }
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

void correct_joint(tinyxml2::XMLDocument& document, XMLElement* joint, double offset) {
  XMLElement* origin = joint->FirstChildElement("origin");
  if (origin == nullptr) {
    origin = document.NewElement("origin");
    joint->InsertFirstChild(origin);
  }
  const Eigen::Vector3d axis =
      triple(joint->FirstChildElement("axis"), "xyz", Eigen::Vector3d::UnitX()).normalized();
  const Eigen::Matrix3d R = rotation_of(triple(origin, "rpy", Eigen::Vector3d::Zero()));
  if (std::string(joint->Attribute("type")) == "prismatic") {
    const Eigen::Vector3d p = triple(origin, "xyz", Eigen::Vector3d::Zero()) - R * axis * offset;
    origin->SetAttribute("xyz", text_of(p).c_str());
  } else {
    const Eigen::Matrix3d turned = R * Eigen::AngleAxisd(-offset, axis).toRotationMatrix();
    origin->SetAttribute("rpy", text_of(rpy_of(turned)).c_str());
  }
  if (XMLElement* limit = joint->FirstChildElement("limit")) {
    for (const char* side : {"lower", "upper"}) {
      double value = 0.0;
      if (limit->QueryDoubleAttribute(side, &value) == tinyxml2::XML_SUCCESS) {
        limit->SetAttribute(side, value + offset);
      }
    }
  }
}

XMLElement* find_joint(XMLElement* robot, const std::string& name) {
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* own = joint->Attribute("name");
    if (own != nullptr && name == own && joint->Attribute("type") != nullptr) return joint;
  }
  return nullptr;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text;
  if (!stream.flush()) throw FileError(file.string() + ": cannot be written");
}

}  // namespace

Correction read_correction(const std::filesystem::path& summary) {
  std::ifstream stream(summary);
  if (!stream) throw FileError(summary.string() + ": no such file; expected a replay's summary.json");
  Correction correction;
  try {
    const auto estimate = nlohmann::ordered_json::parse(stream).at("estimate");
    for (const auto& [joint, value] : estimate.at("offset_deg").items()) {
      correction.offsets_rad.emplace_back(joint, radians(value.get<double>()));
    }
    for (const auto& [joint, value] : estimate.at("stddev_deg").items()) {
      correction.sd_rad.emplace_back(joint, radians(value.get<double>()));
    }
    if (estimate.contains("nuisance")) {
      for (const auto& [name, value] : estimate.at("nuisance").items()) {
        correction.nuisances.emplace_back(name, value.get<double>());
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(summary.string() + ": not a replay's summary.json: " + e.what());
  }
  return correction;
}

void write_corrected_urdf(const std::filesystem::path& urdf, const Correction& correction,
                          const std::filesystem::path& out) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(urdf.c_str()) != tinyxml2::XML_SUCCESS) {
    throw FileError(urdf.string() + ": cannot be read as XML");
  }
  XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) throw FileError(urdf.string() + ": has no <robot>");
  for (const auto& [name, offset] : correction.offsets_rad) {
    XMLElement* joint = find_joint(robot, name);
    if (joint == nullptr) {
      throw FileError(urdf.string() + ": has no joint '" + name + "', which the result corrects");
    }
    correct_joint(document, joint, offset);
  }
  // The arm's offsets hold together with the head's: one without the other would be wrong.
  for (const auto& [name, value] : correction.nuisances) {
    if (XMLElement* joint = find_joint(robot, name)) correct_joint(document, joint, value);
  }
  if (document.SaveFile(out.c_str()) != tinyxml2::XML_SUCCESS) {
    throw FileError(out.string() + ": cannot be written");
  }
}

std::string export_correction(const std::filesystem::path& summary, const std::filesystem::path& urdf,
                              const std::filesystem::path& out) {
  const Correction correction = read_correction(summary);
  std::error_code error;
  std::filesystem::create_directories(out, error);
  write_corrected_urdf(urdf, correction, out / "corrected.urdf");
  std::string yaml = "# encoder = true + offset: subtract from every encoder reading. Degrees.\nversion: 1\noffset_deg:\n";
  std::string delta =
      "# deg to add to each joint's calibrationDelta (the calibrator adds it to the zero, which lowers\n"
      "# the reading by as much)\n";
  for (const auto& [joint, offset] : correction.offsets_rad) {
    yaml += fmt::format("  {}: {:.4f}\n", joint, degrees(offset));
    delta += fmt::format("{:<24} {:+.4f}\n", joint, degrees(offset));
  }
  if (!correction.nuisances.empty()) {
    yaml += "# Estimated beside the offsets; joints in rad, encoder - true. The offsets hold together with them.\nnuisance:\n";
    for (const auto& [name, value] : correction.nuisances) yaml += fmt::format("  {}: {:.6g}\n", name, value);
  }
  yaml += "stddev_deg:\n";
  for (const auto& [joint, sd] : correction.sd_rad) yaml += fmt::format("  {}: {:.4f}\n", joint, degrees(sd));
  write_text(out / "offsets.yaml", yaml);
  write_text(out / "calibration_delta.txt", delta);
  return fmt::format("corrected URDF        {}\noffsets by joint      {}\niCub calibrationDelta {}\n",
                     (out / "corrected.urdf").string(), (out / "offsets.yaml").string(),
                     (out / "calibration_delta.txt").string());
}

}  // namespace bodyschema
