// A configuration file, through every reader of its sections.
#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/imports/joint_mapping.hpp"
#include "bodyschema/imports/yarp_import.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/simulator/simulator_settings.hpp"
#include "bodyschema/vision/vision_setup.hpp"
#include "effects/roles.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::refuse_or_accept([&] {
    const Configuration c = Configuration::parse(fuzz::as_text(data, size), "/nonexistent");
    fuzz::refuse_or_accept([&] { (void)RobotSetup::from(c.section("robot")); });
    fuzz::refuse_or_accept([&] { (void)StereoRig::from(c.section("cameras")); });
    fuzz::refuse_or_accept([&] { (void)BusOptions::from(c.section("bus")); });
    fuzz::refuse_or_accept([&] { (void)YarpImportOptions::from(c.section("yarp_import")); });
    fuzz::refuse_or_accept([&] { (void)simulator::SimulatorSettings::from(c.section("simulator")); });
    fuzz::refuse_or_accept([&] { (void)EstimatorOptions::from(c); });
    fuzz::refuse_or_accept([&] { (void)Beliefs::from(c, test::roles(), {}, {}); });
    fuzz::refuse_or_accept([&] { (void)JointMapping::from(c.section("import")); });
    fuzz::refuse_or_accept([&] { (void)VisionSetup::from(c.section("vision")); });
    (void)c.print();
    c.reject_unknown_keys();
  });
  return 0;
}
