#include "bodyschema/outline/outline_measurement.hpp"

#include <algorithm>
#include <numeric>
#include <random>

#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"

namespace bodyschema {
namespace {

using Kind = Coordinate::Kind;

bool is_angle(Kind kind) {
  return kind == Kind::kJoint || kind == Kind::kTilt1 || kind == Kind::kTilt2 || kind == Kind::kMountTurn ||
         kind == Kind::kRigTurn || kind == Kind::kCameraTurn;
}

bool moves_no_link(Kind kind) {
  return kind == Kind::kFocal || kind == Kind::kCx || kind == Kind::kCy || kind == Kind::kK1 ||
         kind == Kind::kReadout || kind == Kind::kScale || kind == Kind::kSize || kind == Kind::kDilation;
}

class OutlineOfOwnRobot : public OwnRobot {
 protected:
  explicit OutlineOfOwnRobot(int reduction = 1) : OwnRobot(reduction) {
    all_.resize(static_cast<std::size_t>(measurement_.coordinates().size()));
    std::iota(all_.begin(), all_.end(), 0u);
  }

  /// A robot that departs from its model in every coordinate at once, each by a plausible size.
  [[nodiscard]] Corrections all_at_once() const {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Corrections corrections = roles_.no_corrections();
    for (const auto& coordinate : measurement_.coordinates().all()) {
      const double size = coordinate.kind == Kind::kCx || coordinate.kind == Kind::kCy ? 2.0
                          : coordinate.kind == Kind::kDilation                         ? 0.7
                          : coordinate.kind == Kind::kK1                               ? 0.05
                          : is_angle(coordinate.kind)                                  ? 0.02
                          : moves_no_link(coordinate.kind)                             ? 0.02
                                                                                       : 0.003;
      coordinate.in(corrections) = size * uniform(random);
    }
    return corrections;
  }

  /// Where a surface point that is fixed to its part appears, with distortion: written out.
  [[nodiscard]] Eigen::Vector2d appears(const Eigen::Vector3d& p_B, std::size_t part, const Corrections& c,
                                        std::size_t camera) {
    projection_.place(q_, c, camera);
    const Eigen::Vector3d p_C =
        projection_.origin(part) + projection_.links()[part].linear() * (projection_.scale(part) * p_B);
    const Eigen::Vector2d x = p_C.head<2>() / p_C.z();
    const auto& k = rig_.cameras[camera].intrinsics;
    const Eigen::Vector2d bent = (1.0 + c.camera.k1 * x.squaredNorm()) * x;
    const double f = 1.0 + c.camera.focal_scale;
    return {k.fx * f * bent.x() + k.cx + c.camera.cx_px / k.reduction,
            k.fy * f * bent.y() + k.cy + c.camera.cy_px / k.reduction};
  }

  void derivatives_are_those_of_the_projection();

