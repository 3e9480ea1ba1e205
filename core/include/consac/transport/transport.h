#pragma once
// A connected byte stream, and how one is made: TCP (loopback unless asked) or two ends in one process. Sockets are
// hidden in tcp.cpp. Every wait has a deadline; a read spins for a bounded time, then sleeps; a message goes out in
// one write with TCP_NODELAY.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "consac/base/status.h"

namespace consac {

/// One end of a connection. One thread at a time.
class Transport {
 public:
  virtual ~Transport() = default;
  /// Reads what is there, waiting at most `timeout_s` (0: do not wait). Returns the bytes read, 0 when none came in
  /// time; kUnavailable once the peer has closed or reset. Never allocates.
  virtual Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) = 0;
  /// Writes what the peer takes of `bytes`, waiting at most `timeout_s` (0: do not wait) for it to take any. Returns
  /// how many.
  virtual Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) = 0;
  /// Writes all of `bytes` or fails; kDeadlineExceeded when the peer takes none for `timeout_s`.
  Status Write(std::span<const std::byte> bytes, double timeout_s);
  /// Nothing more is written; the peer reads what was, then its end. Where that cannot be done alone, as Close.
  virtual void CloseWriting() { Close(); }
  /// Ends the connection; calling it again does nothing.
  virtual void Close() = 0;
  /// "127.0.0.1:5005" or "in-process", for messages.
  virtual std::string peer() const = 0;
};

/// Waits for connections.
class Listener {
 public:
  virtual ~Listener() = default;
  /// The next connection, or null when none came within `timeout_s` (0: do not wait).
  virtual Result<std::unique_ptr<Transport>> Accept(double timeout_s) = 0;
  /// The port that is open; useful after asking for port 0.
  virtual int port() const = 0;
  /// Stops listening; calling it again does nothing.
  virtual void Close() = 0;
};

/// "tcp://host:port" taken apart; the error says what was expected.
struct Endpoint {
  std::string host = "127.0.0.1";  ///< name or address
  int port = 5005;                 ///< 0: any free port (listening only)
  /// Parses "tcp://host:port" or "host:port".
  static Result<Endpoint> Parse(std::string_view url);
};

/// Opens a port; kAlreadyExists when it is taken.
Result<std::unique_ptr<Listener>> ListenTcp(const Endpoint& endpoint);
/// Connects once; kUnavailable when nobody listens.
Result<std::unique_ptr<Transport>> ConnectTcp(const Endpoint& endpoint, double timeout_s);
/// Two ends of a connection inside this process; each may live on its own thread.
std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>> MakeInProcessPair();

}  // namespace consac
