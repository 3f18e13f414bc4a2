#include "bodyschema/service/health.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/pipeline/frozen_picture.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;

/// All is well: both cameras, encoders in time, converged.
HealthFacts well() {
  HealthFacts facts;
  facts.cameras_channel = "ICUB_CAMERAS";
  facts.joints_channel = "ICUB_JOINT_STATE";
  facts.picture_age_ms = 20.0;
  facts.joints_age_ms = 5.0;
  facts.estimate_age_ms = 25.0;
  facts.encoder_lag_ms = -10.0;
  for (const char* name : {"left", "right"}) {
    CameraFacts camera;
    camera.name = name;
    camera.age_ms = 25.0;
    camera.mask_px = 4000;
    facts.cameras.push_back(camera);
  }
  facts.estimated_since_last = 30;
  facts.estimate.state = EstimatorState::kConverged;
  facts.estimate.hand_sd_m = 4e-4;
  facts.estimate.weakest.text = "0.71 r_wrist_prosup: sd 0.40 deg";
  facts.estimate.best_likelihood = 0.97;
  return facts;
}

void expect(const HealthFacts& facts, HealthLevel level, const std::string& words) {
  const Health health = assess(facts);
  EXPECT_EQ(to_string(health.level), std::string(to_string(level))) << health.sentence;
  EXPECT_THAT(health.sentence, HasSubstr(words));
}

void drop(HealthFacts& facts, DropReason reason, std::uint64_t pictures) {
  facts.since_last.synchroniser.images_dropped[static_cast<std::size_t>(reason)] = pictures;
}

TEST(Health, OkSaysHowGoodAndWhatIsWeakest) {
  expect(well(), HealthLevel::kOk, "hand known to 0.4 mm; weakest 0.71 r_wrist_prosup");
}

TEST(Health, NothingEverArrived) {
  HealthFacts facts = well();
  facts.picture_age_ms = facts.joints_age_ms = facts.estimate_age_ms = -1.0;
  expect(facts, HealthLevel::kStale, "no pictures yet on ICUB_CAMERAS; no encoder readings yet on ICUB_JOINT_STATE");
}

TEST(Health, CamerasFellSilent) {
  HealthFacts facts = well();
  facts.picture_age_ms = 3200.0;
  expect(facts, HealthLevel::kStale, "no pictures on ICUB_CAMERAS for 3.2 s");
}

TEST(Health, PicturesTooLargeToBeTakenInAreNotSilence) {
  HealthFacts facts = well();
  facts.picture_age_ms = facts.estimate_age_ms = -1.0;
  facts.since_last.faults[static_cast<std::size_t>(MessageFault::kTooLarge)] = 30;
  expect(facts, HealthLevel::kStale,
         "no pictures yet on ICUB_CAMERAS; 30 messages or pictures refused in the last second: they are larger than "
         "the configuration allows");
}

TEST(Health, EncodersFellSilent) {
  HealthFacts facts = well();
  facts.joints_age_ms = 61'000.0;
  expect(facts, HealthLevel::kStale, "no encoder readings on ICUB_JOINT_STATE for 61 s");
}

TEST(Health, TheHeadHasTurnedFromItsBackground) {
  HealthFacts facts = well();
  facts.cameras[1].background_turned_rad = 0.21;
  expect(facts, HealthLevel::kWarn,
         "the head has turned by 12.0 deg from where the background was learned, masks are wrong: set "
         "vision.method: auto");
  facts.estimate.state = EstimatorState::kDiverged;
  expect(facts, HealthLevel::kError, "diverged: ");
  expect(facts, HealthLevel::kError, "; the head has turned by 12.0 deg");
  facts.picture_age_ms = 3200.0;
  EXPECT_THAT(assess(facts).sentence, testing::Not(HasSubstr("head"))) << "nothing is seen any more";
  facts = well();
  facts.cameras[1].background_turned_rad = 0.21;
  facts.cameras[1].age_ms = 5000.0;  // not known of what it sees now
  EXPECT_THAT(assess(facts).sentence, testing::Not(HasSubstr("head")));
}