  [[nodiscard]] std::uint32_t position(Kind kind, Eigen::Index index) const {
    return static_cast<std::uint32_t>(measurement_.coordinates().find({kind, index}));
  }
  [[nodiscard]] ObservedEdges edges(const CameraObservation& seen, std::size_t camera) const {
    return {seen, rig_.cameras[camera].intrinsics};
  }

  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  OutlineMeasurement measurement_{robot_, setup_, rig_, roles_};
  RobotProjection projection_{robot_, setup_, rig_, roles_};
  SyntheticReach reach_{robot_, setup_, rig_, Eigen::VectorXd::Zero(7)};
  Eigen::VectorXd q_ = pose(0.5);
  std::vector<std::uint32_t> all_;
  const Corrections nothing_ = roles_.no_corrections();
  OutlineEvidence evidence_;
};

/// Of pictures that are read at half their size.
class OutlineOfReducedPictures : public OutlineOfOwnRobot {
 protected:
  OutlineOfReducedPictures() : OutlineOfOwnRobot(2) {}
};

/// Every derivative against differences of a projection that is written out, at a state where nothing is zero.
void OutlineOfOwnRobot::derivatives_are_those_of_the_projection() {
  const Corrections c = all_at_once();
  constexpr double kStep = 1e-6;
  const int reduction = rig_.cameras[0].intrinsics.reduction;
  for (const std::size_t camera : {0u, 1u}) {
    measurement_.expect(q_, c, camera, all_, {.spacing_px = 6.0}, evidence_);
    const std::vector<OutlinePoint> points(measurement_.points().begin(), measurement_.points().end());
    ASSERT_GT(points.size(), 20u);
    projection_.place(q_, c, camera);
    const std::vector<Pose> links(projection_.links().begin(), projection_.links().end());
    std::vector<Eigen::Vector3d> origins;
    std::vector<double> scales;
    for (std::size_t part = 0; part < projection_.part_count(); ++part) {
      origins.push_back(projection_.origin(part));
      scales.push_back(projection_.scale(part));
    }
    Eigen::MatrixXd G = Eigen::MatrixXd::Zero(points.size(), all_.size());
    for (std::size_t p = 0; p < points.size(); ++p) {
      const auto& point = points[p];
      const std::size_t segment = projection_.segment_of(point.part);
      const Eigen::Vector3d p_B =
          links[point.part].linear().transpose() * (point.p_C - origins[point.part]) / scales[point.part];
      // The point is where it is said to be.
      const Eigen::Vector2d own =
          appears(p_B, point.part, c, camera) + c.shapes[segment].dilation_px / reduction * point.normal;
      ASSERT_LT((own - point.pixel).norm(), 0.02);
      ASSERT_NEAR(point.normal.norm(), 1.0, 1e-6);
      for (std::size_t i = 0; i < all_.size(); ++i) {
        const auto& coordinate = measurement_.coordinates()[i];
        double g = 0.0;
        if (coordinate.kind == Kind::kDilation) {
          g = coordinate.index == static_cast<Eigen::Index>(segment) ? 1.0 / reduction : 0.0;
        } else if (coordinate.kind == Kind::kThickness) {
          if (coordinate.index != static_cast<Eigen::Index>(segment)) continue;
          // Along the surface's normal, which is where the outline moves fastest to.
          Eigen::Vector3d fastest;
          for (int axis = 0; axis < 3; ++axis) {
            const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(axis);
            fastest[axis] = point.normal.dot(appears(p_B + step, point.part, c, camera) -
                                             appears(p_B - step, point.part, c, camera)) /
                            2e-6;
          }
          g = fastest.norm() / scales[point.part];
        } else {
          Corrections plus = c, minus = c;
          coordinate.in(plus) += kStep;
          coordinate.in(minus) -= kStep;
          g = point.normal.dot(appears(p_B, point.part, plus, camera) - appears(p_B, point.part, minus, camera)) /
              (2.0 * kStep);
        }
        G(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(i)) = g;
      }
    }
    const Eigen::MatrixXd A = G.transpose() * G;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      for (std::size_t j = 0; j < all_.size(); ++j) {
        const auto r = static_cast<Eigen::Index>(i), s = static_cast<Eigen::Index>(j);
        EXPECT_NEAR(evidence_.A(r, s), A(r, s), 2e-3 * std::sqrt(A(r, r) * A(s, s)) + 1e-9)
            << "camera " << camera << ", kinds " << static_cast<int>(measurement_.coordinates()[i].kind) << " and "
            << static_cast<int>(measurement_.coordinates()[j].kind);
      }
    }
    // A second camera's own turn is told, the head's joints as well.
    EXPECT_GT(A.diagonal()[position(Kind::kCameraTurn, 1)], 0.0);
    EXPECT_GT(A.diagonal()[position(Kind::kJoint, roles_.head[0])], 0.0);
  }
}

TEST_F(OutlineOfOwnRobot, DerivativesAreThoseOfTheProjection) {
  derivatives_are_those_of_the_projection();
}

TEST_F(OutlineOfReducedPictures, DerivativesAreThoseOfTheProjection) {
  derivatives_are_those_of_the_projection();
}

TEST_F(OutlineOfOwnRobot, AtTheTruthNothingPulls) {
  for (const std::size_t camera : {0u, 1u}) {
    measurement_.linearise(edges(reach_.draw(q_, nothing_, camera), camera), q_, nothing_, camera, all_,
                           {.search_px = 4.0}, evidence_);
    EXPECT_GT(evidence_.sampled, 50.0);
    EXPECT_GT(evidence_.matched_share(), 0.95);
    EXPECT_LT(evidence_.rms_px(), 0.2);
    EXPECT_EQ(evidence_.matched, static_cast<double>(measurement_.points().size()));
  }
}

/// One Gauss-Newton step takes most of a small error of any one coordinate away, also where others are wrong already.
TEST_F(OutlineOfOwnRobot, OneStepTakesASmallErrorAway) {
  struct Error {
    Kind kind;
    Eigen::Index index;
    double size;
  };
  std::vector<Error> errors;
  for (const auto joint : roles_.arm) errors.push_back({Kind::kJoint, joint, radians(0.5)});
  const auto elbow = roles_.index("r_elbow");
  for (const auto kind : {Kind::kShift1, Kind::kShift2, Kind::kAlong}) errors.push_back({kind, elbow, 0.003});
  for (const auto kind : {Kind::kTilt1, Kind::kTilt2}) errors.push_back({kind, elbow, radians(1.0)});
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const auto kind : {Kind::kBase, Kind::kRigShift, Kind::kCameraShift}) errors.push_back({kind, axis, 0.003});
    for (const auto kind : {Kind::kRigTurn, Kind::kCameraTurn}) errors.push_back({kind, axis, radians(0.4)});
  }
  errors.insert(errors.end(), {{Kind::kFocal, 0, 0.01}, {Kind::kCx, 0, 1.5}, {Kind::kCy, 0, -1.5}});
  const auto hand = static_cast<Eigen::Index>(roles_.segments.size() - 1);
  errors.push_back({Kind::kScale, hand, 0.03});
  errors.push_back({Kind::kSize, hand, 0.03});
  const std::size_t camera = 1;
  const CameraObservation seen = reach_.draw(q_, nothing_, camera);
  for (const auto& error : errors) {
    Corrections wrong = nothing_;
    const Coordinate coordinate{error.kind, error.index};
    coordinate.in(wrong) = error.size;
    const std::vector<std::uint32_t> one = {position(error.kind, error.index)};
    measurement_.linearise(edges(seen, camera), q_, wrong, camera, one, {.search_px = 10.0}, evidence_);
    // In the direction of that coordinate alone: one pose cannot tell all apart.
    const double step = evidence_.b(0) / evidence_.A(0, 0);
    EXPECT_NEAR(step, -error.size, 0.25 * std::abs(error.size))
        << "kind " << static_cast<int>(error.kind) << ", " << error.index;
  }
}

