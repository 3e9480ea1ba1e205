// TCP on standalone Asio, without exceptions: non-blocking sockets, bounded spin, then poll with the deadline.
#include <algorithm>
#include <asio/error_code.hpp>
#include <cerrno>
#include <cmath>
#include <exception>
#include <mutex>

// Asio asks for this where exceptions are off. Every call below takes an error_code, so only a broken precondition
// of Asio itself could come here.
#if defined(ASIO_NO_EXCEPTIONS)
namespace asio::detail {
template <typename Exception>
void throw_exception(const Exception&) {
  std::terminate();
}
}  // namespace asio::detail
#endif

#include <asio/buffer.hpp>
#include <asio/connect.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>

#if !defined(_WIN32)
#include <fcntl.h>
#include <poll.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <netinet/tcp.h>
#endif

#include "consac/base/text.h"
#include "consac/transport/transport.h"
#include "transport/waiter.h"

namespace consac {
namespace {

using asio::ip::tcp;

enum class WaitFor : std::uint8_t { kReadable, kWritable };

/// Sleeps until the socket is ready or the time is over; false when it is over. A signal (a job stopped and continued)
/// does not shorten the wait.
bool WaitForSocket(tcp::socket::native_handle_type handle, WaitFor what, double timeout_s) {
  constexpr double kLongestWait = 1e6;  // s
  const double deadline = Now() + std::clamp(timeout_s, 0.0, kLongestWait);
  while (true) {
    const double left = std::max(deadline - Now(), 0.0);
#if defined(_WIN32)
    WSAPOLLFD entry = {handle, static_cast<SHORT>(what == WaitFor::kReadable ? POLLIN : POLLOUT), 0};
    return WSAPoll(&entry, 1, static_cast<int>(std::ceil(left * 1e3))) > 0;
#else
    pollfd entry = {handle, static_cast<short>(what == WaitFor::kReadable ? POLLIN : POLLOUT), 0};
#if defined(__APPLE__)  // has no ppoll
    const int ready = poll(&entry, 1, static_cast<int>(std::ceil(left * 1e3)));
#else
    timespec time;
    time.tv_sec = static_cast<time_t>(left);
    time.tv_nsec = static_cast<long>((left - std::floor(left)) * 1e9);
    const int ready = ppoll(&entry, 1, &time, nullptr);
#endif
    if (ready >= 0 || errno != EINTR) return ready > 0;
#endif
  }
}

/// The system has no more of something that a connection takes.
bool IsShortage(const asio::error_code& error) {
  const asio::error_code none_on_the_machine(ENFILE, asio::error::get_system_category());
  return error == asio::error::no_descriptors || error == none_on_the_machine || error == asio::error::no_memory ||
         error == asio::error::no_buffer_space;
}

Status SocketShortage(const std::string& what, const asio::error_code& error) {
  return {StatusCode::kResourceExhausted,
          what + ": " + error.message() + "; close other connections, or raise the limit of open files (ulimit -n)"};
}

/// Ok when the system has the descriptors that a context takes, at most four: two and two.
Status CheckDescriptors(const std::string& what) {
#if !defined(_WIN32)
  int ends[4] = {-1, -1, -1, -1};
  const bool enough = pipe(ends) == 0 && pipe(ends + 2) == 0;
  const asio::error_code error(errno, asio::error::get_system_category());
  for (const int end : ends) {
    if (end >= 0) close(end);
  }
  if (!enough) return SocketShortage(what, error);
#else
  (void)what;
#endif
  return Status::Ok();
}

using ContextPointer = std::shared_ptr<asio::io_context>;

/// All sockets hang on one context, so that each costs one descriptor and not four. It comes with the first and goes
/// with the last. Asio ends the program where there are no descriptors for it, so they are tried first.
Result<ContextPointer> SocketContext() {
  static std::mutex mutex;
  static std::weak_ptr<asio::io_context> present;
  const std::lock_guard lock(mutex);
  ContextPointer context = present.lock();
  if (context != nullptr) return context;
  CONSAC_RETURN_IF_ERROR(CheckDescriptors("cannot open a socket"));
  context = std::make_shared<asio::io_context>();
  const tcp::socket takes_them(*context);
  present = context;
  return context;
}

std::string EndpointText(const tcp::endpoint& endpoint) {
  return endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

Status PeerGone(const std::string& peer, const asio::error_code& error) {
  const bool closed = error == asio::error::eof;
  return {StatusCode::kUnavailable,
          closed ? peer + " closed the connection" : "the connection to " + peer + " broke: " + error.message()};
}

/// A peer whose machine is gone says nothing and closes nothing: the kernel asks it, and finds out within 30 s.
void WatchPeer(tcp::socket& socket) {
  asio::error_code ignored;
  socket.set_option(asio::socket_base::keep_alive(true), ignored);
#if defined(__linux__)
  constexpr int kQuiet = 10, kBetween = 5, kUnanswered = 4;  // s, s, times
  constexpr int kUntaken = 30'000;                           // ms that data which was sent may stay unacknowledged
  constexpr std::pair<int, int> kOptions[] = {
      {TCP_KEEPIDLE, kQuiet}, {TCP_KEEPINTVL, kBetween}, {TCP_KEEPCNT, kUnanswered}, {TCP_USER_TIMEOUT, kUntaken}};
  for (const auto& [name, value] : kOptions)
    (void)setsockopt(socket.native_handle(), IPPROTO_TCP, name, &value, sizeof(value));
#endif
}

/// A program that the host starts, an engine its trainer, does not inherit the socket: it would keep the port taken.
void KeepFromChildren(tcp::socket::native_handle_type handle) {
#if defined(_WIN32)
  const SOCKET socket = handle;
  (void)SetHandleInformation(reinterpret_cast<HANDLE>(socket), HANDLE_FLAG_INHERIT, 0);
#else
  (void)fcntl(handle, F_SETFD, FD_CLOEXEC);
#endif
}

class TcpTransport final : public Transport {
 public:
  TcpTransport(ContextPointer context, tcp::socket socket) : context_(std::move(context)), socket_(std::move(socket)) {
    asio::error_code ignored;
    socket_.set_option(tcp::no_delay(true), ignored);
    socket_.non_blocking(true, ignored);
    KeepFromChildren(socket_.native_handle());
    WatchPeer(socket_);
    const tcp::endpoint remote = socket_.remote_endpoint(ignored);
    peer_ = EndpointText(remote);
  }

  Result<std::size_t> Read(std::span<std::byte> into, double timeout_s) override {
    std::size_t count = 0;
    asio::error_code error;
    const auto ready = [&] {
      error.clear();
      count = socket_.read_some(asio::buffer(into.data(), into.size()), error);
      return error != asio::error::would_block && error != asio::error::try_again;
    };
    if (!socket_.is_open()) return Status{StatusCode::kUnavailable, "the connection to " + peer_ + " is closed"};
    if (!ready()) {
      if (timeout_s <= 0.0) return std::size_t{0};
      const double deadline = Now() + timeout_s;
      if (!spin_.Spin(timeout_s, ready)) {
        // A socket may wake without data; then the rest of the time is waited again.
        do {
          if (!WaitForSocket(socket_.native_handle(), WaitFor::kReadable, deadline - Now())) return std::size_t{0};
        } while (!ready() && Now() < deadline);
      }
    }
    if (error == asio::error::would_block || error == asio::error::try_again) return std::size_t{0};
    if (error) return PeerGone(peer_, error);
    return count;
  }

  Result<std::size_t> WriteSome(std::span<const std::byte> bytes, double timeout_s) override {
    if (!socket_.is_open()) return Status{StatusCode::kUnavailable, "the connection to " + peer_ + " is closed"};
    double deadline = 0.0;
    while (true) {
      asio::error_code error;
      const std::size_t count = socket_.write_some(asio::buffer(bytes.data(), bytes.size()), error);
      if (!error) return count;
      if (error != asio::error::would_block && error != asio::error::try_again) return PeerGone(peer_, error);
      if (timeout_s <= 0.0) return std::size_t{0};
      if (deadline == 0.0) deadline = Now() + timeout_s;
      if (Now() >= deadline || !WaitForSocket(socket_.native_handle(), WaitFor::kWritable, deadline - Now()))
        return std::size_t{0};
    }
  }

  void CloseWriting() override {
    asio::error_code ignored;
    if (socket_.is_open()) socket_.shutdown(tcp::socket::shutdown_send, ignored);
  }
  void Close() override {
    asio::error_code ignored;
    if (!socket_.is_open()) return;
    socket_.shutdown(tcp::socket::shutdown_both, ignored);
    socket_.close(ignored);
  }

  std::string peer() const override { return peer_; }

 private:
  const ContextPointer context_;  // outlives the socket
  tcp::socket socket_;
  std::string peer_;
  SpinBudget spin_;
};

class TcpListener final : public Listener {
 public:
  explicit TcpListener(const ContextPointer& context) : context_(context), acceptor_(*context) {}

  Status Open(const Endpoint& endpoint) {
    asio::error_code error;
    tcp::resolver resolver(*context_);
    const auto found = resolver.resolve(endpoint.host, std::to_string(endpoint.port), tcp::resolver::passive, error);
    if (error) CONSAC_RETURN_IF_ERROR(CheckDescriptors("cannot find host " + Quote(endpoint.host)));
    if (error || found.empty())
      return {StatusCode::kInvalidArgument, "cannot listen on host " + Quote(endpoint.host) + ": " + error.message()};
    const tcp::endpoint local = found.begin()->endpoint();
    acceptor_.open(local.protocol(), error);
    if (!error) KeepFromChildren(acceptor_.native_handle());
#if defined(_WIN32)
    // There reuse would let two programs listen on one port; a port whose connections linger is free anyway.
    using ExclusiveUse = asio::detail::socket_option::boolean<SOL_SOCKET, SO_EXCLUSIVEADDRUSE>;
    if (!error) acceptor_.set_option(ExclusiveUse(true), error);
#else
    if (!error) acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
#endif
    if (!error) acceptor_.bind(local, error);
    if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (!error) acceptor_.non_blocking(true, error);
    if (error == asio::error::address_in_use) {
      return {StatusCode::kAlreadyExists,
              "port " + std::to_string(endpoint.port) +
                  " is in use; stop what listens there, choose another port, or use port 0 for a free one"};
    }
    if (IsShortage(error)) return SocketShortage("cannot listen on port " + std::to_string(endpoint.port), error);
    if (error)
      return {StatusCode::kUnavailable,
              "cannot listen on " + endpoint.host + ":" + std::to_string(endpoint.port) + ": " + error.message()};
    port_ = acceptor_.local_endpoint(error).port();
    return Status::Ok();
  }

  Result<std::unique_ptr<Transport>> Accept(double timeout_s) override {
    if (!acceptor_.is_open())
      return Status{StatusCode::kFailedPrecondition, "the port is closed; open it before accepting"};
    if (timeout_s > 0.0 && !WaitForSocket(acceptor_.native_handle(), WaitFor::kReadable, timeout_s))
      return std::unique_ptr<Transport>();
    tcp::socket socket(*context_);
    asio::error_code error;
    acceptor_.accept(socket, error);
    if (error == asio::error::would_block || error == asio::error::try_again ||
        error == asio::error::connection_aborted)
      return std::unique_ptr<Transport>();
    if (error) return SocketShortage("cannot accept a connection on port " + std::to_string(port_), error);
    return std::unique_ptr<Transport>(std::make_unique<TcpTransport>(context_, std::move(socket)));
  }

  int port() const override {
    return port_;
  }

  void Close() override {
    asio::error_code ignored;
    acceptor_.close(ignored);
  }

 private:
  const ContextPointer context_;  // outlives the acceptor
  tcp::acceptor acceptor_;
  int port_ = 0;
};

/// A non-blocking connect with a deadline.
asio::error_code ConnectSocket(tcp::socket& socket, const tcp::endpoint& remote, double timeout_s) {
  asio::error_code error;
  socket.open(remote.protocol(), error);
  if (error) return error;
  socket.non_blocking(true, error);
  socket.native_non_blocking(true, error);
  // Asio's connect on a socket in user-set non-blocking mode returns would_block instead of waiting.
  socket.connect(remote, error);
  if (error != asio::error::would_block && error != asio::error::in_progress) return error;
  if (!WaitForSocket(socket.native_handle(), WaitFor::kWritable, timeout_s)) return asio::error::timed_out;
  int code = 0;
  socklen_t size = sizeof(code);
  getsockopt(socket.native_handle(), SOL_SOCKET, SO_ERROR, reinterpret_cast<char*>(&code), &size);
  return asio::error_code(code, asio::error::get_system_category());
}

}  // namespace

Result<std::unique_ptr<Listener>> ListenTcp(const Endpoint& endpoint) {
  const Result<ContextPointer> context = SocketContext();
  if (!context.ok()) return context.status();
  auto listener = std::make_unique<TcpListener>(*context);
  CONSAC_RETURN_IF_ERROR(listener->Open(endpoint));
  return std::unique_ptr<Listener>(std::move(listener));
}

Result<std::unique_ptr<Transport>> ConnectTcp(const Endpoint& endpoint, double timeout_s) {
  const Result<ContextPointer> context = SocketContext();
  if (!context.ok()) return context.status();
  const std::string where = endpoint.host + ":" + std::to_string(endpoint.port);
  asio::error_code error;
  tcp::resolver resolver(**context);
  const auto found = resolver.resolve(endpoint.host, std::to_string(endpoint.port), error);
  if (error) CONSAC_RETURN_IF_ERROR(CheckDescriptors("cannot find host " + Quote(endpoint.host)));
  if (error)
    return Status{StatusCode::kInvalidArgument, "cannot find host " + Quote(endpoint.host) + ": " + error.message()};
  for (const auto& entry : found) {
    tcp::socket socket(**context);
    error = ConnectSocket(socket, entry.endpoint(), timeout_s);
    if (!error) return std::unique_ptr<Transport>(std::make_unique<TcpTransport>(*context, std::move(socket)));
    if (IsShortage(error)) return SocketShortage("cannot connect to " + where, error);
  }
  return Status{StatusCode::kUnavailable,
                "nobody answers at " + where + " (" + error.message() + "); start the engine, or check host and port"};
}

}  // namespace consac
