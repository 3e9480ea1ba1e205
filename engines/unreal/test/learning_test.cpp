// Algorithms that learn at every step, of continuous actions, in the game: what they learn there is what they learn in
// a process of its own, bit for bit, and their models act.
#include "ConsacHyperparametersBase.h"
#include "engines/host/test/in_process.h"
#include "graphs.h"
#include "worlds/pendulum/pendulum.h"

namespace consac::testing {
namespace {

constexpr int kSwingEpisode = 200;
constexpr std::int64_t kSwingSteps = 5000;
const std::vector<std::pair<const char*, const char*>> kSwingSettings = {
    {"learning_rate", "2e-3"}, {"net_arch", "[32, 32]"}, {"batch_size", "64"},      {"gamma", "0.95"},
    {"buffer_size", "5000"},   {"train_freq", "1"},      {"learning_starts", "500"}};

class SwingHyperparameters final : public UConsacHyperparameters {
  SHIM_CLASS(SwingHyperparameters, UConsacHyperparameters)
  FString GetAlgorithm() const override { return algorithm; }
  void Collect(TArray<FConsacHyperparameter>& into) const override {
    for (const auto& [name, value] : kSwingSettings) AddText(into, *Text(name), Text(value));
  }
  FString algorithm = TEXT("sac");
};

/// A pendulum as an agent component, with the events that a person would bind.
class Swinging {
  struct Swing {
    worlds::Pendulum pendulum;
    Rng rng{0, 0};
    float seen[3] = {};
    int step = 0;
    double sum = 0.0;
    std::vector<double> returns;
    std::int64_t seed = -1;
  };
  std::shared_ptr<Swing> swing_ = std::make_shared<Swing>();

 public:
  explicit Swinging(Shim::Game& game) {
    AActor* actor = NewObject<AConsacTestActor>(&game.world());
    UConsacAgentComponent* agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    FConsacEntry seen, done;
    seen.Name = TEXT("swing");
    seen.Space = UConsacBlueprintLibrary::MakeBoxSpace(3, -8.0f, 8.0f);
    done.Name = TEXT("torque");
    done.Space = UConsacBlueprintLibrary::MakeBoxSpace(1, -2.0f, 2.0f);
    agent->Observations.Add(seen);
    agent->Actions.Add(done);
    agent->OnEpisodeBegin.ShimBind(agent, [swing = swing_](UConsacAgentComponent*, int64 seed_or_none) {
      if (seed_or_none >= 0) {
        swing->seed = seed_or_none;
        swing->rng = Rng(static_cast<std::uint64_t>(seed_or_none), StreamId("world"));
      }
      if (swing->step == kSwingEpisode) swing->returns.push_back(swing->sum);
      swing->step = 0;
      swing->sum = 0.0;
      swing->pendulum.Reset(swing->rng, swing->seen);
    });
    agent->OnObserve.ShimBind(agent, [swing = swing_](UConsacAgentComponent* which) {
      EXPECT_TRUE(which->SetObservationNumbers(TEXT("swing"), {swing->seen[0], swing->seen[1], swing->seen[2]}));
    });
    agent->OnAction.ShimBind(agent, [swing = swing_](UConsacAgentComponent* which) {
      const float torque = which->GetActionNumber(TEXT("torque"));
      const float reward = swing->pendulum.Step(&torque, swing->rng, swing->seen).reward;
      which->AddReward(reward);
      swing->sum += static_cast<double>(reward);
      if (++swing->step == kSwingEpisode) which->EndEpisode(EConsacEpisodeEnd::Truncated);
    });
    Shim::Enter(game.world(), *actor, FVector());
  }

