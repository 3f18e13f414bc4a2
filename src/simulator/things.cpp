#include "bodyschema/simulator/things.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/simulator/random.hpp"
#include "shapes.hpp"

namespace bodyschema::simulator {
namespace {

constexpr double kSweepStep_s = 0.1;

Paint mat(float r, float g, float b) {
  return {.albedo = {r, g, b}};
}
Paint glossy(float r, float g, float b, float gloss, float sharpness = 60.0f) {
  return {.albedo = {r, g, b}, .gloss = gloss, .sharpness = sharpness};
}

/// Vertices that reach furthest, one for each of 26 directions.
std::vector<Eigen::Vector3d> corners(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> result;
  if (mesh.vertices.empty()) return result;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Eigen::Vector3f direction(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        if (direction.isZero()) continue;
        const auto furthest =
            std::max_element(mesh.vertices.begin(), mesh.vertices.end(),
                             [&](const auto& a, const auto& b) { return a.dot(direction) < b.dot(direction); });
        result.push_back(furthest->cast<double>());
      }
    }
  }
  return result;
}

struct Ball {
  Eigen::Vector3d centre;
  double radius;
};
Ball ball_around(const TriangleMesh& mesh) {
  const auto points = corners(mesh);
  Eigen::Vector3d low = points.front(), high = points.front();
  for (const auto& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Half the diagonal would cover the corners of the box, which most covers do not fill.
  return {0.5 * (low + high), 0.4 * (high - low).norm()};
}

}  // namespace

/// Where the robot's arm and hand are while it moves.
struct Things::Sweep {
  struct Instant {
    double t_s;
    Pose X_WC;                       // first camera
    Eigen::Vector3d eyes_W, hand_W;  // middle of the cameras; middle of hand base and fingertips
    std::vector<Eigen::Vector3d> balls_W;
  };
  std::vector<Instant> instants;
  std::vector<double> radii;              // of the balls
  std::vector<Eigen::Vector3d> points_W;  // on the covers, all instants
  double end_s = 0.0;
};

Things::~Things() = default;

Things::Things(const TrueRobot& robot, const RobotSetup& setup, const StereoRig& rig, const SimulatorSettings& settings,
               const std::vector<PaintedPart>& arm, const Eigen::VectorXd& q_usual, std::uint64_t seed)
    : motion_begin_s_(robot.site().begin_s), model_(robot.site().model) {
  const FaultSite& site = robot.site();
  std::vector<std::string> links;
  for (const auto& mesh : model_->meshes()) links.push_back(mesh.link);
  second_links_ = links;
  const std::size_t hand = links.size();
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  const std::size_t first_camera = links.size();
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  TrueKinematics kinematics(model_, robot.body(), links);
  std::vector<Pose> X_W(links.size());

  // Frame K from how the head usually stands.
  kinematics.compute(q_usual, X_W);
  const bool weightless = site.gravity_W.norm() < 1e-6;
  const Eigen::Vector3d up = weightless ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : -site.gravity_W.normalized();
  Eigen::Vector3d eyes = Eigen::Vector3d::Zero(), look = eyes;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    eyes += X_W[first_camera + c].translation() / static_cast<double>(rig.cameras.size());
    look += X_W[first_camera + c].linear().col(2);
  }
  Eigen::Vector3d forward = look - look.dot(up) * up;
  if (forward.norm() < 0.1 * look.norm()) {  // straight down: what is up in the picture
    forward = -X_W[first_camera].linear().col(1);
    forward -= forward.dot(up) * up;
  }
  forward.normalize();
  room_.X_WK.linear().col(0) = forward;
  room_.X_WK.linear().col(1) = up.cross(forward);
  room_.X_WK.linear().col(2) = up;
  room_.X_WK.translation() = eyes;

  Sweep sweep;
  sweep.end_s = site.end_s;
  std::vector<std::vector<Eigen::Vector3d>> corners_B;
  std::vector<Ball> balls;
  for (const auto& part : arm) {
    corners_B.push_back(corners(part.mesh));
    balls.push_back(ball_around(part.mesh));
    sweep.radii.push_back(balls.back().radius);
  }
  const double step = std::max(kSweepStep_s, (site.end_s - site.begin_s) / 1500.0);
  for (double t = site.begin_s; t <= site.end_s + 0.5 * step; t += step) {
    kinematics.compute(robot.joints(t), X_W);
    Sweep::Instant instant;
    instant.t_s = t;
    instant.X_WC = kinematics.camera(0, X_W[first_camera]);
    instant.eyes_W.setZero();
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      instant.eyes_W += X_W[first_camera + c].translation() / static_cast<double>(rig.cameras.size());
    }
    instant.hand_W.setZero();
    for (std::size_t i = hand; i < first_camera; ++i) {
      instant.hand_W += X_W[i].translation() / static_cast<double>(first_camera - hand);
    }
    for (std::size_t p = 0; p < arm.size(); ++p) {
      instant.balls_W.push_back(X_W[p] * balls[p].centre);
      for (const auto& corner : corners_B[p]) sweep.points_W.push_back(X_W[p] * corner);
    }
    sweep.instants.push_back(std::move(instant));
  }

  plan_room(settings, sweep, seed);
  held_ = robot.body().held.kind != HeldKind::kNone ? robot.body().held : settings.held;
  if (held_.kind != HeldKind::kNone) plan_held(setup, robot);
  if (settings.second_arm) plan_second_arm(robot, setup, rig, settings, arm, sweep, seed);
  if (settings.person_every_s > 0.0) plan_person(settings, sweep, seed);
}

