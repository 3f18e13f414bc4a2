#include "bodyschema/simulator/kitchen.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/simulator/random.hpp"
#include "texture.hpp"

namespace bodyschema::simulator {
namespace {

using Fill = Texture::Fill;

constexpr float kBack_x = -1.9f;
constexpr float kSide_y = 2.1f;
constexpr float kHeight = 2.6f;  // of the room
constexpr float kWallTexel_m = 0.004f;
constexpr float kTableTexel_m = 0.0015f;
constexpr float kCounter_m = 0.88f;

/// Colours as they are met indoors: much white, grey and wood, some strong ones, a share close to the robot's own.
/// Whoever draws several numbers in one expression does so within braces: there the order is the language's, not the
/// compiler's.
class Palette {
 public:
  Palette(const std::vector<Eigen::Vector3f>& near_colours, std::uint64_t seed)
      : near_(near_colours), random_(seed, "kitchen") {}

  float number(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }
  bool chance(double p) { return random_.uniform() < p; }
  std::size_t below(std::size_t n) { return random_.below(n); }
  std::uint32_t salt() { return static_cast<std::uint32_t>(random_.bits()); }

  Eigen::Vector3f pale() {
    const float level = number(165, 235);
    return level * Eigen::Vector3f::Ones() + Eigen::Vector3f{number(-8, 8), number(-8, 8), number(-18, 8)};
  }
  Eigen::Vector3f wood() {
    const float level = number(0.5, 1.25);
    return level * Eigen::Vector3f{number(130, 160), number(92, 112), number(58, 76)};
  }
  Eigen::Vector3f dark() {
    const float level = number(25, 70);
    return level * Eigen::Vector3f::Ones() + Eigen::Vector3f{number(-6, 6), number(-6, 6), number(-6, 6)};
  }
  Eigen::Vector3f strong() {
    // Hue around the circle, well away from grey.
    const float hue = number(0, 6);
    const auto channel = [&](float shift) {
      const float h = std::fmod(hue + shift, 6.0f);
      return std::clamp(std::abs(h - 3.0f) - 1.0f, 0.0f, 1.0f);
    };
    const float value = number(90, 235);
    const float paleness = number(0.05, 0.5);
    return value * (paleness * Eigen::Vector3f::Ones() +
                    (1.0f - paleness) * Eigen::Vector3f(channel(0), channel(4), channel(2)));
  }
  Eigen::Vector3f any() {
    const double p = random_.uniform();
    if (p < 0.25 && !near_.empty()) {
      const Eigen::Vector3f base = near_[random_.below(near_.size())];
      const float light = number(0.6, 1.0);
      const Eigen::Vector3f off{number(-12, 12), number(-12, 12), number(-12, 12)};
      return (light * base + off).cwiseMax(5.0f).cwiseMin(250.0f);
    }
    if (p < 0.40) return pale();
    if (p < 0.55) return wood();
    if (p < 0.65) return dark();
    return strong();
  }
  Texture::Colours pattern(float pitch_low, float pitch_high) {
    constexpr std::array<Fill, 6> kFills = {Fill::kPlain,  Fill::kStripesUp, Fill::kStripesAcross,
                                            Fill::kChecks, Fill::kSpeckle,   Fill::kGradient};
    return {any(), any(), kFills[below(kFills.size())], number(pitch_low, pitch_high), salt()};
  }