// A camera that takes its rows one after the other shows each where the arm was at that row's time.
TEST_F(OutlineOfOwnRobot, RowsOfAMovingArmAreSeenAtTheirOwnTime) {
  const std::size_t camera = 0;
  const auto& k = rig_.cameras[camera].intrinsics;
  Corrections moving = nothing_;
  moving.qdot = Eigen::VectorXd::Zero(q_.size());
  for (const auto joint : roles_.arm) moving.qdot[joint] = radians(20.0);
  const std::vector<std::uint32_t> readout = {position(Kind::kReadout, 0)};
  const CameraObservation seen = reach_.draw(q_, nothing_, camera);

  // What each row sees, drawn row by row from the arm as it was then.
  constexpr double kReadout_s = 0.030;
  CameraObservation rolled = seen;
  for (int v = 0; v < k.height; ++v) {
    const double time_s = kReadout_s * (v - 0.5 * (k.height - 1)) / (k.height - 1);
    const CameraObservation then = reach_.draw(q_ + time_s * moving.qdot, nothing_, camera);
    const auto row = static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width);
    std::copy_n(then.coverage.begin() + static_cast<std::ptrdiff_t>(row), k.width,
                rolled.coverage.begin() + static_cast<std::ptrdiff_t>(row));
    for (int u = 0; u < k.width; ++u) rolled.mask.set(u, v, then.mask.at(u, v));
  }
  measurement_.linearise(edges(rolled, camera), q_, moving, camera, readout, {.search_px = 10.0}, evidence_);
  const double unaware_px = evidence_.rms_px();
  EXPECT_NEAR(evidence_.b(0) / evidence_.A(0, 0), kReadout_s, 0.15 * kReadout_s);
  moving.camera.readout_s = kReadout_s;
  measurement_.linearise(edges(rolled, camera), q_, moving, camera, readout, {.search_px = 10.0}, evidence_);
  EXPECT_LT(evidence_.rms_px(), 0.4 * unaware_px);
  EXPECT_NEAR(evidence_.b(0) / evidence_.A(0, 0), 0.0, 0.1 * kReadout_s);

  moving.qdot.setZero();
  measurement_.linearise(edges(seen, camera), q_, moving, camera, readout, {.search_px = 10.0}, evidence_);
  EXPECT_EQ(evidence_.A(0, 0), 0.0) << "an arm at rest tells nothing of it";
}

