#include "bodyschema/core/order_statistics.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(OrderStatistics, AreValuesOfTheirOwn) {
  EXPECT_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 3.0, 2.0}), 3.0) << "of two in the middle the larger";
  EXPECT_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.0);
  EXPECT_EQ(quantile({5.0, 1.0, 4.0, 2.0, 3.0}, 0.25), 2.0);
  EXPECT_EQ(quantile({5.0, 1.0, 4.0, 2.0, 3.0}, 0.0), 1.0);
  EXPECT_EQ(quantile({5.0, 1.0, 4.0, 2.0, 3.0}, 1.0), 5.0);
}

TEST(OrderStatistics, OfNothingIsZero) {
  EXPECT_EQ(median({}), 0.0);
  EXPECT_EQ(quantile({}, 0.9), 0.0);
}

}  // namespace
}  // namespace bodyschema
