// An agent with goals in the game: what it is paid, and that what is learned from goals that were not meant is what is
// learned in a process of its own, bit for bit.
#include <atomic>
#include <thread>

#include "ConsacHyperparametersBase.h"
#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "engines/host/test/in_process.h"
#include "graphs.h"
#include "worlds/point_reach/point_reach.h"

namespace consac::testing {
namespace {

constexpr int kReachEpisode = 50;
const std::vector<std::pair<const char*, const char*>> kReachSettings = {{"replay_buffer_class", "HerReplayBuffer"},
                                                                         {"learning_rate", "2e-3"},
                                                                         {"net_arch", "[32, 32]"},
                                                                         {"batch_size", "64"},
                                                                         {"gamma", "0.9"},
                                                                         {"train_freq", "1"},
                                                                         {"learning_starts", "200"}};

class ReachHyperparameters final : public UConsacHyperparameters {
  SHIM_CLASS(ReachHyperparameters, UConsacHyperparameters)
  FString GetAlgorithm() const override { return TEXT("sac"); }
  void Collect(TArray<FConsacHyperparameter>& into) const override {
    for (const auto& [name, value] : kReachSettings) AddText(into, *Text(name), Text(value));
  }
};

/// Point reach as an agent component, which is paid by its goals alone.
struct Reaching {
  explicit Reaching(Shim::Game& game) {
    AActor* actor = NewObject<AConsacTestActor>(&game.world());
    agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    for (const TCHAR* name : {TEXT("achieved_goal"), TEXT("desired_goal"), TEXT("observation")})
      agent->Observations.Add({name, UConsacBlueprintLibrary::MakeBoxSpace(2, -1.0f, 1.0f)});
    agent->Actions.Add({TEXT("move"), UConsacBlueprintLibrary::MakeBoxSpace(2, -1.0f, 1.0f)});
    agent->MaxEpisodeSteps = kReachEpisode;
    agent->GoalReward = EConsacGoalReward::Sparse;
    agent->OnEpisodeBegin.ShimBind(agent, [this](UConsacAgentComponent*, int64 seed_or_none) {
      if (seed_or_none >= 0) {
        seed = seed_or_none;
        rng = Rng(static_cast<std::uint64_t>(seed_or_none), StreamId("world"));
      }
      world.Reset(rng, seen);
    });
    agent->OnObserve.ShimBind(agent, [this](UConsacAgentComponent* which) {
      const TCHAR* names[3] = {TEXT("achieved_goal"), TEXT("desired_goal"), TEXT("observation")};
      for (int i = 0; i < 3; ++i) EXPECT_TRUE(which->SetObservationNumbers(names[i], {seen[2 * i], seen[2 * i + 1]}));
    });
    agent->OnAction.ShimBind(agent, [this](UConsacAgentComponent* which) {
      earned = which->GetEpisodeReward();
      const TArray<float> move = which->GetActionNumbers(TEXT("move"));
      if (which->GetEpisodeSteps() == 0) paid = 0.0f;
      sums_agree = sums_agree && earned == paid;
      if (earned != 0.0f) ++checked;
      paid += world.Step(move.GetData(), rng, seen).reward;
    });
    Shim::Enter(game.world(), *actor, FVector());
  }

