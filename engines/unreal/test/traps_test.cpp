// What stood in the way when a plug-in was tried with a game of one's own: each fails without its mend.
#include <algorithm>

#include "ConsacCameraSensorComponent.h"
#include "ConsacHyperparameters.h"
#include "Misc/App.h"
#include "consac/policy/training_facts.h"
#include "random_policy.h"

namespace consac::testing {
namespace {

bool Logged(const std::string& what) {
  return std::any_of(Shim::Log().begin(), Shim::Log().end(),
                     [&](const std::string& line) { return line.find(what) != std::string::npos; });
}

/// The model of an agent that sees "coin" and "place", one number each, and does "aim" and "move": random weights.
Policy TwoByTwo(const char* coin = "coin", const char* place = "place") {
  Rng rng(4, 4);
  PolicyData data = RandomPolicyData(
      *Space::Dict({{coin, *Space::Box(0, 40, {1})}, {place, *Space::Box(0, 40, {1})}}),
      *Space::Dict({{"aim", *Space::Box(-1, 1, {2})}, {"move", *Space::Box(-1, 1, {1})}}), 2, 3, {8}, rng, 10.0f);
  data.log_std.assign(3, -1.0f);
  return *Policy::Create(std::move(data), 1);
}

void ExpectStarts(AConsacTrainer& trainer) {
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer.StartTraining(result, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
}

FConsacNumbers Row(const TCHAR* name, std::initializer_list<float> values) {
  FConsacNumbers row;
  row.Name = name;
  row.Values = values;
  return row;
}

AConsacTrainer* SpawnTrainer(Shim::Game& game, EConsacMode mode, std::vector<std::string>* errors) {
  return game.SpawnWith<AConsacTrainer>([=](AConsacTrainer& made) {
    made.Mode = mode;
    made.Port = 0;
    made.LogSeconds = 0.0f;
    made.OnTrainerError.ShimBind(nullptr, [errors](const FString& error) { errors->push_back(Text(error)); });
  });
}

// Models of other programs have any letters; an FName has them as it likes.
TEST(Traps, PredictTakesNamesOfModelsWithCapitals) {
  const ScratchFolder scratch("unreal_capitals");
  const std::string file = scratch.path() + "/two.consac";
  Shim::Game game;
  UConsacModel* model = NewObject<UConsacModel>();
  EConsacResult result = EConsacResult::Failed;
  TArray<FConsacNumbers> done;
  FString error;
  ASSERT_TRUE(TwoByTwo("Coin", "myPlace").ToFile(1).Save(file).ok());
  ASSERT_TRUE(model->Load(Text(file), error)) << Text(error);
  model->PredictByNames({Row(u"MYPLACE", {30.0f}), Row(u"coin", {7.0f})}, true, result, done, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  model->PredictByNames({Row(u"myPlace", {30.0f}), Row(u"Coin", {7.0f}), Row(u"More", {1.0f})}, true, result, done,
                        error);
  EXPECT_EQ(Text(error), "the model sees no entry 'more'");
  ASSERT_TRUE(TwoByTwo("Coin", "coin").ToFile(1).Save(file).ok());
  ASSERT_TRUE(model->Load(Text(file), error)) << Text(error);
  model->PredictByNames({Row(u"coin", {30.0f})}, true, result, done, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("several entries 'coin'"), std::string::npos) << Text(error);
}

TEST(Traps, PredictTakesNamesAndSaysItsOrder) {
  const ScratchFolder scratch("unreal_names");
  ASSERT_TRUE(TwoByTwo().ToFile(1).Save(scratch.path() + "/two.consac").ok());
  Shim::Game game;
  EConsacResult result = EConsacResult::Failed;
  UConsacModel* model = nullptr;
  FConsacAction action;
  TArray<FConsacNumbers> named;
  FString error;
  UConsacBlueprintLibrary::LoadConsacModel(nullptr, Text(scratch.path() + "/two.consac"), result, model, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  const std::string says = Text(model->DescribeModel());
  EXPECT_LT(says.find("coin"), says.find("place")) << says;
  model->Predict({7.0f, 30.0f}, true, result, action, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  model->PredictByNames({Row(u"Place", {30.0f}), Row(u"Coin", {7.0f})}, true, result, named, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  ASSERT_EQ(named.Num(), 2);
  EXPECT_EQ(named[0].Name, FName(u"aim"));
  EXPECT_EQ(named[1].Name, FName(u"move"));
  ASSERT_EQ(named[0].Values.Num(), 2);
  EXPECT_EQ(named[0].Values[1], action.Values[1]);
  EXPECT_EQ(named[1].Values[0], action.Values[2]);
  const auto fault = [&](const TArray<FConsacNumbers>& rows) {
    model->PredictByNames(rows, true, result, named, error);
    EXPECT_EQ(result, EConsacResult::Failed);
    EXPECT_TRUE(named.IsEmpty());
    return Text(error);
  };
  EXPECT_EQ(fault({Row(u"place", {30.0f})}), "entry 'coin' is missing");
  EXPECT_EQ(fault({Row(u"coin", {1.0f}), Row(u"coin", {1.0f})}), "entry 'coin' is given twice");
  EXPECT_EQ(fault({Row(u"coin", {1.0f}), Row(u"place", {1.0f, 2.0f})}),
            "entry 'place' has 2 numbers; the model sees 1");
  EXPECT_EQ(fault({Row(u"coin", {1.0f}), Row(u"place", {1.0f}), Row(u"wall", {1.0f})}),
            "the model sees no entry 'wall'");
}

// In a game that acts enemies come and go, and come in kinds that were not there at the beginning.
TEST(Traps, WhereNobodyLearnsWhoeverComesPlays) {
  Shim::Game game;
  std::vector<std::string> errors;
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::ByHand, &errors);
  game.Tick();
  errors.clear();  // nobody was there
  std::vector<std::unique_ptr<RoadAgent>> agents;
  agents.push_back(std::make_unique<RoadAgent>(game, 1));
  ASSERT_TRUE(TickUntil(
      20.0, [&] { game.Tick(); }, [&] { return trainer->IsTraining(); }));
  for (std::uint64_t k = 2; k <= 40; ++k) {
    agents.push_back(std::make_unique<RoadAgent>(game, k));
    if (k % 4 == 0) Shim::Destroy(*agents[k / 2]->actor);
    game.Tick();
  }
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  RoadAgent other(game, 99, actor);
  other.agent->Behaviour = TEXT("boss");
  for (int k = 0; k < 4; ++k) game.Tick();
  const long steps = agents.back()->steps, others = other.steps;
  const long firsts = agents.front()->steps;
  other.agent->MaxEpisodeSteps = 3;
  const FConsacProgress before = trainer->GetTrainerProgress();
  for (int k = 0; k < 10; ++k) game.Tick();
  EXPECT_EQ(agents.back()->steps - steps, 10);
  EXPECT_GE(trainer->GetTrainerProgress().Episodes - before.Episodes, 3) << "of those that came later, too";
  EXPECT_EQ(other.steps - others, 10);
  EXPECT_EQ(agents.front()->steps - firsts, 10) << "who was there goes on as before";
  EXPECT_EQ(agents.front()->seeds.size() < 10, true) << "a newcomer is no reason to begin anew";
  EXPECT_EQ(errors, std::vector<std::string>());
  Shim::Collect();
  trainer->StopTraining();
  EXPECT_FALSE(trainer->IsTraining());
  agents.back()->agent->AddReward(1.0f);
  game.Tick();
}

TEST(Traps, WhereOthersLearnANewcomerWithoutAPlaceIsToldOf) {
  Shim::Game game;
  std::vector<std::string> errors;
  RoadAgent first(game, 1);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  game.Tick();
  ASSERT_TRUE(trainer->IsTraining());
  RoadAgent second(game, 2);
  game.Tick();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("Room For Agents"), std::string::npos) << errors[0];
}

TEST(Traps, AFinishedModelIsNotLostToTheNextTraining) {
  const ScratchFolder scratch("unreal_before");
  const std::string file = scratch.path() + "/default.consac", kept = scratch.path() + "/default.before.consac";
  std::vector<std::byte> earlier;
  for (int training = 1; training <= 2; ++training) {
    Shim::Game game;
    std::vector<std::string> errors;
    RoadAgent agent(game, static_cast<std::uint64_t>(training));
    AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
    trainer->Seed = training;
    trainer->TotalSteps = 300;
    trainer->SaveFolder = Text(scratch.path());
    trainer->bLockStep = true;
    bool done = false;
    trainer->OnTrainingCompleted.ShimBind(nullptr, [&done] { done = true; });
    ASSERT_TRUE(TickUntil(
        60.0, [&] { game.Tick(); }, [&] { return done; }));
    EXPECT_EQ(errors, std::vector<std::string>());
    auto policy = Policy::Load(file, 1);
    ASSERT_TRUE(policy.ok()) << policy.status().message();
    EXPECT_EQ(FactsOf(policy->data().training_json).algorithm, "ppo2") << "an asset shows it";
    auto bytes = ReadFile(file);
    ASSERT_TRUE(bytes.ok()) << bytes.status().message();
    if (training == 1) {
      EXPECT_FALSE(ReadFile(kept).ok());
      earlier = std::move(*bytes);
    } else {
      EXPECT_NE(*bytes, earlier);
      auto before = ReadFile(kept);
      ASSERT_TRUE(before.ok()) << before.status().message();
      EXPECT_EQ(*before, earlier);
    }
  }
  EXPECT_TRUE(Logged("default.before.consac"));
  EXPECT_FALSE(ReadFile(scratch.path() + "/default.new.consac").ok());
}

TEST(Traps, AnEarlierModelThatCannotBeKeptIsNotWrittenOver) {
  const ScratchFolder scratch("unreal_not_kept");
  const std::string name = scratch.path() + "/default";
  ASSERT_TRUE(TwoByTwo().ToFile(1).Save(name + ".consac").ok());
  const auto earlier = ReadFile(name + ".consac");
  std::filesystem::create_directory(name + ".before.consac");  // nothing can be copied there
  Shim::Game game;
  std::vector<std::string> errors;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  trainer->TotalSteps = 300;
  trainer->SaveFolder = Text(scratch.path());
  trainer->bLockStep = true;
  bool done = false;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&done] { done = true; });
  ASSERT_TRUE(TickUntil(
      60.0, [&] { game.Tick(); }, [&] { return done; }));
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("default.new.consac"), std::string::npos) << errors[0];
  EXPECT_EQ(*ReadFile(name + ".consac"), *earlier);
  EXPECT_TRUE(Policy::Load(name + ".new.consac", 1).ok()) << "what was learned is not lost";
}

TEST(Traps, ACameraOfAGameThatDrawsNothingIsRefused) {
  Shim::Game game;
  std::vector<std::string> errors;
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  game.AddComponent<UConsacCameraSensorComponent>(*actor);
  RoadAgent agent(game, 1, actor);
  FApp::ShimSetRenders(false);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  game.Tick();
  FApp::ShimSetRenders(true);
  EXPECT_FALSE(trainer->IsTraining());
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("-RenderOffscreen"), std::string::npos) << errors[0];
}

TEST(Traps, WhatMovesByPhysicsIsNotSteppedSeveralTimesInATick) {
  Shim::Game game;
  std::vector<std::string> errors;
  AActor* actor = NewObject<AConsacTestActor>(&game.world());
  USceneComponent* root = game.AddComponent<USceneComponent>(*actor);
  root->shim_physics_ = true;
  actor->SetRootComponent(root);
  RoadAgent agent(game, 1, actor);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  trainer->MaxStepsPerTick = 64;
  game.Tick();
  EXPECT_FALSE(trainer->IsTraining());
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("Max Steps Per Tick is 64"), std::string::npos) << errors[0];
  trainer->MaxStepsPerTick = 1;
  ExpectStarts(*trainer);
}

