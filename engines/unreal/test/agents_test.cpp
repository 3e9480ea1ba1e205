// Many agents under one Consac Trainer: every mode, agents that come and go, events that stop everything, fixed steps.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ConsacChase.h"
#include "ConsacHyperparametersBase.h"
#include "ConsacRoad.h"
#include "ConsacSubsystem.h"
#include "Misc/App.h"
#include "Stats/Stats.h"
#include "graphs.h"
#include "tests/files.h"

namespace consac::testing {
namespace {

using Agents = std::vector<std::unique_ptr<RoadAgent>>;

Agents Spawn(Shim::Game& game, int count) {
  Agents agents;
  for (int k = 0; k < count; ++k)
    agents.push_back(std::make_unique<RoadAgent>(game, static_cast<std::uint64_t>(k) + 1));
  return agents;
}

/// A trainer that begins at the first tick, and the errors that it told.
AConsacTrainer* SpawnTrainer(Shim::Game& game, EConsacMode mode, std::vector<std::string>* errors) {
  AConsacTrainer* trainer = game.Spawn<AConsacTrainer>();
  trainer->Mode = mode;
  trainer->Port = 0;
  trainer->LogSeconds = 0.001f;
  trainer->OnTrainerError.ShimBind(nullptr, [errors](const FString& error) { errors->push_back(Text(error)); });
  return trainer;
}

double TotalReward(const Agents& agents) {
  double sum = 0.0;
  for (const auto& agent : agents) sum += agent->reward;
  return sum;
}

/// Reward of a step, over so many ticks from now.
double RewardOfTicks(Shim::Game& game, const Agents& agents, int ticks) {
  const double reward = TotalReward(agents);
  long steps = 0;
  for (const auto& agent : agents) steps -= agent->steps;
  for (int k = 0; k < ticks; ++k) game.Tick();
  for (const auto& agent : agents) steps += agent->steps;
  return steps == 0 ? 0.0 : (TotalReward(agents) - reward) / static_cast<double>(steps);
}

class RoadHyperparameters final : public UConsacHyperparameters {
  SHIM_CLASS(RoadHyperparameters, UConsacHyperparameters)
  FString GetAlgorithm() const override { return TEXT("ppo2"); }
  void Collect(TArray<FConsacHyperparameter>& into) const override {
    // As `consac list worlds` suggests for the road.
    AddText(into, TEXT("learning_rate"), TEXT("lin_2e-3"));
    AddReal(into, TEXT("gamma"), 0.7);
    AddReal(into, TEXT("ent_coef"), 0.001);
    AddInteger(into, TEXT("noptepochs"), 10);
    AddText(into, TEXT("norm_obs"), TEXT("true"));
    AddInteger(into, TEXT("n_steps"), 64);
    AddText(into, TEXT("net_arch"), net);
  }
  FString net = TEXT("[32, 32]");
};

/// Whether the log says so.
bool Logged(const std::string& what) {
  return !Shim::LogLines(what).empty();
}

TEST(Agents, ByHandTheirOwnRulesDecide) {
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 4);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  for (int k = 0; k < 500; ++k) game.Tick();
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_TRUE(trainer->IsTraining());
  EXPECT_GE(agents[0]->steps, 498);
  EXPECT_GT(TotalReward(agents), 0.95 * 4 * 498);
  EXPECT_EQ(trainer->GetTrainerProgress().Steps, 4 * (agents[0]->steps - 1));
}

TEST(Agents, TrainInsideLearnsTheRoadAndSavesAModelThatActs) {
  const ScratchFolder scratch("unreal_inside");
  for (const EConsacWhileLearning pace : {EConsacWhileLearning::Wait, EConsacWhileLearning::GoOn}) {
    Shim::Game game;
    std::vector<std::string> errors;
    Agents agents = Spawn(game, 8);
    AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
    trainer->TotalSteps = 60000;
    trainer->WhileLearning = pace;
    trainer->SaveFolder = Text(scratch.path());
    trainer->bLockStep = pace == EConsacWhileLearning::Wait;
    trainer->MaxStepsPerTick = 100;
    trainer->Hyperparameters = NewObject<RoadHyperparameters>(trainer);
    int completed = 0;
    trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
    ASSERT_TRUE(TickUntil(
        100.0, [&] { game.Tick(); }, [&] { return completed > 0 || !errors.empty(); }));
    EXPECT_EQ(errors, std::vector<std::string>());
    EXPECT_GT(trainer->GetTrainerProgress().Updates, 0);
    // Afterwards the agents go on by what was learned.
    EXPECT_GT(RewardOfTicks(game, agents, 50), 0.9);
    auto policy = Policy::Load(scratch.path() + "/default.consac", 1);
    ASSERT_TRUE(policy.ok()) << policy.status().message();
    EXPECT_GT(RoadAccuracy(*policy), 0.9);
    EXPECT_EQ(completed, 1);
  }
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 3);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Act, &errors);
  FConsacBehaviourModel model;
  model.Path = Text(scratch.path() + "/default.consac");
  trainer->Models.Add(model);
  EXPECT_GT(RewardOfTicks(game, agents, 500), 0.9);
  EXPECT_EQ(errors, std::vector<std::string>());
}