void Things::add(PaintedPart part, const Pose& X_WB, bool furniture, bool shadowless) {
  parts_.push_back(std::move(part));
  X_WB_.push_back(X_WB);
  furniture_.push_back(furniture ? 1 : 0);
  shadowless_.push_back(shadowless ? 1 : 0);
}

void Things::plan_room(const SimulatorSettings& settings, const Sweep& sweep, std::uint64_t seed) {
  const Pose X_KW = room_.X_WK.inverse(Eigen::Isometry);
  std::vector<Eigen::Vector3d> points;
  double furthest = 0.0;
  for (const auto& p_W : sweep.points_W) {
    points.push_back(X_KW * p_W);
    furthest = std::max(furthest, points.back().x());
  }
  room_.table = settings.table;
  room_.table_far_x = std::max(room_.table_near_x + 0.8, furthest + 0.25);
  room_.front_x = std::max(room_.front_x, room_.table_far_x + 0.6);
  // Just below all that passes over it; what hangs down on the robot's side does so before its edge.
  constexpr double kClearance_m = 0.025, kLowest_m = 0.9, kHighest_m = 0.12;
  double lowest = -kHighest_m;
  for (const auto& p : points) {
    if (p.x() > room_.table_near_x - 0.02) lowest = std::min(lowest, p.z());
  }
  room_.table_z = std::max(lowest - kClearance_m, -kLowest_m);
  room_.floor_z = room_.table_z - 0.74;
  if (!settings.table) {
    room_.floor_z = std::min(room_.floor_z, -1.15);
    return;
  }

  constexpr float kThickness_m = 0.03f;
  const auto length = static_cast<float>(room_.table_far_x - room_.table_near_x);
  const auto width = static_cast<float>(2.0 * room_.table_half_width);
  PaintedPart top;
  Paint wood = mat(0.6f, 0.5f, 0.4f);
  wood.table = settings.kitchen;
  shapes::add(top, shapes::slab({length, width, kThickness_m}, 0.06f), wood);
  top.cull_back = true;
  Pose X_KB = Pose::Identity();
  X_KB.translation() << 0.5 * (room_.table_near_x + room_.table_far_x), 0.0,
      room_.table_z - 0.5 * static_cast<double>(kThickness_m);
  add(std::move(top), room_.X_WK * X_KB, true, true);

  // Crockery and packets, where the arm does not pass.
  Random random(seed, "things on the table");
  struct Stand {
    double x, y, radius;
  };
  std::vector<Stand> taken;
  for (int n = 0; n < 8; ++n) {
    const std::size_t kind = random.below(5);
    const auto colour = [&](double low, double high) {
      const Eigen::Vector3f c{static_cast<float>(random.uniform(low, high)),
                              static_cast<float>(random.uniform(low, high)),
                              static_cast<float>(random.uniform(low, high))};
      return c;
    };
    const Eigen::Vector3f first = colour(0.1, 0.9), second = colour(0.1, 0.9);
    const auto size = static_cast<float>(random.uniform(0.85, 1.2));
    const Paint china = {.albedo = {0.86f, 0.86f, 0.84f}, .gloss = 0.4f, .sharpness = 60.0f};
    PaintedPart part;
    float radius = 0.0f, height = 0.0f;
    switch (kind) {
      case 0: {  // a mug
        radius = 0.042f * size, height = 0.095f * size;
        Paint glaze = china;
        glaze.albedo = first;
        shapes::add(part, shapes::turned({{0, 0}, {radius, 0}, {radius, 0.35f * height}}), glaze);
        glaze.albedo = second;
        shapes::add(part,
                    shapes::turned({{radius, 0.35f * height},
                                    {radius, height},
                                    {0.9f * radius, height},
                                    {0.88f * radius, 0.1f * height},
                                    {0, 0.1f * height}}),
                    glaze);
        break;
      }
      case 1: {  // a plate
        radius = 0.10f * size, height = 0.02f * size;
        shapes::add(part, shapes::turned({{0, 0}, {0.6f * radius, 0}, {radius, height}, {0.97f * radius, height}}, 40),
                    china);
        Paint rim = china;
        rim.albedo = first;
        shapes::add(part, shapes::turned({{0.97f * radius, height}, {0.7f * radius, 0.45f * height}}, 40), rim);
        shapes::add(part, shapes::turned({{0.7f * radius, 0.45f * height}, {0, 0.3f * height}}, 40), china);
        break;
      }
      case 2: {  // a packet
        radius = 0.075f * size, height = 0.19f * size;
        const Eigen::Isometry3f up = Eigen::Isometry3f(Eigen::Translation3f(0, 0, 0.5f * height));
        shapes::add(part, shapes::moved(shapes::box({0.06f * size, 0.135f * size, height}), up), {.albedo = first});
        shapes::add(part, shapes::moved(shapes::box({0.0605f * size, 0.1f * size, 0.3f * height}), up),
                    {.albedo = second});
        break;
      }
      case 3: {  // a tin or a jar
        radius = 0.037f * size, height = 0.11f * size;
        shapes::add(part, shapes::turned({{0, 0}, {radius, 0}, {radius, 0.15f * height}}),
                    glossy(0.6f, 0.6f, 0.62f, 0.5f));
        shapes::add(part, shapes::turned({{radius, 0.15f * height}, {radius, 0.85f * height}}), {.albedo = first});
        shapes::add(part, shapes::turned({{radius, 0.85f * height}, {radius, height}, {0, height}}),
                    glossy(0.6f, 0.6f, 0.62f, 0.5f));
        break;
      }
      default: {  // a fruit
        radius = 0.036f * size, height = 2.0f * radius;
        Paint skin{.albedo = first, .gloss = 0.25f, .sharpness = 25.0f};
        shapes::add(part,
                    shapes::moved(shapes::ellipsoid({radius, radius, radius}),
                                  Eigen::Isometry3f(Eigen::Translation3f(0, 0, radius))),
                    skin);
        break;
      }
    }
    part.cull_back = false;
    for (int attempt = 0; attempt < 30; ++attempt) {
      const double x = random.uniform(room_.table_near_x + 0.08, room_.table_far_x - 0.08);
      const double y = random.uniform(-room_.table_half_width + 0.1, room_.table_half_width - 0.1);
      const double turn = random.uniform(0.0, 2.0 * kPi);
      bool free = true;
      for (const auto& other : taken) {
        free &= std::hypot(other.x - x, other.y - y) > other.radius + static_cast<double>(radius) + 0.02;
      }
      const double reach = static_cast<double>(radius) + 0.05;
      const double over = room_.table_z + static_cast<double>(height) + 0.03;
      for (const auto& p : points) {
        if (!free) break;
        free &= !(p.z() < over && std::hypot(p.x() - x, p.y() - y) < reach);
      }
      if (!free) continue;
      taken.push_back({x, y, static_cast<double>(radius)});
      Pose X_KT = Pose::Identity();
      X_KT.translation() << x, y, room_.table_z;
      X_KT.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
      add(std::move(part), room_.X_WK * X_KT, true);
      break;
    }
  }
}

