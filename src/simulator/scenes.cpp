#include "bodyschema/simulator/scenes.hpp"

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"

namespace bodyschema::simulator {
namespace {

using Overrides = std::vector<std::string>;

const Overrides kRoom = {"simulator.room.background=kitchen", "simulator.room.table=true"};
const Overrides kHead = {"simulator.motion.head=gaze"};
const Overrides kMaterials = {"simulator.light.looks=covers", "simulator.light.shadows=true",
                              "simulator.room.table=true"};
const Overrides kLight = {"simulator.light.drift=0.2", "simulator.light.flicker=0.03"};
const Overrides kBox = {"simulator.things.held=box"};
const Overrides kSecondArm = {"simulator.things.second_arm=true"};
const Overrides kPerson = {"simulator.things.person_every_s=10"};
const Overrides kShutter = {"simulator.cameras.exposure_ms=8", "simulator.cameras.readout_ms=20"};
const Overrides kJpeg = {"simulator.cameras.jpeg_quality=70"};

Overrides together(const std::vector<Overrides>& several) {
  Overrides all;
  for (const auto& one : several) all.insert(all.end(), one.begin(), one.end());
  return all;
}

}  // namespace

const std::vector<Scene>& scenes() {
  static const std::vector<Scene> all = {
      {"plain", "a plain wall and a grey robot: nothing beyond the configuration", {}},
      {"room", "a cluttered room with a laid table, still head", kRoom},
      {"head", "the same room, the head follows the hand", together({kRoom, kHead})},
      {"materials", "white glossy covers, dark joints, coloured fingertips, shadows", kMaterials},
      {"light", "the light grows by 20 % over the motion and flickers by 3 % from picture to picture", kLight},
      {"object", "the hand holds a box", kBox},
      {"object_part", "the hand holds a box from 15 s on", together({kBox, {"simulator.things.held_from_s=15"}})},
      {"bottle", "the hand holds a bottle", {"simulator.things.held=bottle"}},
      {"stick", "the hand holds a stick", {"simulator.things.held=stick"}},
      {"second_arm", "the robot's other arm is in view", kSecondArm},
      {"person", "a person's arm crosses the view every 10 s", kPerson},
      {"shutter", "8 ms of exposure, rows read out over 20 ms", kShutter},
      {"lens_forgotten",
       "lenses of k1 = -0.3 that the configuration does not know of",
       {"simulator.cameras.lens_k1=-0.3"}},
      {"jpeg", "pictures through JPEG of quality 70", kJpeg},
      {"kitchen", "all of it, but for forgotten lenses",
       together({kRoom, kHead, kMaterials, kLight, kBox, kSecondArm, kPerson, kShutter, kJpeg})}};
  return all;
}

const Scene& scene(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& one : scenes()) {
    if (one.name == name) return one;
    names.push_back(one.name);
  }
  const auto nearest = nearest_name(name, names);
  std::string list;
  for (const auto& known : names) list += (list.empty() ? "" : ", ") + known;
  throw ConfigurationError("unknown scene '" + name + "'; " +
                           (nearest.empty() ? "expected " + list : "did you mean '" + nearest + "'?"));
}

void apply_scene(SimulatorSettings& settings, const std::string& name) {
  for (const auto& assignment : scene(name).overrides) {
    // "a.b.c=value" as the document {a: {b: {c: value}}}.
    const auto equals = assignment.find('=');
    std::string path = assignment.substr(0, equals), yaml, closing;
    for (std::size_t dot; (dot = path.find('.')) != std::string::npos; path = path.substr(dot + 1)) {
      yaml += "{" + path.substr(0, dot) + ": ";
      closing += "}";
    }
    yaml += "{" + path + ": " + assignment.substr(equals + 1) + "}" + closing;
    const auto document = Configuration::parse(yaml);
    settings = SimulatorSettings::from(document.section("simulator"), settings);
    document.reject_unknown_keys();
  }
}

}  // namespace bodyschema::simulator
