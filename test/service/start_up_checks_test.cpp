#include "bodyschema/service/start_up_checks.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(StartUpChecks, AskForAReceiveBufferOnce) {
  EXPECT_EQ(with_receive_buffer("udpm://239.255.76.67:7667?ttl=0"),
            "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=8388608");
  EXPECT_EQ(with_receive_buffer("udpm://"), "udpm://?recv_buf_size=8388608");
  EXPECT_EQ(with_receive_buffer("udpm://?recv_buf_size=5"), "udpm://?recv_buf_size=5");
  EXPECT_EQ(with_receive_buffer("memq://"), "memq://");
}

TEST(StartUpChecks, OtherNetworksThanMulticastHaveNothingToCheck) {
  EXPECT_TRUE(check_network("memq://").empty());
  EXPECT_TRUE(check_network("file:///tmp/a.lcmlog?mode=r").empty());
  EXPECT_TRUE(check_network("udpm://not an address").empty());
}

TEST(StartUpChecks, ComplaintsNameTheCommandThatHelps) {
  for (const auto& complaint : check_network("udpm://239.255.76.67:7667?ttl=0")) {
    EXPECT_TRUE(complaint.find("ip route add") != std::string::npos ||
                complaint.find("sysctl -w net.core.rmem_max=") != std::string::npos)
        << complaint;
  }
}

}  // namespace
}  // namespace bodyschema
