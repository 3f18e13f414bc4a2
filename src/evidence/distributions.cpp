#include "bodyschema/evidence/distributions.hpp"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

namespace bodyschema {
namespace {

/// Where a falling function of x >= 0 reaches `value`.
template <class Falling>
double where(double value, Falling tail) {
  double low = 0.0, high = 1.0;
  while (tail(high) > value && high < 1e12) high *= 2.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (tail(middle) > value ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double chi_square_tail(double x, double dof) {
  return x <= 0.0 ? 1.0 : Eigen::numext::igammac(0.5 * dof, 0.5 * x);
}

double chi_square_quantile(double tail, double dof) {
  return where(tail, [dof](double x) { return chi_square_tail(x, dof); });
}

double student_tail(double x, double dof) {
  return Eigen::numext::betainc(0.5 * dof, 0.5, dof / (dof + x * x));
}

double student_quantile(double tail, double dof) {
  return where(tail, [dof](double x) { return student_tail(x, dof); });
}

double normal_tail(double x) {
  return std::erfc(std::abs(x) / std::sqrt(2.0));
}

double normal_quantile(double tail) {
  return where(tail, [](double x) { return normal_tail(x); });
}

}  // namespace bodyschema