void Things::plan_held(const RobotSetup& setup, const TrueRobot& robot) {
  std::vector<std::string> links = {setup.hand_link};
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  TrueKinematics kinematics(model_, robot.body(), links);
  std::vector<Pose> X_W(links.size());
  kinematics.compute(robot.joints(robot.site().begin_s), X_W);
  const Pose X_PW = X_W[0].inverse(Eigen::Isometry);
  std::vector<Eigen::Vector3d> tips_P;
  for (std::size_t i = 1; i < links.size(); ++i) tips_P.push_back(X_PW * X_W[i].translation());

  // Between thumb and fingers: `across` from one to the others, `reach` from the palm outwards, `along` the thing.
  Eigen::Vector3d thumb = Eigen::Vector3d(0, 0, 0.08), fingers = thumb;
  double gap = 0.05;
  Eigen::Vector3d across = Eigen::Vector3d::UnitX(), reach = Eigen::Vector3d::UnitZ();
  if (!tips_P.empty()) thumb = fingers = tips_P.front();
  if (tips_P.size() > 1) {
    fingers.setZero();
    for (std::size_t i = 1; i < tips_P.size(); ++i) fingers += tips_P[i] / static_cast<double>(tips_P.size() - 1);
    gap = (fingers - thumb).norm();
    if (gap > 1e-3) across = (fingers - thumb) / gap;
  }
  const Eigen::Vector3d middle = 0.5 * (thumb + fingers);
  if (middle.norm() > 1e-3) reach = middle;
  reach -= reach.dot(across) * across;
  if (reach.norm() < 1e-3) reach = across.unitOrthogonal();
  reach.normalize();
  const Eigen::Vector3d along = reach.cross(across);
  X_PT_.linear().col(0) = across;
  X_PT_.linear().col(1) = reach;
  X_PT_.linear().col(2) = along;
  // Held by the pads of the fingers, a little behind their tips.
  X_PT_.translation() = middle - 0.012 * reach;

  constexpr double kFinger_m = 0.012;
  PaintedPart part;
  switch (held_.kind) {
    case HeldKind::kNone: return;
    case HeldKind::kBox: {
      const auto length = static_cast<float>(held_.length_m > 0.0 ? held_.length_m : 0.11);
      const auto thick = static_cast<float>(std::clamp(gap - kFinger_m, 0.02, 0.4 * static_cast<double>(length)));
      const float broad = std::max(thick, 0.62f * length);
      // It lies on the fingers; the thumb reaches it or not.
      X_PT_.translation() +=
          std::max(0.0, 0.5 * (gap - kFinger_m - static_cast<double>(thick))) * X_PT_.linear().col(0);
      shapes::add(part, shapes::box({thick, broad, length}), mat(0.72f, 0.22f, 0.16f));
      // Print on its faces: a band around, and a lid.
      shapes::add(part, shapes::box({1.01f * thick, 1.004f * broad, 0.3f * length}), mat(0.88f, 0.84f, 0.70f));
      shapes::add(part,
                  shapes::moved(shapes::box({1.012f * thick, 1.006f * broad, 0.08f * length}),
                                Eigen::Isometry3f(Eigen::Translation3f(0, 0, -0.4f * length))),
                  mat(0.12f, 0.2f, 0.5f));
      // Most of it stands out of the hand.
      X_PT_.translation() += X_PT_.linear() * Eigen::Vector3d(0, 0.15 * static_cast<double>(broad), 0);
      break;
    }
    case HeldKind::kBottle: {
      const auto length = static_cast<float>(held_.length_m > 0.0 ? held_.length_m : 0.22);
      const auto r = static_cast<float>(std::clamp(0.5 * (gap - kFinger_m), 0.016, 0.031));
      const float z0 = -0.4f * length;
      const auto z = [&](float share) { return z0 + share * length; };
      shapes::add(part, shapes::turned({{0, z(0)}, {0.9f * r, z(0)}, {r, z(0.03f)}, {r, z(0.25f)}}),
                  glossy(0.10f, 0.32f, 0.16f, 0.4f));
      shapes::add(part, shapes::turned({{r, z(0.25f)}, {1.01f * r, z(0.251f)}, {1.01f * r, z(0.55f)}, {r, z(0.551f)}}),
                  mat(0.85f, 0.82f, 0.6f));
      shapes::add(
          part,
          shapes::turned(
              {{r, z(0.55f)}, {r, z(0.66f)}, {0.8f * r, z(0.74f)}, {0.42f * r, z(0.82f)}, {0.38f * r, z(0.93f)}}),
          glossy(0.10f, 0.32f, 0.16f, 0.4f));
      shapes::add(part, shapes::turned({{0.44f * r, z(0.93f)}, {0.44f * r, z(1.0f)}, {0, z(1.0f)}}),
                  mat(0.75f, 0.12f, 0.1f));
      break;
    }
    case HeldKind::kStick: {
      const auto length = static_cast<float>(held_.length_m > 0.0 ? held_.length_m : 0.30);
      const float z0 = -0.35f * length;
      shapes::add(part, shapes::rod({0, 0, z0}, {0, 0, z0 + 0.8f * length}, 0.010f, 0.009f), mat(0.62f, 0.46f, 0.28f));
      shapes::add(part, shapes::rod({0, 0, z0 + 0.8f * length}, {0, 0, z0 + length}, 0.0102f, 0.009f),
                  mat(0.8f, 0.1f, 0.1f));
      break;
    }
  }
  part.cull_back = held_.kind != HeldKind::kBottle;
  held_part_ = parts_.size();
  add(std::move(part), Pose::Identity(), false);
}

