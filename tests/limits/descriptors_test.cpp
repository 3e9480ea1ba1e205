// Descriptors run out: what is there goes on, what cannot be had is one line, nothing spins and nothing is lost.
#include <sys/socket.h>

#include <memory>

#include "tests/faults/fault_peers.h"
#include "tests/limits/limited.h"

namespace consac::testing {
namespace {

int OpenDescriptors() {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) count += entry.exists() ? 1 : 0;
  return count;
}

TEST(LimitOfDescriptors, AConnectionCostsOneAtEachEnd) {
  const auto listener = *ListenTcp({"127.0.0.1", 0});
  constexpr int kConnections = 10;
  std::vector<std::unique_ptr<Transport>> ends;
  const int before = OpenDescriptors();
  for (int i = 0; i < kConnections; ++i) {
    ends.push_back(*ConnectTcp({"127.0.0.1", listener->port()}, 2.0));
    ends.push_back(*listener->Accept(2.0));
    ASSERT_NE(ends.back(), nullptr);
  }
  EXPECT_EQ(OpenDescriptors() - before, 2 * kConnections);
  ends.clear();
  EXPECT_EQ(OpenDescriptors(), before);
}

/// Listens and connects until the descriptors are used up: 0 when that was a Status wherever it came.
int UseThemUp(rlim_t limit) {
  Impose({{RLIMIT_NOFILE, limit}});
  const auto listener = ListenTcp({"127.0.0.1", 0});
  if (!listener.ok()) return listener.status().code() == StatusCode::kResourceExhausted ? 0 : 1;
  std::vector<std::unique_ptr<Transport>> ends;
  while (true) {
    auto near_end = ConnectTcp({"127.0.0.1", (*listener)->port()}, 2.0);
    if (!near_end.ok()) return near_end.status().code() == StatusCode::kResourceExhausted ? 0 : 2;
    ends.push_back(std::move(*near_end));
    auto far_end = (*listener)->Accept(2.0);
    if (!far_end.ok()) return far_end.status().code() == StatusCode::kResourceExhausted ? 0 : 3;
    if (*far_end == nullptr) return 4;
    ends.push_back(std::move(*far_end));
  }
}

TEST(LimitOfDescriptors, NeitherEndDiesOfIt) {
  for (rlim_t limit = 3; limit < 40; ++limit) EXPECT_EQ(InChild([&] { return UseThemUp(limit); }), 0) << limit;
}

TEST(LimitOfDescriptors, TheProgramTakesWhatTheHardLimitHas) {
  ScratchFolder scratch("hard");
  Program program(scratch.path(), {"serve", "road-v0", "--port", "0", "--port-file", "port"},
                  {.limits = {{RLIMIT_NOFILE, 64, 16}}});
  ASSERT_TRUE(Soon([&] { return !TextOf(scratch.path() + "/port").empty(); })) << program.error();
  std::istringstream limits(TextOf("/proc/" + std::to_string(program.pid()) + "/limits"));
  std::string line;
  while (std::getline(limits, line) && !line.starts_with("Max open files")) continue;
  std::istringstream values(line.substr(std::string("Max open files").size()));
  int soft = 0, hard = 0;
  values >> soft >> hard;
  EXPECT_EQ(soft, 64) << line;
  EXPECT_EQ(hard, 64) << line;
}

TEST(LimitOfDescriptors, SharedMemoryThatCannotBeHadIsDoneWithout) {
  Engine engine;
  EXPECT_EQ(InChild([&] {
              // Enough for the connection, not for the memory beside it.
              auto transport = engine.Connect();
              Impose({{RLIMIT_NOFILE, 256}});
              while (dup(STDIN_FILENO) >= 0) {
              }
              EnvClientOptions options;
              options.protocol = Protocol::kProtocol2;
              const auto client = EnvClient::Open(std::move(transport), options);
              if (!client.ok()) ADD_FAILURE() << client.status().message();
              return client.ok() && (*client)->description().find("shared") == std::string::npos ? 0 : 1;
            }),
            0);
}

/// `consac serve` with few descriptors, and its port.
class Served {
 public:
  Served(const std::string& folder, rlim_t limit)
      : folder_(folder),
        program_(folder,
                 {"serve", "road-v0", "--port", "0", "--port-file", "port", "--trainers", "1000", "--envs", "2"},
                 {.limits = {{RLIMIT_NOFILE, limit}}}) {
    Soon([&] { return !TextOf(folder_ + "/port").empty() || !program_.error().empty(); });
    const std::string text = TextOf(folder_ + "/port");
    port_ = text.empty() ? 0 : std::stoi(text);
  }
  int port() const { return port_; }
  Program& program() { return program_; }