TEST(Health, EncodersLateButUsed) {
  HealthFacts facts = well();
  facts.encoder_lag_ms = 140.0;
  expect(facts, HealthLevel::kWarn, "encoders late by 140 ms");
}

TEST(Health, ALensThatIsTakenIntoAccountIsNamed) {
  HealthFacts facts = well();
  Finding lens;
  lens.effect = "distortion";
  lens.sentence = "the lens bends the picture inwards (k1) by -0.30 more than configured";
  lens.estimated = true;
  facts.estimate.findings.causes = {lens};
  expect(facts, HealthLevel::kOk, "taken into account: the lens bends the picture inwards (k1) by -0.30");
}

TEST(Health, EncodersTooLateToBeUsed) {
  HealthFacts facts = well();
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = 4000.0;
  facts.encoder_lag_ms = 640.0;
  drop(facts, DropReason::kNoEncoders, 60);
  expect(facts, HealthLevel::kError, "encoders late by 640 ms");
}

TEST(Health, JointNeverPublished) {
  HealthFacts facts = well();
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = -1.0;
  facts.missing_joints = {"r_elbow", "r_wrist_yaw"};
  expect(facts, HealthLevel::kError, "no reading of r_elbow, r_wrist_yaw: publish it");
  drop(facts, DropReason::kMissingJoint, 60);
  expect(facts, HealthLevel::kError, "no reading of r_elbow, r_wrist_yaw: publish it");
}

TEST(Health, JointStopped) {
  HealthFacts facts = well();
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = 2500.0;
  facts.blocking_joint = "r_elbow";
  drop(facts, DropReason::kMissingJoint, 60);
  expect(facts, HealthLevel::kError, "readings of r_elbow have stopped");
}

TEST(Health, EveryMessageRefused) {
  HealthFacts facts = well();
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = 2500.0;
  facts.since_last.faults[static_cast<std::size_t>(MessageFault::kNotFinite)] = 100;
  expect(facts, HealthLevel::kError, "100 messages or pictures refused in the last second: an encoder reports NaN");
}

TEST(Health, SomeMessagesRefused) {
  HealthFacts facts = well();
  facts.since_last.faults[static_cast<std::size_t>(MessageFault::kWrongSize)] = 3;
  expect(facts, HealthLevel::kWarn, "3 messages or pictures refused in the last second: a picture has not the size");
}

TEST(Health, PicturesOfOneCameraRefused) {
  HealthFacts facts = well();
  facts.cameras[1].age_ms = -1.0;
  facts.since_last.faults[static_cast<std::size_t>(MessageFault::kBrokenPicture)] = 30;
  expect(facts, HealthLevel::kWarn,
         "nothing yet from the right camera; working with the other; 30 messages or pictures refused in the last "
         "second: a JPEG picture is broken");
  facts.since_last.faults = {};
  facts.cameras[1].age_ms = 5000.0;
  drop(facts, DropReason::kOutOfOrder, 29);
  expect(facts, HealthLevel::kWarn, "for 5.0 s; working with the other; 29 pictures came twice or out of order");
  drop(facts, DropReason::kOutOfOrder, 0);
  EXPECT_EQ(assess(facts).sentence, "nothing from the right camera for 5.0 s; working with the other");
}