void Things::plan_second_arm(const TrueRobot& robot, const RobotSetup& setup, const StereoRig& rig,
                             const SimulatorSettings& settings, const std::vector<PaintedPart>& arm, const Sweep& sweep,
                             std::uint64_t seed) {
  const FaultSite& site = robot.site();
  Random random(seed, "second arm");
  std::vector<std::string> links = second_links_;
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  ForwardKinematics kinematics(model_, links);
  std::vector<Pose> X_W(links.size());
  std::vector<Ball> balls;
  std::vector<std::vector<Eigen::Vector3d>> corners_B;
  for (const auto& part : arm) {
    balls.push_back(ball_around(part.mesh));
    corners_B.push_back(corners(part.mesh));
  }

  // The mirror stands upright in the middle of the robot and faces its side. An arm on the middle itself gets its
  // image beside it.
  const Eigen::Vector3d side = room_.X_WK.linear().col(1);
  Eigen::VectorXd q = robot.trajectory().first();
  kinematics.compute(Eigen::VectorXd::Zero(q.size()), X_W);
  double beside = 0.0;  // an axis across the body has no place; that of the next joints tells the shoulder's
  for (std::size_t j = 0; j < std::min<std::size_t>(3, site.arm.size()); ++j) {
    beside = std::max(beside, std::abs(kinematics.joint_axis(site.arm[j]).point_W.dot(side)));
  }
  double shift = 0.0;
  if (beside < 0.05) shift = 0.5 * random.sign();
  mirror_W_.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() - 2.0 * side * side.transpose();
  mirror_W_.topRightCorner<3, 1>() = shift * side;
  const auto mirror = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(mirror_W_.topLeftCorner<3, 3>() * p + mirror_W_.topRightCorner<3, 1>());
  };

  const Pose X_KW = room_.X_WK.inverse(Eigen::Isometry);
  constexpr double kApart_m = 0.02;
  /// The smallest gap to the first arm over time, and to the table.
  const auto clear = [&](const Eigen::VectorXd& posture) {
    kinematics.compute(posture, X_W);
    for (std::size_t p = 0; p < arm.size(); ++p) {
      const Eigen::Vector3d centre = mirror(X_W[p] * balls[p].centre);
      for (std::size_t i = 0; i < sweep.instants.size(); i += 2) {
        for (std::size_t o = 0; o < arm.size(); ++o) {
          const double apart = balls[p].radius + sweep.radii[o] + kApart_m;
          if ((sweep.instants[i].balls_W[o] - centre).squaredNorm() < apart * apart) return false;
        }
      }
      if (!settings.table) continue;
      for (const auto& corner : corners_B[p]) {
        const Eigen::Vector3d point = X_KW * mirror(X_W[p] * corner);
        if (point.x() > room_.table_near_x - 0.02 && point.z() < room_.table_z + 0.005) return false;
      }
    }
    return true;
  };
  // In view: some of the hand in the first camera's picture, half-way through the motion.
  const Pose X_CW = sweep.instants[sweep.instants.size() / 2].X_WC.inverse(Eigen::Isometry);
  const auto in_view = [&](const Eigen::VectorXd& posture) {
    kinematics.compute(posture, X_W);
    const auto& k = rig.cameras.front().intrinsics;
    for (std::size_t l = second_links_.size(); l < links.size(); ++l) {
      const Eigen::Vector3d p_C = X_CW * mirror(X_W[l].translation());
      if (p_C.z() < 0.15) return false;
      const Eigen::Vector2d pixel = k.project(p_C);
      const double border = 0.02 * k.width;
      if (pixel.x() > border && pixel.y() > border && pixel.x() < k.width - border && pixel.y() < k.height - border) {
        return true;
      }
    }
    return false;
  };
  std::vector<Eigen::VectorXd> postures;
  Eigen::VectorXd out_of_the_way = q;
  bool any_clear = false;
  for (int attempt = 0; attempt < 20000 && postures.size() < 3; ++attempt) {
    for (const auto joint : site.arm) {
      const auto& info = model_->joints()[static_cast<std::size_t>(joint)];
      const double low = std::max(info.lower_rad, -kPi), high = std::min(info.upper_rad, kPi);
      q[joint] = random.uniform(low + 0.05 * (high - low), high - 0.05 * (high - low));
    }
    const bool seen = in_view(q);
    if (!seen && any_clear) continue;
    if (!clear(q)) continue;
    out_of_the_way = q;
    any_clear = true;
    if (!seen) continue;
    // Reached from the one before without touching anything.
    bool free = true;
    for (int i = 1; i < 8 && free && !postures.empty(); ++i) {
      free = clear(postures.back() + (i / 8.0) * (q - postures.back()));
    }
    if (free) postures.push_back(q);
  }
  if (postures.empty()) postures.push_back(out_of_the_way);
  second_motion_ = std::make_unique<Trajectory>(postures.front());
  while (second_motion_->duration_s() < site.end_s + 2.0) {
    // There and back again, for the way from the last to the first was not looked at.
    const auto visit = [&](const Eigen::VectorXd& posture) {
      second_motion_->hold(random.uniform(1.0, 3.0));
      if (postures.size() > 1) second_motion_->move_to(posture, random.uniform(1.5, 3.5));
    };
    for (std::size_t i = 1; i < postures.size(); ++i) visit(postures[i]);
    for (std::size_t i = postures.size(); i-- > 0;) visit(postures[i]);
  }
  second_part_ = parts_.size();
  for (const auto& part : arm) {
    // Seen from the corner of the eye: what is finer than 2 mm need not be drawn.
    PaintedPart other = part;
    std::vector<std::size_t> source;
    other.mesh = shapes::mirrored(shapes::coarse(part.mesh, 0.002f, &source));
    if (!part.paints.empty()) {
      other.paint_of_triangle.clear();
      for (const auto f : source) other.paint_of_triangle.push_back(part.paint_of_triangle[f]);
    }
    add(std::move(other), Pose::Identity(), false);
  }
}