TEST(Agents, ATrainingInsideWritesItsNumbersAndTheGamesOwnForTensorBoard) {
  const ScratchFolder scratch("unreal_log");
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 2);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  trainer->TotalSteps = 256;
  trainer->WhileLearning = EConsacWhileLearning::Wait;
  trainer->bLockStep = true;
  trainer->LogFolder = Text(scratch.path() + "/logs");
  trainer->Hyperparameters = NewObject<RoadHyperparameters>(trainer);
  int completed = 0;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
  const auto tick = [&] {
    trainer->NoteStat(TEXT("Goals"), 0.5f);
    game.Tick();
  };
  ASSERT_TRUE(TickUntil(60.0, tick, [&] { return completed > 0 || !errors.empty(); }));
  EXPECT_EQ(errors, std::vector<std::string>());
  std::string events;
  for (const auto& [path, text] : FilesBelow(scratch.path() + "/logs/PPO2_1"))
    events += path.find("events.out.tfevents.") != std::string::npos ? text : std::string();
  EXPECT_NE(events.find("game/goals"), std::string::npos);
  const std::string csv = TextOf(scratch.path() + "/logs/PPO2_1/progress.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3) << "two updates of two agents' 64 steps: " << csv;
  EXPECT_NE(csv.find("game/goals"), std::string::npos) << csv;
}

/// A trainer that learns in the game, waits for its learner, has no end of its own, and keeps its models in `folder`.
AConsacTrainer* SpawnLearner(Shim::Game& game, const std::string& folder, std::vector<std::string>* errors) {
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, errors);
  trainer->TotalSteps = 1000000;
  trainer->WhileLearning = EConsacWhileLearning::Wait;
  trainer->SaveFolder = Text(folder);
  trainer->bLockStep = true;
  trainer->Hyperparameters = NewObject<RoadHyperparameters>(trainer);
  return trainer;
}

void TickUntilItHasLearned(Shim::Game& game, const AConsacTrainer& trainer, std::int64_t updates) {
  EXPECT_TRUE(TickUntil(
      60.0, [&] { game.Tick(); }, [&] { return trainer.GetTrainerProgress().Updates >= updates; }));
}

