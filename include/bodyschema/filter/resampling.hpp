#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace bodyschema {

/// Systematic resampling (the paper's reference [30]): ancestors of n new particles drawn with one
/// random number. A particle of normalised weight w is taken floor(n w) or ceil(n w) times.
///
/// @param weights  not negative, not all zero; need not be normalised
/// @param u  in [0, 1)
/// @param ancestors  out; its size is the number of particles drawn; ascending
void systematic_resampling(std::span<const double> weights, double u, std::span<std::size_t> ancestors);

/// 1 / sum of squared normalised weights; 0 when all weights are zero.
double effective_sample_size(std::span<const double> weights);

}  // namespace bodyschema
