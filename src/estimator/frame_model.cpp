#include "frame_model.hpp"

#include <algorithm>
#include <utility>

namespace bodyschema {

namespace {

/// Pictures that show the arm later or earlier than their stamps say.
ErrorModel of_time(const JointRoles& roles) {
  ErrorModel model(roles);
  model.add("latency", {});
  return model;
}

}  // namespace

bool Frame::exposed() const {
  return std::any_of(seen.begin(), seen.end(), [](const auto* camera) { return camera != nullptr; });
}

FrameModel::FrameModel(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                       const JointRoles& roles, State state, const ErrorModel& beside, const SilhouetteModel* drawn)
    : roles_(roles), rig_(rig), state_(std::move(state)),
      measurement_(robot, setup, rig, roles, drawn != nullptr ? *drawn : silhouette_model(*robot, setup)),
      track_(robot, setup), probes_(state_.model(), state_.refs(), measurement_.coordinates()),
      beside_(beside, fitted_parameters(beside), measurement_.coordinates()),
      time_(of_time(roles), fitted_parameters(of_time(roles)), measurement_.coordinates()),
      settled_(rig.cameras.size(), roles.no_corrections()), scratch_(roles.no_corrections()), nothing_(scratch_),
      position_(static_cast<std::size_t>(measurement_.coordinates().size()), -1), questions_(rig.cameras.size()) {
  for (auto& question : questions_) question.corrections = nothing_;
  for (std::size_t c = 1; c < rig.cameras.size(); ++c) {
    more_measurements_.emplace_back(robot, setup, rig, roles, measurement_);
    worker_ = std::make_unique<BackgroundWorker>();
  }
  for (std::size_t e = 0; e < state_.model().size(); ++e) {
    sags_ = sags_ || std::as_const(state_).model()[e].follows_gravity();
    remembers_ = remembers_ || std::as_const(state_).model()[e].has_memory();
  }
  find_still_parts(setup.default_joints(*robot));
}

void FrameModel::find_still_parts(const Eigen::VectorXd& q) {
  constexpr double kStep_rad = 0.1, kMoved = 1e-9;
  auto& projection = measurement_.projection();
  still_parts_.assign(projection.part_count(), true);
  for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
    projection.place(q, nothing_, c);
    const std::vector<Pose> rest(projection.links().begin(), projection.links().end());
    for (const auto* joints : {&roles_.arm, &roles_.head}) {
      for (const auto joint : *joints) {
        Eigen::VectorXd moved = q;
        moved[joint] += kStep_rad;
        projection.place(moved, nothing_, c);
        const auto links = projection.links();
        for (std::size_t part = 0; part < rest.size(); ++part) {
          if (!links[part].isApprox(rest[part], kMoved)) still_parts_[part] = false;
        }
      }
    }
  }
}

void FrameModel::forget() {
  track_.forget();
  state_.model().forget();
  probes_.forget();
  beside_.forget();
  time_.forget();
}

/// What effects look at, with those that have a memory as they are now.
void FrameModel::expose(const JointSample& joints, std::size_t camera, const Eigen::VectorXd& x, Exposure& out) {
  track_.instant(joints, camera, state_.model().offsets(), out.at);
  if (remembers_) {
    out.remembered = roles_.no_corrections();
    for (std::size_t e = 0; e < state_.model().size(); ++e) {
      const Effect& effect = std::as_const(state_).model()[e];
      if (effect.has_memory()) effect.apply(out.at, out.remembered);
    }
  }
  if (!sags_) return;
  settle_under_gravity(
      [&]() -> const Eigen::VectorXd& {
        corrections(out, x, scratch_);
        return scratch_.dq;
      },
      [&](const Eigen::VectorXd& dq) { track_.torques_at(joints, -dq, out.at); });
}

