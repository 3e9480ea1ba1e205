// Both transports: bytes arrive, waits end, ends are told apart, misuse is a Status. And spinning never starves the
// peer when both share a core.
#include "consac/transport/transport.h"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <thread>
#if defined(_WIN32)
#include <winsock2.h>
// after it
#include <windows.h>
#else
#include <fcntl.h>
#include <sys/stat.h>
#endif
#if defined(__linux__)
#include <pthread.h>
#include <sched.h>
#endif

#include "consac/base/hooks.h"

namespace consac {
namespace {

using Pair = std::pair<std::unique_ptr<Transport>, std::unique_ptr<Transport>>;

Pair TcpPair() {
  auto listener = ListenTcp({"127.0.0.1", 0});
  auto near_end = ConnectTcp({"127.0.0.1", (*listener)->port()}, 1.0);
  auto far_end = (*listener)->Accept(1.0);
  return {std::move(*near_end), std::move(*far_end)};
}

class BothTransports : public ::testing::TestWithParam<Pair (*)()> {};
INSTANTIATE_TEST_SUITE_P(Each, BothTransports, ::testing::Values(TcpPair, MakeInProcessPair));

TEST_P(BothTransports, CarriesBytesBothWays) {
  auto [a, b] = GetParam()();
  std::vector<std::byte> sent(200000), got;
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i * 7);
  std::thread writer([&, &a = a] { EXPECT_TRUE(a->Write(sent, 5.0).ok()); });
  std::byte buffer[5000];
  while (got.size() < sent.size()) {
    const auto count = b->Read(buffer, 5.0);
    ASSERT_TRUE(count.ok() && *count > 0);
    got.insert(got.end(), buffer, buffer + *count);
  }
  writer.join();
  EXPECT_EQ(got, sent);
}

TEST_P(BothTransports, AReadWithoutDataEndsInTime) {
  auto [a, b] = GetParam()();
  std::byte buffer[8];
  EXPECT_EQ(*a->Read(buffer, 0.0), 0u);
  const double start = Now();
  EXPECT_EQ(*a->Read(buffer, 0.05), 0u);
  EXPECT_GE(Now() - start, 0.045);
  EXPECT_LT(Now() - start, 2.0);
}

TEST_P(BothTransports, AClosedPeerIsUnavailableAndClosingTwiceDoesNothing) {
  auto [a, b] = GetParam()();
  const std::byte last{1};
  ASSERT_TRUE(b->Write({&last, 1}, 1.0).ok());
  b->Close();
  b->Close();
  std::byte buffer[8];
  EXPECT_EQ(*a->Read(buffer, 1.0), 1u);
  EXPECT_EQ(a->Read(buffer, 1.0).status().code(), StatusCode::kUnavailable);
  a->Close();
  EXPECT_FALSE(a->Write({&last, 1}, 1.0).ok());
}

TEST_P(BothTransports, APeerThatTakesNothingIsADeadline) {
  auto [a, b] = GetParam()();
  const std::vector<std::byte> much(64 << 20);
  EXPECT_EQ(a->Write(much, 0.1).code(), StatusCode::kDeadlineExceeded);
}

#if defined(__linux__)
// A job that is stopped and continued, or a debugger that attaches, interrupts system calls.
TEST(Tcp, ASignalDoesNotEndAWait) {
  struct sigaction action {};
  action.sa_handler = [](int) {};
  struct sigaction before {};
  ASSERT_EQ(sigaction(SIGUSR1, &action, &before), 0);
  auto [a, b] = TcpPair();
  const pthread_t reader = pthread_self();
  std::atomic<bool> over{false};
  std::thread disturber([&, sender = a.get()] {
    for (int i = 0; i < 20; ++i) {
      pthread_kill(reader, SIGUSR1);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    over = true;
    const std::byte byte{1};
    EXPECT_TRUE(sender->Write({&byte, 1}, 1.0).ok());
  });
  std::byte got{};
  const auto count = b->Read({&got, 1}, 5.0);
  EXPECT_TRUE(over) << "the wait ended with a signal";
  EXPECT_TRUE(count.ok() && *count == 1);
  disturber.join();
  sigaction(SIGUSR1, &before, nullptr);
}
#endif

TEST(Tcp, APortInUseAndAClosedPortAreNamed) {
  auto listener = ListenTcp({"127.0.0.1", 0});
  const int port = (*listener)->port();
  const auto second = ListenTcp({"127.0.0.1", port});
  EXPECT_EQ(second.status().code(), StatusCode::kAlreadyExists);
  EXPECT_NE(second.status().message().find(std::to_string(port)), std::string::npos);
  (*listener)->Close();
  (*listener)->Close();
  EXPECT_EQ((*listener)->Accept(0.0).status().code(), StatusCode::kFailedPrecondition);
  const auto nobody = ConnectTcp({"127.0.0.1", port}, 1.0);
  EXPECT_EQ(nobody.status().code(), StatusCode::kUnavailable);
  EXPECT_NE(nobody.status().message().find("nobody answers"), std::string::npos);
}

/// Sockets of this process that a program which it starts would inherit.
int InheritedSockets() {
  int count = 0;
#if defined(_WIN32)
  constexpr std::uintptr_t kHandles = 0x4000, kBetween = 4;
  for (std::uintptr_t value = kBetween; value < kHandles; value += kBetween) {
    int type = 0, size = sizeof(type);
    const bool is_socket =
        getsockopt(static_cast<SOCKET>(value), SOL_SOCKET, SO_TYPE, reinterpret_cast<char*>(&type), &size) == 0;
    DWORD flags = 0;
    if (is_socket && GetHandleInformation(reinterpret_cast<HANDLE>(value), &flags) != 0)
      count += (flags & HANDLE_FLAG_INHERIT) != 0 ? 1 : 0;
  }
#else
  constexpr int kDescriptors = 1024;
  for (int descriptor = 0; descriptor < kDescriptors; ++descriptor) {
    struct stat status {};
    const bool is_socket = fstat(descriptor, &status) == 0 && S_ISSOCK(status.st_mode);
    count += is_socket && (fcntl(descriptor, F_GETFD) & FD_CLOEXEC) == 0 ? 1 : 0;
  }
#endif
  return count;
}

TEST(Tcp, AProgramThatIsStartedInheritsNoSocket) {
  const int before = InheritedSockets();
  const auto listener = ListenTcp({"127.0.0.1", 0});
  ASSERT_TRUE(listener.ok());
  const auto ends = TcpPair();
  EXPECT_EQ(InheritedSockets(), before);
}

TEST(Tcp, AcceptingWithNobodyThereIsNull) {
  auto listener = ListenTcp({"127.0.0.1", 0});
  const auto accepted = (*listener)->Accept(0.01);
  ASSERT_TRUE(accepted.ok());
  EXPECT_EQ(*accepted, nullptr);
}

TEST(Endpoint, ParsesUrlsAndQuotesOthers) {
  const auto endpoint = Endpoint::Parse("tcp://localhost:5005");
  ASSERT_TRUE(endpoint.ok());
  EXPECT_EQ(endpoint->host, "localhost");
  EXPECT_EQ(endpoint->port, 5005);
  for (const char* text : {"tcp://[::1]:5005", "tcp://::1:5005"}) {
    const auto six = Endpoint::Parse(text);
    ASSERT_TRUE(six.ok()) << text;
    EXPECT_EQ(six->host, "::1");
    EXPECT_EQ(six->port, 5005);
  }
  for (const char* text : {"tcp://localhost", "localhost:99999", "tcp://:5005", "http://a:1/x", "tcp://a:b"}) {
    const auto bad = Endpoint::Parse(text);
    ASSERT_FALSE(bad.ok()) << text;
    EXPECT_NE(bad.status().message().find(text), std::string::npos);
  }
}

#if defined(__linux__)
// Pure spinning would give 125 round trips a second here: one per time slice.
TEST(Tcp, BothEndsOnOneCoreKeepFiveThousandRoundTrips) {
  auto [a, b] = TcpPair();
  const auto pin = [] {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(0, &set);
    sched_setaffinity(0, sizeof(set), &set);
  };
  constexpr int kRounds = 2000;
  std::thread echo([&, &b = b] {
    pin();
    std::byte byte;
    for (int i = 0; i < kRounds; ++i) {
      if (!b->Read({&byte, 1}, 5.0).ok() || !b->Write({&byte, 1}, 5.0).ok()) return;
    }
  });
  double seconds = 0;
  std::thread caller([&, &a = a] {
    pin();
    std::byte byte{1};
    const double start = Now();
    for (int i = 0; i < kRounds; ++i) {
      if (!a->Write({&byte, 1}, 5.0).ok() || !a->Read({&byte, 1}, 5.0).ok()) return;
    }
    seconds = Now() - start;
  });
  caller.join();
  echo.join();
  ASSERT_GT(seconds, 0.0);
  // A loaded machine may be slower than 5,000 a second; a spinning pair would take 16 s.
  EXPECT_LT(seconds, 4.0);
}
#endif

}  // namespace
}  // namespace consac
