#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema {

// What the pictures tell too little of, nobody applies: it stays on the robot as it is. A camera's pose that was found
// together with six degrees in a joint is wrong by these on a robot that keeps its zero, and so is all that holds
// together with them; what is written has to be right for the robot as it will be.

/// Which of some effects of a state can stay as they are believed: those that all together lie no further from there
/// than the pictures leave open, one standard deviation (the mean of their chi-square distribution). To leave more
/// would cost more than what is not known of it anyway. The one furthest off is given up first.
/// @param untold  positions in the state's model
std::vector<std::size_t> left_as_they_are(const State& state, const MemoryEstimate& estimate,
                                          std::vector<std::size_t> untold);

/// The estimate given that these effects are as believed: what is correlated with them moves along.
Eigen::VectorXd given_as_believed(const State& state, const MemoryEstimate& estimate,
                                  const std::vector<std::size_t>& effects);

/// A change of the estimate without what it changes in these effects: what is correlated with them goes back along.
Eigen::VectorXd beside(const State& state, const MemoryEstimate& estimate, const std::vector<std::size_t>& effects,
                       const Eigen::VectorXd& change);

/// Beliefs that hold these effects of the state where they are believed to be.
std::vector<Belief> held_as_believed(std::vector<Belief> beliefs, const State& state,
                                     const std::vector<std::size_t>& effects);

}  // namespace bodyschema