Frame FrameModel::take(const Observation& observation, const Eigen::VectorXd& x) {
  if (observation.encoders_begin_anew) forget();
  track_.add(observation.encoders);
  state_.set(x);
  probes_.follow(state_.model());
  Frame frame;
  const double stamp_s = seconds(observation.utime);
  behind_s_ = std::max(behind_s_, last_s_ - stamp_s);  // a clock that stepped back: for what was learned time goes on
  frame.time_s = last_s_ = stamp_s + behind_s_;
  frame.exposures.resize(rig_.cameras.size());
  frame.seen.resize(rig_.cameras.size(), nullptr);
  // The earlier exposure first: what has a memory goes with time.
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < frame.seen.size() && c < observation.cameras.size(); ++c) {
    if (!observation.cameras[c]) continue;
    frame.seen[c] = &*observation.cameras[c];
    order.push_back(c);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return frame.seen[a]->utime < frame.seen[b]->utime; });
  for (const auto c : order) {
    JointSample joints = frame.seen[c]->joints;
    joints.utime = frame.seen[c]->utime;
    track_.advance(joints.utime, [&](const JointSample& sample) {
      state_.model().observe(sample);
      probes_.observe(sample);
      beside_.observe(sample);
      time_.observe(sample);
    });
    expose(joints, c, x, frame.exposures[c]);
  }
  for (std::size_t c = 0; c < frame.seen.size() && !order.empty(); ++c) {
    if (frame.seen[c] == nullptr) expose(frame.seen[order.front()]->joints, c, x, frame.exposures[c]);
  }
  return frame;
}

Exposure FrameModel::at_rest(const Eigen::VectorXd& q, std::size_t camera) {
  Exposure exposure;
  exposure.at = Instant::at_rest(q, camera);
  exposure.at.q -= state_.model().offsets();
  track_.torques_at({0, q, exposure.at.qdot}, state_.model().offsets(), exposure.at);
  return exposure;
}

Exposure FrameModel::preview(const JointSample& joints, std::size_t camera) {
  Exposure exposure;
  expose(joints, camera, state_.x(), exposure);
  return exposure;
}

void FrameModel::corrections(const Exposure& exposure, const Eigen::VectorXd& x, Corrections& out) {
  state_.set(x);
  if (!remembers_) {
    state_.model().corrections(exposure.at, out);
    return;
  }
  if (exposure.remembered.dq.size() > 0) {
    out = exposure.remembered;
  } else {
    out.clear();
  }
  out.qdot = exposure.at.qdot;
  for (std::size_t e = 0; e < state_.model().size(); ++e) {
    const Effect& effect = std::as_const(state_).model()[e];
    if (!effect.has_memory()) effect.apply(exposure.at, out);
  }
}

void FrameModel::settle(const Frame& frame, const Eigen::VectorXd& x) {
  settled_frame_ = &frame;
  Eigen::VectorXd rest = x;
  rest.head(state_.joints()).setZero();
  for (std::size_t c = 0; c < settled_.size(); ++c) corrections(frame.exposures[c], rest, settled_[c]);
}

void FrameModel::place(const Eigen::VectorXd& x, std::size_t camera, std::span<Eigen::Isometry3f> X_CB) {
  scratch_ = settled_[camera];
  for (Eigen::Index k = 0; k < state_.joints(); ++k) {
    scratch_.dq[state_.parameters()[static_cast<std::size_t>(k)].joint] -= x[k];
  }
  auto& projection = measurement_.projection();
  projection.place(settled_frame_->exposures[camera].at.encoder, scratch_, camera);
  projection.parts(X_CB);
}

RobotProjection& FrameModel::project(const Exposure& exposure, const Eigen::VectorXd& x) {
  corrections(exposure, x, scratch_);
  measurement_.projection().place(exposure.at.encoder, scratch_, exposure.at.camera);
  return measurement_.projection();
}

RobotProjection& FrameModel::project_nominal(const Exposure& exposure) {
  measurement_.projection().place(exposure.at.encoder, nothing_, exposure.at.camera);
  return measurement_.projection();
}

Pose FrameModel::hand_pose(const Exposure& exposure, const Eigen::VectorXd& x) {
  return project(exposure, x).hand();
}

Pose FrameModel::nominal_hand_pose(const Exposure& exposure) {
  return project_nominal(exposure).hand();
}

