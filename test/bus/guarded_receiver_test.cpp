#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <sstream>
#include <thread>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/error.hpp"
#include "own_port.hpp"

/// What one source only (bus.one_source) does on a real network of this machine's own.
namespace bodyschema {
namespace {

constexpr const char* kChannel = "CHANNEL";

/// Packets of one LCM connection, as bytes.
class Sender {
 public:
  explicit Sender(int port) : socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    inet_pton(AF_INET, "239.255.76.67", &address.sin_addr);
    const unsigned char here = 0;
    setsockopt(socket_, IPPROTO_IP, IP_MULTICAST_TTL, &here, sizeof here);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Sender() { close(socket_); }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void message(std::size_t bytes = 10) {
    std::string packet = word(0x4c433032) + word(sequence_++) + kChannel + std::string(1, '\0');
    send(packet + std::string(bytes, 'x'));
  }
  /// A message of `count` packets, of which those from `from` on are sent.
  void fragments(unsigned count, unsigned from = 0) {
    constexpr unsigned kEach = 100;
    for (unsigned i = from; i < count; ++i) {
      std::string packet = word(0x4c433033) + word(sequence_) + word(count * kEach) + word(i * kEach);
      for (const unsigned v : {i, count}) packet += {static_cast<char>(v >> 8), static_cast<char>(v)};
      if (i == 0) packet += std::string(kChannel) + std::string(1, '\0');
      send(packet + std::string(kEach, 'x'));
    }
    ++sequence_;
  }

 private:
  static std::string word(unsigned v) {
    return {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8), static_cast<char>(v)};
  }
  void send(const std::string& packet) { (void)!::send(socket_, packet.data(), packet.size(), 0); }
  int socket_;
  bool connected_ = false;
  unsigned sequence_ = 0;
};

class OneSource : public testing::Test {
 protected:
  void SetUp() override {
    // Before the receiver's thread begins and until it has ended: spdlog's loggers may not be exchanged beside it.
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)));
    try {
      link_ = std::make_unique<LcmLink>("udpm://239.255.76.67:" + std::to_string(port_) + "?ttl=0", 60.0, kLongest);
    } catch (const Error& e) {
      GTEST_SKIP() << "LCM needs a multicast route (scripts/multicast adds it): " << e.what();
    }
    link_->subscribe(kChannel, 4,
                     [this](const std::string&, Bytes message, std::int64_t) { sizes_.push_back(message.size()); });
    sender_.message();
    if (!link_->handle(2000)) {
      GTEST_SKIP() << "no multicast packet comes back on this machine: LCM needs a route (scripts/multicast adds it)";
    }
    sizes_.clear();
  }
  void TearDown() override {
    link_.reset();
    spdlog::set_default_logger(logger_before_);
  }
  /// Until all that was sent before has come in.
  template <class Condition>
  static bool eventually(Condition condition) {
    for (int i = 0; i < 500 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return condition();
  }

  static constexpr std::size_t kLongest = 10'000;
  const int port_ = own_port();
  std::shared_ptr<spdlog::logger> logger_before_ = spdlog::default_logger();
  std::ostringstream log_;
  std::unique_ptr<LcmLink> link_;
  Sender sender_{port_};
  std::vector<std::size_t> sizes_;
};

TEST_F(OneSource, CountsMessagesOfWhichAPartIsMissing) {
  sender_.fragments(3);
  sender_.fragments(4, 2);  // two are withheld
  sender_.fragments(3);
  EXPECT_TRUE(eventually([this] { return link_->lost().incomplete == 1; })) << link_->lost().incomplete;
  while (link_->handle(200)) {
  }
  EXPECT_EQ(sizes_, (std::vector<std::size_t>{300, 300}));
}

TEST_F(OneSource, LongMessagesOfAnotherAreRefusedAndCountedOnce) {
  Sender other(port_);
  sender_.fragments(3);
  other.fragments(30);
  other.fragments(30);
  EXPECT_TRUE(eventually([this] { return link_->refused_sources().messages == 2; }))
      << link_->refused_sources().messages;
  while (link_->handle(200)) {
  }
  EXPECT_EQ(sizes_, (std::vector<std::size_t>{300}));
  EXPECT_EQ(link_->lost().incomplete, 0u);
}

TEST_F(OneSource, CountsAndSaysWhatIsTooLarge) {
  sender_.fragments(3);
  sender_.fragments(101);
  sender_.fragments(102);
  EXPECT_TRUE(eventually([this] { return link_->lost().too_large == 2; })) << link_->lost().too_large;
  while (link_->handle(200)) {
  }
  EXPECT_EQ(sizes_, (std::vector<std::size_t>{300}));
  EXPECT_EQ(link_->lost().incomplete, 0u);
  link_.reset();
  EXPECT_NE(log_.str().find("bus.max_width_px"), std::string::npos) << log_.str();
}

TEST_F(OneSource, WhenTooManyWaitTheOldestGoAndAreCounted) {
  for (std::size_t i = 1; i <= 10; ++i) sender_.message(i);
  EXPECT_TRUE(eventually([this] { return link_->lost().queue == 6; })) << link_->lost().queue;
  while (link_->handle(200)) {
  }
  EXPECT_EQ(sizes_, (std::vector<std::size_t>{7, 8, 9, 10}));
}

TEST_F(OneSource, TwoOthersInTurnDoNotFillTheLog) {
  Sender one(port_), other(port_);
  for (int i = 0; i < 500; ++i) {
    one.message();
    other.message();
    if (i % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(eventually([this] { return link_->refused_sources().messages >= 900; }))
      << link_->refused_sources().messages;
  link_.reset();
  const std::string text = log_.str();
  const auto lines = std::count(text.begin(), text.end(), '\n');
  EXPECT_GE(lines, 1);
  EXPECT_LE(lines, 2) << text;
}

TEST(LcmLink, ASignalDoesNotEndTheReceiving) {
  struct sigaction action {
  }, previous{};
  action.sa_handler = [](int) {};
  sigaction(SIGUSR1, &action, &previous);
  LcmLink link("memq://");
  std::atomic<bool> done{false};
  bool failed = false;
  std::thread receiving([&] {
    try {
      for (int i = 0; i < 20; ++i) link.handle(50);
    } catch (const Error&) {
      failed = true;
    }
    done = true;
  });
  while (!done) {
    pthread_kill(receiving.native_handle(), SIGUSR1);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  receiving.join();
  sigaction(SIGUSR1, &previous, nullptr);
  EXPECT_FALSE(failed);
}

}  // namespace
}  // namespace bodyschema
