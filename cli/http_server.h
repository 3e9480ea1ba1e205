#pragma once
// A web server for one page of this program: loopback alone, a few paths, one answer a connection. Not a server for a
// network: no TLS, no files, no keep-alive. For peers that are not to be trusted: a page of another site in the same
// browser (DNS rebinding, cross-site requests), programs that send slowly, much, or nothing at all.

#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <string_view>

#include "consac/transport/transport.h"

namespace consac::cli {

inline constexpr std::size_t kMostHeadBytes = 16 << 10;  ///< request line and headers; browsers send some 1 KiB
inline constexpr std::size_t kMostBodyBytes = 1 << 20;   ///< of a POST: hints of 5,000 joints take 1 MB
inline constexpr std::size_t kMostConnections = 64;      ///< at once; the next ones wait in the system's queue

/// What was asked, its Host and Origin checked.
struct HttpRequest {
  std::string method;  ///< "GET" or "POST"
  std::string path;    ///< "/pose": as it came, nothing decoded
  std::string body;    ///< of a POST, JSON
};

/// The answer. A body that stays where it is may be a view, of what outlives the server; else it is `text`.
struct HttpResponse {
  int status = 200;
  std::string_view type = "application/json";
  std::string text;
  std::string_view view;  ///< sent instead of `text` where that is empty

  /// A failure in a line of plain text.
  static HttpResponse Error(int status, std::string_view line);
};

/// How much of `bytes` is one whole request. `error.status` other than 200: it is none, and that is the answer.
struct HttpReading {
  bool complete = false;
  HttpRequest request;
  HttpResponse error;
};
/// Reads what has arrived so far from a page that stands at `port` of this machine: HTTP/1.0 or 1.1, GET or POST, of a
/// Host that is 127.0.0.1 or localhost with that port (80 may be left out), with no Origin but that; a POST is
/// application/json with a Content-Length. Source: RFC 9112.
HttpReading ReadHttpRequest(std::string_view bytes, int port);

/// The server. One thread.
class HttpServer {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  /// Listens on 127.0.0.1. `budget_s`: how long a connection may take from its beginning to the last byte, however it
  /// spends that time.
  static Result<HttpServer> Open(int port, double budget_s);
  int port() const { return port_; }
  /// Takes what has come, answers what is complete, sends what is due; waits at most `wait_s` where there was nothing
  /// to do. An error is of a connection that could not be taken (no descriptor is free, the peer is gone again): the
  /// others go on, and the next call tries anew.
  Status Poll(const Handler& handler, double wait_s);

 private:
  using Clock = std::chrono::steady_clock;
  struct Connection {
    std::unique_ptr<Transport> transport;
    Clock::time_point end;  // of its budget
    std::string in;         // of a request that is still to be complete
    std::string head;       // of the answer; empty: none yet
    HttpResponse answer;
    std::size_t sent = 0;  // of head and body
    bool told = false;     // that nothing more is written
    bool heard = false;    // all that the peer says
  };

  bool Go(Connection& connection, const Handler& handler, bool* busy);
  static bool Send(Connection& connection, bool* busy);

  std::unique_ptr<Listener> listener_;
  int port_ = 0;
  double budget_s_ = 0.0;
  std::list<Connection> connections_;
};

}  // namespace consac::cli
