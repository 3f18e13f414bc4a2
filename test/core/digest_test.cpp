#include "bodyschema/core/digest.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

// The values that FNV's authors publish.
TEST(Digest, IsFnv1a) {
  EXPECT_EQ(Digest().text(), "cbf29ce484222325");
  EXPECT_EQ(Digest().add("a").text(), "af63dc4c8601ec8c");
  EXPECT_EQ(Digest().add("foobar").text(), "85944171f73967e8");
  EXPECT_EQ(Digest().add("foo").add("bar").value(), Digest().add("foobar").value());
}

}  // namespace
}  // namespace bodyschema