void Things::plan_person(const SimulatorSettings& settings, const Sweep& sweep, std::uint64_t seed) {
  Random random(seed, "person");
  const Pose X_KW = room_.X_WK.inverse(Eigen::Isometry);
  for (double t = motion_begin_s_ + settings.person_first_s; t + settings.person_stays_s <= sweep.end_s + 1.0;
       t += settings.person_every_s) {
    const double middle_s = t + 0.5 * settings.person_stays_s;
    const auto& at = *std::min_element(sweep.instants.begin(), sweep.instants.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.t_s - middle_s) < std::abs(b.t_s - middle_s);
    });
    // Mostly between the eyes and the hand, sometimes behind it.
    const double depth = random.uniform() < 0.7 ? random.uniform(0.70, 0.82) : random.uniform(1.25, 1.5);
    const double side = random.sign();
    const Eigen::Vector3d right = at.X_WC.linear().col(0), down = at.X_WC.linear().col(1);
    const Eigen::Vector3d forward = at.X_WC.linear().col(2);
    const double distance = depth * (at.hand_W - at.eyes_W).norm();
    const Eigen::Vector3d centre = at.eyes_W + depth * (at.hand_W - at.eyes_W);
    const double past = random.uniform(-0.10, 0.25), low = random.uniform(-0.12, 0.12);
    const double come = random.uniform(-0.25, 0.25), go = random.uniform(-0.25, 0.25);
    Crossing crossing;
    crossing.begin_s = t;
    crossing.end_s = t + settings.person_stays_s;
    crossing.to_W = centre + distance * (-side * past * right + low * down);
    crossing.from_W = centre + side * (distance * 0.95 + 0.15) * right + distance * come * down;
    crossing.out_W = centre + side * (distance * 0.95 + 0.15) * right + distance * go * down;
    crossing.shoulder_W = centre + side * (0.62 + 0.3 * distance) * right - 0.15 * down + 0.25 * forward;
    if (settings.table) {  // nobody reaches through the table
      Eigen::Vector3d shoulder_K = X_KW * crossing.shoulder_W;
      shoulder_K.z() = std::max(shoulder_K.z(), room_.table_z + 0.15);
      crossing.shoulder_W = room_.X_WK * shoulder_K;
      for (auto* p : {&crossing.to_W, &crossing.from_W, &crossing.out_W}) {
        Eigen::Vector3d p_K = X_KW * *p;
        p_K.z() = std::max(p_K.z(), room_.table_z + 0.06);
        *p = room_.X_WK * p_K;
      }
    }
    crossings_.push_back(crossing);
  }
  if (crossings_.empty()) return;

  // z from the shoulder to the fingers, origin in the palm's middle, y out of the back of the hand.
  PaintedPart part;
  const float tone = static_cast<float>(random.uniform(0.35, 1.0));
  const Eigen::Vector3f dark{0.36f, 0.22f, 0.15f}, pale{0.86f, 0.64f, 0.52f};
  const Paint skin = {.albedo = dark + tone * (pale - dark), .gloss = 0.06f, .sharpness = 12.0f};
  const Eigen::Vector3f cloth{static_cast<float>(random.uniform(0.08, 0.85)),
                              static_cast<float>(random.uniform(0.08, 0.85)),
                              static_cast<float>(random.uniform(0.08, 0.85))};
  const Paint sleeve = {.albedo = cloth};
  const Paint stripe = {.albedo = (0.55f * cloth).eval()};
  shapes::add(part, shapes::ellipsoid({0.042f, 0.016f, 0.052f}), skin);
  for (int f = 0; f < 4; ++f) {
    const float x = -0.030f + 0.020f * static_cast<float>(f);
    const float length = 0.062f + (f == 1 || f == 2 ? 0.014f : 0.0f);
    shapes::add(part, shapes::rod({x, 0, 0.035f}, {1.25f * x, -0.008f, 0.045f + 0.55f * length}, 0.010f, 0.009f, 12),
                skin);
    shapes::add(part,
                shapes::rod({1.25f * x, -0.008f, 0.045f + 0.55f * length}, {1.3f * x, -0.028f, 0.045f + length}, 0.009f,
                            0.0075f, 12),
                skin);
  }
  shapes::add(part, shapes::rod({0.034f, -0.004f, -0.02f}, {0.062f, -0.014f, 0.022f}, 0.012f, 0.011f, 12), skin);
  shapes::add(part, shapes::rod({0.062f, -0.014f, 0.022f}, {0.066f, -0.022f, 0.052f}, 0.011f, 0.009f, 12), skin);
  shapes::add(part, shapes::rod({0, 0, -0.17f}, {0, 0, -0.04f}, 0.034f, 0.026f), skin);
  constexpr int kBands = 8;
  for (int i = 0; i < kBands; ++i) {
    const float z0 = -0.14f - 0.07f * static_cast<float>(i), z1 = z0 - 0.07f;
    const float r0 = 0.041f + 0.0022f * static_cast<float>(i), r1 = r0 + 0.0022f;
    std::vector<Eigen::Vector2f> profile = {{r1, z1}, {r0, z0}};
    if (i == 0) profile.emplace_back(0.028f, z0 - 0.002f);             // its hem, down to the skin
    if (i == kBands - 1) profile.insert(profile.begin(), {0.0f, z1});  // and the end nobody sees
    shapes::add(part, shapes::turned(profile), i % 2 == 0 ? sleeve : stripe);
  }
  part.cull_back = false;
  person_ = true;
  person_part_ = parts_.size();
  add(std::move(part), Pose::Identity(), false);
}

