#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace bodyschema {

/// By how much standard deviations are too small, by the answers of a log without each of its sections in turn: the
/// jackknife's deviation (Quenouille 1956, Tukey 1958) over the one that is claimed. One factor a parameter, at least
/// 1: what sections scatter by beyond that counts where it hardly happens by chance (chi-square of their number less
/// one).
///
/// A few sections hardly convict one parameter alone. Those that pictures tell, of one kind, are looked at together:
/// the claim counts as so many directions, and each section less one as one direction a parameter (a variance with its
/// conjugate prior).
///
/// What pictures' noise and posture errors do not explain, and lasts for a while, shows here: a hand that holds
/// something for a time, masks that are wrong in some pictures alike.
/// @param without  estimates without each section; fewer than three say nothing
/// @param sd  claimed of the estimate from all sections
/// @param told  positions of parameters of one kind that pictures tell
/// @param prior_directions  that the claim counts as
Eigen::VectorXd section_spread(const std::vector<Eigen::VectorXd>& without, const Eigen::VectorXd& sd,
                               std::span<const Eigen::Index> told = {}, double prior_directions = 0.0);

}  // namespace bodyschema
