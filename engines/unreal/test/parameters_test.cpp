// Numbers of the world that a trainer sets, numbers of the game's own that it is told, and agents that are paid
// together: over protocol 2, and where the game learns by itself.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <future>
#include <set>

#include "consac/env/buffer.h"
#include "consac/server/env_client.h"
#include "graphs.h"

namespace consac::testing {
namespace {

constexpr float kUnread = -1.0f;

/// An agent whose episodes last three decisions, and who reads what they have of "Wind" where they begin.
struct Windy {
  explicit Windy(Shim::Game& game, const char* behaviour = "default", const char* group = nullptr) {
    actor = NewObject<AConsacTestActor>(&game.world());
    agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    agent->Behaviour = Text(behaviour);
    if (group != nullptr) agent->Group = *Text(group);
    agent->Observations.Add({TEXT("wind"), UConsacBlueprintLibrary::MakeBoxSpace(1, -100.0f, 100.0f)});
    agent->Actions.Add({TEXT("steer"), UConsacBlueprintLibrary::MakeDiscreteSpace(2)});
    agent->MaxEpisodeSteps = 3;
    agent->OnEpisodeBegin.ShimBind(agent, [this](UConsacAgentComponent* which, int64) {
      if (reads) winds.push_back(which->GetEnvironmentParameter(TEXT("Wind")));
      episode_reward = 0.0f;
    });
    agent->OnObserve.ShimBind(agent, [this](UConsacAgentComponent* which) {
      EXPECT_TRUE(which->SetObservationNumber(TEXT("wind"), winds.empty() ? kUnread : winds.back()));
      episode_reward = which->GetEpisodeReward();
      most = std::max(most, episode_reward);
    });
    agent->OnAction.ShimBind(agent, [this](UConsacAgentComponent* which) {
      ++steps;
      if (on_action) on_action(which);
    });
    Shim::Enter(game.world(), *actor, FVector());
  }
  Windy(const Windy&) = delete;
  Windy& operator=(const Windy&) = delete;

  AActor* actor;
  UConsacAgentComponent* agent;
  bool reads = true;
  std::vector<float> winds;
  float episode_reward = 0.0f, most = 0.0f;
  int steps = 0;
  std::function<void(UConsacAgentComponent*)> on_action;
};

FConsacParameter Wind(double value, const TCHAR* training = TEXT("")) {
  FConsacParameter wind;
  wind.Name = TEXT("Wind");
  wind.Default = value;
  wind.bBounded = true;
  wind.Low = 0.0;
  wind.High = 9.0;
  wind.Description = TEXT("m/s, against the agent");
  wind.Training = training;
  return wind;
}

class Parameters : public ::testing::Test {
 protected:
  AConsacTrainer* Trainer(EConsacMode mode) {
    AConsacTrainer* trainer = game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
      made.Mode = mode;
      made.Port = 0;
      made.LogSeconds = 0.0f;
      made.TotalSteps = 100000;
      made.EnvironmentParameters.Add(Wind(4.0));
    });
    trainer->OnTrainerError.ShimBind(nullptr, [this](const FString& error) { errors_.push_back(Text(error)); });
    return trainer;
  }
  /// Ticks until `peer` is done with whoever drives.
  void TickFor(std::future<void>& peer) {
    EXPECT_TRUE(TickUntil(
        60.0, [&] { game_.Tick(); },
        [&] { return peer.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }));
    peer.get();
  }

  Shim::Game game_;
  std::vector<std::string> errors_;
};