TEST(Agents, StoppedEarlyKeepsWhatWasLearnedAndWritesOverNothingBeforeThat) {
  const ScratchFolder scratch("unreal_stopped");
  const std::string path = scratch.path() + "/new/default.stopped.consac";
  std::vector<std::string> errors;
  const auto train_until = [&](std::int64_t updates) {
    Shim::Game game;
    Agents agents = Spawn(game, 8);
    AConsacTrainer* trainer = SpawnLearner(game, scratch.path() + "/new", &errors);
    game.Tick();
    TickUntilItHasLearned(game, *trainer, updates);
    EConsacResult result = EConsacResult::Failed;
    FString error;
    trainer->SaveModel(TEXT("default"), Text(scratch.path() + "/by/hand/now.consac"), result, error);
    EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  };
  train_until(0);
  EXPECT_FALSE(std::filesystem::exists(path)) << "nothing was learned yet";
  EXPECT_TRUE(Policy::Load(scratch.path() + "/by/hand/now.consac", 1).ok()) << "Save Model makes its folder";
  train_until(2);
  EXPECT_TRUE(Policy::Load(path, 1).ok());
  const auto kept = std::filesystem::last_write_time(path);
  train_until(0);
  EXPECT_EQ(std::filesystem::last_write_time(path), kept);
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/new/default.consac")) << "that name is for finished ones";
  EXPECT_EQ(errors, std::vector<std::string>());
}

TEST(Agents, WhoeverHearsThatAModelCouldNotBeKeptMayStopOrStart) {
  std::vector<std::string> errors;
  Shim::Game game;
  Agents agents = Spawn(game, 8);
  AConsacTrainer* trainer = SpawnLearner(game, "/proc/nowhere", &errors);
  int told = 0;
  trainer->OnTrainerError.ShimBind(nullptr, [&](const FString&) {
    ++told;
    trainer->StopTraining();
    EConsacResult result = EConsacResult::Failed;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  });
  TickUntilItHasLearned(game, *trainer, 1);
  trainer->StopTraining();
  EXPECT_EQ(told, 1);
  EXPECT_TRUE(trainer->IsTraining()) << "it was started anew by whoever heard";
}

TEST(Agents, NothingIsStartedByATrainerThatLeaves) {
  std::vector<std::string> errors;
  Shim::Game game;
  Agents agents = Spawn(game, 8);
  AConsacTrainer* trainer = SpawnLearner(game, "/proc/nowhere", &errors);
  int told = 0;
  trainer->OnTrainerError.ShimBind(nullptr, [&](const FString&) {
    ++told;
    EConsacResult result = EConsacResult::Success;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Failed);
  });
  TickUntilItHasLearned(game, *trainer, 1);
  Shim::StreamOut(*trainer);
  EXPECT_EQ(told, 1);
  EXPECT_FALSE(trainer->IsTraining());
}

TEST(Agents, ATrainerOutsideTrainsThemAsOneBatchInLockStep) {
  const ProgramFolder scratch("unreal_serve");
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 8);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Serve, &errors);
  trainer->TotalSteps = 20000;
  trainer->MaxStepsPerTick = 100;
  trainer->bLockStep = true;
  trainer->MaxWaitSeconds = 0.05f;
  game.Tick();
  ASSERT_GT(trainer->GetTrainerPort(), 0);
  // The button takes host, port and hyperparameters from the trainer.
  trainer->Port = trainer->GetTrainerPort();
  trainer->Program.Program = Text(CONSAC_PROGRAM);
  trainer->Program.RunsFolder = Text(scratch.path());
  trainer->Program.RunName = TEXT("herd");
  trainer->Hyperparameters = NewObject<RoadHyperparameters>(trainer);
  trainer->StartProgram();
  int completed = 0;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
  ASSERT_TRUE(TickUntil(
      100.0, [&] { game.Tick(); }, [&] { return completed > 0 || !errors.empty(); }));
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_EQ(trainer->GetTrainerProgress().Steps, 20000);
  EXPECT_GT(Shim::ShownStat(TEXT("Milliseconds of a step")), 0.0f);
  EXPECT_GT(
      Shim::ShownStat(TEXT("Mean reward of an episode")) + static_cast<float>(trainer->GetTrainerProgress().Episodes),
      0.0f);
  trainer->StopProgram();
  auto policy = Policy::Load(scratch.path() + "/herd/model.consac", 1);
  ASSERT_TRUE(policy.ok()) << policy.status().message();
  EXPECT_GT(RoadAccuracy(*policy), 0.9);
}

