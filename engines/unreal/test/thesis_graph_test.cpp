// The thesis' graph, played node by node against the real trainer; its model through Model Connection and Predict.
#include "graphs.h"

namespace consac::testing {
namespace {

/// The thesis trained for 20,000; then a few of the 1,640 states are still wrong, and the best action of a model may
/// stay in one of them until the coin moves.
constexpr int kRoadSteps = 40000;

/// Start Trainer Program for what listens on `port`.
UConsacTrainerProgram* StartProgram(int port, const std::string& runs, const std::string& more = "") {
  FConsacProgramSettings settings;
  settings.Program = Text(CONSAC_PROGRAM);
  settings.Port = port;
  settings.RunName = TEXT("walker");
  settings.RunsFolder = Text(runs);
  settings.ExtraArguments = Text("--no-tensorboard --no-progress" + more);
  EConsacResult result = EConsacResult::Failed;
  UConsacTrainerProgram* program = nullptr;
  FString error;
  UConsacBlueprintLibrary::StartTrainerProgram(nullptr, settings, result, program, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  return program;
}

UConsacModel* LoadModel(const FString& path) {
  EConsacResult result = EConsacResult::Failed;
  UConsacModel* model = nullptr;
  FString error;
  UConsacBlueprintLibrary::LoadConsacModel(nullptr, path, result, model, error);
  EXPECT_EQ(result, EConsacResult::Success) << Text(error);
  return model;
}

/// What the model does in every state of the road, by Predict, by Predict Many and by the core's own policy.
void ExpectSameActions(UConsacModel& model, const std::string& path) {
  auto policy = Policy::Load(path, 1);
  ASSERT_TRUE(policy.ok());
  TArray<float> all, many;
  std::vector<std::int32_t> expected;
  EConsacResult result = EConsacResult::Failed;
  FConsacAction action;
  FString error;
  Rng rng(0, 0);
  for (int actor = 0; actor <= 40; ++actor) {
    for (int coin = 0; coin <= 40; ++coin) {
      const float seen[2] = {static_cast<float>(actor), static_cast<float>(coin)};
      std::int32_t choice = -1;
      policy->Act(reinterpret_cast<const std::byte*>(seen), nullptr, 1, ActionMode::kDeterministic, rng,
                  reinterpret_cast<std::byte*>(&choice));
      expected.push_back(choice);
      model.Predict({seen[0], seen[1]}, true, result, action, error);
      ASSERT_EQ(result, EConsacResult::Success) << Text(error);
      ASSERT_EQ(action.Choice, choice) << actor << ", " << coin;
      all.Append({seen[0], seen[1]});
    }
  }
  model.PredictMany(all, true, result, many, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  ASSERT_EQ(static_cast<std::size_t>(many.Num()), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_EQ(static_cast<std::int32_t>(many[static_cast<int32>(k)]), expected[k]);
  EXPECT_GT(RoadAccuracy(*policy), 0.9);
}

TEST(ThesisGraph, LearnsTheRoadFromTheRealTrainerAndWalksByItsModel) {
  const ProgramFolder scratch("unreal thesis");
  Shim::Game game;
  RoadGraph graph(game);
  // As it is drawn: On Training Completed -> Close Training.
  int completed = 0;
  graph.environment().OnTrainingCompleted.ShimBind(nullptr, [&] {
    ++completed;
    graph.environment().CloseTraining();
  });
  ASSERT_EQ(graph.Setup(kRoadSteps, 0), EConsacResult::Success) << Text(graph.error);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Waiting) << Text(graph.error);
  ASSERT_GT(graph.environment().GetTrainingPort(), 0);
  UConsacTrainerProgram* program = StartProgram(graph.environment().GetTrainingPort(), scratch.path());
  ASSERT_NE(program, nullptr);

  // Tick mode: one Training in a tick, which never waits.
  EConsacConnection connection = EConsacConnection::Waiting;
  ASSERT_TRUE(TickUntil(
      120.0,
      [&] {
        connection = graph.Tick();
        game.Tick();
      },
      [&] { return connection == EConsacConnection::Completed; }))
      << graph.steps << " steps; " << Text(graph.error);
  EXPECT_TRUE(graph.environment().IsTrainingCompleted());
  EXPECT_EQ(completed, 1);
  EXPECT_EQ(graph.steps, kRoadSteps);
  EXPECT_GT(graph.resets, 0);
  EXPECT_GT(graph.MeanReward(), 0.9);
  EXPECT_EQ(graph.environment().GetTrainingProgress().Steps, kRoadSteps);
  ASSERT_TRUE(TickUntil(
      30.0, [] { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }, [&] { return !program->IsRunning(); }));
  // Tick goes on; the port stays closed, so that no other trainer begins anew.
  for (int tick = 0; tick < 100; ++tick) {
    ASSERT_EQ(graph.Tick(), EConsacConnection::Completed) << Text(graph.error);
    ASSERT_EQ(graph.Train(), EConsacTraining::Completed) << Text(graph.error);
    ASSERT_EQ(graph.environment().GetTrainingPort(), 0);
  }
  EXPECT_EQ(completed, 1);
  ASSERT_EQ(graph.Setup(kRoadSteps, 0), EConsacResult::Success);
  EXPECT_FALSE(graph.environment().IsTrainingCompleted());
  EXPECT_EQ(graph.Tick(), EConsacConnection::Waiting) << Text(graph.error);
  EXPECT_GT(graph.environment().GetTrainingPort(), 0);

  const FString path = program->GetModelPath();
  UConsacModel* model = LoadModel(path);
  ASSERT_NE(model, nullptr);
  ExpectSameActions(*model, Text(path));

  // Model Connection: the same graph, no network.
  RoadGraph walker(game);
  ASSERT_EQ(walker.Setup(0, 0), EConsacResult::Success);
  EConsacResult result = EConsacResult::Failed;
  FString error;
  walker.environment().ModelConnection(model, result, error);
  ASSERT_EQ(result, EConsacResult::Success) << Text(error);
  for (int tick = 0; tick < 3000; ++tick) ASSERT_EQ(walker.Tick(), EConsacConnection::Connected) << Text(walker.error);
  EXPECT_GT(walker.steps, 2500);
  EXPECT_GT(walker.MeanReward(), 0.9);
  EXPECT_EQ(walker.environment().GetTrainingPort(), 0);
}

TEST(ThesisGraph, LoopModeIsTheSameGraphInALoopOfOneTick) {
  const ProgramFolder scratch("unreal_loop");
  Shim::Game game;
  RoadGraph graph(game);
  graph.environment().LoopWaitSeconds = 1.0f;
  ASSERT_EQ(graph.Setup(20000, 0), EConsacResult::Success);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Waiting);
  UConsacTrainerProgram* program = StartProgram(graph.environment().GetTrainingPort(), scratch.path());
  int ticks = 0;
  EConsacConnection connection = EConsacConnection::Waiting;
  ASSERT_TRUE(TickUntil(
      120.0,
      [&] {
        if (connection == EConsacConnection::Connected) ++ticks;
        connection = graph.Tick(1000);
      },
      [&] { return connection == EConsacConnection::Completed; }))
      << graph.steps;
  EXPECT_EQ(graph.steps, 20000);
  EXPECT_LT(ticks, 100) << "a tick made few steps";
  EXPECT_GT(graph.MeanReward(), 0.9);
  program->Stop();
  EXPECT_FALSE(program->IsRunning());
}

TEST(ThesisGraph, PlayIsStoppedInTheMiddleAndStartedAgainAtOnceOnTheSamePort) {
  const ProgramFolder scratch("unreal_again");
  int port = 0;
  for (int round = 0; round < 3; ++round) {
    Shim::Game game;
    RoadGraph graph(game);
    ASSERT_EQ(graph.Setup(1000000, port), EConsacResult::Success);
    ASSERT_NE(graph.Tick(), EConsacConnection::Failed) << "round " << round << ": " << Text(graph.error);
    port = graph.environment().GetTrainingPort();
    UConsacTrainerProgram* program = StartProgram(port, scratch.path());
    EXPECT_TRUE(TickUntil(
        60.0, [&] { (void)graph.Tick(); }, [&] { return graph.steps > 200; }))
        << Text(graph.error);
    if (round == 1) program->Stop();
    // Stopping play closes nothing by hand: the component's End Play does.
  }
  Shim::Game game;
  RoadGraph graph(game);
  ASSERT_EQ(graph.Setup(1, port), EConsacResult::Success);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Waiting) << Text(graph.error);
}

TEST(ThesisGraph, APortThatCannotBeOpenedIsSaidByThePin) {
  Shim::Game game;
  RoadGraph first(game), second(game);
  ASSERT_EQ(first.Setup(100, 0), EConsacResult::Success);
  EXPECT_EQ(first.Tick(), EConsacConnection::Waiting) << Text(first.error);
  const int port = first.environment().GetTrainingPort();
  ASSERT_EQ(second.Setup(100, port), EConsacResult::Success);
  EXPECT_EQ(second.Tick(), EConsacConnection::Failed);
  EXPECT_NE(Text(second.error).find(std::to_string(port)), std::string::npos) << Text(second.error);
  // An address that lets other computers in wants a token, which this component does not have.
  EConsacResult result = EConsacResult::Failed;
  second.environment().SetupEnvironment(RoadSeen(), RoadDone(), 100, FString(), result, second.error, TEXT("0.0.0.0"),
                                        0);
  EXPECT_EQ(second.Tick(), EConsacConnection::Failed);
  EXPECT_NE(Text(second.error).find("token"), std::string::npos) << Text(second.error);
  EXPECT_EQ(second.environment().GetTrainingPort(), 0);
}

/// A trainer gives up after a second of silence; the game is paused for longer.
void PauseIsToldTo(Shim::Game& game, UConsacTrainerProgram& program, const std::function<long()>& steps,
                   const std::function<void()>& play) {
  ASSERT_TRUE(TickUntil(60.0, play, [&] { return steps() > 100; }));
  game.world().shim_paused_ = true;
  game.Tick();
  const long before = steps();
  EXPECT_FALSE(TickUntil(
      2.5,
      [&] {
        game.Tick();
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      },
      [&] { return !program.IsRunning() || steps() != before; }));
  game.world().shim_paused_ = false;
  game.Tick();
  EXPECT_TRUE(TickUntil(20.0, play, [&] { return steps() > before + 100 || !program.IsRunning(); }));
  EXPECT_TRUE(program.IsRunning());
  program.Stop();
}

TEST(ThesisGraph, ATrainerWaitsWhileTheGameIsPaused) {
  const ProgramFolder scratch("unreal_pause");
  Shim::Game game;
  RoadGraph graph(game);
  ASSERT_EQ(graph.Setup(1000000, 0), EConsacResult::Success);
  (void)graph.Tick();
  UConsacTrainerProgram* program = StartProgram(graph.environment().GetTrainingPort(), scratch.path(), " --deadline 1");
  PauseIsToldTo(
      game, *program, [&] { return graph.steps; },
      [&] {
        (void)graph.Tick();
        game.Tick();
      });
}

TEST(ThesisGraph, ATrainerOfManyAgentsWaitsToo) {
  const ProgramFolder scratch("unreal_pause_many");
  Shim::Game game;
  RoadAgent agent(game, 1);
  AConsacTrainer* trainer = game.SpawnWith<AConsacTrainer>([](AConsacTrainer& made) {
    made.Port = 0;
    made.TotalSteps = 1000000;
  });
  game.Tick();
  UConsacTrainerProgram* program = StartProgram(trainer->GetTrainerPort(), scratch.path(), " --deadline 1");
  PauseIsToldTo(
      game, *program, [&] { return agent.steps; }, [&] { game.Tick(); });
}

TEST(ThesisGraph, TheFirstNodesInTheWrongOrderSayWhatIsMissing) {
  Shim::Game game;
  RoadGraph graph(game);
  EXPECT_EQ(graph.Tick(), EConsacConnection::Failed);
  EXPECT_NE(Text(graph.error).find("Setup Environment"), std::string::npos) << Text(graph.error);
  EXPECT_EQ(graph.Train(), EConsacTraining::Failed);
  ASSERT_EQ(graph.Setup(100, 0), EConsacResult::Success);
  EXPECT_EQ(graph.Train(), EConsacTraining::Failed);
  EXPECT_NE(Text(graph.error).find("Training Connection"), std::string::npos) << Text(graph.error);
  EConsacResult result = EConsacResult::Success;
  FString error;
  graph.environment().ModelConnection(nullptr, result, error);
  EXPECT_EQ(result, EConsacResult::Failed);
  EXPECT_NE(Text(error).find("Load Model"), std::string::npos) << Text(error);
  ASSERT_FALSE(Shim::Log().empty());
  EXPECT_EQ(Shim::Log().back(), "LogConsac: Error: " + Text(error));
}

TEST(ThesisGraph, AnObservationThatDoesNotFitIsRefusedAndTheNextOneGoesOn) {
  const ProgramFolder scratch("unreal_misfit");
  Shim::Game game;
  RoadGraph graph(game);
  ASSERT_EQ(graph.Setup(1000000, 0), EConsacResult::Success);
  (void)graph.Tick();
  UConsacTrainerProgram* program = StartProgram(graph.environment().GetTrainingPort(), scratch.path());
  ASSERT_TRUE(TickUntil(
      60.0, [&] { (void)graph.Tick(); }, [&] { return graph.steps > 50; }));
  // Until an action was handed out, what comes is not looked at.
  EConsacTraining training = EConsacTraining::Waiting;
  ASSERT_TRUE(TickUntil(
      10.0, [&] { training = graph.Train(); }, [&] { return training == EConsacTraining::Step; }));
  FConsacAction action;
  FString error;
  graph.environment().Train({1.0f, 2.0f, 3.0f}, 0.0f, false, training, action, error);
  EXPECT_EQ(training, EConsacTraining::Failed);
  EXPECT_NE(Text(error).find('3'), std::string::npos) << Text(error);
  const float zero = 0.0f;
  graph.environment().Train({1.0f, zero / zero}, 0.0f, false, training, action, error);
  EXPECT_EQ(training, EConsacTraining::Failed);
  const long before = graph.steps;
  EXPECT_TRUE(TickUntil(
      10.0, [&] { (void)graph.Tick(); }, [&] { return graph.steps > before + 50; }))
      << Text(graph.error);
  program->Stop();
}

}  // namespace
}  // namespace consac::testing