/// The trainer's end: one action, 0, for everybody.
struct Peer {
  explicit Peer(int port) {
    EnvClientOptions options;
    options.protocol = Protocol::kProtocol2;
    auto opened = EnvClient::Open(*ConnectTcp({"127.0.0.1", port}, 5.0), options);
    EXPECT_TRUE(opened.ok()) << opened.status().message();
    client = std::move(*opened);
    for (const BehaviourSpec& behaviour : client->spec().behaviours) buffers.emplace_back(behaviour);
    for (BatchBuffer& buffer : buffers) batches.push_back(buffer.batch());
  }
  void Set(double wind) { client->SetParameters(0, std::span(&wind, 1)); }
  void Reset() { EXPECT_TRUE(client->Reset(1, batches).ok()); }
  void Step() {
    for (std::size_t b = 0; b < buffers.size(); ++b) {
      buffers[b].Advance();
      batches[b] = buffers[b].batch();
      std::memset(batches[b].actions, 0, sizeof(std::int32_t) * batches[b].slots.size());
    }
    const Status stepped = client->Step(batches, MoreSteps::kYes);
    EXPECT_TRUE(stepped.ok()) << stepped.message();
  }
  float Seen() {
    float seen = 0.0f;
    std::memcpy(&seen, batches[0].next_observations, sizeof(seen));
    return seen;
  }
  std::unique_ptr<EnvClient> client;
  std::vector<BatchBuffer> buffers;
  std::vector<Batch> batches;
};

TEST_F(Parameters, ATrainerElsewhereSetsThem) {
  Windy agent(game_);
  AConsacTrainer* trainer = Trainer(EConsacMode::Serve);
  game_.Tick();
  std::future<void> peer = std::async(std::launch::async, [port = trainer->GetTrainerPort()] {
    Peer at(port);
    const std::vector<ParameterSpec>& parameters = at.client->spec().parameters;
    ASSERT_EQ(parameters.size(), 1u);
    EXPECT_EQ(parameters[0].name, "wind") << "in lower case, however a packaged game spells it";
    EXPECT_EQ(parameters[0].default_value, 4.0);
    EXPECT_EQ(parameters[0].high, 9.0);
    EXPECT_EQ(parameters[0].description, "m/s, against the agent");
    at.Reset();
    EXPECT_EQ(at.Seen(), 4.0f) << "nobody has set it";
    at.Set(7.0);
    at.Step();
    EXPECT_EQ(at.Seen(), 4.0f) << "the episode under way keeps what it has";
    at.Step();
    at.Step();
    EXPECT_EQ(at.Seen(), 7.0f) << "the next one has begun by itself";
    at.Set(2.0);
    at.Reset();
    EXPECT_EQ(at.Seen(), 2.0f);
    at.client->Close();
  });
  TickFor(peer);
  // The next trainer finds the world as it was made.
  peer = std::async(std::launch::async, [port = trainer->GetTrainerPort()] {
    Peer at(port);
    at.Reset();
    EXPECT_EQ(at.Seen(), 4.0f);
  });
  TickFor(peer);
  EXPECT_EQ(errors_, std::vector<std::string>());
}

