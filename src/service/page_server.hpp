#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace bodyschema {

/// What a request asks for; its text lives as long as the call.
struct PageRequest {
  std::string_view path;   ///< as sent, nothing decoded
  std::string_view query;  ///< after the question mark
};

struct PageAnswer {
  int status = 200;
  std::string_view type = "text/plain";
  std::string body{};
};

/// As much of HTTP/1.1 as a page for this machine needs, and bounds on all a client can ask for:
/// GET and HEAD on 127.0.0.1, one request to a connection; its head at most 8 KiB, there within 2 s of
/// connecting; the answer taken within 10 s; at most 32 connections, further ones get 503. Headers
/// other than Host are not looked at, so neither ranges nor bodies nor keeping alive exist.
///
/// One thread, the least important of the machine, does everything and waits for no client; it calls
/// the handler. Handlers that throw are answered with 500.
///
/// Not cpp-httplib: there every connection holds a thread until its client is done, and time is limited for each read,
/// not for a request, so that a few clients that dawdle shut out all others and cost the estimator threads.
class PageServer {
 public:
  using Handler = std::function<PageAnswer(const PageRequest&)>;

  /// Throws DeviceError when the port cannot be had.
  /// @param port  0: any free one, see port()
  PageServer(int port, Handler handler);
  /// Closes every connection; waits for no more than the handler's current call.
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] int port() const { return port_; }

 private:
  /// A file descriptor, closed in the end.
  class Descriptor {
   public:
    explicit Descriptor(int number = -1) : number_(number) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept;
    Descriptor& operator=(Descriptor&& other) noexcept;
    [[nodiscard]] int get() const { return number_; }

   private:
    int number_;
  };

  struct Connection {
    Descriptor socket;
    std::int64_t until_us = 0;  ///< closed then, whatever it has come to
    std::string head{};         ///< the request so far
    std::string answer{};       ///< empty: the request is not complete
    std::size_t sent = 0;
  };

  void serve();
  void accept_all();
  /// These return whether the connection goes on.
  bool read(Connection& connection) const;
  static bool write(Connection& connection);
  [[nodiscard]] std::string answer_to(std::string_view head) const;

  Handler handler_;
  int port_ = 0;
  Descriptor listener_;
  Descriptor stop_;
  std::int64_t accept_again_us_ = 0;
  std::vector<Connection> connections_;
  std::thread thread_;  ///< last: everything else is there when it starts
};

}  // namespace bodyschema