TEST_F(OutlineOfOwnRobot, ADilatedPredictionLiesOutsideByAsMuch) {
  Corrections fat = nothing_;
  for (auto& shape : fat.shapes) shape.dilation_px = 1.0;
  measurement_.linearise(edges(reach_.draw(q_, nothing_, 0), 0), q_, fat, 0, {}, {}, evidence_);
  double sum = 0.0;
  for (const auto& point : measurement_.points()) sum += point.residual_px;
  EXPECT_NEAR(sum / evidence_.matched, -1.0, 0.1);
}

/// What covers the arm by 5 mm shows as those of its distance.
TEST_F(OutlineOfOwnRobot, AThickerPredictionLiesOutsideByAsMuchAsItIsNear) {
  Corrections thick = nothing_;
  for (auto& shape : thick.shapes) shape.thickness_m = 0.005;
  measurement_.linearise(edges(reach_.draw(q_, nothing_, 0), 0), q_, thick, 0, {}, {.search_px = 12.0}, evidence_);
  ASSERT_GT(evidence_.matched_share(), 0.8);
  const double fx = rig_.cameras[0].intrinsics.fx;
  double sum = 0.0, predicted = 0.0;
  for (const auto& point : measurement_.points()) {
    sum += point.residual_px;
    predicted += 0.005 * fx / point.p_C.z();
  }
  EXPECT_NEAR(-sum / predicted, 1.0, 0.1);
}

/// A glove lies over the outline of the wrist.
TEST_F(OutlineOfOwnRobot, NoOutlineIsPredictedUnderACover) {
  const auto found = std::find_if(roles_.segments.begin(), roles_.segments.end(),
                                  [](const auto& segment) { return segment.name == "r_hand"; });
  ASSERT_NE(found, roles_.segments.end());
  const auto hand = static_cast<std::size_t>(found - roles_.segments.begin());
  Eigen::VectorXd q = q_;
  q(robot_->joint_index("r_shoulder_pitch")) = radians(-60.0);
  q(robot_->joint_index("r_elbow")) = radians(40.0);
  const auto points_of = [&](const Corrections& c) {
    measurement_.expect(q, c, 0, {}, {.spacing_px = 1.5}, evidence_);
    return std::vector<OutlinePoint>(measurement_.points().begin(), measurement_.points().end());
  };
  const auto bare = points_of(nothing_);
  constexpr double kThickness_m = 0.02;
  Corrections glove = nothing_;
  glove.shapes[hand].thickness_m = kThickness_m;
  const double fx = rig_.cameras[0].intrinsics.fx;
  const auto under = [&](const OutlinePoint& point) {
    return projection_.segment_of(point.part) != hand && std::any_of(bare.begin(), bare.end(), [&](const auto& near) {
             return projection_.segment_of(near.part) == hand &&
                    (near.pixel - point.pixel).norm() < kThickness_m * fx / near.p_C.z();
           });
  };
  ASSERT_GT(std::count_if(bare.begin(), bare.end(), under), 0) << "there is something beside the hand";
  const auto gloved = points_of(glove);
  EXPECT_EQ(std::count_if(gloved.begin(), gloved.end(), under), 0);
  EXPECT_GT(gloved.size(), bare.size() / 4);
}