bool Things::holding(double t_s) const {
  return held_.kind != HeldKind::kNone && (held_.from_s <= 0.0 || t_s >= motion_begin_s_ + held_.from_s);
}

Things::Placer::Placer(const Things& things) : things_(things) {
  if (things_.second_motion_) {
    second_arm_ = std::make_unique<ForwardKinematics>(things_.model_, things_.second_links_);
    X_W_.resize(things_.second_links_.size());
  }
}

void Things::Placer::place(double t_s, const Pose& X_WP, std::span<Pose> X_WB, std::span<char> hidden) {
  const Things& s = things_;
  std::copy(s.X_WB_.begin(), s.X_WB_.end(), X_WB.begin());
  std::fill(hidden.begin(), hidden.end(), static_cast<char>(0));
  if (s.held_.kind != HeldKind::kNone) {
    X_WB[s.held_part_] = X_WP * s.X_PT_;
    hidden[s.held_part_] = s.holding(t_s) ? 0 : 1;
  }
  if (second_arm_) {
    second_arm_->compute(s.second_motion_->position(t_s), X_W_);
    for (std::size_t p = 0; p < X_W_.size(); ++p) {
      // A mirror image of a pose is no pose; the mesh is mirrored too.
      Eigen::Matrix4d image = s.mirror_W_ * X_W_[p].matrix();
      image.col(0) *= -1.0;
      X_WB[s.second_part_ + p].matrix() = image;
    }
  }
  if (s.person_) {
    hidden[s.person_part_] = 1;
    for (const auto& crossing : s.crossings_) {
      if (t_s < crossing.begin_s || t_s > crossing.end_s) continue;
      hidden[s.person_part_] = 0;
      const double x = (t_s - crossing.begin_s) / (crossing.end_s - crossing.begin_s);
      constexpr double kWay = 0.4;  // of the time for coming, and for going
      const Eigen::Vector3d hand = crossing.from_W + minimum_jerk(x / kWay) * (crossing.to_W - crossing.from_W) +
                                   minimum_jerk((x - 1.0 + kWay) / kWay) * (crossing.out_W - crossing.to_W);
      Pose X = Pose::Identity();
      const Eigen::Vector3d z = (hand - crossing.shoulder_W).normalized();
      const Eigen::Vector3d up = s.room_.X_WK.linear().col(2);
      Eigen::Vector3d y = up - up.dot(z) * z;
      y = y.norm() > 1e-6 ? Eigen::Vector3d(y.normalized()) : Eigen::Vector3d(z.unitOrthogonal());
      X.linear().col(0) = y.cross(z);
      X.linear().col(1) = y;
      X.linear().col(2) = z;
      X.translation() = hand;
      X_WB[s.person_part_] = X;
      break;
    }
  }
}

}  // namespace bodyschema::simulator
