#pragma once

#include <memory>

#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {

/// The diagnosis of a robot that runs: what recent pictures ask for outside the state that is estimated. The search of
/// `bodyschema diagnose` over the same candidates and the same statistics of blocks, from the pictures' linearisation
/// alone; no fit is repeated.
///
/// Two frames a second are kept until the next look, then linearised over all coordinates about what the last look
/// found; afterwards their evidence moves along with what all of them ask for, and is measured anew where causes are
/// others and outlines are kept. All of it happens in a thread of its own, which the scheduler serves after the
/// estimator's. What was found by two looks in a row is said. When looks begin and answers are said depends on the
/// pictures' stamps, so that a log gives what the robot gave. All times are those of stamps.
class LiveDiagnosis {
 public:
  /// @param waits  true: every answer is waited for, so that it depends on the pictures alone (replay). false: one that
  ///   is late, on a machine that is overloaded, is said when it is there
  explicit LiveDiagnosis(const Pipeline& pipeline, bool waits = false);
  ~LiveDiagnosis();
  LiveDiagnosis(const LiveDiagnosis&) = delete;
  LiveDiagnosis& operator=(const LiveDiagnosis&) = delete;

  /// After each step of the estimator: takes in the observation, with its masks, and puts what is found into the
  /// estimate. @return whether it has just been found
  bool watch(const Observation& observation, Estimate& estimate);
  /// Processor time of its own thread so far, s.
  [[nodiscard]] double processor_s() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