  /// Mean return of the last episodes that were played to their end, -1600 where there were fewer.
  double MeanReturn(std::size_t episodes) const {
    if (swing_->returns.size() < episodes) return -1600.0;
    double sum = 0.0;
    for (std::size_t i = 0; i < episodes; ++i) sum += swing_->returns[swing_->returns.size() - 1 - i];
    return sum / static_cast<double>(episodes);
  }
  /// The latest that an episode began with; -1 for none.
  std::int64_t seed() const { return swing_->seed; }
};

AConsacTrainer* SpawnPendulumTrainer(Shim::Game& game, EConsacMode mode, std::vector<std::string>* errors) {
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = mode;
  trainer->LogSeconds = 0.0f;
  trainer->bLockStep = true;
  trainer->MaxStepsPerTick = 100;
  trainer->OnTrainerError.ShimBind(nullptr, [errors](const FString& error) { errors->push_back(Text(error)); });
  return trainer;
}

/// An algorithm, and the mean return that its model has at least; 0: in so few steps it learns too little to say.
struct Learned {
  const char* algorithm;
  double least;
};
class LearningInTheGame : public ::testing::TestWithParam<Learned> {};
INSTANTIATE_TEST_SUITE_P(Each, LearningInTheGame,
                         ::testing::Values(Learned{"sac", -400.0}, Learned{"ddpg", -400.0}, Learned{"td3", 0.0}),
                         [](const auto& tested) { return std::string(tested.param.algorithm); });

TEST_P(LearningInTheGame, IsWhatItIsInProcessAndItsModelActs) {
  const ScratchFolder scratch("unreal_swing");
  std::vector<std::string> errors;
  std::int64_t seed = -1;
  {
    Shim::Game game;
    Swinging agent(game);
    AConsacTrainer* trainer = SpawnPendulumTrainer(game, EConsacMode::Train, &errors);
    trainer->TotalSteps = kSwingSteps;
    trainer->Seed = 3;
    trainer->WhileLearning = EConsacWhileLearning::Wait;
    trainer->SaveFolder = Text(scratch.path());
    SwingHyperparameters* hyperparameters = NewObject<SwingHyperparameters>(trainer);
    hyperparameters->algorithm = Text(GetParam().algorithm);
    trainer->Hyperparameters = hyperparameters;
    int completed = 0;
    trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
    ASSERT_TRUE(TickUntil(
        200.0, [&] { game.Tick(); }, [&] { return completed > 0 || !errors.empty(); }));
    ASSERT_EQ(errors, std::vector<std::string>());
    EXPECT_EQ(trainer->GetTrainerProgress().Steps, kSwingSteps) << "none is lost";
    seed = agent.seed();
  }
  ASSERT_GE(seed, 0);
  host::TrainOptions options;
  options.algorithm = GetParam().algorithm;
  options.total_steps = kSwingSteps;
  options.seed = 3;
  for (const auto& [name, value] : kSwingSettings) options.hyperparameters.emplace_back(name, value);
  const auto alone = InProcess("pendulum-v1", 1, options, static_cast<std::uint64_t>(seed));
  const Result<Policy> learned = Policy::Load(scratch.path() + "/default.consac");
  ASSERT_TRUE(learned.ok()) << learned.status().message();
  EXPECT_GT(alone->updates(), 4000);
  EXPECT_EQ(learned->data().parameters, alone->Snapshot().parameters);

  Shim::Game game;
  Swinging agent(game);
  AConsacTrainer* trainer = SpawnPendulumTrainer(game, EConsacMode::Act, &errors);
  FConsacBehaviourModel model;
  model.Path = Text(scratch.path() + "/default.consac");
  trainer->Models.Add(model);
  ASSERT_TRUE(TickUntil(
      60.0, [&] { game.Tick(); }, [&] { return agent.MeanReturn(20) > -1600.0 || !errors.empty(); }));
  EXPECT_EQ(errors, std::vector<std::string>());
  if (GetParam().least < 0.0) {
    EXPECT_GT(agent.MeanReturn(20), GetParam().least) << "one that does nothing has -1200";
  }
}

}  // namespace
}  // namespace consac::testing