 private:
  const std::vector<Eigen::Vector3f>& near_;
  Random random_;
};

/// Numbers drawn one after the other.
struct Drawn {
  float a = 0, b = 0, c = 0, d = 0, e = 0;
};

Texture::Colours plain(const Eigen::Vector3f& colour) {
  return {colour, colour};
}

/// Doors side by side, with a groove around each, a panel and a handle.
void cupboards(Texture& wall, Palette& palette, float x0, float x1, float y0, float y1, const Eigen::Vector3f& colour,
               bool handles_up) {
  const float width = palette.number(0.38, 0.6);
  const Eigen::Vector3f handle = palette.chance(0.5) ? palette.dark() : Eigen::Vector3f(190, 190, 195);
  const bool panelled = palette.chance(0.6);
  for (float x = x0; x + 0.2f < x1; x += width) {
    const float right = std::min(x1, x + width);
    wall.rectangle(x, y0, right, y1, plain(0.45f * colour));
    wall.rectangle(x + 0.006f, y0 + 0.006f, right - 0.006f, y1 - 0.006f,
                   {colour * 0.94f, colour, Fill::kGradient, 0.1f, 0});
    if (panelled) {
      wall.rectangle(x + 0.06f, y0 + 0.06f, right - 0.06f, y1 - 0.06f, plain(0.78f * colour));
      wall.rectangle(x + 0.068f, y0 + 0.066f, right - 0.066f, y1 - 0.068f, plain(0.97f * colour));
    }
    const float hx = palette.chance(0.5) ? x + 0.03f : right - 0.045f;
    const float hy = handles_up ? y1 - 0.22f : y0 + 0.08f;
    wall.rectangle(hx, hy, hx + 0.016f, hy + 0.13f, plain(handle));
  }
}

/// Bottles, jars, boxes and books in a row.
void row_of_things(Texture& wall, Palette& palette, float x0, float x1, float foot, float tallest) {
  for (float x = x0; x < x1;) {
    const float width = palette.number(0.03, 0.13);
    const float height = palette.number(0.35, 1.0) * tallest;
    const auto look = palette.pattern(0.01f, 0.05f);
    if (palette.chance(0.45)) {
      wall.rectangle(x, foot, x + width, foot + height, look);
    } else if (palette.chance(0.6)) {
      // A bottle or a jar with its lid.
      wall.rectangle(x, foot, x + width, foot + 0.72f * height, look);
      wall.rectangle(x + 0.3f * width, foot + 0.7f * height, x + 0.7f * width, foot + height, plain(palette.any()));
      wall.rectangle(x, foot + 0.2f * height, x + width, foot + 0.45f * height, plain(palette.any()));
    } else {
      wall.ellipse(x + 0.5f * width, foot + 0.4f * height, 0.5f * width, 0.4f * height, look);
    }
    x += width + (palette.chance(0.3) ? palette.number(0.0, 0.2) : palette.number(0.0, 0.015));
  }
}

void shelf(Texture& wall, Palette& palette, float x0, float x1, float y) {
  wall.rectangle(x0, y - 0.025f, x1, y, plain(palette.wood()));
  wall.rectangle(x0, y - 0.06f, x1, y - 0.025f, plain(Eigen::Vector3f(95, 92, 88)));  // its shadow
  row_of_things(wall, palette, x0 + 0.02f, x1 - 0.12f, y, palette.number(0.15, 0.3));
}

void pictures(Texture& wall, Palette& palette, float x0, float x1, int count) {
  for (int i = 0; i < count; ++i) {
    const float w = palette.number(0.2, 0.6), h = palette.number(0.2, 0.5);
    const float x = palette.number(x0, std::max(x0 + 0.01f, x1 - w)), y = palette.number(1.1, 1.8);
    wall.rectangle(x, y, x + w, y + h, plain(palette.dark()));
    wall.rectangle(x + 0.02f, y + 0.02f, x + w - 0.02f, y + h - 0.02f, plain(palette.pale()));
    wall.rectangle(x + 0.05f, y + 0.05f, x + w - 0.05f, y + h - 0.05f, palette.pattern(0.02f, 0.12f));
    for (int k = 0; k < 6; ++k) {
      const Drawn n{palette.number(0.25, 0.75), palette.number(0.25, 0.75), palette.number(0.02, 0.2),
                    palette.number(0.02, 0.2)};
      wall.ellipse(x + n.a * w, y + n.b * h, n.c * w, n.d * h, palette.pattern(0.01f, 0.05f));
    }
  }
}

Texture front_wall(Palette& palette) {
  constexpr float kWidth = 2.0f * kSide_y;
  Texture wall(kWidth, kHeight, kWallTexel_m, palette.pale());
  const Eigen::Vector3f doors = palette.chance(0.5) ? palette.pale() : palette.any();
  // Tiles between counter and wall cupboards.
  const Eigen::Vector3f tile = palette.pale();
  const float size = palette.number(0.08, 0.16);
  for (float y = kCounter_m; y < 1.5f; y += size) {
    for (float x = 0.0f; x < kWidth; x += size) {
      const float tint = palette.number(0.9, 1.04);
      const Eigen::Vector3f colour = palette.chance(0.08) ? palette.strong() : Eigen::Vector3f(tint * tile);
      wall.rectangle(x + 0.003f, y + 0.003f, x + size, y + size, plain(colour.cwiseMin(250.0f)));
    }
  }
  cupboards(wall, palette, 0.0f, kWidth, 0.1f, 0.84f, doors, true);
  wall.rectangle(0.0f, 0.0f, kWidth, 0.1f, plain(palette.dark()));
  const auto stone = palette.dark();
  wall.rectangle(0.0f, 0.84f, kWidth, kCounter_m, {stone, 2.2f * stone, Fill::kSpeckle, 0.03f, palette.salt()});
  cupboards(wall, palette, 0.0f, 1.2f, 1.5f, 2.2f, doors, false);
  cupboards(wall, palette, 2.9f, kWidth, 1.5f, 2.2f, doors, false);
  // The window.
  const float x = palette.number(1.3, 1.7);
  wall.rectangle(x, 1.0f, x + 1.1f, 2.1f, plain(palette.pale()));
  wall.rectangle(x + 0.05f, 1.05f, x + 1.05f, 2.05f,
                 {Eigen::Vector3f(205, 215, 205), Eigen::Vector3f(238, 245, 252), Fill::kGradient, 0.1f, 0});
  for (int i = 0; i < 7; ++i) {  // trees
    const Drawn n{palette.number(0.15, 0.95), palette.number(1.1, 1.35), palette.number(0.05, 0.13),
                  palette.number(0.04, 0.1)};
    wall.ellipse(x + n.a, n.b, n.c, n.d,
                 {Eigen::Vector3f(60, 95, 50), Eigen::Vector3f(110, 140, 80), Fill::kSpeckle, 0.04f, palette.salt()});
  }
  wall.rectangle(x + 0.535f, 1.05f, x + 0.565f, 2.05f, plain(palette.pale()));
  const auto curtain = palette.pattern(0.03f, 0.09f);
  wall.rectangle(x - 0.12f, 0.95f, x + 0.1f, 2.2f, curtain);
  wall.rectangle(x + 1.0f, 0.95f, x + 1.22f, 2.2f, curtain);
  row_of_things(wall, palette, 0.1f, kWidth - 0.1f, kCounter_m, 0.36f);
  wall.shade_up(0.72f, 1.0f);
  wall.mottle(0.10f, 0.35f, palette.salt());
  wall.finish();
  return wall;
}

Texture side_wall(Palette& palette, float width) {
  Texture wall(width, kHeight, kWallTexel_m, palette.pale());
  if (palette.chance(0.5)) {
    const auto paper = palette.pale();
    wall.rectangle(0, 0, width, kHeight,
                   {paper, 0.9f * paper, palette.chance(0.5) ? Fill::kStripesUp : Fill::kChecks,
                    palette.number(0.06, 0.2), palette.salt()});
  }
  const float door = palette.number(0.1, width - 1.2);
  wall.rectangle(door, 0.0f, door + 0.95f, 2.05f, plain(palette.pale()));
  const auto leaf = palette.any();
  wall.rectangle(door + 0.06f, 0.0f, door + 0.89f, 1.98f, {leaf, 0.85f * leaf, Fill::kGradient, 0.1f, 0});
  wall.rectangle(door + 0.15f, 0.2f, door + 0.8f, 0.9f, plain(0.8f * leaf));
  wall.rectangle(door + 0.15f, 1.05f, door + 0.8f, 1.8f, plain(0.8f * leaf));
  const bool right = door < 0.5f * width;
  const float x0 = right ? door + 1.1f : 0.1f, x1 = right ? width - 0.1f : door - 0.15f;
  if (x1 - x0 > 0.5f) {
    for (const float y : {0.35f, 0.75f, 1.15f}) {
      if (palette.chance(0.75)) shelf(wall, palette, x0, x1, y);
    }
    pictures(wall, palette, x0, x1, 2);
  }
  wall.rectangle(0, 0, width, 0.09f, plain(palette.wood()));
  wall.shade_up(0.7f, 0.97f);
  wall.mottle(0.12f, 0.4f, palette.salt());
  wall.finish();
  return wall;
}

Texture floor_of(Palette& palette, float width, float height) {
  Texture floor(width, height, kWallTexel_m, palette.wood());
  if (palette.chance(0.6)) {
    // Boards.
    const Eigen::Vector3f wood = palette.wood();
    for (float y = 0.0f; y < height; y += 0.12f) {
      for (float x = -palette.number(0.0, 1.0); x < width; x += 1.1f) {
        const Eigen::Vector3f board = palette.number(0.8, 1.1) * wood;
        floor.rectangle(x, y, x + 1.1f, y + 0.12f, plain(0.5f * board));
        floor.rectangle(x + 0.003f, y + 0.003f, x + 1.097f, y + 0.117f,
                        {0.85f * board, board, Fill::kGrain, 0.012f, palette.salt()});
      }
    }
  } else {
    const Eigen::Vector3f first = palette.pale();
    const Eigen::Vector3f second = palette.chance(0.5) ? palette.dark() : Eigen::Vector3f(0.85f * first);
    floor.rectangle(0, 0, width, height, {first, second, Fill::kChecks, palette.number(0.2, 0.35), 0});
  }
  // A carpet, and things that lie about.
  const float askew = palette.number(-0.3, 0.3);
  floor.turned_rectangle(0.6f * width, 0.5f * height, 1.4f, 0.9f, askew, palette.pattern(0.05f, 0.2f));
  for (int i = 0; i < 5; ++i) {
    const Drawn n{palette.number(0.3, 0.95), palette.number(0.05, 0.95), palette.number(0.08, 0.4),
                  palette.number(0.08, 0.4), palette.number(-1.5, 1.5)};
    floor.turned_rectangle(n.a * width, n.b * height, n.c, n.d, n.e, palette.pattern(0.02f, 0.1f));
  }
  floor.mottle(0.15f, 0.3f, palette.salt());
  floor.finish();
  return floor;
}

Texture table_top(Palette& palette, float width, float height) {
  Eigen::Vector3f wood = palette.wood();
  Texture top(width, height, kTableTexel_m, wood);
  top.rectangle(0, 0, width, height,
                {0.72f * wood, 1.08f * wood, Fill::kGrain, palette.number(0.006, 0.014), palette.salt()});
  for (float x = 0.0f; x < width; x += 0.16f) top.rectangle(x, 0, x + 0.0025f, height, plain(0.5f * wood));
  const int mats = 1 + static_cast<int>(palette.below(3));
  for (int i = 0; i < mats; ++i) {  // table mats
    const float x = palette.number(0.15, 0.85) * width, y = palette.number(0.2, 0.8) * height;
    const float askew = palette.number(-0.2, 0.2);
    top.turned_rectangle(x, y, 0.44f, 0.31f, askew, palette.pattern(0.012f, 0.05f));
  }
  const int magazines = 2 + static_cast<int>(palette.below(4));
  for (int i = 0; i < magazines; ++i) {
    const Drawn n{palette.number(0.1, 0.9) * width, palette.number(0.08, 0.92) * height, palette.number(-1.5, 1.5)};
    top.turned_rectangle(n.a, n.b, 0.21f, 0.28f, n.c, palette.pattern(0.02f, 0.12f));
    for (int k = 0; k < 4; ++k) {  // pictures on their covers
      const Drawn m{palette.number(-0.07, 0.07), palette.number(-0.1, 0.1), palette.number(0.02, 0.1),
                    palette.number(0.02, 0.1)};
      top.turned_rectangle(n.a + m.a * std::cos(n.c) - m.b * std::sin(n.c),
                           n.b + m.a * std::sin(n.c) + m.b * std::cos(n.c), m.c, m.d, n.c,
                           palette.pattern(0.008f, 0.04f));
    }
  }
  const int papers = 2 + static_cast<int>(palette.below(4));
  for (int i = 0; i < papers; ++i) {
    const float x = palette.number(0.1, 0.9) * width, y = palette.number(0.1, 0.9) * height;
    const float angle = palette.number(-1.5, 1.5);
    const Eigen::Vector3f paper = Eigen::Vector3f(228, 228, 222) * palette.number(0.85, 1.05);
    top.turned_rectangle(x, y, 0.21f, 0.148f, angle, plain(paper));
    for (float line = -0.055f; line < 0.06f; line += 0.011f) {  // writing
      const float length = palette.number(0.08, 0.18);
      const float along = -0.095f + 0.5f * length;
      top.turned_rectangle(x + along * std::cos(angle) - line * std::sin(angle),
                           y + along * std::sin(angle) + line * std::cos(angle), length, 0.003f, angle,
                           plain(Eigen::Vector3f(70, 70, 80)));
    }
  }
  for (int i = 0; i < 5; ++i) {  // cutlery
    const float x = palette.number(0.1, 0.9) * width, y = palette.number(0.1, 0.9) * height;
    const float angle = palette.number(-1.5, 1.5);
    top.turned_rectangle(x, y, 0.19f, 0.012f, angle, plain(Eigen::Vector3f(175, 178, 182)));
    top.turned_rectangle(x + 0.07f * std::cos(angle), y + 0.07f * std::sin(angle), 0.05f, 0.022f, angle,
                         plain(Eigen::Vector3f(150, 154, 160)));
  }
  for (int i = 0; i < 12; ++i) {  // crumbs, coasters, notes
    const float r = palette.number(0.006, 0.05);
    const Drawn n{palette.number(0.05, 0.95), palette.number(0.05, 0.95)};
    top.ellipse(n.a * width, n.b * height, r, r, palette.pattern(0.01f, 0.03f));
  }
  top.mottle(0.10f, 0.08f, palette.salt());
  top.finish();
  return top;
}

}  // namespace

struct Kitchen::Walls {
  Texture front, back, left, right, floor, table;
  Eigen::Vector3f ceiling;
};

Kitchen::Kitchen(const RoomPlan& plan, const std::vector<Eigen::Vector3f>& near_colours, std::uint64_t seed)
    : plan_(plan) {
  R_KW_ = plan_.X_WK.linear().transpose().cast<float>();
  p_KW_ = -R_KW_ * plan_.X_WK.translation().cast<float>();
  Palette palette(near_colours, seed);
  const auto depth = static_cast<float>(plan_.front_x) - kBack_x;
  auto front = front_wall(palette);
  auto back = side_wall(palette, 2.0f * kSide_y);
  auto left = side_wall(palette, depth);
  auto right = side_wall(palette, depth);
  auto floor = floor_of(palette, depth, 2.0f * kSide_y);
  auto table = table_top(palette, 2.0f * static_cast<float>(plan_.table_half_width),
                         static_cast<float>(plan_.table_far_x - plan_.table_near_x));
  walls_ = std::make_unique<const Walls>(Walls{std::move(front), std::move(back), std::move(left), std::move(right),
                                               std::move(floor), std::move(table), palette.pale()});
}

Kitchen::~Kitchen() = default;

void Kitchen::paint(const Lens& lens, const Pose& X_WC, int v0, int v1, std::vector<float>& picture) const {
  const auto& k = lens.camera().intrinsics;
  picture.resize(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height) * 3);
  const Eigen::Matrix3f R_KC = R_KW_ * X_WC.linear().cast<float>();
  const Eigen::Vector3f eye = R_KW_ * X_WC.translation().cast<float>() + p_KW_;
  const auto floor_z = static_cast<float>(plan_.floor_z);
  const auto front_x = static_cast<float>(plan_.front_x);
  const Eigen::Vector3f high(front_x, kSide_y, floor_z + kHeight);
  const Eigen::Vector3f low(kBack_x, -kSide_y, floor_z);
  const auto pixel = 1.0f / static_cast<float>(k.fx);
  float* out = picture.data() + static_cast<std::size_t>(v0) * static_cast<std::size_t>(k.width) * 3;
  for (int v = v0; v < v1; ++v) {
    for (int u = 0; u < k.width; ++u, out += 3) {
      const Eigen::Vector3f ray = R_KC * lens.ray(u, v);
      float length = 1e9f;
      int axis = 0;
      for (int i = 0; i < 3; ++i) {
        if (std::abs(ray[i]) < 1e-6f) continue;
        const float t = ((ray[i] > 0.0f ? high[i] : low[i]) - eye[i]) / ray[i];
        if (t < length) {
          length = t;
          axis = i;
        }
      }
      const Eigen::Vector3f p = eye + length * ray;
      // Seen at a slant, a pixel covers more of a wall one way than the other: between the two.
      const float footprint = length * pixel / std::sqrt(std::max(0.05f, std::abs(ray[axis])));
      Eigen::Vector3f colour;
      if (axis == 0) {
        colour = ray.x() > 0.0f ? walls_->front.at(kSide_y - p.y(), p.z() - floor_z, footprint)
                                : walls_->back.at(p.y() + kSide_y, p.z() - floor_z, footprint);
      } else if (axis == 1) {
        colour = ray.y() > 0.0f ? walls_->left.at(p.x() - kBack_x, p.z() - floor_z, footprint)
                                : walls_->right.at(front_x - p.x(), p.z() - floor_z, footprint);
      } else {
        colour = ray.z() > 0.0f ? walls_->ceiling : walls_->floor.at(p.x() - kBack_x, p.y() + kSide_y, footprint);
      }
      out[0] = colour[0];
      out[1] = colour[1];
      out[2] = colour[2];
    }
  }
}

Eigen::Vector3f Kitchen::table_albedo(const Eigen::Vector3f& p_W, float footprint_m) const {
  const Eigen::Vector3f p = R_KW_ * p_W + p_KW_;
  const float x = static_cast<float>(plan_.table_half_width) - p.y();
  const float y = p.x() - static_cast<float>(plan_.table_near_x);
  return walls_->table.at(x, y, footprint_m) * (1.0f / 255.0f);
}

}  // namespace bodyschema::simulator
