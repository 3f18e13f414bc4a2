#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/simulator/trajectory.hpp"

namespace bodyschema::simulator {

/// A fault as people write it: `name:key=value,key=value`, e.g.
/// `backlash:joint=r_elbow,value=0.8`. Units are those of `FaultKind`.
struct FaultSpec {
  std::string name;
  std::map<std::string, std::string> arguments;

  /// Throws ConfigurationError for text of another form.
  static FaultSpec parse(const std::string& text);
  /// The same from code; numbers keep ten digits.
  static FaultSpec of(std::string name, const std::string& joint, double value);
  FaultSpec& set(const std::string& key, double number);
  [[nodiscard]] std::string text() const;
  /// The `value` argument; 0 when absent.
  [[nodiscard]] double value() const;
  friend bool operator==(const FaultSpec&, const FaultSpec&) = default;
};

/// The robot that a fault befalls: what it is nominally and what it is about to do.
struct FaultSite {
  std::shared_ptr<const RobotModel> model;
  std::vector<Eigen::Index> arm;                    ///< shoulder to wrist, as in RobotSetup::estimated_joints
  std::vector<Eigen::Index> head;                   ///< RobotSetup::head_joints that move both cameras
  std::vector<Eigen::Index> fingers;                ///< joints that curl a finger
  std::optional<Eigen::Index> left_pan, right_pan;  ///< joints that turn one camera alone, sideways
  std::string hand_link;
  Eigen::Vector3d gravity_W{0, 0, -9.81};
  std::size_t cameras = 2;
  std::vector<std::string> camera_names;  ///< as in the rig
  /// The pair frame K, in which both cameras are displaced together: origin midway between the cameras, axes of
  /// the first one, head and eyes at RobotSetup::default_joints. It is rigid with the last link that carries all.
  std::string mount_link;
  Pose X_MK = Pose::Identity();            ///< K in that link, metres
  const Trajectory* trajectory = nullptr;  ///< intended motion; outlives the faults
  double begin_s = 0.0;                    ///< when the motion proper begins
  double end_s = 0.0;                      ///< ... and ends
  std::uint64_t seed = 0;

