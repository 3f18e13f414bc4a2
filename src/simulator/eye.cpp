#include "eye.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "shapes.hpp"

namespace bodyschema::simulator {
namespace {

/// Between two slices of a picture the robot and the room move by no more than this, or, where it is more, than this
/// share of what one row's exposure smears; other things by more, for nothing is measured on them.
constexpr double kStep_px = 0.5, kStepOfSmear = 0.2, kThings = 2.5;
constexpr int kMostSlices = 48;
/// The lamp's view is drawn anew after so many slices; shadows are softer than what moves meanwhile.
constexpr int kSlicesPerShadow = 4;

/// Greys from dark metal to white plastic, the same for a link on every run.
Eigen::Vector3f grey_of(const std::string& link) {
  Random random(7, link);
  const auto level = static_cast<float>(random.uniform(0.55, 0.85));
  Eigen::Vector3f colour(level, level, level);
  for (int k = 0; k < 3; ++k) colour[k] += static_cast<float>(random.uniform(-0.04, 0.04));
  return colour;
}

/// Paints a robot as robots are: see Looks::kCovers. Which link is a cover and which a joint is told by size, so
/// that it works for robots nobody has painted.
class CoverPainter {
 public:
  CoverPainter(const std::shared_ptr<const RobotModel>& shared_model, const RobotSetup& setup, double gloss)
      : gloss_(static_cast<float>(gloss)) {
    const RobotModel& model = *shared_model;
    std::vector<std::string> names;
    for (const auto& mesh : model.meshes()) names.push_back(mesh.link);
    const std::size_t tips = names.size();
    names.insert(names.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
    names.push_back(setup.hand_link);
    ForwardKinematics kinematics(shared_model, names);
    X_W_.resize(names.size());
    kinematics.compute(Eigen::VectorXd::Zero(model.joint_count()), X_W_);
    for (std::size_t p = 0; p < tips; ++p) {
      const auto& vertices = model.meshes()[p].mesh.vertices;
      Eigen::Vector3f low = vertices.front(), high = low;
      for (const auto& v : vertices) {
        low = low.cwiseMin(v);
        high = high.cwiseMax(v);
      }
      sizes_.push_back((high - low).norm());
      bool in_hand = true, finger = false, same_as_hand = true;
      for (Eigen::Index j = 0; j < model.joint_count(); ++j) {
        const bool hand_moves = kinematics.moves(j, names.size() - 1);
        in_hand &= !hand_moves || kinematics.moves(j, p);
        same_as_hand &= hand_moves == kinematics.moves(j, p);
        finger |= !hand_moves && kinematics.moves(j, p);
      }
      hand_.push_back(in_hand);
      finger_.push_back(in_hand && finger);
      rigid_.push_back(in_hand && same_as_hand);
      std::vector<std::size_t> own;
      for (std::size_t t = tips; t + 1 < names.size(); ++t) {
        bool rigid = true;
        for (Eigen::Index j = 0; j < model.joint_count(); ++j) {
          rigid &= kinematics.moves(j, t) == kinematics.moves(j, p);
        }
        if (rigid && in_hand) own.push_back(t);
      }
      tips_of_.push_back(std::move(own));
    }
    // Of what is rigid with the hand the largest piece is the palm; the others are fingers, as of a gripper.
    std::size_t palm = tips;
    for (std::size_t p = 0; p < tips; ++p) {
      if (rigid_[p] && (palm == tips || sizes_[p] > sizes_[palm])) palm = p;
    }
    for (std::size_t p = 0; p < tips; ++p) {
      if (rigid_[p] && p != palm) finger_[p] = true;
    }
  }

  void paint(std::size_t p, PaintedPart& part) const {
    const float largest = *std::max_element(sizes_.begin(), sizes_.end());
    Paint base;
    if (finger_[p]) {
      base = {.albedo = {0.20f, 0.20f, 0.21f}, .gloss = 0.35f * gloss_, .sharpness = 25.0f};
    } else if (hand_[p]) {
      base = {.albedo = {0.82f, 0.82f, 0.80f}, .gloss = gloss_, .sharpness = 60.0f};
    } else if (sizes_[p] > 0.62f * largest) {
      base = {.albedo = {0.90f, 0.90f, 0.88f}, .gloss = gloss_, .sharpness = 70.0f};
    } else {
      base = {.albedo = {0.13f, 0.13f, 0.14f}, .gloss = 0.5f * gloss_, .sharpness = 35.0f};
    }
    part.paints = {base};
    part.paint_of_triangle.assign(part.mesh.triangles.size(), 0);
    if (tips_of_[p].empty() || !(finger_[p] || hand_[p])) return;
    // Rubber pads at the fingertips.
    constexpr std::array<std::array<float, 3>, 5> kTips = {{{0.75f, 0.14f, 0.12f},
                                                            {0.12f, 0.30f, 0.72f},
                                                            {0.10f, 0.50f, 0.22f},
                                                            {0.82f, 0.62f, 0.10f},
                                                            {0.48f, 0.16f, 0.55f}}};
    constexpr float kPad_m = 0.017f;
    for (const auto t : tips_of_[p]) {
      const auto& colour = kTips[(t - sizes_.size()) % kTips.size()];
      part.paints.push_back({.albedo = {colour[0], colour[1], colour[2]}, .gloss = 0.1f, .sharpness = 15.0f});
      const Eigen::Vector3f tip = (X_W_[p].inverse(Eigen::Isometry) * X_W_[t].translation()).cast<float>();
      for (std::size_t f = 0; f < part.mesh.triangles.size(); ++f) {
        const auto& triangle = part.mesh.triangles[f];
        const Eigen::Vector3f middle =
            (part.mesh.vertices[triangle[0]] + part.mesh.vertices[triangle[1]] + part.mesh.vertices[triangle[2]]) /
            3.0f;
        if ((middle - tip).norm() < kPad_m) {
          part.paint_of_triangle[f] = static_cast<std::uint8_t>(part.paints.size() - 1);
        }
      }
    }
  }

 private:
  float gloss_;
  std::vector<Pose> X_W_;
  std::vector<float> sizes_;
  std::vector<bool> hand_, finger_, rigid_;
  std::vector<std::vector<std::size_t>> tips_of_;
};

}  // namespace

std::vector<PaintedPart> painted_arm(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup,
                                     const SimulatorSettings& settings, const TrueBody& body) {
  std::vector<PaintedPart> parts;
  std::optional<CoverPainter> painter;
  if (settings.looks == Looks::kCovers) painter.emplace(model, setup, settings.gloss);
  for (std::size_t p = 0; p < model->meshes().size(); ++p) {
    const auto& link = model->meshes()[p];
    const TrueCover& cover = body.covers[p];
    PaintedPart part;
    part.mesh = link.mesh;
    for (auto& vertex : part.mesh.vertices) vertex *= static_cast<float>(cover.scale);
    if (cover.dilation_m != 0.0) part.mesh = shapes::dilated(part.mesh, static_cast<float>(cover.dilation_m));
    const auto painted = settings.albedo.find(link.link);
    part.albedo =
        painted != settings.albedo.end() ? Eigen::Vector3f(painted->second.cast<float>()) : grey_of(link.link);
    part.cull_back = setup.culling == FaceCulling::kBack || (link.closed && link.consistent_winding);
    if (painter) {
      painter->paint(p, part);
      if (painted != settings.albedo.end()) part.paints.front().albedo = part.albedo;
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

double Eye::Shutter::row_middle_s(int v) const {
  const double place = rows > 1 ? static_cast<double>(v) / (rows - 1) - 0.5 : 0.0;
  return middle_s + place * readout_s;
}

float Eye::Shutter::share(int v, double begin_s, double end_s) const {
  const double t = row_middle_s(v);
  if (exposure_s <= 0.0) return t >= begin_s && t < end_s ? 1.0f : 0.0f;
  const double open = std::max(begin_s, t - 0.5 * exposure_s);
  const double shut = std::min(end_s, t + 0.5 * exposure_s);
  return static_cast<float>(std::max(0.0, shut - open) / exposure_s);
}

Eye::Eye(const Studio& studio, std::size_t camera)
    : studio_(studio), index_(camera), camera_(studio.robot->body().cameras[camera]) {
  std::vector<std::string> links;
  for (const auto& mesh : studio_.model->meshes()) links.push_back(mesh.link);
  covers_ = links.size();
  links.push_back(studio_.setup.hand_link);
  links.insert(links.end(), studio_.setup.fingertip_links.begin(), studio_.setup.fingertip_links.end());
  links.push_back(camera_.link);
  X_W_.resize(links.size());
  X_CA_.resize(covers_);
  kinematics_ = std::make_unique<TrueKinematics>(studio_.model, studio_.robot->body(), std::move(links));
  if (studio_.plan.output == Output::kJoints) return;

  const SimulatorSettings& settings = studio_.settings;
  const int width = camera_.intrinsics.width;
  const int height = camera_.intrinsics.height;
  lens_ = std::make_unique<Lens>(camera_);
  arm_ = std::make_unique<Rasterizer>(studio_.arm, width, height, settings.supersampling);
  if (studio_.things) {
    const std::size_t count = studio_.things->parts().size();
    things_ = std::make_unique<Rasterizer>(studio_.things->parts(), width, height, settings.supersampling);
    placer_ = std::make_unique<Things::Placer>(*studio_.things);
    X_WT_.resize(count);
    X_CT_.resize(count);
    hidden_.resize(count);
  }
  if (studio_.plan.output == Output::kSilhouettes) {
    if (settings.outline_noise.sd_px > 0.0) {
      outlines_ = std::make_unique<OutlineDisplacer>(width, height, settings.outline_noise, studio_.plan.seed,
                                                     camera == 0 ? "left outlines" : "right outlines");
    }
    return;
  }
  sensor_ = std::make_unique<ImageSensor>(width, height, settings.blur_px, settings.noise_levels);
  if (settings.shadows) {
    std::vector<const TriangleMesh*> meshes;
    constexpr float kFinest_m = 0.003f;  // shadows need no more
    casting_.clear();
    for (const auto& part : studio_.arm) casting_.push_back(shapes::coarse(part.mesh, kFinest_m));
    if (studio_.things) {
      for (const auto& part : studio_.things->parts()) casting_.push_back(shapes::coarse(part.mesh, kFinest_m));
    }
    for (const auto& mesh : casting_) meshes.push_back(&mesh);
    casters_.resize(meshes.size());
    casters_hidden_.resize(meshes.size());
    shadow_ =
        std::make_unique<ShadowMap>(std::move(meshes), settings.lamp_direction_W, radians(settings.lamp_size_deg));
  }
}

void Eye::pose(double t_s) {
  studio_.robot->joints(t_s, q_);
  kinematics_->compute(q_, X_W_);
  X_WC_ = kinematics_->camera(index_, X_W_.back());
  if (studio_.plan.output == Output::kJoints) return;
  const Pose X_CW = X_WC_.inverse(Eigen::Isometry);
  const Eigen::Vector3d hand_W = X_W_[covers_].translation();
  for (std::size_t p = 0; p < covers_; ++p) {
    Pose& X = X_W_[p];
    X.translation() = hand_W + studio_.robot->body().covers[p].reach * (X.translation() - hand_W);
    X_CA_[p] = (X_CW * X).cast<float>();
  }
  if (!placer_) return;
  placer_->place(t_s, X_W_[covers_], X_WT_, hidden_);
  for (std::size_t p = 0; p < X_WT_.size(); ++p) X_CT_[p] = (X_CW * X_WT_[p]).cast<float>();
}

void Eye::shoot(int index, double exposure_s, CameraTruth& truth, CameraFrame* frame) {
  const auto& timing = studio_.robot->timing();
  Shutter shutter;
  shutter.exposure_s = std::max(0.0, 1e-3 * studio_.settings.exposure_ms + timing.longer_exposure_s);
  shutter.readout_s = std::max(0.0, 1e-3 * studio_.settings.readout_ms + timing.longer_readout_s);
  shutter.rows = camera_.intrinsics.height;
  shutter.middle_s = exposure_s;
  if (studio_.settings.stamp_first_row) shutter.middle_s += 0.5 * (shutter.exposure_s + shutter.readout_s);

  pose(shutter.middle_s);
  const Pose X_CW = X_WC_.inverse(Eigen::Isometry);
  truth.exposure_utime = studio_.utime(shutter.middle_s);
  truth.q = q_;
  truth.X_WC = X_WC_;
  truth.X_CP = X_CW * X_W_[covers_];
  for (std::size_t i = 0; i < studio_.setup.fingertip_links.size(); ++i) {
    const Eigen::Vector3d tip_C = X_CW * X_W_[covers_ + 1 + i].translation();
    truth.fingertips_C.push_back(tip_C);
    truth.fingertips_px.push_back(project(camera_, tip_C));
  }
  truth.holding = studio_.things && studio_.things->holding(shutter.middle_s);
  if (studio_.plan.output == Output::kJoints || frame == nullptr) return;
  if (plain(shutter)) {
    shoot_plain(truth, *frame);
  } else {
    shoot_scene(shutter, truth, *frame);
  }
  if (outlines_) {
    seen_.resize(frame->coverage.size());
    for (std::size_t i = 0; i < seen_.size(); ++i) seen_[i] = static_cast<float>(frame->coverage[i]) / 255.0f;
    outlines_->displace(shutter.middle_s, index, seen_);
    const int width = camera_.intrinsics.width;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      frame->coverage[i] = static_cast<std::uint8_t>(255.0f * std::clamp(seen_[i], 0.0f, 1.0f) + 0.5f);
      frame->silhouette.set(static_cast<int>(i) % width, static_cast<int>(i) / width, seen_[i] >= 0.5f);
    }
  }
  if (studio_.plan.output == Output::kPictures) finish(shutter, index, *frame);
}

bool Eye::plain(const Shutter& shutter) const {
  return !things_ && !shadow_ && studio_.settings.looks == Looks::kGrey && shutter.exposure_s <= 0.0 &&
         shutter.readout_s <= 0.0;
}

void Eye::paint_room(int v0, int v1) {
  const bool same = (room_X_WC_.matrix() - X_WC_.matrix()).cwiseAbs().maxCoeff() < 1e-9;
  if (same && has_room_) return;
  if (same) {  // a still camera: the next band will be wanted too
    v0 = 0;
    v1 = camera_.intrinsics.height;
  }
  const bool whole = v0 <= 0 && v1 >= camera_.intrinsics.height;
  if (studio_.kitchen) {
    studio_.kitchen->paint(*lens_, X_WC_, v0, v1, room_);
  } else {
    studio_.background->paint(*lens_, X_WC_, v0, v1, room_);
  }
  room_X_WC_ = X_WC_;
  has_room_ = whole;
}

void Eye::shoot_plain(CameraTruth& truth, CameraFrame& frame) {
  Lighting lighting;
  lighting.to_lamp_C = (X_WC_.linear().transpose() * studio_.settings.lamp_direction_W.normalized()).cast<float>();
  lighting.ambient = static_cast<float>(studio_.settings.ambient);
  lighting.diffuse = static_cast<float>(studio_.settings.diffuse);
  arm_->draw(X_CA_, camera_, lighting, static_cast<float>(studio_.robot->body().dilation_px));
  frame.silhouette = arm_->mask();
  const auto& coverage = arm_->coverage();
  frame.coverage.resize(coverage.size());
  double covered = 0.0;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    frame.coverage[i] = static_cast<std::uint8_t>(255.0f * coverage[i] + 0.5f);
    covered += static_cast<double>(coverage[i]);
  }
  truth.visible_share = covered / static_cast<double>(coverage.size());
  if (studio_.plan.output == Output::kSilhouettes) return;

  paint_room(0, camera_.intrinsics.height);
  light_ = room_;
  const auto& colour = arm_->colour();
  const auto box = arm_->box();
  const int width = camera_.intrinsics.width;
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; ++u) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      if (coverage[i] <= 0.0f) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        light_[3 * i + k] = colour[3 * i + k] + (1.0f - coverage[i]) * light_[3 * i + k];
      }
    }
  }
}

