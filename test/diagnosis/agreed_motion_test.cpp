#include "agreed_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "binomial.hpp"
#include "random_seed.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr double kStep_s = 0.2, kPi = 3.14159265358979323846;
constexpr int kInstants = 150;
constexpr Eigen::Index kMotions = 3, kPoints = 90;

using Motion = std::function<Eigen::Vector3d(double t_s, std::size_t camera)>;

/// Pictures of an outline whose residuals are noise, alike over `alike` neighbours, and a motion.
struct Seen {
  std::size_t cameras = 2;
  int alike = 5;
  double noise_px = 0.4;
  double seconds_apart = 0.03;  ///< of the two cameras' pictures
  int instants = kInstants;
};

std::vector<MotionEvidence> pictures(std::mt19937_64& random, const Seen& seen, const Motion& motion) {
  std::normal_distribution<double> normal;
  std::vector<MotionEvidence> list;
  for (int i = 0; i < seen.instants; ++i) {
    for (std::size_t camera = 0; camera < seen.cameras; ++camera) {
      const double t = kStep_s * i;
      Eigen::MatrixXd G(kPoints, kMotions);
      Eigen::VectorXd r(kPoints);
      double own = 0.0;
      for (Eigen::Index k = 0; k < kPoints; ++k) {
        // How points move turns along the outline, and from picture to picture.
        const double at = 2.0 * kPi * static_cast<double>(k) / kPoints + 0.05 * i;
        G.row(k) << std::cos(at), std::sin(at), std::sin(2.0 * at);
        if (k % seen.alike == 0) own = seen.noise_px * normal(random);
        r[k] = own;
      }
      r += G * motion(t, camera);
      MotionEvidence picture;
      picture.utime = microseconds(t + seen.seconds_apart * static_cast<double>(camera));
      picture.camera = camera;
      picture.A = G.transpose() * G;
      picture.b = G.transpose() * r;
      picture.square = r.squaredNorm();
      picture.precision = 1.0 / (seen.noise_px * seen.noise_px * seen.alike);
      list.push_back(std::move(picture));
    }
  }
  return list;
}

AgreedMotionSettings settings(double level = 0.01) {
  return {Eigen::VectorXd::Constant(kMotions, 10.0), 1'000'000, level};
}

Eigen::Vector3d still(double, std::size_t) {
  return Eigen::Vector3d::Zero();
}

/// However much alike along the outline, and whatever noise is taken to be: nothing is agreed about.
TEST(AgreedMotion, OfNoiseAloneIsNothing) {
  std::mt19937_64 random(test::seed());
  constexpr int kLogs = 200;
  constexpr double kLevel = 0.05;
  for (const int instants : {6, kInstants}) {
    int none = 0;
    for (int i = 0; i < kLogs; ++i) {
      none += agreed_share(pictures(random, {.alike = 1 + i % 12, .instants = instants}, still), settings(kLevel)) == 0;
    }
    EXPECT_GE(none, test::fewest_right(std::vector<double>(kLogs, 1.0 - kLevel))) << instants;
  }
}

/// In half a second it goes to and fro: the mean over a second is nothing.
TEST(AgreedMotion, SeesWhatGoesToAndFroFasterThanPicturesCome) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, 0.5);
  double at = -1.0;
  Eigen::Vector3d now;
  const auto seen = pictures(random, {}, [&](double t, std::size_t) -> Eigen::Vector3d {
    if (t != at) now = Eigen::Vector3d::NullaryExpr([&] { return normal(random); });
    at = t;
    return now;
  });
  // Of each point's square: three motions of 0.5 px, each seen by half of the outline.
  const double moved = 3.0 * 0.25 * 0.5, share = moved / (moved + 0.16);
  EXPECT_NEAR(agreed_share(seen, settings()), share, 0.1);
}

/// Two cameras that shake by themselves agree about nothing, but each with itself from picture to picture.
TEST(AgreedMotion, SeesACameraThatSwaysByItself) {
  std::mt19937_64 random(test::seed());
  const auto sway = [](double t, std::size_t camera) -> Eigen::Vector3d {
    return {(camera == 0 ? 0.7 : -0.7) * std::sin(2.0 * kPi * t / 3.0), 0.0, 0.0};
  };
  const double moved = 0.49 / 4.0, share = moved / (moved + 0.16);
  EXPECT_NEAR(agreed_share(pictures(random, {}, sway), settings()), share, 0.1);
}

TEST(AgreedMotion, OfOneCameraSeesASlowOne) {
  std::mt19937_64 random(test::seed());
  const auto sway = [](double t, std::size_t) -> Eigen::Vector3d {
    return {0.7 * std::sin(2.0 * kPi * t / 5.0), 0.0, 0.0};
  };
  const double moved = 0.49 / 4.0, share = moved / (moved + 0.16);
  EXPECT_NEAR(agreed_share(pictures(random, {.cameras = 1}, sway), settings()), share, 0.1);
}

/// Postures minutes apart say nothing of each other.
TEST(AgreedMotion, ComparesNoPicturesThatLieFarApart) {
  std::mt19937_64 random(test::seed());
  const auto off = [](double, std::size_t) -> Eigen::Vector3d { return {2.0, 0.0, 0.0}; };
  auto far = pictures(random, {.cameras = 1}, off);
  EXPECT_GT(agreed_share(far, settings()), 0.5);
  for (std::size_t p = 0; p < far.size(); ++p) far[p].utime *= 100;
  EXPECT_EQ(agreed_share(far, settings()), 0.0);
}

}  // namespace
}  // namespace bodyschema::diagnosis