/// Between fingers the sides of a fat outline meet, and those of a thin one at their tips.
TEST_F(OutlineOfOwnRobot, NoOutlineIsPredictedWhereItsSidesHaveMet) {
  const auto points_of = [&](double dilation_px) {
    Corrections c = nothing_;
    for (auto& shape : c.shapes) shape.dilation_px = dilation_px;
    measurement_.expect(q_, c, 0, {}, {.spacing_px = 1.0}, evidence_);
    return std::vector<OutlinePoint>(measurement_.points().begin(), measurement_.points().end());
  };
  const auto bare = points_of(0.0);
  for (const double dilation_px : {5.0, -4.0}) {
    const auto moved = points_of(dilation_px);
    EXPECT_GT(moved.size(), bare.size() / 2);
    for (const auto& point : moved) {
      double nearest_px = 1e9;
      for (const auto& b : bare) nearest_px = std::min(nearest_px, (b.pixel - point.pixel).norm());
      EXPECT_GT(nearest_px, 0.9 * std::abs(dilation_px)) << point.pixel.transpose();
    }
  }
}

TEST_F(OutlineOfOwnRobot, WhatLiesBeyondTheSearchIsNotMatchedAndCosts) {
  const auto seen = reach_.draw(q_, nothing_, 0);
  Corrections wrong = nothing_;
  wrong.dq[roles_.arm[0]] = radians(-8.0);
  const auto share = [&](double search_px) {
    measurement_.linearise(edges(seen, 0), q_, wrong, 0, {}, {.search_px = search_px}, evidence_);
    return evidence_.matched_share();
  };
  const double narrow = share(3.0), narrow_misfit = evidence_.misfit;
  EXPECT_LT(narrow, 0.6);
  EXPECT_GT(share(60.0), narrow + 0.2);
  // However far is searched: within 12 px, where the misfit looks, it is the same.
  share(9.0);
  EXPECT_NEAR(evidence_.misfit, narrow_misfit, 1e-9);
  measurement_.linearise(edges(seen, 0), q_, nothing_, 0, {}, {.search_px = 3.0}, evidence_);
  EXPECT_LT(evidence_.misfit, 0.05 * narrow_misfit);
}

/// Geman and McClure's: a residual r costs r^2 c^2 / (r^2 + c^2) and weighs (c^2 / (r^2 + c^2))^2.
TEST_F(OutlineOfOwnRobot, WeightsAndCostsAreThoseOfTheRobustScale) {
  Corrections wrong = nothing_;
  wrong.camera.cx_px = 2.5;
  const double c = 1.7, c2 = c * c;
  const std::vector<std::uint32_t> active = {position(Kind::kCx, 0), position(Kind::kCy, 0)};
  measurement_.linearise(edges(reach_.draw(q_, nothing_, 0), 0), q_, wrong, 0, active,
                         {.search_px = 14.0, .robust_px = c}, evidence_);
  double square = 0.0, weight = 0.0, cost = 0.0, misfit = 0.0;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (const auto& point : measurement_.points()) {
    const double r2 = point.residual_px * point.residual_px;
    const double w = std::pow(c2 / (r2 + c2), 2);
    EXPECT_NEAR(point.weight, w, 1e-12);
    square += w * r2;
    weight += w;
    cost += r2 * c2 / (r2 + c2);
    misfit += r2 * 36.0 / (r2 + 36.0);
    A += w * point.normal * point.normal.transpose();
    b += w * point.residual_px * point.normal;
  }
  const double lost = evidence_.sampled - evidence_.matched;
  EXPECT_NEAR(evidence_.square, square, 1e-9 * square);
  EXPECT_NEAR(evidence_.weight, weight, 1e-9 * weight);
  EXPECT_NEAR(evidence_.cost, cost + lost * c2, 1e-9 * cost);
  EXPECT_NEAR(evidence_.misfit, misfit + lost * 36.0, 1e-9 * misfit);
  EXPECT_LT((evidence_.A - A).norm(), 1e-9 * A.norm());
  EXPECT_LT((evidence_.b - b).norm(), 1e-9 * b.norm());
}

