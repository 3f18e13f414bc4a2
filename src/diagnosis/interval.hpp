#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "bodyschema/diagnosis/block_statistics.hpp"
#include "bodyschema/effects/effect.hpp"

namespace bodyschema::diagnosis {

/// Two-sided 95 % point of Student's t with so many degrees of freedom; of fewer than one as of one.
double student95(double dof);

/// How far an estimate may be from the truth: one rule for the intervals of causes and offsets and for
/// the limits of what was not found.
class IntervalRule {
 public:
  /// @param final_fit  of the final model: how much wider its errors are than white noise would make
  ///        them is the least that is believed of any fit
  /// @param blocks  those in which anything was seen
  /// @param systematic_share, systematic_error  as in DiagnosisOptions
  IntervalRule(const BlockFit& final_fit, std::size_t blocks, double systematic_share,
               std::map<std::string, double> systematic_error = {});

  /// Half of the 95 % interval of a fit's column, in units of the column; infinite where the fit is not
  /// usable.
  /// @param common  what the errors that all blocks have in common are a share of: the estimate
  /// @param placed  one sigma of such errors whatever the estimate is
  [[nodiscard]] double half(const BlockFit& fit, Eigen::Index column, double common, double placed = 0.0) const;
  /// Of an effect, in units of its column.
  [[nodiscard]] double placed(const std::string& effect, const EffectParameter& p) const;

 private:
  double inflation_, student_, systematic_share_;
  std::map<std::string, double> systematic_error_;
};

}  // namespace bodyschema::diagnosis