TEST(Agents, DecisionPeriodAndEpisodeLengthAreKept) {
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 2);
  agents[0]->agent->DecisionPeriod = 3;
  agents[0]->agent->MaxEpisodeSteps = 10;
  SpawnTrainer(game, EConsacMode::ByHand, &errors);
  for (int k = 0; k < 301; ++k) game.Tick();
  EXPECT_EQ(agents[0]->steps, 101);
  EXPECT_EQ(agents[1]->steps, 101);
  EXPECT_EQ(agents[0]->seeds.size(), 11U);  // the first, and one after every ten decisions
  EXPECT_EQ(agents[1]->seeds.size(), 1U);
  EXPECT_EQ(agents[1]->agent->GetEpisodeSteps(), 100);
}

TEST(Agents, MisfitsAreNamed) {
  Shim::Game game;
  std::vector<std::string> errors;
  const auto trouble = [&](const std::function<void(AConsacTrainer&, Agents&)>& spoil) {
    Shim::Game own;
    std::vector<std::string> told;
    Agents agents = Spawn(own, 2);
    AConsacTrainer* trainer = SpawnTrainer(own, EConsacMode::ByHand, &told);
    spoil(*trainer, agents);
    for (int k = 0; k < 5; ++k) own.Tick();
    return told.empty() ? std::string() : told.front();
  };
  EXPECT_EQ(trouble([](AConsacTrainer&, Agents&) {}), "");
  EXPECT_NE(trouble([](AConsacTrainer&, Agents& agents) {
              agents[1]->agent->Actions[0].Space.Size = 4;
            }).find("behaviour 'default'"),
            std::string::npos);
  EXPECT_NE(
      trouble([](AConsacTrainer&, Agents& agents) { agents[0]->agent->Actions[0].Name = NAME_None; }).find("name"),
      std::string::npos);
  EXPECT_NE(
      trouble([](AConsacTrainer&, Agents& agents) { agents[0]->agent->Observations[0].Space.Size = 0; }).find("places"),
      std::string::npos);
  EXPECT_NE(trouble([](AConsacTrainer& trainer, Agents&) { trainer.Mode = EConsacMode::Act; }).find("model"),
            std::string::npos);
  EXPECT_NE(trouble([](AConsacTrainer& trainer, Agents&) {
              trainer.Mode = EConsacMode::Train;
              RoadHyperparameters* wrong = NewObject<RoadHyperparameters>(&trainer);
              wrong->net = TEXT("[no, numbers]");
              trainer.Hyperparameters = wrong;
            }).find("net_arch"),
            std::string::npos);
}

TEST(Agents, TheyComeAndGoAndTheirPlacesAreTakenOver) {
  for (const int room : {0, 6}) {
    Shim::Game game;
    std::vector<std::string> errors;
    Agents agents = Spawn(game, 4);
    AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
    trainer->RoomForAgents = room;
    Rng rng(3, 0);
    for (int k = 0; k < 2000; ++k) {
      if (rng.Below(20) == 0 && !agents.empty()) {
        const std::size_t which = static_cast<std::size_t>(rng.Below(static_cast<std::uint32_t>(agents.size())));
        Shim::Destroy(*agents[which]->actor);
        agents.erase(agents.begin() + static_cast<std::ptrdiff_t>(which));
      }
      if (rng.Below(20) == 0 && agents.size() < 4)
        agents.push_back(std::make_unique<RoadAgent>(game, static_cast<std::uint64_t>(k)));
      game.Tick();
      if (k % 500 == 0) Shim::Collect();
    }
    EXPECT_EQ(errors, std::vector<std::string>()) << "room " << room;
    EXPECT_TRUE(trainer->IsTraining());
  }
}