/// Leaves what the parameters do to the coordinates in `out.J`, and these in `out.active`.
void FrameModel::find_directions(const Exposure& exposure, const Eigen::VectorXd& x, bool with_beside, Question& out) {
  state_.set(x);
  probes_.follow(state_.model());
  probes_.directions(exposure.at, directions_);
  if (with_beside) {
    beside_.directions(exposure.at, more_directions_);
    directions_.insert(directions_.end(), more_directions_.begin(), more_directions_.end());
    time_.directions(exposure.at, more_directions_);
    directions_.push_back(more_directions_.front());
  }
  std::fill(position_.begin(), position_.end(), -1);
  out.active.clear();
  for (const auto& direction : directions_) {
    for (const auto& step : direction) {
      if (position_[step.coordinate] >= 0) continue;
      position_[step.coordinate] = static_cast<Eigen::Index>(out.active.size());
      out.active.push_back(step.coordinate);
    }
  }
  const auto active = static_cast<Eigen::Index>(out.active.size()), n = state_.size() + beside_count();
  out.J.setZero(active, n);
  out.by_time.setZero(with_beside ? active : 0);
  for (std::size_t k = 0; k < directions_.size(); ++k) {
    const auto parameter = static_cast<Eigen::Index>(k);
    for (const auto& step : directions_[k]) {
      const auto at = position_[step.coordinate];
      (parameter < n ? out.J(at, parameter) : out.by_time[at]) = step.amount;
    }
  }
}

void FrameModel::ask(const Frame& frame, std::span<const OutlineSearch> search) {
  const auto ask_camera = [&](std::size_t c) {
    Question& question = questions_[c];
    if (!question.asked) return;
    OutlineSearch beside = search[c];
    if (c < frame.covered.size()) beside.covered = &frame.covered[c];
    measurement_of(c).linearise(ObservedEdges(*frame.seen[c], rig_.cameras[c].intrinsics),
                                frame.exposures[c].at.encoder, question.corrections, c, question.active, beside,
                                question.answer);
  };
  if (worker_ != nullptr && questions_[1].asked) {
    worker_->share([&] { ask_camera(0); }, [&] { ask_camera(1); });
  } else {
    ask_camera(0);
  }
}

void FrameModel::linearise(const Frame& frame, const Eigen::VectorXd& x, std::span<const OutlineSearch> search,
                           bool with_beside, FrameEvidence& out,
                           const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look) {
  const Eigen::Index n = state_.size() + beside_count();
  out.cameras.resize(frame.seen.size());
  out.cost.assign(frame.seen.size(), 0.0);
  out.sampled = out.matched = out.square = out.weight = out.odd = 0.0;
  out.samples.assign(with_beside ? frame.seen.size() : 0, {});
  out.time.assign(with_beside ? frame.seen.size() : 0, {});
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    Question& question = questions_[c];
    question.asked = frame.seen[c] != nullptr && !frame.seen[c]->mask.empty();
    if (!question.asked) continue;
    find_directions(frame.exposures[c], x, with_beside, question);
    corrections(frame.exposures[c], x, question.corrections);
  }
  ask(frame, search);
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    auto& evidence = out.cameras[c];
    evidence.A.setZero(n, n);
    evidence.b.setZero(n);
    evidence.square = evidence.weight = 0.0;
    const auto& [active, J, by_time, corrections, answer, asked] = questions_[c];
    if (!asked) continue;
    const OutlineMeasurement& measurement = measurement_of(c);
    if (with_beside) out.samples[c].assign(measurement.samples().begin(), measurement.samples().end());
    out.odd += answer.odd;
    out.sampled += answer.sampled;
    out.matched += answer.matched;
    const double unit = picture_unit_px(c), unit2 = unit * unit;
    out.cost[c] = answer.cost / unit2;
    if (answer.weight <= 0.0) continue;
    evidence.A = J.transpose() * answer.A * J / unit2;
    evidence.b = J.transpose() * answer.b / unit2;
    if (with_beside) {
      const Eigen::VectorXd seen = answer.A * by_time / unit2;
      out.time[c] = {J.transpose() * seen, by_time.dot(seen), by_time.dot(answer.b) / unit2};
    }
    evidence.square = answer.square / unit2;
    evidence.weight = answer.weight;
    out.square += evidence.square;
    out.weight += evidence.weight;
    if (look) look(c, measurement.points());
  }
}

Eigen::MatrixXd FrameModel::hand_jacobian(const Exposure& exposure, const Eigen::VectorXd& x) {
  Question& question = questions_[exposure.at.camera];
  find_directions(exposure, x, true, question);
  corrections(exposure, x, question.corrections);
  const auto link = measurement_.projection().hand_link();
  return measurement_
             .link_jacobian(exposure.at.encoder, question.corrections, exposure.at.camera, question.active, link)
             .topRows<3>() *
         question.J;
}

}  // namespace bodyschema