std::vector<Eye::Slice> Eye::slices(const Shutter& shutter) {
  const int rows = shutter.rows;
  const double begin_s = shutter.row_middle_s(0) - 0.5 * shutter.exposure_s;
  const double end_s = shutter.row_middle_s(rows - 1) + 0.5 * shutter.exposure_s;
  std::vector<Slice> result;
  if (end_s - begin_s < 1e-6) return {{shutter.middle_s, begin_s - 1.0, end_s + 1.0, 0, rows}};

  // How far does anything move meanwhile? Corners of boxes around the parts, seen at three moments.
  const auto& k = camera_.intrinsics;
  std::vector<Eigen::Vector2d> before, now;
  const auto look = [&](std::vector<Eigen::Vector2d>& pixels) {
    pixels.clear();
    const auto corners = [&](const Rasterizer& raster, const std::vector<Eigen::Isometry3f>& X_CB, bool things) {
      for (std::size_t p = 0; p < X_CB.size(); ++p) {
        const auto& ball = raster.ball(p);
        for (int corner = 0; corner < 8; ++corner) {
          const Eigen::Vector3f offset((corner & 1) ? 1.0f : -1.0f, (corner & 2) ? 1.0f : -1.0f,
                                       (corner & 4) ? 1.0f : -1.0f);
          const Eigen::Vector3f p_C = X_CB[p] * (ball.centre_B + ball.radius / std::sqrt(3.0f) * offset);
          const bool there = p_C.z() > 0.05f && !(things && hidden_[p] != 0);
          pixels.push_back(there ? project(camera_, p_C.cast<double>()) : Eigen::Vector2d(1e9, 1e9));
        }
      }
    };
    corners(*arm_, X_CA_, false);
    if (things_) corners(*things_, X_CT_, true);
  };
  const auto near = [&](const Eigen::Vector2d& pixel) {
    return pixel.x() > -0.5 * k.width && pixel.x() < 1.5 * k.width && pixel.y() > -0.5 * k.height &&
           pixel.y() < 1.5 * k.height;
  };
  pose(begin_s);
  look(before);
  Eigen::Matrix3d R_before = X_WC_.linear();
  double way_px = 0.0;
  std::vector<double> ways(before.size(), 0.0);
  for (const double t_s : {0.5 * (begin_s + end_s), end_s}) {
    pose(t_s);
    look(now);
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (near(now[i]) && near(before[i])) ways[i] += (now[i] - before[i]).norm();
    }
    way_px += rotation_distance(R_before, X_WC_.linear()) * k.fx;
    R_before = X_WC_.linear();
    before.swap(now);
  }
  const double smear = shutter.exposure_s / (end_s - begin_s);
  const auto step_px = [&](double way) { return std::max(kStep_px, kStepOfSmear * smear * way); };
  double steps = way_px / step_px(way_px);
  for (std::size_t i = 0; i < ways.size(); ++i) {
    steps = std::max(steps, ways[i] / (step_px(ways[i]) * (i < 8 * covers_ ? 1.0 : kThings)));
  }
  const int count = std::clamp(static_cast<int>(std::ceil(steps)), 1, kMostSlices);
  if (count == 1) return {{shutter.middle_s, begin_s - 1.0, end_s + 1.0, 0, rows}};
  const double step_s = (end_s - begin_s) / count;
  for (int i = 0; i < count; ++i) {
    Slice slice;
    slice.begin_s = begin_s + i * step_s;
    slice.end_s = i + 1 == count ? end_s + 1e-9 : slice.begin_s + step_s;
    slice.t_s = 0.5 * (slice.begin_s + slice.end_s);
    slice.v0 = 0;
    slice.v1 = rows;
    while (slice.v0 < rows && shutter.share(slice.v0, slice.begin_s, slice.end_s) <= 0.0f) ++slice.v0;
    while (slice.v1 > slice.v0 && shutter.share(slice.v1 - 1, slice.begin_s, slice.end_s) <= 0.0f) --slice.v1;
    if (slice.v1 > slice.v0) result.push_back(slice);
  }
  return result;
}