  UConsacAgentComponent* agent = nullptr;
  worlds::PointReachSparse world;
  Rng rng{0, 0};
  float seen[6] = {}, paid = 0.0f, earned = 0.0f;
  bool sums_agree = true;  // Get Episode Reward is the sum of what the world would pay
  int checked = 0;
  std::int64_t seed = -1;
};

AConsacTrainer* SpawnReachTrainer(Shim::Game& game, EConsacMode mode, std::vector<std::string>* errors) {
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = mode;
  trainer->Port = 0;
  trainer->LogSeconds = 0.0f;
  trainer->bLockStep = true;
  trainer->MaxStepsPerTick = 100;
  trainer->OnTrainerError.ShimBind(nullptr, [errors](const FString& error) { errors->push_back(Text(error)); });
  return trainer;
}

TEST(Goals, WhatIsLearnedInTheGameIsWhatIsLearnedInProcessAndItReaches) {
  const ScratchFolder scratch("unreal_reach");
  std::vector<std::string> errors;
  std::int64_t seed = -1;
  host::TrainOptions options;
  options.algorithm = "sac";
  options.total_steps = 5000;
  options.seed = 3;
  for (const auto& [name, value] : kReachSettings) options.hyperparameters.emplace_back(name, value);
  {
    Shim::Game game;
    Reaching agent(game);
    AConsacTrainer* trainer = SpawnReachTrainer(game, EConsacMode::Train, &errors);
    trainer->TotalSteps = options.total_steps;
    trainer->Seed = static_cast<int64>(options.seed);
    trainer->WhileLearning = EConsacWhileLearning::Wait;
    trainer->SaveFolder = Text(scratch.path());
    trainer->Hyperparameters = NewObject<ReachHyperparameters>(trainer);
    int completed = 0;
    trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
    ASSERT_TRUE(TickUntil(
        200.0, [&] { game.Tick(); }, [&] { return completed > 0 || !errors.empty(); }));
    ASSERT_EQ(errors, std::vector<std::string>());
    seed = agent.seed;
    EXPECT_TRUE(agent.sums_agree);
    EXPECT_GT(agent.checked, 4000);
  }
  const auto alone = InProcess("point-reach-v0", 1, options, static_cast<std::uint64_t>(seed));
  const Result<Policy> learned = Policy::Load(scratch.path() + "/default.consac");
  ASSERT_TRUE(learned.ok()) << learned.status().message();
  EXPECT_GT(alone->updates(), 4000);
  EXPECT_EQ(learned->data().parameters, alone->Snapshot().parameters);

  Shim::Game game;
  Reaching agent(game);
  AConsacTrainer* trainer = SpawnReachTrainer(game, EConsacMode::Act, &errors);
  FConsacBehaviourModel model;
  model.Path = Text(scratch.path() + "/default.consac");
  trainer->Models.Add(model);
  ASSERT_TRUE(TickUntil(
      60.0, [&] { game.Tick(); }, [&] { return trainer->GetTrainerProgress().Episodes >= 50 || !errors.empty(); }));
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_GT(trainer->GetTrainerProgress().MeanEpisodeReward, -20.0f) << "who does not move has -49";
}

TEST(Goals, AreOfferedToATrainerElsewhere) {
  Shim::Game game;
  std::vector<std::string> errors;
  Reaching agent(game);
  AConsacTrainer* trainer = SpawnReachTrainer(game, EConsacMode::Serve, &errors);
  trainer->bLockStep = false;
  for (int k = 0; k < 3; ++k) game.Tick();
  const int port = trainer->GetTrainerPort();
  std::atomic<bool> done = false;
  bool prices = false;
  float paid[2] = {1.0f, 1.0f};
  std::thread elsewhere([&] {
    EnvClientOptions options;
    options.protocol = Protocol::kProtocol2;
    auto client = EnvClient::Open(*ConnectTcp({"127.0.0.1", port}, 2.0), options);
    if (client.ok()) {
      prices = (*client)->prices_goals();
      BatchBuffer rows((*client)->spec().behaviours[0]);
      const float seen[2][6] = {{0.5f, 0.5f, 0.5f, 0.52f, 0, 0}, {0.5f, 0.5f, 0.5f, 0.6f, 0, 0}};
      EXPECT_TRUE((*client)->Reset(1, {&rows.batch(), 1}).ok());
      const Status asked = (*client)->PriceGoals(0, reinterpret_cast<const std::byte*>(seen), 2, paid);
      EXPECT_TRUE(asked.ok()) << asked.message();
    }
    done = true;
  });
  EXPECT_TRUE(TickUntil(
      20.0, [&] { game.Tick(); }, [&] { return done.load(); }));
  elsewhere.join();
  EXPECT_TRUE(prices);
  EXPECT_EQ(paid[0], 0.0f);
  EXPECT_EQ(paid[1], -1.0f);
}

TEST(Goals, ThatAreNotObservedAreRefusedInOneLine) {
  Shim::Game game;
  std::vector<std::string> errors;
  Reaching agent(game);
  agent.agent->Observations[1].Name = TEXT("wanted");
  AConsacTrainer* trainer = SpawnReachTrainer(game, EConsacMode::Train, &errors);
  trainer->Hyperparameters = NewObject<ReachHyperparameters>(trainer);
  game.Tick();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("has a goal reward, but no observations 'achieved_goal' and 'desired_goal'"),
            std::string::npos)
      << errors[0];
}

}  // namespace
}  // namespace consac::testing