TEST(Agents, AnEventMayStopTheTrainingOrDestroyAnyone) {
  for (const int what : {0, 1, 2, 3}) {
    for (const int when : {0, 1, 2}) {
      Shim::Game game;
      std::vector<std::string> errors;
      Agents agents = Spawn(game, 3);
      AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
      int calls = 0;
      const auto strike = [&] {
        if (++calls != 5) return;
        if (what == 0) trainer->StopTraining();
        if (what == 1) Shim::Destroy(*trainer);
        if (what == 2) Shim::Destroy(*agents[0]->actor);
        if (what == 3) Shim::Destroy(*agents[2]->actor);
      };
      UConsacAgentComponent* agent = agents[1]->agent;
      if (when == 0) agent->OnObserve.ShimBind(nullptr, [&](UConsacAgentComponent*) { strike(); });
      if (when == 1) agent->OnAction.ShimBind(nullptr, [&](UConsacAgentComponent*) { strike(); });
      if (when == 2) agent->OnHeuristic.ShimBind(nullptr, [&](UConsacAgentComponent*) { strike(); });
      for (int k = 0; k < 30; ++k) game.Tick();
      EXPECT_GE(calls, 5);
      EXPECT_EQ(trainer->IsTraining(), what >= 2) << what << ", " << when;
      EXPECT_EQ(errors, std::vector<std::string>());
    }
  }
}

TEST(Agents, ATrainerThatDiesInAnEventLeavesTheAgentsToTheOneThatBegins) {
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 2);
  AConsacTrainer* first = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  AConsacTrainer* second = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  second->bAutoStart = false;
  int calls = 0;
  agents[0]->agent->OnAction.ShimBind(nullptr, [&](UConsacAgentComponent*) {
    if (++calls != 3) return;
    Shim::Destroy(*first);
    EConsacResult result = EConsacResult::Failed;
    FString error;
    second->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  });
  for (int k = 0; k < 3; ++k) game.Tick();
  ASSERT_GE(calls, 3);
  EXPECT_TRUE(second->IsTraining());
  const double before = TotalReward(agents);
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_GT(calls, 10) << "the agents act on";
  EXPECT_GT(TotalReward(agents), before) << "by their own rules";
  EXPECT_EQ(errors, std::vector<std::string>());
}

TEST(Agents, FixedStepsArePutBackHoweverItEnds) {
  FApp::SetUseFixedTimeStep(false);
  FApp::SetFixedDeltaTime(0.25);
  const auto untouched = [] { return !FApp::UseFixedTimeStep() && FApp::GetFixedDeltaTime() == 0.25; };
  for (const int end : {0, 1, 2, 3}) {
    Shim::Game game;  // ends the test where the project's physics settings are changed
    std::vector<std::string> errors;
    Agents agents = Spawn(game, 1);
    AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
    trainer->bFixedStep = true;
    trainer->FixedStepSeconds = 0.05f;
    EXPECT_TRUE(untouched());
    Shim::ForgetLog();
    game.Tick();
    EXPECT_TRUE(FApp::UseFixedTimeStep());
    EXPECT_FLOAT_EQ(static_cast<float>(FApp::GetFixedDeltaTime()), 0.05f);
    EXPECT_TRUE(Logged("Max Physics Delta Time")) << "a tick is longer than physics may do";
    if (end == 0) trainer->StopTraining();
    if (end == 1) Shim::Destroy(*trainer);
    if (end == 2) game.Travel();
    if (end < 3) {
      EXPECT_TRUE(untouched());
    }
  }
  EXPECT_TRUE(untouched());
}