void Eye::draw(const Slice& slice, bool robot_too, bool new_shadow) {
  Lighting lighting;
  lighting.to_lamp_C = (X_WC_.linear().transpose() * studio_.settings.lamp_direction_W.normalized()).cast<float>();
  lighting.ambient = static_cast<float>(studio_.settings.ambient);
  lighting.diffuse = static_cast<float>(studio_.settings.diffuse);
  const auto extent = lens_->extent(slice.v0, slice.v1);
  Rasterizer::Cut cut{slice.v0, slice.v1, &extent, {}};
  std::vector<char> nothing;
  if (!robot_too) {
    nothing.assign(covers_, 1);
    cut.hidden = nothing;
  }
  arm_->draw_samples(X_CA_, camera_, lighting, static_cast<float>(studio_.robot->body().dilation_px), cut);
  if (things_) {
    cut.hidden = hidden_;
    things_->draw_samples(X_CT_, camera_, lighting, 0.0f, cut);
  }
  if (shadow_ && new_shadow) {
    for (std::size_t p = 0; p < covers_; ++p) {
      casters_[p] = X_W_[p].cast<float>();
      casters_hidden_[p] = robot_too ? 0 : 1;
    }
    for (std::size_t p = 0; p < X_WT_.size(); ++p) {
      casters_[covers_ + p] = X_WT_[p].cast<float>();
      casters_hidden_[covers_ + p] = hidden_[p] != 0 || studio_.things->shadowless()[p] != 0 ? 1 : 0;
    }
    shadow_->draw(casters_, casters_hidden_);
  }
}

