#include "bodyschema/bus/udpm_assembler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <new>
#include <numeric>
#include <random>

namespace bodyschema {
namespace {

using Packet = std::vector<std::uint8_t>;

const Sender kRobot{0x0a000001, 4000};
const Sender kOther{0x0a000002, 4000};

void put(Packet& packet, std::uint32_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) packet.push_back(static_cast<std::uint8_t>(value >> shift));
}

Packet short_message(const std::string& channel, const Packet& data) {
  Packet packet;
  put(packet, 0x4c433032, 4);
  put(packet, 1, 4);
  packet.insert(packet.end(), channel.begin(), channel.end());
  packet.push_back(0);
  packet.insert(packet.end(), data.begin(), data.end());
  return packet;
}

/// As LCM cuts them: the first holds the channel besides.
std::vector<Packet> fragments(const std::string& channel, const Packet& data, std::uint32_t sequence,
                              std::size_t each) {
  std::vector<Packet> packets;
  const std::size_t count = (data.size() + each - 1) / each;
  for (std::size_t i = 0; i < count; ++i) {
    Packet packet;
    put(packet, 0x4c433033, 4);
    put(packet, sequence, 4);
    put(packet, static_cast<std::uint32_t>(data.size()), 4);
    put(packet, static_cast<std::uint32_t>(i * each), 4);
    put(packet, static_cast<std::uint32_t>(i), 2);
    put(packet, static_cast<std::uint32_t>(count), 2);
    if (i == 0) {
      packet.insert(packet.end(), channel.begin(), channel.end());
      packet.push_back(0);
    }
    const auto begin = data.begin() + static_cast<std::ptrdiff_t>(i * each);
    packet.insert(packet.end(), begin, begin + static_cast<std::ptrdiff_t>(std::min(each, data.size() - i * each)));
    packets.push_back(std::move(packet));
  }
  return packets;
}

Packet numbers(std::size_t n) {
  Packet data(n);
  std::iota(data.begin(), data.end(), std::uint8_t{0});
  return data;
}

TEST(UdpmAssembler, ShortMessageIsOnePacket) {
  UdpmAssembler assembler;
  const auto message = assembler.take(short_message("ICUB_JOINT_STATE", numbers(100)), kRobot);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, "ICUB_JOINT_STATE");
  EXPECT_EQ(message->bytes, numbers(100));
  EXPECT_EQ(message->sender, kRobot);
  EXPECT_EQ(kRobot.text(), "10.0.0.1:4000");
}

TEST(UdpmAssembler, FragmentsComeInAnyOrder) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  UdpmAssembler assembler;
  for (std::uint32_t sequence = 0; sequence < 50; ++sequence) {
    auto packets = fragments("ICUB_CAMERAS", numbers(5000), sequence, 700);
    std::shuffle(packets.begin(), packets.end(), random);
    for (std::size_t i = 0; i < packets.size(); ++i) {
      const auto message = assembler.take(packets[i], kRobot);
      ASSERT_EQ(message.has_value(), i + 1 == packets.size());
      if (message) {
        EXPECT_EQ(message->channel, "ICUB_CAMERAS");
        EXPECT_EQ(message->bytes, numbers(5000));
      }
    }
  }
  EXPECT_EQ(assembler.incomplete(), 0u);
}

TEST(UdpmAssembler, MessagesOfTwoSendersDoNotMix) {
  UdpmAssembler assembler;
  const auto ours = fragments("C", numbers(2000), 7, 900);
  const auto theirs = fragments("C", Packet(2000, 0xEE), 7, 900);
  EXPECT_FALSE(assembler.take(ours[0], kRobot));
  EXPECT_FALSE(assembler.take(theirs[0], kOther));
  EXPECT_FALSE(assembler.take(theirs[1], kOther));
  EXPECT_FALSE(assembler.take(ours[1], kRobot));
  const auto message = assembler.take(ours[2], kRobot);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->bytes, numbers(2000));
  EXPECT_EQ(assembler.take(theirs[2], kOther)->sender, kOther);
}

TEST(UdpmAssembler, LostFragmentCostsItsMessageOnly) {
  UdpmAssembler assembler;
  const auto first = fragments("C", numbers(2000), 1, 900);
  const auto second = fragments("C", numbers(2500), 2, 900);
  EXPECT_FALSE(assembler.take(first[0], kRobot));
  EXPECT_FALSE(assembler.take(first[2], kRobot));
  EXPECT_FALSE(assembler.take(second[0], kRobot));
  EXPECT_FALSE(assembler.take(first[1], kRobot)) << "too late";
  EXPECT_FALSE(assembler.take(second[1], kRobot));
  EXPECT_TRUE(assembler.take(second[2], kRobot));
  EXPECT_EQ(assembler.incomplete(), 1u);
}