  FaultSite() = default;
  FaultSite(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig);
  /// Positions in RobotModel::meshes of the covers that belong to a part of the robot: `all`, `hand` (what all
  /// arm joints move), `palm` and `fingers` (the hand's pieces that are rigid with the hand link, and the others),
  /// `forearm`, `upper_arm`, or rendered links by name, several joined by '+'. Empty: no such part.
  [[nodiscard]] std::vector<std::size_t> covers_of(const std::string& part) const;
};

/// A joint whose rotation axis or place is not where the URDF has it. Neither changes the pose at
/// joint angle zero by rotation, so no offset absorbs it.
struct JointMisplacement {
  Eigen::Index joint = 0;
  double lengthening_m = 0.0;  ///< everything beyond moves this much further out along the axis
  double tilt_1_rad = 0.0;     ///< turn of the axis about the first perpendicular direction
  double tilt_2_rad = 0.0;     ///< ... about the second
  double shift_1_m = 0.0;      ///< everything beyond moves along the first perpendicular direction
  double shift_2_m = 0.0;      ///< ... along the second
  /// Everything beyond moves by this in the frame of the link that carries the joint, metres.
  Eigen::Vector3d shift_P = Eigen::Vector3d::Zero();
};

/// A rendered link's cover as it was moulded, against its mesh.
struct TrueCover {
  double scale = 1.0;       ///< about the origin of the link's frame
  double reach = 1.0;       ///< that origin lies this many times as far from the hand link's
  double dilation_m = 0.0;  ///< the surface lies this far outside the drawn one, along its normals
};

/// Things that a hand can hold.
enum class HeldKind { kNone, kBox, kBottle, kStick };
/// What the hand holds: rigid with the hand link, between thumb (the first fingertip) and fingers.
struct HeldThing {
  HeldKind kind = HeldKind::kNone;
  double length_m = 0.0;  ///< longest side; 0: 0.11 (box), 0.22 (bottle), 0.30 (stick)
  double from_s = 0.0;    ///< there from this time after the beginning of the motion on; 0: all the time
};

/// The robot and its cameras as built, where that is not what URDF and configuration say.
struct TrueBody {
  std::vector<CameraModel> cameras;
  std::vector<Pose> X_CT;        ///< each true camera in the frame where it should be, metres
  Pose X_KT = Pose::Identity();  ///< displacement of all cameras together (FaultSite::X_MK)
  std::string mount_link;        ///< FaultSite's
  Pose X_MK = Pose::Identity();  ///< FaultSite's
  std::vector<JointMisplacement> misplacements;
  std::vector<TrueCover> covers;  ///< one per RobotModel::meshes
  HeldThing held;
  double dilation_px = 0.0;  ///< the picture of the robot spills this far over its outline
  double payload_kg = 0.0;   ///< held at the hand link's origin
};

/// When pictures are really taken. A picture stamped t was exposed at t - latency_s (+ right_skew_s
/// in the right camera).
struct ExposureTiming {
  double latency_s = 0.0;
  double right_skew_s = 0.0;
  double longer_exposure_s = 0.0;  ///< true - configured time that a row is exposed
  double longer_readout_s = 0.0;   ///< true - configured time from the first row to the last
};

/// An encoder that delivers one and the same reading for a while, seconds of the log.
struct EncoderStall {
  Eigen::Index joint = 0;
  double begin_s = 0.0;
  double end_s = 0.0;
};

/// Torques that gravity puts on the joints of the robot as built, load in the hand included.
class JointTorques {
 public:
  virtual ~JointTorques() = default;
  /// Nm, RobotModel order; valid until the next call.
  virtual const Eigen::VectorXd& total(const Eigen::VectorXd& q) = 0;
  virtual const Eigen::VectorXd& payload(const Eigen::VectorXd& q) = 0;
};

/// One instant of the drive: where the motors are. Times advance by a small constant step.
struct MotorStep {
  double t_s;
  double dt_s;
  const Eigen::VectorXd& angle;         ///< rad
  const Eigen::VectorXd& velocity;      ///< rad/s
  const Eigen::VectorXd& acceleration;  ///< rad/s^2
  JointTorques& torques;
};

/// A way in which the simulated robot departs from its description, written as the physics that
/// causes it. A fault overrides the one hook where it lives:
///
///     motor ──transmit──> joint ──build──> links, cameras ──expose──> picture
///       └────read───────> encoder message
///
/// Transmission faults are called at every step in order of time and may keep state.
class Fault {
 public:
  virtual ~Fault() = default;
  virtual void build(TrueBody&) {}
  /// Changes joint angles `q`, which start out as the motors' angles (and what faults before did).
  virtual void transmit(const MotorStep&, Eigen::VectorXd& q) { (void)q; }
  /// Changes encoder angles, which start out as the motors' angles.
  virtual void read(Eigen::VectorXd& encoder) const { (void)encoder; }
  virtual void expose(ExposureTiming&) {}
  virtual void stall(std::vector<EncoderStall>&) {}
};

/// Strict access to a fault's arguments. Errors name the fault, the key and what was expected.
class FaultArguments {
 public:
  FaultArguments(const FaultSpec& spec, const FaultSite& site) : spec_(spec), site_(site) {}
  [[nodiscard]] double number(const std::string& key, double min, double max) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback, double min, double max) const;
  [[nodiscard]] Eigen::Index joint(const std::string& key = "joint") const;
  [[nodiscard]] std::string choice_or(const std::string& key, const std::string& fallback,
                                      const std::vector<std::string>& choices) const;
  /// Positions of the covers named by `part`; all when it is left out.
  [[nodiscard]] std::vector<std::size_t> covers() const;
  /// What share of a change befalls each camera by `source`: left, right, common, or difference (the first camera
  /// by half, the second by minus half).
  [[nodiscard]] std::vector<double> camera_shares() const;
  /// The unit vector of `axis`, x, y or z; x when it is left out.
  [[nodiscard]] Eigen::Vector3d axis() const;
  [[nodiscard]] const FaultSpec& spec() const { return spec_; }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& expected) const;
  const FaultSpec& spec_;
  const FaultSite& site_;
};

/// Where a fault of a kind could sit, and how small it can be and still be found 90 % of the time
/// in a 50 s log (from trials of the diagnosis; `spec` lacks only its value).
struct FaultTarget {
  FaultSpec spec;
  double detectable = 0.0;
};

/// An entry of the catalogue of faults.
struct FaultKind {
  std::string name;
  std::string parameter;          ///< what `value` is
  std::string unit;               ///< ... and its unit
  std::string meaning;            ///< one sentence, with the sign
  std::vector<std::string> keys;  ///< arguments besides `value`
  bool in_catalogue = true;       ///< false: outside of what a diagnosis can name
  bool one_sided = false;         ///< only positive values make sense
  int stage = 0;                  ///< order of application; offsets are read last
  std::function<std::unique_ptr<Fault>(const FaultArguments&, const FaultSite&)> make;
  std::function<std::vector<FaultTarget>(const FaultSite&)> targets;
};

/// All kinds, in the order of the catalogue.
const std::vector<FaultKind>& fault_kinds();
/// Throws ConfigurationError naming the nearest kind.
const FaultKind& fault_kind(const std::string& name);

/// Throws ConfigurationError for an unknown fault, key, joint or a value out of range.
std::unique_ptr<Fault> make_fault(const FaultSpec& spec, const FaultSite& site);

struct DrawOptions {
  /// Size over the smallest detectable one; drawn between 3 and 6 unless given.
  std::optional<double> multiple_of_detectable{};
  bool outside_catalogue = false;      ///< draw among the faults no diagnosis can name
  std::vector<std::string> exclude{};  ///< kinds not to draw
};
/// A fault whose kind, place, sign, size and remaining arguments are drawn at random. Joint offsets are
/// never drawn: they are not a fault of this sort.
FaultSpec draw_fault(std::uint64_t seed, const FaultSite& site, const DrawOptions& options = {});

}  // namespace bodyschema::simulator