 private:
  std::string folder_;
  Program program_;
  int port_;
};

/// HELLO, and what comes back.
FrameType Greet(RawTrainer& trainer) {
  trainer.Send(FrameType::kHello, 0, EncodeHello({}));
  return trainer.Next().header.type;
}

TEST(LimitOfDescriptors, AServerServesWhoIsThereAndLaterWhoWaits) {
  ScratchFolder scratch("descriptors");
  Served served(scratch.path(), 24);
  ASSERT_GT(served.port(), 0) << served.program().error();
  const auto connect = [&] { return std::make_unique<RawTrainer>(*ConnectTcp({"127.0.0.1", served.port()}, 2.0)); };
  auto first = connect();
  ASSERT_EQ(Greet(*first), FrameType::kWelcome);
  std::vector<std::unique_ptr<RawTrainer>> others;  // more than there are descriptors
  for (int i = 0; i < 20; ++i) {
    others.push_back(connect());
    others.back()->Send(FrameType::kHello, 0, EncodeHello({}));
  }
  ASSERT_TRUE(Soon([&] { return Count(served.program().error(), "cannot accept") > 0; }));
  first->Send(FrameType::kConfigure, 1, "{}");
  EXPECT_EQ(first->Next().header.type, FrameType::kSpec) << "the session there goes on";
  auto last = connect();
  last->Send(FrameType::kHello, 0, EncodeHello({}));
  for (const auto& other : others) other->transport().Close();
  others.clear();
  EXPECT_EQ(last->Next().header.type, FrameType::kWelcome) << "served as soon as there is room";
  served.program().Signal(SIGTERM);
  const Outcome left = served.program().Wait();
  EXPECT_EQ(left.code, 130) << left.error;
  EXPECT_EQ(Count(left.error, "cannot accept"), 1) << left.error;
}

/// Seconds of a core.
double CpuSeconds(const rusage& used) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

TEST(LimitOfDescriptors, AServerThatLetsNobodyInWaitsWithoutSpinning) {
  int refused = 0;
  for (rlim_t limit = 5; limit < 12; ++limit) {
    ScratchFolder scratch("no_descriptors");
    Served served(scratch.path(), limit);
    if (served.port() == 0) {
      const Outcome left = served.program().Wait();
      EXPECT_EQ(left.code, 6) << limit << ": " << left.error;
      EXPECT_EQ(Count(left.error, "\n"), 1) << left.error;
      continue;
    }
    // The first two are let in where as many descriptors are left as it took to write the file of the port.
    const auto silent = ConnectTcp({"127.0.0.1", served.port()}, 2.0),
               other = ConnectTcp({"127.0.0.1", served.port()}, 2.0);
    const auto waiting = ConnectTcp({"127.0.0.1", served.port()}, 2.0);
    ASSERT_TRUE(silent.ok() && other.ok() && waiting.ok());
    std::byte bytes[64];
    (void)(*waiting)->Read(bytes, 0.3);  // nothing comes
    served.program().Signal(SIGTERM);
    rusage before{}, after{};
    getrusage(RUSAGE_CHILDREN, &before);
    const Outcome left = served.program().Wait();
    getrusage(RUSAGE_CHILDREN, &after);
    EXPECT_EQ(left.code, 130) << limit << ": " << left.error;
    EXPECT_LE(Count(left.out + left.error, "\n"), 3) << left.error;
    EXPECT_LT(CpuSeconds(after) - CpuSeconds(before), 1.0);
    refused += Count(left.error, "cannot accept");
  }
  EXPECT_GT(refused, 0) << "no limit let a server listen and nobody in";
}

TEST(LimitOfDescriptors, ATrainingWithoutThemIsOneLineAndAnExitCode) {
  for (rlim_t limit = 4; limit < 16; ++limit) {  // the system's loader takes one
    ScratchFolder scratch("files");
    const Outcome left =
        Program(scratch.path(), {"train", "road-v0", "--steps", "300", "--name", "few", "--no-table", "--no-progress"},
                {.limits = {{RLIMIT_NOFILE, limit}}})
            .Wait();
    EXPECT_TRUE(left.code == 0 || left.code == 6) << limit << ": " << left.code << " " << left.error;
    EXPECT_LE(Count(left.error, "\n"), 2) << limit << ": " << left.error;
    EXPECT_EQ(left.code == 0, std::filesystem::exists(scratch.path() + "/runs/few/model.consac")) << limit;
  }
}

}  // namespace
}  // namespace consac::testing
