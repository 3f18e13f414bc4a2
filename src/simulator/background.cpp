#include "bodyschema/simulator/background.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/simulator/random.hpp"
#include "texture.hpp"

namespace bodyschema::simulator {
namespace {

/// The room: a sphere around the robot's root. Its finite size gives the two eyes parallax.
constexpr float kRoomRadius_m = 1.6f;

struct FaceAxes {
  Eigen::Vector3f forward, right, down;
};

const std::array<FaceAxes, 6>& face_axes() {
  static const std::array<FaceAxes, 6> axes = [] {
    std::array<FaceAxes, 6> result;
    for (int f = 0; f < 6; ++f) {
      const int axis = f / 2;
      auto& a = result[static_cast<std::size_t>(f)];
      a.forward = Eigen::Vector3f::Unit(axis) * (f % 2 == 0 ? 1.0f : -1.0f);
      a.right = Eigen::Vector3f::Unit((axis + 1) % 3);
      a.down = Eigen::Vector3f::Unit((axis + 2) % 3);
    }
    return result;
  }();
  return axes;
}

enum class Pattern { kPlain, kStripes, kChecks, kSpeckle, kGradient };

struct Shape {
  Eigen::Vector3f centre, right, down;  // on the unit sphere, tangent axes
  float half_width, half_height;        // tangent of the half angle
  bool ellipse;
  Pattern fill;
  float pitch;
  std::uint32_t salt;
  Eigen::Vector3f first, second;

  /// The colour where the direction meets the shape; false outside.
  bool colour(const Eigen::Vector3f& direction, Eigen::Vector3f& out) const {
    const float z = direction.dot(centre);
    if (z <= 0.1f) return false;
    const float x = direction.dot(right) / z;
    const float y = direction.dot(down) / z;
    const float ax = x / half_width;
    const float ay = y / half_height;
    if (ellipse ? ax * ax + ay * ay > 1.0f : (std::abs(ax) > 1.0f || std::abs(ay) > 1.0f)) return false;
    float mix = 0.0f;
    switch (fill) {
      case Pattern::kPlain: break;
      case Pattern::kStripes: mix = std::sin(x / pitch * 6.2831853f) > 0.0f ? 1.0f : 0.0f; break;
      case Pattern::kChecks:
        mix =
            (static_cast<int>(std::floor(x / pitch)) + static_cast<int>(std::floor(y / pitch))) % 2 == 0 ? 1.0f : 0.0f;
        break;
      case Pattern::kSpeckle: mix = value_noise(x / pitch * 3.0f, y / pitch * 3.0f, salt); break;
      case Pattern::kGradient: mix = 0.5f + 0.5f * ay; break;
    }
    out = first + mix * (second - first);
    return true;
  }
};

}  // namespace

Background Background::single_colour(const Eigen::Vector3f& colour, float unevenness, std::uint64_t seed) {
  Background b;
  b.flat_ = true;
  b.flat_colour_ = colour;
  b.unevenness_ = unevenness;
  Random random(seed, "background light");
  for (std::size_t k = 0; k < 3; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      b.waves_[k][axis] = static_cast<float>(random.uniform(-3.0, 3.0));
    }
    b.phases_[k] = static_cast<float>(random.uniform(0.0, 2.0 * kPi));
  }
  return b;
}

