#pragma once

namespace bodyschema {

/// Probability that a chi-square variable of `dof` degrees of freedom exceeds x.
double chi_square_tail(double x, double dof);
/// The x that it exceeds with probability `tail`.
double chi_square_quantile(double tail, double dof);
/// Probability that |t| of Student's distribution exceeds |x|, both sides together.
double student_tail(double x, double dof);
/// The x > 0 that |t| exceeds with probability `tail`.
double student_quantile(double tail, double dof);
/// Probability that a normal variable exceeds |x| in size, and the x that it does with probability `tail`.
double normal_tail(double x);
double normal_quantile(double tail);

}  // namespace bodyschema