TEST(Health, WordsOfOthersStayInOneLine) {
  HealthFacts facts = well();
  facts.reload_failure = "b.yaml:3: unexpected\nREADY=1\r\tetc\x7f";
  expect(facts, HealthLevel::kWarn, "b.yaml:3: unexpected READY=1  etc ");
  facts.recording_failure = "disk\nfull";
  expect(facts, HealthLevel::kWarn, "disk full");
  for (const char c : assess(facts).sentence) EXPECT_GE(c, ' ');
  facts.reload_failure.assign(100'000, 'x');
  EXPECT_LT(assess(facts).sentence.size(), 1100u);
}

TEST(Health, SecondPublisher) {
  HealthFacts facts = well();
  drop(facts, DropReason::kDuplicate, 30);
  expect(facts, HealthLevel::kWarn, "second publisher on ICUB_CAMERAS?");
}

TEST(Health, OneCameraDead) {
  HealthFacts facts = well();
  facts.cameras[1].age_ms = 4200.0;
  expect(facts, HealthLevel::kWarn, "nothing from the right camera for 4.2 s; working with the other");
  facts.cameras[1].age_ms = -1.0;
  expect(facts, HealthLevel::kWarn, "nothing yet from the right camera");
}

TEST(Health, FrozenPictureOnlyWhenTheArmMoves) {
  HealthFacts facts = well();
  facts.cameras[0].unchanged_ms = 3000.0;
  expect(facts, HealthLevel::kOk, "converged");
  facts.cameras[0].moved_meanwhile_rad = 0.2094;
  expect(facts, HealthLevel::kWarn,
         "the left camera has shown the same picture for 3.0 s while the arm moved by 12 deg");
}

TEST(Health, APictureThatIsLeftOutAsFrozenIsSaidToBe) {
  HealthFacts facts = well();
  facts.cameras[0].unchanged_ms = 3000.0;
  facts.cameras[0].moved_meanwhile_rad = 0.99 * kFrozenMotion_rad;
  expect(facts, HealthLevel::kOk, "converged");
  facts.cameras[0].moved_meanwhile_rad = 1.2 * kFrozenMotion_rad;
  facts.cameras[0].mask_px = 0;  // it has no mask
  expect(facts, HealthLevel::kWarn,
         "the left camera has shown the same picture for 3.0 s while the arm moved by 0.3 deg");
}

TEST(Health, MaskEmptyInOneCamera) {
  HealthFacts facts = well();
  facts.cameras[0].mask_px = 0;
  expect(facts, HealthLevel::kWarn, "mask empty in the left camera");
}

TEST(Health, HandNotInView) {
  HealthFacts facts = well();
  facts.cameras[0].mask_px = facts.cameras[1].mask_px = 0;
  facts.estimate.state = EstimatorState::kHandNotInView;
  expect(facts, HealthLevel::kWarn, "hand not in view");
}

TEST(Health, LightsOff) {
  HealthFacts facts = well();
  facts.cameras[0].brightness = 0.5;
  expect(facts, HealthLevel::kError, "the left camera's picture is black");
}

TEST(Health, AnEncoderStalls) {
  HealthFacts facts = well();
  facts.estimate.state = EstimatorState::kDiverged;
  facts.estimate.stalled_joint = "r_elbow";
  facts.estimate.stalled_motion_rad = 0.21;
  expect(facts, HealthLevel::kError,
         "the encoder of r_elbow stands still while the pictures show the joint move, by 12 deg so far");
}

TEST(Health, SwappedPictures) {
  HealthFacts facts = well();
  facts.estimate.state = EstimatorState::kDiverged;
  facts.estimate.cameras_swapped = true;
  expect(facts, HealthLevel::kError, "the left and right pictures are swapped");
}

TEST(Health, Diverged) {
  HealthFacts facts = well();
  facts.estimate.state = EstimatorState::kDiverged;
  facts.estimate.best_likelihood = 0.41;
  expect(facts, HealthLevel::kError, "diverged: the best prediction does not fit the pictures (likelihood 0.41)");
}

TEST(Health, Converging) {
  HealthFacts facts = well();
  facts.estimate.state = EstimatorState::kConverging;
  facts.estimate.hand_sd_m = 2.1e-3;
  expect(facts, HealthLevel::kWarn, "converging: hand known to 2.1 mm so far");
}

TEST(Health, AModelThatIsContradictedIsNotOk) {
  HealthFacts facts = well();
  facts.estimate.state = EstimatorState::kModelMisfit;
  facts.estimate.misfit = "the pictures ask for mesh_scale 9 %";
  expect(facts, HealthLevel::kWarn, "do not use the offsets: the pictures ask for mesh_scale 9 %");
}

TEST(Health, Overload) {
  HealthFacts facts = well();
  facts.shed_since_last = 12;
  expect(facts, HealthLevel::kWarn, "12 frames of the last second shed");
}

TEST(Health, ClockStep) {
  HealthFacts facts = well();
  facts.since_last.synchroniser.clock_steps = 1;  // nothing need have been dropped for it
  expect(facts, HealthLevel::kWarn, "the clock of the time stamps stepped back");
}

TEST(Health, OverloadWithNothingLeft) {
  HealthFacts facts = well();
  facts.shed_since_last = 29;
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = 1200.0;
  expect(facts, HealthLevel::kError, "29 frames of the last second shed and none worked on: the machine is overloaded");
}

TEST(Health, StuckEstimator) {
  HealthFacts facts = well();
  facts.busy_ms = 2400.0;
  facts.estimated_since_last = 0;
  expect(facts, HealthLevel::kError, "at work on one frame for 2.4 s");
}

TEST(Health, RecordingAndReloadFailures) {
  HealthFacts facts = well();
  facts.recording_failure = "a.lcmlog: No space left on device";
  expect(facts, HealthLevel::kWarn, "recording has ended: a.lcmlog: No space left on device");
  facts.reload_failure = "b.yaml:3: unknown key";
  expect(facts, HealthLevel::kWarn, "reload refused, going on as before: b.yaml:3: unknown key");
  // Nothing else hides that a file has ended, and it hides nothing.
  facts.estimates_failure = "c.jsonl: cut short";
  facts.picture_age_ms = 3200.0;
  expect(facts, HealthLevel::kStale,
         "no pictures on ICUB_CAMERAS for 3.2 s; recording has ended: a.lcmlog: No space left on device; "
         "writing of estimates has ended: c.jsonl: cut short");
}

TEST(Health, FramesThatCouldNotBeWorkedOn) {
  HealthFacts facts = well();
  facts.failed_since_last = 2;
  facts.frame_failure = "camera 'left': picture of 1x1x3";
  expect(facts, HealthLevel::kWarn, "2 frames of the last second could not be worked on: camera 'left'");
  facts.estimated_since_last = 0;
  facts.estimate_age_ms = 2000.0;
  expect(facts, HealthLevel::kError, "2 frames of the last second could not be worked on: camera 'left'");
}

TEST(Health, WhatHidesTheHandIsSaidBesideWhatTheRestGives) {
  HealthFacts facts = well();
  facts.estimate.hidden = {.hand = 0.35, .robot = 0.2, .holds = true};
  expect(facts, HealthLevel::kOk, "hand known to 0.4 mm; weakest 0.71 r_wrist_prosup");
  expect(facts, HealthLevel::kOk, "; 35 % of the hand is hidden, it holds something");
  facts.estimate.hidden = {.holds = true};
  expect(facts, HealthLevel::kOk, "; the hand holds something");
  facts.estimate.hidden = {.hand = 0.95, .robot = 0.6};
  facts.estimate.state = EstimatorState::kOccluded;
  expect(facts, HealthLevel::kWarn, "occluded: too little of the hand is seen to say where it is");
  expect(facts, HealthLevel::kWarn, "95 % of the hand is hidden");
}

TEST(Health, StampsThatErrAreSaidBesideTheRest) {
  HealthFacts facts = well();
  facts.estimate.stamp_sd_s = 0.012;
  expect(facts, HealthLevel::kWarn, "; pictures are taken 12 ms before or after their stamps");
  facts.estimate.stamp_sd_s = 0.001;
  EXPECT_EQ(assess(facts).level, HealthLevel::kOk);
}

TEST(Health, WhatThePicturesAskForIsSaidBesideTheRest) {
  HealthFacts facts = well();
  facts.estimate.findings.causes.push_back(
      {.effect = "latency", .joint = "", .source = "", .sentence = "", .parameters = {{"delay", "ms", 58.2, 0.4}}});
  expect(facts, HealthLevel::kWarn, "hand known to 0.4 mm");
  expect(facts, HealthLevel::kWarn, "; the pictures ask for: latency 58.2 ms");
  facts.estimate.state = EstimatorState::kDiverged;
  expect(facts, HealthLevel::kError, "latency 58.2 ms");
  // What is estimated is taken into account: nothing to look at.
  facts = well();
  facts.estimate.findings.causes.push_back({.effect = "focal_length",
                                            .joint = "",
                                            .source = "",
                                            .sentence = "",
                                            .parameters = {{"scale", "%", 0.4, 0.01}},
                                            .estimated = true});
  EXPECT_EQ(assess(facts).level, HealthLevel::kOk);
}

}  // namespace
}  // namespace bodyschema