TEST(Agents, FixedStepsOfTwoGamesAreKeptUntilTheLastEnds) {
  FApp::SetUseFixedTimeStep(false);
  FApp::SetFixedDeltaTime(0.25);
  Shim::Game game, other_game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 1), others = Spawn(other_game, 1);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  AConsacTrainer* other = SpawnTrainer(other_game, EConsacMode::ByHand, &errors);
  trainer->bFixedStep = other->bFixedStep = true;
  trainer->FixedStepSeconds = 0.05f;
  other->FixedStepSeconds = 0.1f;
  game.Tick();
  other_game.Tick();
  trainer->StopTraining();
  EXPECT_TRUE(FApp::UseFixedTimeStep());
  EXPECT_EQ(FApp::GetFixedDeltaTime(), static_cast<double>(0.1f));
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer->StartTraining(result, error);
  EXPECT_EQ(FApp::GetFixedDeltaTime(), static_cast<double>(0.05f));
  trainer->StopTraining();
  EXPECT_TRUE(FApp::UseFixedTimeStep());
  EXPECT_EQ(FApp::GetFixedDeltaTime(), static_cast<double>(0.1f)) << "its own ticks are as long as it wants them";
  other->StopTraining();
  EXPECT_FALSE(FApp::UseFixedTimeStep());
  EXPECT_EQ(FApp::GetFixedDeltaTime(), 0.25);
  EXPECT_EQ(errors, std::vector<std::string>());
}

TEST(Agents, DemonstrationsAreRecorded) {
  const ScratchFolder scratch("unreal_record");
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 2);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  trainer->RecordFolder = Text(scratch.path());
  for (int k = 0; k < 101; ++k) game.Tick();
  trainer->StopTraining();
  EXPECT_EQ(errors, std::vector<std::string>());
  const auto bytes = ReadFile(scratch.path() + "/default.safetensors");
  ASSERT_TRUE(bytes.ok()) << bytes.status().message();
  // Two agents' hundred steps of two floats each, at the least.
  EXPECT_GT(bytes->size(), 2U * 100U * 2U * sizeof(float));

  // No further one takes its place, and one in which nothing was done is no file.
  const auto start = [&] {
    EConsacResult result = EConsacResult::Failed;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  };
  for (const std::string name : {"default-2", "default-3"}) {
    start();
    for (int k = 0; k < 5; ++k) game.Tick();
    Shim::ForgetLog();
    trainer->StopTraining();
    EXPECT_NE(Shim::Log().back().find(name + ".safetensors"), std::string::npos) << Shim::Log().back();
    EXPECT_TRUE(std::filesystem::exists(scratch.path() + "/" + name + ".safetensors"));
  }
  start();
  trainer->StopTraining();
  EXPECT_FALSE(std::filesystem::exists(scratch.path() + "/default-4.safetensors"));
  const auto still = ReadFile(scratch.path() + "/default.safetensors");
  ASSERT_TRUE(still.ok());
  EXPECT_EQ(*still, *bytes) << "what was shown first is what it was";
  EXPECT_EQ(errors, std::vector<std::string>());
}

TEST(Agents, TwoTrainersOneAgentNoneAreSaid) {
  Shim::Game game;
  std::vector<std::string> errors, second_errors;
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  game.Tick();
  ASSERT_EQ(errors.size(), 1U) << "no agents, said once";
  Agents agents = Spawn(game, 1);
  AConsacTrainer* second = SpawnTrainer(game, EConsacMode::ByHand, &second_errors);
  second->bAutoStart = false;
  EConsacResult result = EConsacResult::Success;
  FString error;
  second->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  trainer->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  trainer->StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  UConsacSubsystem* subsystem = UConsacSubsystem::Of(trainer);
  ASSERT_NE(subsystem, nullptr);
  EXPECT_EQ(subsystem->GetTrainer(), trainer);
  EXPECT_EQ(subsystem->GetAgents().Num(), 1);
}

TEST(Agents, ForbiddenChoicesAreNotMade) {
  const ScratchFolder scratch("unreal_masks");
  Shim::Game game;
  std::vector<std::string> errors;
  Agents agents = Spawn(game, 2);
  int forbidden = 0;
  for (auto& agent : agents) {
    agent->agent->bForbidsChoices = true;
    agent->agent->OnObserve.ShimBind(nullptr, [](UConsacAgentComponent* which) {
      EXPECT_TRUE(which->SetChoiceAllowed(TEXT("walk"), 1, false));
      EXPECT_FALSE(which->SetChoiceAllowed(TEXT("walk"), 3, false));
      EXPECT_FALSE(which->SetChoiceAllowed(TEXT("fly"), 1, false));
    });
    agent->agent->OnAction.ShimBind(nullptr, [&forbidden](UConsacAgentComponent* which) {
      forbidden += which->GetActionChoice(TEXT("walk")) == 1 ? 1 : 0;
    });
  }
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  trainer->TotalSteps = 100000;
  for (int k = 0; k < 300; ++k) game.Tick();
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_GT(agents[0]->steps, 200);
  EXPECT_EQ(forbidden, 0);
}