TEST(UdpmAssembler, LiesAreRefusedBeforeMemoryIsTaken) {
  UdpmAssembler assembler;
  const auto refused = [&](std::uint32_t size, std::uint32_t offset, std::uint32_t fragment, std::uint32_t count,
                           std::size_t payload) {
    Packet packet;
    put(packet, 0x4c433033, 4);
    put(packet, 1, 4);
    put(packet, size, 4);
    put(packet, offset, 4);
    put(packet, fragment, 2);
    put(packet, count, 2);
    packet.resize(packet.size() + payload, 'x');
    return !assembler.take(packet, kRobot);
  };
  EXPECT_TRUE(refused(0x7fffffff, 0, 1, 4, 100)) << "2 GB";
  EXPECT_TRUE(refused(1000, 990, 1, 4, 100)) << "beyond the end";
  EXPECT_TRUE(refused(1000, 0xffffffff, 1, 4, 100)) << "offset beyond the end";
  EXPECT_TRUE(refused(1000, 0, 4, 4, 100)) << "fragment 4 of 4, from 0";
  EXPECT_TRUE(refused(1000, 0, 0, 0, 100)) << "no fragments";
  EXPECT_TRUE(refused(1000, 0, 0, 2, 100)) << "a channel without end";
  EXPECT_EQ(assembler.incomplete(), 0u) << "nothing was begun";
  EXPECT_FALSE(assembler.take(Packet(3, 0), kRobot));
  EXPECT_FALSE(assembler.take(Packet(60, 0x4c), kRobot));
  EXPECT_FALSE(assembler.take(short_message(std::string(64, 'c'), {}), kRobot));
}

TEST(UdpmAssembler, WhatIsTooLargeIsCountedOnceWhereItIsWanted) {
  UdpmAssembler assembler({.message_bytes = 1000}, [](const std::string& channel, Sender) { return channel == "C"; });
  for (std::uint32_t sequence = 1; sequence <= 3; ++sequence) {
    for (const auto& packet : fragments("C", numbers(1001), sequence, 300)) {
      EXPECT_FALSE(assembler.take(packet, kRobot));
      EXPECT_FALSE(assembler.take(packet, kRobot)) << "as over a second interface";
    }
    for (const auto& packet : fragments("OTHERS", numbers(1001), sequence, 300)) {
      EXPECT_FALSE(assembler.take(packet, kOther));
    }
    EXPECT_EQ(assembler.too_large(), sequence);
  }
  EXPECT_EQ(assembler.pending_bytes(), 0u);
  EXPECT_EQ(assembler.incomplete(), 0u);
}