Background Background::clutter(const std::vector<Eigen::Vector3f>& near_colours, std::uint64_t seed) {
  Background b;
  Random random(seed, "background clutter");
  const auto colour = [&]() -> Eigen::Vector3f {
    if (!near_colours.empty() && random.uniform() < 0.35) {
      const Eigen::Vector3f base = near_colours[random.below(near_colours.size())];
      const auto light = static_cast<float>(random.uniform(0.5, 1.0));
      Eigen::Vector3f c = base * light;
      for (int k = 0; k < 3; ++k) c[k] += static_cast<float>(random.uniform(-15.0, 15.0));
      return c.cwiseMax(5.0f).cwiseMin(250.0f);
    }
    return {static_cast<float>(random.uniform(15.0, 240.0)), static_cast<float>(random.uniform(15.0, 240.0)),
            static_cast<float>(random.uniform(15.0, 240.0))};
  };
  const auto direction = [&] {
    Eigen::Vector3f d;
    for (int k = 0; k < 3; ++k) d[k] = static_cast<float>(random.normal());
    return Eigen::Vector3f(d.normalized());
  };

  std::vector<Shape> shapes;
  for (int n = 0; n < 420; ++n) {
    Shape s;
    s.centre = direction();
    s.right = s.centre.unitOrthogonal();
    s.down = s.centre.cross(s.right);
    const float scale = n < 120 ? 1.0f : 0.4f;  // large things first, small ones in front
    s.half_width = scale * static_cast<float>(random.uniform(0.05, 0.40));
    s.half_height = scale * static_cast<float>(random.uniform(0.05, 0.40));
    s.ellipse = random.uniform() < 0.35;
    s.fill = static_cast<Pattern>(random.below(5));
    s.pitch = static_cast<float>(random.uniform(0.015, 0.10));
    s.salt = static_cast<std::uint32_t>(random.bits());
    s.first = colour();
    s.second = colour();
    shapes.push_back(s);
  }
  const Eigen::Vector3f floor = colour();
  const Eigen::Vector3f ceiling = colour();
  const auto salt = static_cast<std::uint32_t>(random.bits());

  const auto texels = static_cast<std::size_t>(kFaceSize) * kFaceSize;
  b.faces_.resize(6 * texels * 3);
  for (std::size_t f = 0; f < 6; ++f) {
    const FaceAxes& axes = face_axes()[f];
    const auto direction_of = [&](int column, int row) {
      const float x = (static_cast<float>(column) + 0.5f) / kFaceSize * 2.0f - 1.0f;
      const float y = (static_cast<float>(row) + 0.5f) / kFaceSize * 2.0f - 1.0f;
      return Eigen::Vector3f((axes.forward + x * axes.right + y * axes.down).normalized());
    };
    float* const face = b.faces_.data() + f * texels * 3;
    for (int row = 0; row < kFaceSize; ++row) {
      for (int column = 0; column < kFaceSize; ++column) {
        const Eigen::Vector3f d = direction_of(column, row);
        const float mottle = 0.85f + 0.3f * value_noise(d.x() * 9.0f + d.z() * 5.0f, d.y() * 9.0f - d.z() * 4.0f, salt);
        const Eigen::Vector3f c = (floor + (0.5f + 0.5f * d.z()) * (ceiling - floor)) * mottle;
        Eigen::Map<Eigen::Vector3f>(face + 3 * (row * kFaceSize + column)) = c;
      }
    }
    for (const Shape& shape : shapes) {
      // The shape's corners bound its texels while they lie before this face; else search it all.
      float x0 = 1.0f, x1 = -1.0f, y0 = 1.0f, y1 = -1.0f;
      bool before = true;
      bool any_before = false;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector3f corner = shape.centre + ((k & 1) ? 1.0f : -1.0f) * shape.half_width * shape.right +
                                       ((k & 2) ? 1.0f : -1.0f) * shape.half_height * shape.down;
        const float z = corner.dot(axes.forward);
        any_before |= z > 0.0f;
        if (z < 0.05f) {
          before = false;
          continue;
        }
        x0 = std::min(x0, corner.dot(axes.right) / z);
        x1 = std::max(x1, corner.dot(axes.right) / z);
        y0 = std::min(y0, corner.dot(axes.down) / z);
        y1 = std::max(y1, corner.dot(axes.down) / z);
      }
      if (!any_before) continue;
      if (!before) x0 = y0 = -1.0f, x1 = y1 = 1.0f;
      const auto texel = [](float x) {
        return std::clamp(static_cast<int>(std::floor((std::clamp(x, -1.5f, 1.5f) + 1.0f) * 0.5f * kFaceSize)), -1,
                          kFaceSize);
      };
      const int column0 = std::max(0, texel(x0) - 1), column1 = std::min(kFaceSize - 1, texel(x1) + 1);
      const int row0 = std::max(0, texel(y0) - 1), row1 = std::min(kFaceSize - 1, texel(y1) + 1);
      for (int row = row0; row <= row1; ++row) {
        for (int column = column0; column <= column1; ++column) {
          Eigen::Vector3f c;
          if (shape.colour(direction_of(column, row), c)) {
            Eigen::Map<Eigen::Vector3f>(face + 3 * (row * kFaceSize + column)) = c;
          }
        }
      }
    }
  }
  return b;
}