void Eye::compose(const Slice& slice, const Shutter& shutter) {
  const int width = camera_.intrinsics.width;
  const int n = arm_->samples_per_pixel();
  const auto sample_width = static_cast<std::size_t>(width) * static_cast<std::size_t>(n);
  const float per_sample = 1.0f / static_cast<float>(n * n);
  const auto& arm_depth = arm_->inverse_depth();
  const auto& arm_weight = arm_->sample_weight();
  const auto arm_box = arm_->box();
  const auto things_box = things_ ? things_->box() : Rasterizer::Box{};
  const bool pictures = studio_.plan.output == Output::kPictures;
  const auto ambient = static_cast<float>(studio_.settings.ambient);
  const auto lamp_share = std::max(1e-3f, static_cast<float>(studio_.settings.diffuse));
  const Eigen::Matrix3f R_WC = X_WC_.linear().cast<float>();
  const Eigen::Vector3f p_WC = X_WC_.translation().cast<float>();
  const Eigen::Vector3f up_W = studio_.things
                                   ? Eigen::Vector3f(studio_.things->room().X_WK.linear().col(2).cast<float>())
                                   : Eigen::Vector3f::UnitZ();
  const auto pixel = 1.0f / static_cast<float>(camera_.intrinsics.fx);

  /// What the samples of a pixel that show one kind of thing add up to.
  struct Sum {
    float weight = 0.0f, depth = 0.0f;                   // of samples; 1 / depth
    Eigen::Vector3f paint = Eigen::Vector3f::Zero();     // albedo
    Eigen::Vector3f lit = Eigen::Vector3f::Zero();       // albedo * shade
    float gloss = 0.0f, shine = 0.0f, sharpness = 0.0f;  // weighted by gloss
    float table = 0.0f, table_shade = 0.0f;
    float shade = 0.0f;

    void add(const Paint& p, float w, float s, float cosine) {
      weight += w;
      shade += w * s;
      if (p.table) {
        table += w;
        table_shade += w * s;
      } else {
        paint += w * p.albedo;
        lit += w * s * p.albedo;
      }
      if (p.gloss > 0.0f) {
        gloss += w * p.gloss;
        shine += w * p.gloss * cosine;
        sharpness += w * p.gloss * p.sharpness;
      }
    }
  };
  const auto colour_of = [&](Sum& sum, int u, int v) -> Eigen::Vector3f {
    const Eigen::Vector3f& ray_C = lens_->ray(u, v);
    const float depth = sum.weight / sum.depth;
    const Eigen::Vector3f ray_W = R_WC * ray_C;
    const float length = depth / ray_C.z();
    const Eigen::Vector3f p_W = p_WC + length * ray_W;
    const float lamp = shadow_ ? shadow_->lit(p_W, (sum.shade / sum.weight - ambient) / lamp_share) : 1.0f;
    if (sum.table > 0.0f) {
      const float footprint = length * pixel / std::sqrt(std::max(0.05f, std::abs(ray_W.dot(up_W))));
      const Eigen::Vector3f albedo = studio_.kitchen->table_albedo(p_W, footprint);
      sum.paint += sum.table * albedo;
      sum.lit += sum.table_shade * albedo;
    }
    Eigen::Vector3f colour = ambient * sum.paint + lamp * (sum.lit - ambient * sum.paint);
    if (sum.gloss > 0.0f && lamp > 0.0f) {
      const float cosine = std::clamp(sum.shine / sum.gloss, 0.0f, 1.0f);
      const float highlight = lamp * sum.gloss * std::pow(cosine, sum.sharpness / sum.gloss);
      colour += highlight * Eigen::Vector3f::Ones();
    }
    return 255.0f * per_sample * colour;
  };

  for (int v = slice.v0; v < slice.v1; ++v) {
    const float share = shutter.share(v, slice.begin_s, slice.end_s);
    if (share <= 0.0f) continue;
    for (int u = 0; u < width; ++u) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      const auto in = [&](const Rasterizer::Box& box) {
        return u >= box.u0 && u < box.u1 && v >= box.v0 && v < box.v1;
      };
      const bool arm_here = in(arm_box), things_here = in(things_box);
      Sum arm, thing;
      if (arm_here || things_here) {
        for (int t = v * n; t < (v + 1) * n; ++t) {
          std::size_t s =
              static_cast<std::size_t>(t) * sample_width + static_cast<std::size_t>(u) * static_cast<std::size_t>(n);
          for (const std::size_t end = s + static_cast<std::size_t>(n); s < end; ++s) {
            const float near_arm = arm_here ? arm_depth[s] : 0.0f;
            const float near_thing = things_here ? things_->inverse_depth()[s] : 0.0f;
            const float weight = near_arm <= 0.0f ? 0.0f : arm_weight.empty() ? 1.0f : arm_weight[s];
            there_[i] += share * per_sample * weight;
            const bool arm_seen = weight > 0.0f && near_arm >= near_thing;
            if (arm_seen) {
              seen_[i] += share * per_sample * weight;
              if (n % 2 == 1 && t == v * n + n / 2 && s + static_cast<std::size_t>(n - n / 2) == end &&
                  weight >= 0.5f) {
                middle_[i] += share;
              }
            }
            if (!pictures) continue;
            if (arm_seen) {
              arm.depth += weight * near_arm;
              const Paint& paint = arm_->paints()[arm_->paint_index()[s]];
              arm.add(paint, weight, arm_->shade()[s], paint.gloss > 0.0f ? arm_->shine()[s] : 0.0f);
            }
            if (near_thing > 0.0f && (!arm_seen || weight < 1.0f)) {
              const float rest = arm_seen ? 1.0f - weight : 1.0f;
              thing.depth += rest * near_thing;
              const Paint& paint = things_->paints()[things_->paint_index()[s]];
              thing.add(paint, rest, things_->shade()[s], paint.gloss > 0.0f ? things_->shine()[s] : 0.0f);
            }
          }
        }
      }
      if (!pictures) continue;
      const float covered = per_sample * (arm.weight + thing.weight);
      Eigen::Vector3f colour = (1.0f - covered) * Eigen::Map<const Eigen::Vector3f>(room_.data() + 3 * i);
      if (arm.weight > 0.0f) colour += colour_of(arm, u, v);
      if (thing.weight > 0.0f) colour += colour_of(thing, u, v);
      Eigen::Map<Eigen::Vector3f>(light_.data() + 3 * i) += share * colour;
    }
  }
}