TEST(Traps, ABodyBelowTheRootAndANewcomerAreLookedAtToo) {
  Shim::Game game;
  std::vector<std::string> errors;
  const auto body = [&game] {  // a scene root with a simulated mesh below it
    AActor* actor = NewObject<AConsacTestActor>(&game.world());
    actor->SetRootComponent(game.AddComponent<USceneComponent>(*actor));
    game.AddComponent<USceneComponent>(*actor)->shim_physics_ = true;
    return actor;
  };
  RoadAgent first(game, 1);
  AConsacTrainer* trainer = SpawnTrainer(game, EConsacMode::Train, &errors);
  trainer->MaxStepsPerTick = 8;
  trainer->RoomForAgents = 2;
  game.Tick();
  EXPECT_TRUE(trainer->IsTraining());
  RoadAgent late(game, 2, body());
  game.Tick();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].find("Max Steps Per Tick is 8"), std::string::npos) << errors[0];
  EXPECT_EQ(late.steps, 0);
  // With several ticks to a decision one step is taken in a tick anyway.
  trainer->StopTraining();
  first.agent->DecisionPeriod = late.agent->DecisionPeriod = 2;
  ExpectStarts(*trainer);
}

TEST(Traps, EpisodesThatEndWithTheirFirstStepAreToldOf) {
  Shim::Game game;
  Shim::ForgetLog();
  std::vector<std::string> errors;
  RoadAgent agent(game, 1);
  agent.agent->OnAction.ShimBind(
      agent.agent, [](UConsacAgentComponent* which) { which->EndEpisode(EConsacEpisodeEnd::Terminated); });
  SpawnTrainer(game, EConsacMode::ByHand, &errors);
  for (int k = 0; k < 19; ++k) game.Tick();
  EXPECT_FALSE(Logged("ended with their first step"));
  for (int k = 0; k < 60; ++k) game.Tick();
  const auto told = std::count_if(Shim::Log().begin(), Shim::Log().end(), [](const std::string& line) {
    return line.find("ended with their first step") != std::string::npos;
  });
  EXPECT_EQ(told, 1);
}

TEST(Traps, AFastTrainingWithoutFixedStepSaysHowLongATickIs) {
  for (const bool fixed : {false, true}) {
    Shim::Game game;
    Shim::ForgetLog();
    std::vector<std::string> errors;
    RoadAgent agent(game, 1);
    SpawnTrainer(game, EConsacMode::Train, &errors)->bFixedStep = fixed;
    game.Tick();
    EXPECT_NE(Logged("without Fixed Step"), fixed);
  }
}

}  // namespace
}  // namespace consac::testing