/// A tool in the hand that no mesh shows: the step that the rest asks for hardly changes.
TEST_F(OutlineOfOwnRobot, WhatLiesFarOffTheOutlineSaysLittle) {
  Corrections wrong = nothing_;
  wrong.camera.cx_px = 1.0;
  const std::vector<std::uint32_t> active = {position(Kind::kCx, 0)};
  CameraObservation seen = reach_.draw(q_, nothing_, 0);
  const auto step = [&] {
    measurement_.linearise(edges(seen, 0), q_, wrong, 0, active, {.search_px = 12.0, .robust_px = 1.0}, evidence_);
    return evidence_.b(0) / evidence_.A(0, 0);
  };
  const double without = step();
  // To the right of a stretch of the outline it goes on for 8 px.
  for (int v = 60; v < 120; ++v) {
    int last = -1;
    for (int u = 0; u < 310; ++u) last = seen.mask.at(u, v) ? u : last;
    for (int u = last; last >= 0 && u < std::min(last + 9, 319); ++u) {
      seen.mask.set(u, v);
      seen.coverage[static_cast<std::size_t>(v * 320 + u)] = 255;
    }
  }
  EXPECT_NEAR(without, -1.0, 0.2);
  EXPECT_NEAR(step(), without, 0.1);
}

/// A part that is counted half says half; where its outline lies it says all the same.
TEST_F(OutlineOfOwnRobot, PartsCountAsTheyAreWeighed) {
  Corrections wrong = nothing_;
  wrong.camera.cx_px = 1.0;
  const auto seen = reach_.draw(q_, nothing_, 0);
  const std::vector<std::uint32_t> active = {position(Kind::kCx, 0)};
  OutlineSearch search;
  measurement_.linearise(edges(seen, 0), q_, wrong, 0, active, search, evidence_);
  const OutlineEvidence plain = evidence_;
  const std::size_t part = measurement_.points().front().part;
  double of_it = 0.0;
  for (const auto& point : measurement_.points()) {
    if (point.part == part) of_it += point.weight * std::pow(point.normal.x(), 2);
  }
  search.part_weight.assign(measurement_.part_count(), 1.0);
  search.part_weight[part] = 0.5;
  measurement_.linearise(edges(seen, 0), q_, wrong, 0, active, search, evidence_);
  EXPECT_GT(of_it, 0.0);
  EXPECT_NEAR(evidence_.A(0, 0), plain.A(0, 0) - 0.5 * of_it, 1e-9 * plain.A(0, 0));
  EXPECT_EQ(evidence_.matched, plain.matched);
}

/// What a picture would tell, without one.
TEST_F(OutlineOfOwnRobot, WhatIsExpectedIsWhatAPictureOfThatPoseTells) {
  const OutlineSearch search{.search_px = 4.0, .robust_px = 3.0};
  OutlineEvidence expected;
  measurement_.expect(q_, nothing_, 0, all_, search, expected);
  EXPECT_EQ(expected.matched, expected.sampled);
  EXPECT_EQ(expected.b.norm(), 0.0);
  EXPECT_EQ(expected.square, 0.0);
  EXPECT_EQ(expected.weight, expected.sampled);
  measurement_.linearise(edges(reach_.draw(q_, nothing_, 0), 0), q_, nothing_, 0, all_, search, evidence_);
  EXPECT_EQ(expected.sampled, evidence_.sampled);
  for (Eigen::Index i = 0; i < expected.A.rows(); ++i) {
    EXPECT_NEAR(evidence_.A(i, i), expected.A(i, i), 0.1 * expected.A(i, i)) << i;
  }
}

TEST_F(OutlineOfOwnRobot, OnlyWhatIsAskedForIsAnsweredInTheOrderAsked) {
  const auto seen = reach_.draw(q_, nothing_, 0);
  Corrections wrong = nothing_;
  wrong.camera.cx_px = 1.0;
  measurement_.linearise(edges(seen, 0), q_, wrong, 0, all_, {}, evidence_);
  const OutlineEvidence whole = evidence_;
  const std::vector<std::uint32_t> some = {position(Kind::kFocal, 0), position(Kind::kJoint, roles_.arm[3])};
  measurement_.linearise(edges(seen, 0), q_, wrong, 0, some, {}, evidence_);
  ASSERT_EQ(evidence_.b.size(), 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(evidence_.b(row), whole.b(some[i]), 1e-9 * std::abs(whole.b(some[i])));
    EXPECT_NEAR(evidence_.A(row, 0), whole.A(some[i], some[0]), 1e-9 * std::abs(whole.A(some[0], some[0])));
  }
}

