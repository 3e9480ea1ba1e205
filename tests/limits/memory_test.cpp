// Memory runs out: what was learned is saved, whoever is served goes on, a further trainer is turned away.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "run/src/session.h"
#include "tests/faults/fault_peers.h"
#include "tests/limits/limited.h"

namespace consac::testing {
namespace {

/// Address space that this process has taken.
rlim_t AddressSpace() {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

/// What a world takes in every step.
struct Greed {
  std::size_t piece;  ///< bytes
  int pieces;
};

/// A world that takes more and more memory from step kBegins on, while no more than this process has by then is to be
/// had.
class HoardingWorld final : public PlainWorld {
 public:
  explicit HoardingWorld(Greed greed) : PlainWorld(*Space::Discrete(4), *Space::Discrete(2)), greed_(greed) {}
  void Step(std::span<Batch> batches) override {
    PlainWorld::Step(batches);
    if (stepped() == kBegins && !limited_.exchange(true)) Impose({{RLIMIT_AS, AddressSpace()}});
    for (int i = 0; i < greed_.pieces && stepped() >= kBegins; ++i)
      hoard_.push_back(std::make_unique<std::byte[]>(greed_.piece));
  }

 private:
  static constexpr int kBegins = 500;
  static inline std::atomic<bool> limited_{false};  // by the first of several
  const Greed greed_;
  std::vector<std::unique_ptr<std::byte[]>> hoard_;
};

/// Trains on `worlds` hoarding worlds, several of them on threads of their own. 0 when that ended for want of memory,
/// said what is saved, and saved it.
int TrainUntilShort(const std::string& folder, Greed greed, int worlds = 1) {
  const std::atomic<bool> never{false};
  run::RunConfig config;
  config.world = "plain-v0";
  config.directory = folder;
  config.name = "short";
  config.steps = 1000000;
  config.table = config.progress = config.tensorboard = false;
  config.hyperparameters = {{"n_steps", "32"}};
  std::vector<run::WorldSource> sources;
  for (int i = 0; i < worlds; ++i)
    sources.push_back({run::MakeLocalLink(std::make_unique<HoardingWorld>(greed)), nullptr});
  const Result<run::RunSummary> summary = run::RunSession(config, run::Length::kOfCaller, std::move(sources), never);
  if (summary.ok()) return 1;
  std::printf("%s\n", summary.status().message().c_str());
  if (summary.status().code() != StatusCode::kResourceExhausted) return 2;
  if (summary.status().message().find("what was learned is saved") == std::string::npos) return 3;
  if (!Policy::Load(folder + "/short/model.consac").ok()) return 4;
  return std::filesystem::is_empty(folder + "/short/checkpoints") ? 5 : 0;
}

// Little enough for first aid; all that is found, bit by bit; beyond all that is kept aside.
constexpr Greed kLittle{64 << 10, 1}, kAll{64 << 10, 8192}, kMuch{std::size_t{1} << 32, 1};

TEST(LimitOfMemory, ATrainingThatRunsShortSavesWhatItHasLearned) {
  for (const Greed greed : {kLittle, kAll, kMuch}) {
    ScratchFolder scratch("short");
    EXPECT_EQ(InChild([&] { return TrainUntilShort(scratch.path(), greed); }), 0)
        << greed.piece << " x " << greed.pieces;
  }
}

// Where the machine has too little, another limit of the run's own gives it no more.
TEST(LimitOfMemory, AReplayThatTheMachineHasNoMemoryForIsNotTheRunsLimit) {
  ScratchFolder scratch("replay");
  EXPECT_EQ(InChild([&] {
              run::RunConfig config;
              config.world = "cartpole-v1";
              config.algorithm = "dqn";
              config.directory = scratch.path();
              config.name = "replay";
              config.max_memory_mib = 64 << 10;
              config.hyperparameters = {{"buffer_size", "100000000"}};
              Impose({{RLIMIT_AS, AddressSpace() + (rlim_t{1} << 30)}});
              const std::atomic<bool> never{false};
              const Status refused = run::Train(config, never).status();
              std::printf("%s\n", refused.message().c_str());
              const bool advised = refused.message().find("max_memory_mib") != std::string::npos;
              return refused.message().ends_with("more than there is; lower buffer_size") && !advised ? 0 : 1;
            }),
            0);
}

// Eigen, which fresh weights are made with, was compiled without exceptions: it went on with nothing.
TEST(LimitOfMemory, WeightsThatCannotBeMadeAreNoCrash) {
  ScratchFolder scratch("wide");
  EXPECT_EQ(InChild([&] {
              run::RunConfig config;
              config.world = "cartpole-v1";
              config.directory = scratch.path();
              config.table = config.progress = config.tensorboard = false;
              config.hyperparameters = {{"net_arch", "[2000, 2000]"}, {"n_steps", "64"}};
              Impose({{RLIMIT_AS, AddressSpace() + (rlim_t{120} << 20)}});
              const std::atomic<bool> never{false};
              try {
                const Result<run::RunSummary> summary = run::Train(config, never);
                return summary.ok() ? 1 : summary.status().code() == StatusCode::kResourceExhausted ? 0 : 2;
              } catch (const std::bad_alloc&) {  // the program's main says so
                return 0;
              }
            }),
            0);
}

// Two at once, each of which takes what it finds: what is kept for saving is there for saving all the same.
TEST(LimitOfMemory, SoDoesOneThatRunsShortOnAWorkersThread) {
  for (const Greed greed : {kLittle, kAll, kMuch}) {
    for (int i = 0; i < 3; ++i) {
      ScratchFolder scratch("threads");
      EXPECT_EQ(InChild([&] { return TrainUntilShort(scratch.path(), greed, 2); }), 0)
          << greed.piece << " x " << greed.pieces;
    }
  }
}

/// Lines of `text` that are no warnings.
int Errors(const std::string& text) {
  return Count("\n" + text, "\n") - 1 - Count("\n" + text, "\nwarning: ");
}

// From too little for anything to enough for all of it; what lies below is the loader's.
TEST(LimitOfMemory, ATrainingTrainsOrSaysInOneLineWhyNotWhateverTheLimit) {
  for (rlim_t mebibytes = 20; mebibytes <= 400; mebibytes += mebibytes < 120 ? 10 : 70) {
    ScratchFolder scratch("begin");
    const Outcome left = Program(scratch.path(),
                                 {"train", "road-v0", "--steps", "300", "--name", "few", "--no-table", "--no-progress",
                                  "--threads", "4"},
                                 {.limits = {{RLIMIT_AS, mebibytes << 20}}})
                             .Wait();
    if (left.error.find("loading shared libraries") != std::string::npos) continue;
    const bool trained = std::filesystem::exists(scratch.path() + "/runs/few/model.consac");
    EXPECT_TRUE(left.code == 6 || (left.code == 0 && trained)) << mebibytes << ": " << left.code << " " << left.error;
    EXPECT_EQ(Errors(left.error), left.code == 0 ? 0 : 1) << mebibytes << ": " << left.error;
  }
}

// A new run that does not fit leaves the one that it was to overwrite.
TEST(LimitOfMemory, WhateverTheLimitOneRunOrTheOtherIsWhole) {
  ScratchFolder scratch("overwrite");
  const auto train = [&](const std::vector<std::string>& more, const ProgramOptions& options) {
    std::vector<std::string> arguments = {"train", "cartpole-v1", "--algo", "dqn",        "--steps",
                                          "300",   "--name",      "few",    "--no-table", "--no-progress"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Program(scratch.path(), arguments, options).Wait();
  };
  ASSERT_EQ(train({"--set", "net_arch=[16]", "buffer_size=1000"}, {}).code, 0);
  const std::string run = scratch.path() + "/runs/few", old = TextOf(run + "/config.yaml");
  int kept = 0;
  for (const auto& [resource, mebibytes] : {std::pair{RLIMIT_AS, 28},
                                            {RLIMIT_AS, 34},
                                            {RLIMIT_AS, 40},
                                            {RLIMIT_AS, 46},
                                            {RLIMIT_AS, 52},
                                            {RLIMIT_AS, 60},
                                            {RLIMIT_DATA, 1},
                                            {RLIMIT_DATA, 10},
                                            {RLIMIT_DATA, 16},
                                            {RLIMIT_DATA, 20},
                                            {RLIMIT_DATA, 24}}) {
    const Outcome left = train({"--force", "--set", "net_arch=[512, 512]", "buffer_size=100000"},
                               {.limits = {{resource, static_cast<rlim_t>(mebibytes) << 20}}});
    if (left.error.find("loading shared libraries") != std::string::npos) continue;
    EXPECT_TRUE(left.code == 0 || left.code == 6) << mebibytes << ": " << left.code << " " << left.error;
    EXPECT_TRUE(Policy::Load(run + "/model.consac").ok()) << mebibytes << ": " << left.error;
    int checkpoints = 0;
    for (const auto& entry : std::filesystem::directory_iterator(run + "/checkpoints"))
      checkpoints += entry.path().filename().string().starts_with("step_") ? 1 : 0;
    EXPECT_GT(checkpoints, 0) << mebibytes << ": " << left.error;
    kept += TextOf(run + "/config.yaml") == old ? 1 : 0;
  }
  EXPECT_GT(kept, 0) << "some of these limits are below what the new run needs";
}

TEST(LimitOfMemory, ASmallStackIsEnough) {
  for (const rlim_t kibibytes : {128, 256, 512, 1024, 1040}) {
    ScratchFolder scratch("stack");
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"train", "road-v0", "--steps", "300", "--name", "few", "--no-table"},
          std::vector<std::string>{"eval", "few", "--episodes", "1", "--max-episode-steps", "20"}}) {
      const Outcome left = Program(scratch.path(), arguments, {.limits = {{RLIMIT_STACK, kibibytes << 10}}}).Wait();
      EXPECT_EQ(left.code, 0) << kibibytes << " KiB, " << arguments[0] << ": " << left.error;
    }
  }
  ScratchFolder scratch("no_stack");
  const Outcome left = Program(scratch.path(), {"list", "worlds"}, {.limits = {{RLIMIT_STACK, 64 << 10}}}).Wait();
  EXPECT_EQ(left.code, 6) << left.error;
  EXPECT_EQ(Count(left.error, "ulimit -s"), 1) << left.error;
}

// Pictures are the last thing that memory is for.
TEST(LimitOfMemory, ACurveThatCannotBeDrawnIsAWarning) {
  ScratchFolder scratch("curve");
  const Outcome left =
      Program(scratch.path(), {"train", "road-v0", "--steps", "300", "--name", "few", "--no-table", "--threads", "1"},
              {.limits = {{RLIMIT_AS, rlim_t{40} << 20}}})
          .Wait();
  EXPECT_EQ(left.code, 0) << left.error;
  EXPECT_EQ(Count(left.out + left.error, "warning: there is no curve: there is not enough free memory"), 1)
      << left.out << left.error;
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/runs/few/curve.svg"));
  EXPECT_TRUE(Policy::Load(scratch.path() + "/runs/few/model.consac").ok());
}

/// All memory that is to be had in pieces of kPiece, until it goes out of scope; smaller ones are left.
class Famine {
 public:
  Famine() {
    void* const crumbs = std::malloc(kPiece / 2);
    Impose({{RLIMIT_AS, AddressSpace()}});
    for (void* piece = std::malloc(kPiece); piece != nullptr; piece = std::malloc(kPiece)) {
      *static_cast<void**>(piece) = hoard_;
      hoard_ = piece;
    }
    std::free(crumbs);
  }
  ~Famine() {
    while (hoard_ != nullptr) std::free(std::exchange(hoard_, *static_cast<void**>(hoard_)));
  }