void Eye::shoot_scene(const Shutter& shutter, CameraTruth& truth, CameraFrame& frame) {
  const int width = camera_.intrinsics.width;
  const int height = camera_.intrinsics.height;
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const bool pictures = studio_.plan.output == Output::kPictures;
  seen_.assign(pixels, 0.0f);
  there_.assign(pixels, 0.0f);
  middle_.assign(pixels, 0.0f);
  if (pictures) light_.assign(3 * pixels, 0.0f);
  int number = 0;
  for (const Slice& slice : slices(shutter)) {
    pose(slice.t_s);
    draw(slice, true, number++ % kSlicesPerShadow == 0);
    if (pictures) paint_room(slice.v0, slice.v1);
    compose(slice, shutter);
  }
  frame.coverage.resize(pixels);
  frame.silhouette = BinaryMask(width, height);
  const auto& decides = arm_->samples_per_pixel() % 2 == 1 ? middle_ : seen_;
  double seen = 0.0, there = 0.0;
  for (std::size_t i = 0; i < pixels; ++i) {
    frame.coverage[i] = static_cast<std::uint8_t>(255.0f * std::min(1.0f, seen_[i]) + 0.5f);
    if (decides[i] >= 0.5f) frame.silhouette.set(static_cast<int>(i) % width, static_cast<int>(i) / width);
    seen += static_cast<double>(seen_[i]);
    there += static_cast<double>(there_[i]);
  }
  truth.visible_share = seen / static_cast<double>(pixels);
  truth.hidden_share = there > 0.0 ? 1.0 - seen / there : 0.0;
}

