#include "bodyschema/calibration/camera_search.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/filter/hammoude.hpp"
#include "bodyschema/outline/robot_projection.hpp"
#include "bodyschema/search/simplified_mesh.hpp"
#include "bodyschema/search/search_level.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kPostures = 6;        ///< that are looked at
constexpr std::size_t kFewestPictured = 3;  ///< fewer leave the distance open
constexpr int kWidth_px = 128;              ///< pictures are looked at about this large
constexpr int kDirections = 160, kRolls = 12;
constexpr std::size_t kSeeds = 30;  ///< places that are moved
constexpr int kRounds = 14, kSamples = 48, kElite = 8;

/// A mask at a fraction of its size: pixels that are robot by more than half.
BinaryMask shrunk(const BinaryMask& mask, int factor) {
  BinaryMask small(mask.width() / factor, mask.height() / factor);
  for (int v = 0; v < small.height(); ++v) {
    for (int u = 0; u < small.width(); ++u) {
      int covered = 0;
      for (int dv = 0; dv < factor; ++dv) {
        for (int du = 0; du < factor; ++du) covered += mask.at(u * factor + du, v * factor + dv);
      }
      if (2 * covered > factor * factor) small.set(u, v);
    }
  }
  return small;
}

/// Where a mask's middle lies, and how much of it there is.
struct Blob {
  Eigen::Vector2d ray = Eigen::Vector2d::Zero();  ///< of its centroid, z = 1
  double area = 0.0;                              ///< in squared ray units
  double at_border = 0.0;                         ///< share of the picture's border that it covers
};

Blob blob_of(const BinaryMask& mask, const PinholeIntrinsics& k) {
  Blob blob;
  double n = 0.0, border = 0.0, covered = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      const bool edge = u == 0 || v == 0 || u + 1 == mask.width() || v + 1 == mask.height();
      border += edge;
      if (!mask.at(u, v)) continue;
      covered += edge;
      sum += Eigen::Vector2d((u - k.cx) / k.fx, (v - k.cy) / k.fy);
      n += 1.0;
    }
  }
  if (n <= 0.0) return blob;
  blob.ray = sum / n;
  blob.area = n / (k.fx * k.fy);
  blob.at_border = covered / border;
  return blob;
}