 private:
  static constexpr std::size_t kPiece = 60 << 10;
  void* hoard_ = nullptr;
};

TEST(LimitOfMemory, AReaderWithoutRoomSaysSoAtOnce) {
  EXPECT_EQ(InChild([] {
              const Famine famine;
              FrameReader reader;
              Frame frame;
              return reader.Next(&frame).status().code() == StatusCode::kResourceExhausted ? 0 : 1;
            }),
            0);
}

TEST(LimitOfMemory, AConnectionThatCannotBeReadIsTurnedAwayAtOnce) {
  EXPECT_EQ(InChild([] {
              const auto env = (*worlds::FindWorld("cartpole-v1"))->create(1);
              EnvServerOptions options;
              options.training_length = 100;
              const auto server = *EnvServer::Create(*env, *ListenTcp({"127.0.0.1", 0}), options);
              const auto trainer = *ConnectTcp({"127.0.0.1", server->port()}, 2.0);
              {
                const Famine famine;
                (void)server->Poll(0.5);
              }
              return Listen(*trainer, 0.5).starts_with("busy: this engine has no memory") ? 0 : 1;
            }),
            0);
}

TEST(LimitOfMemory, AFurtherTrainerThatCannotBeAffordedHearsCapacityAndTheOthersGoOn) {
  ScratchFolder scratch("capacity");
  Program program(scratch.path(), {"serve", "cartpole-v1", "--port", "0", "--port-file", "port", "--envs", "100000"},
                  {.limits = {{RLIMIT_AS, rlim_t{400} << 20}}});
  ASSERT_TRUE(Soon([&] { return !TextOf(scratch.path() + "/port").empty(); })) << program.error();
  const int port = std::stoi(TextOf(scratch.path() + "/port"));
  std::vector<std::unique_ptr<RawTrainer>> served;
  std::string refused;
  for (int i = 0; i < 16 && refused.empty(); ++i) {
    auto trainer = std::make_unique<RawTrainer>(*ConnectTcp({"127.0.0.1", port}, 2.0));
    trainer->Send(FrameType::kHello, 0, EncodeHello({}));
    const Frame answer = trainer->Next();
    if (answer.header.type == FrameType::kWelcome) {
      trainer->Send(FrameType::kConfigure, 1, "{}");
      EXPECT_EQ(trainer->Next().header.type, FrameType::kSpec);
      served.push_back(std::move(trainer));
      continue;
    }
    refused = answer.header.type == FrameType::kError ? ParseError(answer.payload)->code : "the connection's end";
  }
  EXPECT_EQ(refused, "CAPACITY") << program.error();
  EXPECT_GE(served.size(), 1u);
  for (const auto& trainer : served) {
    trainer->Send(FrameType::kPing, 0, "");
    EXPECT_EQ(trainer->Next().header.type, FrameType::kPong);
  }
  program.Signal(SIGTERM);
  EXPECT_EQ(program.Wait().code, 130);
}

}  // namespace
}  // namespace consac::testing