void Eye::finish(const Shutter& shutter, int index, CameraFrame& frame) {
  const SimulatorSettings& settings = studio_.settings;
  const bool drifts = settings.light_drift != 0.0 || settings.colour_drift != 0.0;
  if (drifts || settings.flicker > 0.0) {
    const double span_s = std::max(1e-3, studio_.motion_end_s - studio_.motion_begin_s);
    const auto row = 3 * static_cast<std::size_t>(camera_.intrinsics.width);
    double jump = 1.0;
    if (settings.flicker > 0.0 && settings.flicker_hz <= 0.0) {
      Random random(studio_.plan.seed, index_ == 0 ? "left flicker" : "right flicker",
                    static_cast<std::uint64_t>(index));
      jump += settings.flicker * std::clamp(random.normal(), -3.0, 3.0);
    }
    for (int v = 0; v < shutter.rows; ++v) {
      const double t = shutter.row_middle_s(v);
      const double way = std::clamp((t - studio_.motion_begin_s) / span_s, 0.0, 1.0);
      double gain = jump * (1.0 + settings.light_drift * way);
      if (settings.flicker > 0.0 && settings.flicker_hz > 0.0) {
        // A row sees the mean of the lamp over its exposure.
        const double omega = 2.0 * kPi * settings.flicker_hz;
        const double half = 0.5 * omega * shutter.exposure_s;
        gain *= 1.0 + settings.flicker * std::sin(omega * t) * (half > 1e-9 ? std::sin(half) / half : 1.0);
      }
      const std::array<float, 3> gains = {static_cast<float>(gain * (1.0 + settings.colour_drift * way)),
                                          static_cast<float>(gain),
                                          static_cast<float>(gain * (1.0 - settings.colour_drift * way))};
      float* p = light_.data() + static_cast<std::size_t>(v) * row;
      for (std::size_t i = 0; i < row; ++i) p[i] *= gains[i % 3];
    }
  }
  const double exposure =
      1.0 + settings.exposure_swing * std::sin(2.0 * kPi * shutter.middle_s / settings.exposure_period_s);
  Random noise(studio_.plan.seed, index_ == 0 ? "left image noise" : "right image noise",
               static_cast<std::uint64_t>(index));
  sensor_->expose(light_, exposure, noise, frame.image);
  if (settings.jpeg_quality > 0) {
    auto message = to_jpeg_message(frame.image, 0, settings.jpeg_quality);
    frame.jpeg = std::move(message.data);
    ImageView view;
    view.width = message.width;
    view.height = message.height;
    view.pixelformat = message.pixelformat;
    view.data = frame.jpeg;
    if (const auto result = unpack(view, frame.image); !result.ok()) throw DataError("JPEG: " + result.detail);
  }
}

Image Eye::room() {
  pose(0.0);
  const int height = camera_.intrinsics.height;
  if (things_) {
    for (std::size_t p = 0; p < hidden_.size(); ++p) hidden_[p] = studio_.things->furniture()[p] != 0 ? 0 : 1;
  }
  const auto pixels = static_cast<std::size_t>(camera_.intrinsics.width) * static_cast<std::size_t>(height);
  seen_.assign(pixels, 0.0f);
  there_.assign(pixels, 0.0f);
  middle_.assign(pixels, 0.0f);
  light_.assign(3 * pixels, 0.0f);
  const Slice whole{0.0, -1.0, 1.0, 0, height};
  paint_room(0, height);
  draw(whole, false, true);
  compose(whole, {0.0, 0.0, 0.0, height});
  Image image;
  Random unused(0, "");
  ImageSensor(camera_.intrinsics.width, height, studio_.settings.blur_px, 0.0).expose(light_, 1.0, unused, image);
  return image;
}

}  // namespace bodyschema::simulator