TEST(Samples, TheRoadPlaysByItself) {
  Shim::Game game;
  AConsacRoad* road = game.SpawnWith<AConsacRoad>([](AConsacRoad& made) {
    made.Port = 0;
    made.StepsPerTick = 1000;
  });
  game.Tick();
  EXPECT_GT(road->Environment->GetTrainingPort(), 0);
  const ProgramFolder scratch("unreal_road");
  FConsacProgramSettings settings;
  settings.Program = Text(CONSAC_PROGRAM);
  settings.Port = road->Environment->GetTrainingPort();
  settings.RunsFolder = Text(scratch.path());
  FString error;
  UConsacTrainerProgram* program = NewObject<UConsacTrainerProgram>();
  ASSERT_TRUE(program->Start(settings, {}, error)) << Text(error);
  ASSERT_TRUE(TickUntil(
      100.0, [&] { game.Tick(); }, [&] { return road->Environment->IsTrainingCompleted(); }));
  EXPECT_GT(road->GetCoinsCollected(), 500);
  const FString model = program->GetModelPath();
  ASSERT_TRUE(TickUntil(
      30.0, [] { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }, [&] { return !program->IsRunning(); }));
  AConsacRoad* walker = game.SpawnWith<AConsacRoad>([&](AConsacRoad& made) { made.ModelPath = model; });
  for (int k = 0; k < 2000; ++k) game.Tick();
  EXPECT_GT(walker->GetCoinsCollected(), 80);
}

TEST(Samples, ARoadThatDoesNotBeginOpensNoPort) {
  for (const char* path : {"/nowhere/at/all.consac", ""}) {
    Shim::Game game;
    AConsacRoad* road = game.SpawnWith<AConsacRoad>([path](AConsacRoad& made) {
      made.Port = 0;
      made.ModelPath = Text(path);
      made.TrainingLength = *path == 0 ? -1 : 100;  // refused
    });
    Shim::ForgetLog();
    for (int k = 0; k < 3; ++k) game.Tick();
    EXPECT_EQ(road->Environment->GetTrainingPort(), 0) << path;
    EConsacConnection connection = EConsacConnection::Connected;
    FString error;
    road->Environment->TrainingConnection(connection, error);
    EXPECT_EQ(connection, EConsacConnection::Failed) << path << ": it was never set up";
  }
}

TEST(Samples, TheChaseIsLearnedInside) {
  Shim::Game game;
  AConsacChase* chase = game.Spawn<AConsacChase>();
  chase->Trainer->Mode = EConsacMode::Train;
  chase->Trainer->TotalSteps = 200000;
  chase->Trainer->WhileLearning = EConsacWhileLearning::Wait;
  chase->Trainer->bLockStep = true;
  std::vector<std::string> errors;
  chase->Trainer->OnTrainerError.ShimBind(nullptr, [&errors](const FString& error) { errors.push_back(Text(error)); });
  const auto catches_of = [&](int ticks) {
    const int before = chase->GetCatches();
    for (int k = 0; k < ticks; ++k) game.Tick();
    return chase->GetCatches() - before;
  };
  const int first = catches_of(1000);
  ASSERT_TRUE(TickUntil(
      100.0, [&] { game.Tick(); },
      [&] { return chase->Trainer->GetTrainerProgress().Steps >= 200000 || !errors.empty(); }));
  const int last = catches_of(1000);
  EXPECT_EQ(errors, std::vector<std::string>());
  EXPECT_GT(last, 3 * first) << first;
}

}  // namespace
}  // namespace consac::testing