TEST(UdpmAssembler, ManySendersCannotFillTheMemory) {
  UdpmAssembler assembler({.message_bytes = 10'000, .pending_bytes = 50'000, .senders = 8});
  for (std::uint16_t port = 1; port <= 100; ++port) {
    const auto packets = fragments("C", numbers(10'000), 1, 900);
    for (std::size_t i = 0; i + 1 < packets.size(); ++i) {
      EXPECT_FALSE(assembler.take(packets[i], {1, port}));
      EXPECT_LE(assembler.pending_bytes(), 50'000u);
    }
  }
  EXPECT_GE(assembler.incomplete(), 95u) << "not even five messages fit";
}

TEST(UdpmAssembler, AnAnnouncementTakesNoMemory) {
  UdpmAssembler assembler;
  for (std::uint16_t port = 1; port <= 60; ++port) {
    (void)assembler.take(fragments("C", numbers(20'000'000), 1, 60'000)[1], {1, port});
  }
  EXPECT_LT(assembler.pending_bytes(), 60u * 61'000u);
  EXPECT_EQ(assembler.incomplete(), 0u) << "nobody is driven out by what is only announced";
  // Nor does a packet that says it is all of a message, and is not.
  auto lie = fragments("C", numbers(100), 2, 100)[0];
  lie[9] = 1;  // 65636 bytes
  EXPECT_FALSE(assembler.take(lie, kOther));
  EXPECT_EQ(assembler.incomplete(), 1u);
}

TEST(UdpmAssembler, NobodyDrivesOutASenderThatAsksForLess) {
  UdpmAssembler assembler({.message_bytes = 10'000, .pending_bytes = 20'000, .senders = 8});
  const auto ours = fragments("C", numbers(5000), 1, 900);
  EXPECT_FALSE(assembler.take(ours[0], kRobot));
  for (std::uint32_t sequence = 0; sequence < 20; ++sequence) {
    for (std::uint16_t port = 1; port <= 7; ++port) {  // of each its first, and more: none is complete
      const auto theirs = fragments("C", numbers(10'000), sequence, 900);
      for (std::size_t i = 0; i < 11; ++i) EXPECT_FALSE(assembler.take(theirs[i], {1, port}));
    }
  }
  for (std::size_t i = 1; i + 1 < ours.size(); ++i) EXPECT_FALSE(assembler.take(ours[i], kRobot));
  EXPECT_TRUE(assembler.take(ours.back(), kRobot));
}

// As where memory is short; the service goes on with the next packet.
TEST(UdpmAssembler, KeepsCountWhereItThrows) {
  bool short_of_memory = true;
  UdpmAssembler assembler({}, [&](const std::string&, Sender) {
    if (short_of_memory) throw std::bad_alloc();
    return true;
  });
  const auto first = fragments("C", numbers(2000), 1, 900);
  EXPECT_THROW((void)assembler.take(first[0], kRobot), std::bad_alloc);
  short_of_memory = false;
  EXPECT_FALSE(assembler.take(first[1], kRobot));
  EXPECT_FALSE(assembler.take(first[2], kRobot));
  EXPECT_TRUE(assembler.take(first[0], kRobot)) << "sent again";
  EXPECT_EQ(assembler.pending_bytes(), 0u);
}

TEST(UdpmAssembler, WhatDoesNotTellItsChannelGoesFirst) {
  UdpmAssembler assembler({.message_bytes = 10'000, .pending_bytes = 20'000, .senders = 8});
  const auto ours = fragments("C", numbers(9000), 1, 900);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_FALSE(assembler.take(ours[i], kRobot));
  for (std::uint16_t port = 1; port <= 100; ++port) {
    const auto theirs = fragments("C", numbers(9000), 1, 900);
    for (std::size_t i = 1; i < 10; ++i) EXPECT_FALSE(assembler.take(theirs[i], {1, port}));
  }
  EXPECT_TRUE(assembler.take(ours[9], kRobot));
}

TEST(UdpmAssembler, WhatIsNotWantedIsDroppedOnceItTellsItsChannel) {
  std::vector<std::string> asked;
  UdpmAssembler assembler({}, [&](const std::string& channel, Sender sender) {
    asked.push_back(channel);
    return channel == "C" && sender == kRobot;
  });
  const auto points = fragments("POINTS", numbers(9000), 1, 900);
  EXPECT_FALSE(assembler.take(points[1], kOther));
  for (std::size_t i = 0; i < 10; ++i) EXPECT_FALSE(assembler.take(points[i], kOther));
  EXPECT_LT(assembler.pending_bytes(), 900u);
  const auto theirs = fragments("C", numbers(9000), 2, 900);
  for (const auto& packet : theirs) EXPECT_FALSE(assembler.take(packet, kOther));
  const auto ours = fragments("C", numbers(9000), 1, 900);
  for (std::size_t i = 0; i < 9; ++i) EXPECT_FALSE(assembler.take(ours[i], kRobot));
  EXPECT_TRUE(assembler.take(ours[9], kRobot));
  EXPECT_EQ(asked, (std::vector<std::string>{"POINTS", "C", "C"}));
  EXPECT_EQ(assembler.incomplete(), 0u) << "these are not lost";
}

TEST(ChannelOwners, FirstComeFirstServedUntilSilent) {
  ChannelOwners owners(2'000'000);
  EXPECT_FALSE(owners.owner("C"));
  EXPECT_TRUE(owners.admit("C", kRobot, 0));
  EXPECT_FALSE(owners.admit("C", kOther, 1));
  EXPECT_TRUE(owners.admit("D", kOther, 1)) << "another channel";
  EXPECT_TRUE(owners.admit("C", kRobot, 1'500'000));
  EXPECT_FALSE(owners.admit("C", kOther, 3'500'000));
  EXPECT_TRUE(owners.admit("C", kOther, 3'500'001)) << "the owner has been silent for more than two seconds";
  EXPECT_FALSE(owners.admit("C", kRobot, 3'600'000));
  EXPECT_EQ(owners.owner("C"), kOther);
}

}  // namespace
}  // namespace bodyschema