/// Even directions on a sphere (Fibonacci lattice).
Eigen::Vector3d direction(int i, int n) {
  const double z = 1.0 - (2.0 * i + 1.0) / n, r = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double angle = i * kPi * (3.0 - std::sqrt(5.0));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// A camera that looks along `forward`, rolled about it.
Eigen::Matrix3d looking(const Eigen::Vector3d& forward, double roll) {
  const Eigen::Vector3d other = std::abs(forward.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  Eigen::Matrix3d R_PC;
  R_PC.col(2) = forward;
  R_PC.col(0) = forward.cross(other).normalized();  // with z up: x to the right
  R_PC.col(1) = R_PC.col(2).cross(R_PC.col(0));
  return R_PC * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

class CameraSearch {
 public:
  CameraSearch(PictureLog& log, int threads) : log_(log), threads_(threads) {}

  std::vector<CameraPlace> find(std::size_t camera, std::size_t most) {
    if (!prepare(camera)) return {};
    const Eigen::Vector3d middle = middle_of_postures();
    std::vector<CameraPlace> places;
    for (int d = 0; d < kDirections; ++d) {
      for (int r = 0; r < kRolls; ++r) {
        const auto R_PC = looking(direction(d, kDirections), 2.0 * kPi * r / kRolls);
        const auto place = placed(R_PC);
        if (!place) continue;
        // The surface that shows is a guess: nearer and further, too.
        for (const double further : {0.75, 1.0, 1.35}) {
          auto moved = *place;
          moved.X_PC.translation() = middle + further * (place->X_PC.translation() - middle);
          places.push_back(moved);
        }
      }
    }
    score(places);
    sort(places);
    auto seeds = distinct(places, kSeeds);
    for (std::size_t i = 0; i < seeds.size(); ++i) seeds[i] = narrowed(seeds[i], i);
    sort(seeds);
    return distinct(seeds, most);
  }

 private:
  /// What is known of one posture.
  struct Posture {
    std::vector<Pose> X_PB;  ///< parts in the frame that carries the camera
    Eigen::Vector3d centre_P;
    double surface = 0.0;  ///< m^2
    Blob blob;
  };

  /// The pictures of a camera that differ most in posture.
  [[nodiscard]] std::vector<std::size_t> chosen(std::size_t camera) const {
    std::vector<std::size_t> all, chosen;
    const auto pictures = log_.pictures();
    for (std::size_t p = 0; p < pictures.size(); ++p) {
      if (pictures[p].camera == camera && pictures[p].mask.count() > 0) all.push_back(p);
    }
    while (!all.empty() && chosen.size() < kPostures) {
      std::size_t best = 0;
      double furthest = -1.0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        double nearest = 1e9;
        for (const auto p : chosen) {
          nearest = std::min(nearest, (pictures[all[i]].joints.q - pictures[p].joints.q).cwiseAbs().maxCoeff());
        }
        if (nearest <= furthest) continue;
        furthest = nearest;
        best = i;
      }
      constexpr double kSame_rad = 0.05;
      if (furthest < kSame_rad) break;
      chosen.push_back(all[best]);
      all.erase(all.begin() + static_cast<std::ptrdiff_t>(best));
    }
    return chosen;
  }

  /// What the masks show of the robot, as fine as small pictures need it.
  [[nodiscard]] SilhouetteModel shown_model(const PinholeIntrinsics& small) const {
    SilhouetteModel all = silhouette_model(*log_.robot(), log_.setup()), model;
    model.culling = all.culling;
    const auto shown = log_.parts_shown();
    for (std::size_t b = 0; b < all.parts.size(); ++b) {
      if (shown[b]) model.parts.push_back(std::move(all.parts[b]));
    }
    const double bound_m = search_mesh_bound_m(model, std::vector{small});
    for (auto& part : model.parts) part = simplified_mesh(part, bound_m);
    return model;
  }

  bool prepare(std::size_t camera) {
    const auto pictures = chosen(camera);
    if (pictures.size() < kFewestPictured) return false;
    const auto& rig = log_.rig();
    const auto& k = rig.cameras[camera].intrinsics;
    const int factor = std::max(1, k.width / kWidth_px);
    const PinholeIntrinsics small = reduced(k, factor);
    std::vector<std::string> links;
    const auto shown = log_.parts_shown();
    for (std::size_t b = 0; b < shown.size(); ++b) {
      if (shown[b]) links.push_back(log_.setup().model.rendered_links[b]);
    }
    if (links.empty()) return false;
    links.push_back(rig.cameras[camera].link);
    ForwardKinematics kinematics(log_.robot(), links);
    std::vector<Pose> X_WB(links.size());
    const SilhouetteModel model = shown_model(small);
    std::vector<ObservedSilhouette> observed;
    postures_.clear();
    for (const auto p : pictures) {
      const auto& picture = log_.pictures()[p];
      kinematics.compute(picture.joints.q, X_WB);
      Posture posture;
      const Pose X_PW = X_WB.back().inverse(Eigen::Isometry);
      for (std::size_t b = 0; b + 1 < X_WB.size(); ++b) posture.X_PB.push_back(X_PW * X_WB[b]);
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::size_t b = 0; b < model.parts.size(); ++b) {
        const auto& mesh = model.parts[b];
        for (const auto& t : mesh.triangles) {
          const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), c = mesh.vertices[t[1]].cast<double>(),
                                d = mesh.vertices[t[2]].cast<double>();
          const double area = 0.5 * (c - a).cross(d - a).norm();
          sum += area * (posture.X_PB[b] * ((a + c + d) / 3.0));
          posture.surface += area;
        }
      }
      posture.centre_P = sum / std::max(1e-12, posture.surface);
      BinaryMask mask = shrunk(picture.mask, factor);
      posture.blob = blob_of(mask, small);
      observed.push_back({std::move(mask), picture.valid.empty() ? BinaryMask() : shrunk(picture.valid, factor)});
      postures_.push_back(std::move(posture));
    }
    // Every posture is a camera of its own to the scorer: all are scored at once.
    const std::vector<PinholeIntrinsics> cameras(postures_.size(), small);
    SilhouetteOptions options;
    options.engine = "contour";
    options.threads = threads_;
    scorer_ = make_silhouette_scorer(model, cameras, options);
    scorer_->set_observation(observed);
    return true;
  }

  void score(std::vector<CameraPlace>& places) {
    const std::size_t parts = postures_.front().X_PB.size(), n = postures_.size();
    X_CB_.resize(places.size() * n * parts);
    counts_.resize(places.size() * n);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Pose X_CP = places[i].X_PC.inverse(Eigen::Isometry);
      for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t b = 0; b < parts; ++b) {
          X_CB_[(i * n + p) * parts + b] = (X_CP * postures_[p].X_PB[b]).cast<float>();
        }
      }
    }
    scorer_->score(X_CB_, counts_);
    for (std::size_t i = 0; i < places.size(); ++i) {
      double sum = 0.0;
      for (std::size_t p = 0; p < n; ++p) {
        const auto& c = counts_[i * n + p];
        sum += hammoude_distance(c.union_count(), c.intersection);
      }
      places[i].distance = sum / static_cast<double>(n);
    }
  }

  /// Where a camera of this orientation sees the robot's middle where the masks have theirs, as large as they are.
  [[nodiscard]] std::optional<CameraPlace> placed(const Eigen::Matrix3d& R_PC) const {
    Eigen::Matrix3d H = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    const auto add = [&](const Eigen::Vector3d& row, double value, double weight) {
      H += weight * row * row.transpose();
      g += weight * value * row;
    };
    for (const auto& posture : postures_) {
      const Eigen::Vector3d c = R_PC.transpose() * posture.centre_P;
      const Eigen::Vector2d& m = posture.blob.ray;
      // A mask that leaves the picture has its middle elsewhere, and more of it is outside.
      const double whole = std::max(0.1, 1.0 - 4.0 * posture.blob.at_border);
      add({1.0, 0.0, -m.x()}, m.x() * c.z() - c.x(), whole);
      add({0.0, 1.0, -m.y()}, m.y() * c.z() - c.y(), whole);
      // A convex body shows a quarter of its surface on average (Cauchy).
      const double depth = std::sqrt(0.25 * posture.surface / std::max(1e-9, posture.blob.area));
      add({0.0, 0.0, 1.0}, depth - c.z(), 0.05 * whole);
    }
    const Eigen::Vector3d t = H.ldlt().solve(g);  // p_C = R_CP p_P + t
    for (const auto& posture : postures_) {
      if ((R_PC.transpose() * posture.centre_P + t).z() < 0.05) return std::nullopt;
    }
    CameraPlace place;
    place.X_PC.linear() = R_PC;
    place.X_PC.translation() = -(R_PC * t);
    return place;
  }

  static void sort(std::vector<CameraPlace>& places) {
    std::stable_sort(places.begin(), places.end(),
                     [](const auto& a, const auto& b) { return a.distance < b.distance; });
  }

  [[nodiscard]] static bool alike(const CameraPlace& a, const CameraPlace& b) {
    constexpr double kAngle_rad = 0.17, kShare = 0.15;
    const double reach = std::max(0.2, a.X_PC.translation().norm());
    return rotation_distance(a.X_PC.linear(), b.X_PC.linear()) < kAngle_rad &&
           (a.X_PC.translation() - b.X_PC.translation()).norm() < kShare * reach;
  }

  /// The first ones of a list that are not alike.
  [[nodiscard]] static std::vector<CameraPlace> distinct(const std::vector<CameraPlace>& places, std::size_t most) {
    std::vector<CameraPlace> list;
    for (const auto& place : places) {
      if (list.size() >= most) break;
      const bool known = std::any_of(list.begin(), list.end(), [&](const auto& other) { return alike(other, place); });
      if (!known) list.push_back(place);
    }
    return list;
  }

  [[nodiscard]] Eigen::Vector3d middle_of_postures() const {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto& posture : postures_) middle += posture.centre_P / static_cast<double>(postures_.size());
    return middle;
  }

  /// Moved until silhouettes agree best: random places about the best ones so far, ever nearer.
  [[nodiscard]] CameraPlace narrowed(const CameraPlace& start, std::size_t seed) {
    std::mt19937_64 random(seed + 1);
    std::normal_distribution<double> normal;
    const Eigen::Vector3d middle = middle_of_postures();
    std::vector<CameraPlace> elite = {start};
    double turn = 0.25, shift = 0.2;  // rad; share of the distance
    for (int round = 0; round < kRounds; ++round) {
      std::vector<CameraPlace> places = elite;
      while (static_cast<int>(places.size()) < kSamples) {
        CameraPlace place = elite[static_cast<std::size_t>(random() % elite.size())];
        const double reach = (place.X_PC.translation() - middle).norm();
        Eigen::Vector3d w, s;
        for (int k = 0; k < 3; ++k) {
          w[k] = turn * normal(random);
          s[k] = shift * reach * normal(random);
        }
        // About the robot's middle, so that it stays in view.
        const Eigen::Matrix3d R = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
        place.X_PC.translation() = middle + R * (place.X_PC.translation() - middle) + 0.3 * s;
        place.X_PC.linear() = R * place.X_PC.linear();
        // ... and along the line of sight, where it is known least.
        place.X_PC.translation() += place.X_PC.linear().col(2) * s.z();
        Eigen::Vector3d v;
        for (int k = 0; k < 3; ++k) v[k] = 0.3 * turn * normal(random);
        place.X_PC.linear() = place.X_PC.linear() * Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix();
        places.push_back(place);
      }
      score(places);
      sort(places);
      places.resize(kElite);
      elite = std::move(places);
      turn *= 0.75;
      shift *= 0.75;
    }
    return elite.front();
  }

  PictureLog& log_;
  int threads_;
  std::vector<Posture> postures_;
  std::unique_ptr<SilhouetteScorer> scorer_;
  std::vector<Eigen::Isometry3f> X_CB_;
  std::vector<SilhouetteCounts> counts_;
};

}  // namespace

std::vector<CameraPlace> find_camera(PictureLog& log, std::size_t camera, std::size_t most, int threads) {
  return CameraSearch(log, threads).find(camera, most);
}

}  // namespace bodyschema