/// Where the hand goes, by differences: coordinates that move no link move no hand.
TEST_F(OutlineOfOwnRobot, TheHandsJacobianIsThatOfItsPose) {
  const Corrections c = all_at_once();
  constexpr double kStep = 1e-6;
  const std::size_t camera = 1, hand = projection_.hand_link();
  const Eigen::MatrixXd J = measurement_.link_jacobian(q_, c, camera, all_, hand);
  ASSERT_EQ(J.rows(), 6);
  const auto hand_at = [&](std::size_t i, double step) {
    Corrections moved = c;
    measurement_.coordinates()[i].in(moved) += step;
    projection_.place(q_, moved, camera);
    return projection_.hand();
  };
  for (std::size_t i = 0; i < all_.size(); ++i) {
    const Pose plus = hand_at(i, kStep), minus = hand_at(i, -kStep);
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(plus.linear() * minus.linear().transpose()));
    Eigen::VectorXd expected(6);
    expected << (plus.translation() - minus.translation()) / (2 * kStep), turn.angle() * turn.axis() / (2 * kStep);
    const auto column = static_cast<Eigen::Index>(i);
    const auto& coordinate = measurement_.coordinates()[i];
    EXPECT_LT((J.col(column) - expected).norm(), 1e-4) << static_cast<int>(coordinate.kind) << ' ' << coordinate.index;
    EXPECT_TRUE(!moves_no_link(coordinate.kind) || J.col(column).norm() == 0.0) << static_cast<int>(coordinate.kind);
  }
}

/// Of a picture twice as wide and high: as many points, looked for twice as far.
TEST(OutlineSearch, GrowsWithThePicture) {
  EXPECT_EQ(picture_unit({320, 240, 257, 257, 159.5, 119.5}), 1.0);
  EXPECT_EQ(picture_unit({640, 480, 514, 514, 319.5, 239.5}), 2.0);
  const Configuration configuration =
      Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/robot.yaml");
  const auto setup = RobotSetup::from(configuration.section("robot"));
  const auto robot = setup.load();
  StereoRig rig = StereoRig::from(configuration.section("cameras"));
  std::vector<OutlineEvidence> evidence(2);
  for (const int times : {1, 2}) {
    for (auto& camera : rig.cameras) {
      auto& k = camera.intrinsics;
      if (times == 2) k = {640, 480, 2 * k.fx, 2 * k.fy, 2 * k.cx + 0.5, 2 * k.cy + 0.5};
    }
    const auto roles = JointRoles::of(robot, setup, rig);
    SyntheticReach reach(robot, setup, rig, Eigen::VectorXd::Zero(7));
    Eigen::VectorXd q = setup.default_joints(*robot);
    for (const auto& [joint, deg] : {std::pair{"neck_pitch", -10.0},
                                     {"r_shoulder_pitch", -70.0},
                                     {"r_shoulder_roll", 22.0},
                                     {"r_shoulder_yaw", 16.0},
                                     {"r_elbow", 75.0}}) {
      q(robot->joint_index(joint)) = radians(deg);
    }
    OutlineMeasurement measurement(robot, setup, rig, roles);
    auto wrong = roles.no_corrections();
    wrong.dq[roles.arm[0]] = radians(0.7);
    const std::vector<std::uint32_t> active = {
        static_cast<std::uint32_t>(measurement.coordinates().find({Kind::kJoint, roles.arm[0]}))};
    const auto seen = reach.draw(q, roles.no_corrections(), 0);
    measurement.linearise({seen, rig.cameras[0].intrinsics}, q, wrong, 0, active, {},
                          evidence[static_cast<std::size_t>(times - 1)]);
  }
  EXPECT_NEAR(evidence[1].sampled, evidence[0].sampled, 0.15 * evidence[0].sampled);
  EXPECT_NEAR(evidence[1].rms_px(), 2.0 * evidence[0].rms_px(), 0.3 * evidence[0].rms_px());
  EXPECT_NEAR(evidence[1].A(0, 0), 4.0 * evidence[0].A(0, 0), evidence[0].A(0, 0));
}

}  // namespace
}  // namespace bodyschema
