#include "bodyschema/evidence/distributions.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

TEST(Distributions, AreThoseOfTheTables) {
  // Abramowitz and Stegun, tables 26.8 and 26.10.
  EXPECT_NEAR(chi_square_quantile(0.05, 1), 3.841459, 1e-5);
  EXPECT_NEAR(chi_square_quantile(0.05, 10), 18.30704, 1e-4);
  EXPECT_NEAR(chi_square_quantile(0.001, 7), 24.32189, 1e-4);
  EXPECT_NEAR(chi_square_quantile(0.5, 100), 99.33413, 1e-4);
  EXPECT_NEAR(student_quantile(0.05, 1), 12.70620, 1e-4);
  EXPECT_NEAR(student_quantile(0.05, 10), 2.228139, 1e-5);
  EXPECT_NEAR(student_quantile(0.01, 30), 2.749996, 1e-5);
  EXPECT_NEAR(normal_quantile(0.05), 1.959964, 1e-5);
  EXPECT_NEAR(normal_quantile(1e-4), 3.890592, 1e-5);
}

TEST(Distributions, TailsAreOfBothSidesAndInvertTheQuantiles) {
  EXPECT_EQ(chi_square_tail(0.0, 3), 1.0);
  EXPECT_EQ(chi_square_tail(-1.0, 3), 1.0);
  EXPECT_NEAR(chi_square_tail(2.0 * std::log(2.0), 2), 0.5, 1e-12) << "of two degrees of freedom exp(-x / 2)";
  EXPECT_NEAR(student_tail(1.0, 1), 0.5, 1e-9) << "Cauchy's quartiles are at 1";
  EXPECT_EQ(student_tail(-2.0, 5), student_tail(2.0, 5));
  EXPECT_EQ(normal_tail(-1.5), normal_tail(1.5));
  for (const double tail : {0.3, 1e-2, 1e-5, 1e-9}) {
    for (const double dof : {1.0, 4.5, 60.0}) {
      EXPECT_NEAR(chi_square_tail(chi_square_quantile(tail, dof), dof), tail, 1e-6 * tail);
      EXPECT_NEAR(student_tail(student_quantile(tail, dof), dof), tail, 1e-3 * tail);
    }
    EXPECT_NEAR(normal_tail(normal_quantile(tail)), tail, 1e-6 * tail);
  }
  EXPECT_NEAR(student_quantile(0.05, 1e6), normal_quantile(0.05), 1e-4);
}

}  // namespace
}  // namespace bodyschema