TEST_F(Parameters, ATrainingInsideDrawsThemForEveryEpisode) {
  Windy agent(game_);
  AConsacTrainer* trainer = Trainer(EConsacMode::Train);
  trainer->EnvironmentParameters[0].Training = TEXT("uniform 2 5");
  trainer->TotalSteps = 600;
  trainer->WhileLearning = EConsacWhileLearning::Wait;
  trainer->bLockStep = true;
  int completed = 0;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
  ASSERT_TRUE(TickUntil(
      60.0, [&] { game_.Tick(); }, [&] { return completed > 0 || !errors_.empty(); }));
  ASSERT_EQ(errors_, std::vector<std::string>());
  ASSERT_GE(agent.winds.size(), 200u);
  EXPECT_GE(*std::min_element(agent.winds.begin(), agent.winds.end()), 2.0f);
  EXPECT_LE(*std::max_element(agent.winds.begin(), agent.winds.end()), 5.0f);
  EXPECT_GT(std::set<float>(agent.winds.begin(), agent.winds.end()).size(), 190u);
  // Whoever acts next has the world as it was made.
  agent.winds.clear();
  trainer->StopTraining();
  trainer->Mode = EConsacMode::ByHand;
  EConsacResult result = EConsacResult::Failed;
  FString error;
  trainer->StartTraining(result, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  for (int k = 0; k < 20; ++k) game_.Tick();
  ASSERT_GE(agent.winds.size(), 5u);
  for (const float wind : agent.winds) EXPECT_EQ(wind, 4.0f);
}

TEST_F(Parameters, TheProgramSetsThemAndItsLogHasTheGamesOwnNumbers) {
  const ProgramFolder scratch("unreal_parameters");
  Windy agent(game_);
  agent.on_action = [](UConsacAgentComponent* which) {
    UConsacBlueprintLibrary::RecordStat(which, TEXT("Gust"), 2.5f);
  };
  AConsacTrainer* trainer = Trainer(EConsacMode::Serve);
  trainer->EnvironmentParameters[0].Training = TEXT("uniform 6 8");
  trainer->TotalSteps = 400;
  trainer->bLockStep = true;
  trainer->MaxWaitSeconds = 0.05f;
  game_.Tick();
  trainer->Program.Program = Text(CONSAC_PROGRAM);
  trainer->Program.RunsFolder = Text(scratch.path());
  trainer->Program.RunName = TEXT("windy");
  int completed = 0;
  trainer->OnTrainingCompleted.ShimBind(nullptr, [&completed] { ++completed; });
  trainer->StartProgram();
  ASSERT_TRUE(TickUntil(
      100.0, [&] { game_.Tick(); }, [&] { return completed > 0 || !errors_.empty(); }));
  EXPECT_EQ(errors_, std::vector<std::string>());
  ASSERT_GE(agent.winds.size(), 100u);
  EXPECT_GE(*std::min_element(agent.winds.begin(), agent.winds.end()), 6.0f);
  EXPECT_LE(*std::max_element(agent.winds.begin(), agent.winds.end()), 8.0f);
  std::string rows;
  ASSERT_TRUE(TickUntil(
      30.0, [&] { game_.Tick(); },
      [&] {
        std::ifstream file(scratch.path() + "/windy/progress.csv");
        rows.assign(std::istreambuf_iterator<char>(file), {});
        return rows.find("game/gust") != std::string::npos;
      }))
      << rows;
  EXPECT_NE(rows.find("2.5"), std::string::npos) << rows;
  trainer->StopProgram();
}

TEST_F(Parameters, WhatIsNotDeclaredIsNamedWithTheNearest) {
  Windy agent(game_);
  agent.reads = false;
  Shim::ForgetLog();
  EXPECT_EQ(agent.agent->GetEnvironmentParameter(TEXT("wind")), 0.0f) << "nobody has declared it";
  AConsacTrainer* trainer = Trainer(EConsacMode::ByHand);
  EXPECT_EQ(agent.agent->GetEnvironmentParameter(TEXT("wind")), 4.0f) << "no training has begun";
  for (int k = 0; k < 3; ++k) game_.Tick();
  ASSERT_TRUE(trainer->IsTraining());
  EXPECT_EQ(agent.agent->GetEnvironmentParameter(TEXT("WIND")), 4.0f);
  UConsacBlueprintLibrary::ForgetErrors();
  EXPECT_EQ(agent.agent->GetEnvironmentParameter(TEXT("wnd")), 0.0f);
  EXPECT_EQ(Shim::LogLines("is 'wind' meant?").size(), 1u);
}

TEST_F(Parameters, WhatCannotBeIsRefusedInOneLine) {
  Windy agent(game_);
  agent.reads = false;
  AConsacTrainer* trainer = Trainer(EConsacMode::ByHand);
  trainer->bAutoStart = false;
  game_.Tick();
  const auto said = [&] {
    EConsacResult result = EConsacResult::Success;
    FString error;
    trainer->StartTraining(result, error);
    EXPECT_EQ(result, EConsacResult::Failed);
    return Text(error);
  };
  trainer->EnvironmentParameters[0].Default = 10.0;
  EXPECT_NE(said().find("parameter 'wind' is 10"), std::string::npos);
  trainer->EnvironmentParameters[0] = FConsacParameter();
  EXPECT_NE(said().find("environment parameter 0 has no name"), std::string::npos);
  trainer->EnvironmentParameters[0] = Wind(1.0);
  trainer->EnvironmentParameters.Add(Wind(2.0));
  EXPECT_NE(said().find("'wind'"), std::string::npos);
  trainer->EnvironmentParameters[1] = Wind(2.0, TEXT("uniform"));
  trainer->EnvironmentParameters[1].Name = TEXT("Rain");
  trainer->Mode = EConsacMode::Train;
  EXPECT_NE(said().find("rain"), std::string::npos);
}

TEST_F(Parameters, AGraphReadsThemWhereTrainingSaysReset) {
  RoadGraph graph(game_);
  graph.environment().EnvironmentParameters.Add(Wind(4.0));
  EXPECT_EQ(graph.environment().GetTrainingParameter(TEXT("wind")), 4.0f) << "before Setup Environment";
  graph.environment().RecordTrainingStat(TEXT("early"), 1.0f);
  ASSERT_EQ(graph.Setup(100000, 0), EConsacResult::Success) << Text(graph.error);
  ASSERT_EQ(graph.Tick(), EConsacConnection::Waiting);
  std::future<void> peer = std::async(std::launch::async, [port = graph.environment().GetTrainingPort()] {
    Peer at(port);
    ASSERT_EQ(at.client->spec().parameters.size(), 1u);
    at.Set(7.0);
    at.Reset();
    at.Set(3.0);
    bool noted = false;
    for (int k = 0; k < 50; ++k) {
      at.Step();
      for (const Statistic& statistic : at.client->statistics())
        noted = noted || (statistic.name == "metres" && statistic.value == 1.5);
    }
    EXPECT_TRUE(noted);
  });
  std::vector<float> winds;
  ASSERT_TRUE(TickUntil(
      60.0,
      [&] {
        const long resets = graph.resets;
        graph.Tick();
        if (graph.resets != resets) winds.push_back(graph.environment().GetTrainingParameter(TEXT("wind")));
        graph.environment().RecordTrainingStat(TEXT("Metres"), 1.5f);
        game_.Tick();
      },
      [&] { return peer.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }));
  peer.get();
  ASSERT_FALSE(winds.empty());
  EXPECT_EQ(winds[0], 7.0f) << "of the episode that begins";
  for (std::size_t k = 1; k < winds.size(); ++k) EXPECT_EQ(winds[k], 3.0f) << k;
}

TEST_F(Parameters, ATrainerIsToldOfGroupsAcrossBehaviours) {
  Windy keeper(game_, "keeper", "Red"), striker(game_, "striker", "red"), referee(game_, "referee");
  striker.on_action = [&](UConsacAgentComponent* which) {
    which->AddReward(1.0f);
    if (striker.steps == 2) which->AddGroupReward(0.25f);
  };
  referee.on_action = [&](UConsacAgentComponent* which) {
    which->AddGroupReward(5.0f);  // in no group: its own
    if (referee.steps == 2) UConsacBlueprintLibrary::AddGroupReward(which, TEXT("RED"), 0.5f);
    UConsacBlueprintLibrary::AddGroupReward(which, TEXT("blue"), 100.0f);  // nobody's
    UConsacBlueprintLibrary::AddGroupReward(nullptr, TEXT("red"), 100.0f);
  };
  AConsacTrainer* trainer = Trainer(EConsacMode::Serve);
  game_.Tick();
  std::future<void> peer = std::async(std::launch::async, [port = trainer->GetTrainerPort()] {
    Peer at(port);
    const std::vector<GroupSpec>& groups = at.client->spec().groups;
    ASSERT_EQ(groups.size(), 1u);
    EXPECT_EQ(groups[0].name, "red");
    ASSERT_EQ(groups[0].members.size(), 2u);
    EXPECT_EQ(groups[0].members[1].behaviour, 1u) << "the striker";
    at.Reset();
    at.Step();
    EXPECT_EQ(at.client->group_rewards()[0], 0.0f);
    EXPECT_EQ(at.batches[1].rewards[0], 1.0f);
    at.Step();
    EXPECT_EQ(at.client->group_rewards()[0], 0.75f);
    EXPECT_EQ(at.batches[0].rewards[0], 0.75f) << "the keeper";
    EXPECT_EQ(at.batches[1].rewards[0], 1.75f) << "beside what it earned alone";
    EXPECT_EQ(at.batches[2].rewards[0], 5.0f) << "the referee";
    at.Step();
    EXPECT_EQ(at.client->group_rewards()[0], 0.0f);
    at.client->Close();
  });
  TickFor(peer);
  EXPECT_EQ(errors_, std::vector<std::string>());
}

TEST_F(Parameters, AgentsOfOneBehaviourAreOfGroupsToo) {
  Shim::ForgetLog();
  Windy one(game_, "default", "red"), two(game_, "default", "red"), three(game_, "default", "blue");
  one.on_action = [&](UConsacAgentComponent* which) {
    which->AddGroupReward(1.0f);
    if (one.steps == 1) which->AddGroupReward(std::nanf(""));
  };
  AConsacTrainer* trainer = Trainer(EConsacMode::ByHand);
  for (int k = 0; k < 3; ++k) game_.Tick();
  EXPECT_EQ(one.episode_reward, 2.0f);
  EXPECT_EQ(two.episode_reward, 2.0f);
  EXPECT_EQ(three.episode_reward, 0.0f);
  EXPECT_EQ(Shim::LogLines("a reward of the group 'red' is not finite").size(), 1u);
  // One that comes later is of its group as well.
  Windy four(game_, "default", "red");
  for (int k = 0; k < 10; ++k) game_.Tick();
  EXPECT_EQ(four.most, 3.0f) << "of an episode's three steps";
  EXPECT_EQ(three.most, 0.0f);
  EXPECT_EQ(errors_, std::vector<std::string>());
  trainer->StopTraining();
  one.agent->AddGroupReward(1.0f);  // nobody listens
  UConsacBlueprintLibrary::AddGroupReward(one.agent, TEXT("red"), 1.0f);
}

TEST_F(Parameters, APlaceOfAGroupIsForItsAgentsAlone) {
  auto keeper = std::make_unique<Windy>(game_, "keeper", "red");
  Windy striker(game_, "striker", "red"), other(game_, "striker");
  AConsacTrainer* trainer = Trainer(EConsacMode::Serve);
  game_.Tick();
  Shim::Destroy(*keeper->actor);
  game_.Tick();
  Windy stranger(game_, "keeper");
  game_.Tick();
  ASSERT_EQ(errors_.size(), 1u);
  EXPECT_NE(errors_[0].find("all of them are there or of other groups"), std::string::npos) << errors_[0];
  Windy second(game_, "keeper", "red");
  game_.Tick();
  EXPECT_EQ(errors_.size(), 1u);
  EXPECT_TRUE(trainer->IsTraining());
}

TEST_F(Parameters, AnAgentWhoseGoalsPayIsInNoGroup) {
  Windy agent(game_, "default", "red");
  agent.reads = false;
  agent.agent->Observations.Add({TEXT("achieved_goal"), UConsacBlueprintLibrary::MakeBoxSpace(1, -1.0f, 1.0f)});
  agent.agent->Observations.Add({TEXT("desired_goal"), UConsacBlueprintLibrary::MakeBoxSpace(1, -1.0f, 1.0f)});
  agent.agent->GoalReward = EConsacGoalReward::Sparse;
  Trainer(EConsacMode::ByHand);
  game_.Tick();
  ASSERT_EQ(errors_.size(), 1u);
  EXPECT_NE(errors_[0].find("is in the group 'red', and its goals say what it is paid"), std::string::npos)
      << errors_[0];
}

}  // namespace
}  // namespace consac::testing