Eigen::Vector3f Background::look_up(const Eigen::Vector3f& direction) const {
  if (flat_) {
    float light = 0.0f;
    for (std::size_t k = 0; k < 3; ++k) light += std::sin(waves_[k].dot(direction) + phases_[k]);
    return flat_colour_ * (1.0f + unevenness_ * light / 3.0f);
  }
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const auto face_index = static_cast<std::size_t>(2 * axis + (direction[axis] < 0.0f ? 1 : 0));
  const float scale = 1.0f / std::abs(direction[axis]);
  const float x = (direction[(axis + 1) % 3] * scale + 1.0f) * 0.5f * kFaceSize - 0.5f;
  const float y = (direction[(axis + 2) % 3] * scale + 1.0f) * 0.5f * kFaceSize - 0.5f;
  const int column = std::clamp(static_cast<int>(std::floor(x)), 0, kFaceSize - 2);
  const int row = std::clamp(static_cast<int>(std::floor(y)), 0, kFaceSize - 2);
  const float ax = std::clamp(x - static_cast<float>(column), 0.0f, 1.0f);
  const float ay = std::clamp(y - static_cast<float>(row), 0.0f, 1.0f);
  const float* texel = faces_.data() + (face_index * kFaceSize * kFaceSize + static_cast<std::size_t>(row) * kFaceSize +
                                        static_cast<std::size_t>(column)) *
                                           3;
  using Colour = Eigen::Map<const Eigen::Vector3f>;
  return (1 - ay) * ((1 - ax) * Colour(texel) + ax * Colour(texel + 3)) +
         ay * ((1 - ax) * Colour(texel + 3 * kFaceSize) + ax * Colour(texel + 3 * kFaceSize + 3));
}

void Background::paint(const Lens& lens, const Pose& X_WC, int v0, int v1, std::vector<float>& picture) const {
  const auto& k = lens.camera().intrinsics;
  picture.resize(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height) * 3);
  const Eigen::Matrix3f R_WC = X_WC.linear().cast<float>();
  const Eigen::Vector3f p_WC = X_WC.translation().cast<float>();
  const float free = kRoomRadius_m * kRoomRadius_m - p_WC.squaredNorm();
  const bool inside = free > 0.0f;
  float* out = picture.data() + static_cast<std::size_t>(v0) * static_cast<std::size_t>(k.width) * 3;
  for (int v = v0; v < v1; ++v) {
    for (int u = 0; u < k.width; ++u, out += 3) {
      Eigen::Vector3f direction = R_WC * lens.ray(u, v);
      if (inside) {
        // Where the ray meets the sphere around the root.
        const float along = p_WC.dot(direction);
        direction = p_WC + (std::sqrt(along * along + free) - along) * direction;
      }
      const Eigen::Vector3f colour = look_up(direction.normalized());
      std::copy_n(colour.data(), 3, out);
    }
  }
}

void Background::paint(const CameraModel& camera, const Pose& X_WC, std::vector<float>& picture) const {
  paint(Lens(camera), X_WC, 0, camera.intrinsics.height, picture);
}

}  // namespace bodyschema::simulator
