// The Consac panel of the editor: what it shows, to the number; what its buttons do; how it is drawn.
#include <cmath>
#include <cstdlib>

#include "ConsacPanel.h"
#include "ConsacPanelState.h"
#include "ConsacWatch.h"
#include "CoreGlobals.h"
#include "Editor.h"
#include "Editor/EditorEngine.h"
#include "Framework/Docking/TabManager.h"
#include "HAL/PlatformTime.h"
#include "Logging/LogMacros.h"
#include "Misc/OutputDeviceRedirector.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"
#include "ToolMenus.h"
#include "Widgets/Input/SButton.h"
#include "graphs.h"
#include "panel_picture.h"
#include "tests/files.h"

namespace consac::testing {
namespace {

constexpr const TCHAR* kTools = u"LevelEditor.MainMenu.Tools";

/// A game that plays in the editor.
class PlayedGame : public Shim::Game {
 public:
  PlayedGame() {
    world().WorldType = EWorldType::PIE;
    GEditor->PlayWorld = &world();
  }
};

FConsacPanelTrainer Learner() {
  FConsacPanelTrainer row;
  row.Name = TEXT("Trainer");
  row.Mode = TEXT("Train Inside");
  row.bRuns = true;
  row.Agents = 8;
  row.Progress.State = TEXT("collecting");
  row.Progress.Steps = 12000;
  row.Progress.TotalSteps = 20000;
  row.Progress.Episodes = 130;
  row.Progress.MeanEpisodeReward = 61.25f;
  row.Progress.MeanEpisodeLength = 98.0f;
  row.Progress.StepsPerSecond = 480.0f;
  row.Progress.PollMilliseconds = 0.125f;
  return row;
}

FConsacPanelState Playing(const FConsacPanelTrainer& row) {
  FConsacPanelState panel;
  panel.bPlays = panel.bLevelHasTrainer = true;
  panel.Trainers.Add(row);
  return panel;
}

TEST(PanelCurve, IsALineFromSideToSide) {
  FConsacCurve curve;
  EXPECT_TRUE(curve.InPicture(100.0f, 50.0f).IsEmpty());
  curve.Add(10, 1.0f);
  EXPECT_TRUE(curve.InPicture(100.0f, 50.0f).IsEmpty()) << "one point is no line";
  curve.Add(20, 3.0f);
  curve.Add(40, 2.0f);
  const TArray<FVector2f> line = curve.InPicture(100.0f, 50.0f);
  ASSERT_EQ(line.Num(), 3);
  EXPECT_EQ(line[0].X, 0.0f);
  EXPECT_EQ(line[0].Y, 50.0f) << "the lowest is at the bottom";
  EXPECT_FLOAT_EQ(line[1].X, 100.0f / 3.0f);
  EXPECT_EQ(line[1].Y, 0.0f);
  EXPECT_EQ(line[2].X, 100.0f);
  EXPECT_EQ(line[2].Y, 25.0f);
  curve.Add(40, 5.0f);
  EXPECT_EQ(curve.GetPoints().Num(), 3) << "no step more: the same point";
  EXPECT_EQ(curve.GetHighest(), 5.0f);
  EXPECT_EQ(curve.InPicture(100.0f, 50.0f)[2].Y, 0.0f);
  curve.Add(5, 4.0f);
  ASSERT_EQ(curve.GetPoints().Num(), 1) << "fewer steps: another training";
  curve.Add(6, 4.0f);
  EXPECT_EQ(curve.InPicture(100.0f, 50.0f)[0].Y, 25.0f) << "all alike: in the middle";
}

TEST(PanelCurve, StaysShortAndEvenlyDenseForAsLongAsATrainingIs) {
  FConsacCurve curve;
  for (int64 sample = 0; sample < 100000; ++sample) curve.Add(8 * sample, static_cast<float>(sample));
  const TArray<FConsacCurvePoint> points = curve.GetPoints();
  ASSERT_GT(points.Num(), FConsacCurve::Most / 2);
  ASSERT_LE(points.Num(), FConsacCurve::Most + 1);
  EXPECT_EQ(points[0].Steps, 0);
  EXPECT_EQ(points[points.Num() - 1].Steps, 8 * 99999) << "the latest is always there";
  for (int32 at = 2; at + 1 < points.Num(); ++at)
    EXPECT_EQ(points[at].Steps - points[at - 1].Steps, points[1].Steps - points[0].Steps) << at;
}

TEST(PanelClock, TellsWhereAFrameGoes) {
  FConsacFrameClock clock;
  clock.EndFrame(1.0);
  for (const double begin : {1.0, 1.016}) {
    clock.BeginWorld(begin + 0.001);
    clock.EndWorld(begin + 0.004);
    clock.BeginWorld(begin + 0.005);  // a second one that plays
    clock.EndWorld(begin + 0.006);
    clock.EndFrame(begin + 0.016);
  }
  clock.EndFrame(5.0);  // nothing played
  FConsacFrameTimes times = clock.Take();
  EXPECT_EQ(times.Frames, 2);
  EXPECT_NEAR(times.Frame, 16.0, 1e-9);
  EXPECT_NEAR(times.Worlds, 4.0, 1e-9);
  EXPECT_EQ(clock.Take().Frames, 0) << "taken";
}

TEST(PanelWords, SayHowItStands) {
  FConsacPanelState panel = Playing(Learner());
  EXPECT_EQ(Text(ConsacPanelWords::State(panel)),
            "Trainer (Train Inside): collecting\nstep 12000 of 20000, 130 episodes, mean reward 61.2 over 98 steps");
  panel.Trainers[0].bRuns = false;
  EXPECT_NE(Text(ConsacPanelWords::State(panel)).find("collecting; stopped\n"), std::string::npos);
  panel.Trainers[0].Progress = FConsacProgress();
  EXPECT_EQ(Text(ConsacPanelWords::State(panel)), "Trainer (Train Inside): has not begun");
  panel.Trainers.Add(panel.Trainers[0]);
  panel.Trainers[1].bWaitsForTurn = true;
  EXPECT_NE(Text(ConsacPanelWords::State(panel)).find("\nTrainer (Train Inside): waits for its turn"),
            std::string::npos);
  panel.Trainers.Reset();
  EXPECT_NE(Text(ConsacPanelWords::State(panel)).find("nobody trains"), std::string::npos);
  panel.bPlays = false;
  EXPECT_NE(Text(ConsacPanelWords::State(panel)).find("Press Play"), std::string::npos);
  panel.bLevelHasTrainer = false;
  EXPECT_NE(Text(ConsacPanelWords::State(panel)).find("Tools > Consac > New Hello Level"), std::string::npos);
  EXPECT_EQ(Text(ConsacPanelWords::Slow(panel)) + Text(ConsacPanelWords::Speed(panel)), "");
}

TEST(PanelWords, SayWhatIsSlow) {
  FConsacPanelState panel = Playing(Learner());
  EXPECT_EQ(Text(ConsacPanelWords::Speed(panel)), "") << "no frame was seen";
  panel.Times.Frames = 15;
  panel.Times.Frame = 16.0;
  panel.Times.Worlds = 4.0;
  EXPECT_EQ(Text(ConsacPanelWords::Speed(panel)),
            "480 steps/s of 8 agents, 62 frames/s\na frame takes 16.00 ms: 4.00 ms the game's tick, 12.00 ms drawing "
            "and the editor; the latest decision 0.125 ms");
  EXPECT_NE(Text(ConsacPanelWords::Slow(panel)).find("75 %, is drawing and the editor: a small viewport"),
            std::string::npos)
      << Text(ConsacPanelWords::Slow(panel));
  panel.Trainers[0].bFullSpeed = false;
  EXPECT_NE(Text(ConsacPanelWords::Slow(panel)).find("Full Speed of the trainer is off"), std::string::npos);
  panel.Times.Worlds = 12.0;
  EXPECT_NE(Text(ConsacPanelWords::Slow(panel)).find("75 %, is the game's own tick"), std::string::npos);
  panel.Trainers[0].Progress.PollMilliseconds = 9.0f;
  EXPECT_NE(Text(ConsacPanelWords::Slow(panel)).find("the decision, 9.000 ms: a smaller network"), std::string::npos);
  panel.Trainers[0].Port = 5005;
  EXPECT_NE(Text(ConsacPanelWords::Slow(panel)).find("waits for the trainer's answer"), std::string::npos);
  panel.Trainers[0].Progress.Steps = 20000;
  EXPECT_EQ(Text(ConsacPanelWords::Slow(panel)), "") << "it has come to its end";
  panel.Trainers[0].Progress.Steps = 0;
  EXPECT_EQ(Text(ConsacPanelWords::Slow(panel)),
            "Nobody trains yet: Start Program, or consac train tcp://127.0.0.1:5005 in a terminal.");
}

TEST(PanelWords, SayHowLongAgo) {
  EXPECT_EQ(Text(ConsacPanelWords::Ago(59.0)), "just now");
  EXPECT_EQ(Text(ConsacPanelWords::Ago(-3.0)), "just now") << "two clocks are never one";
  EXPECT_EQ(Text(ConsacPanelWords::Ago(60.0)), "1 min ago");
  EXPECT_EQ(Text(ConsacPanelWords::Ago(7199.0)), "1 h ago");
  EXPECT_EQ(Text(ConsacPanelWords::Ago(90000.0)), "1 day ago");
  EXPECT_EQ(Text(ConsacPanelWords::Ago(200000.0)), "2 days ago");
}

TEST(PanelWords, NameTheModelsAndTheirDates) {
  FConsacPanelState panel;
  EXPECT_EQ(Text(ConsacPanelWords::Models(panel)), "No models below Saved/Consac yet.");
  panel.NowUtc.shim_unix_ = 1700000000.0;
  FConsacPanelModel model;
  model.File = TEXT("hello/default.consac");
  model.Changed.shim_unix_ = 1700000000.0 - 600.0;
  model.Bytes = 20000;
  panel.Models.Add(model);
  panel.MoreModels = 3;
  EXPECT_EQ(Text(ConsacPanelWords::Models(panel)),
            "Models below Saved/Consac, the latest first:\nhello/default.consac, 10 min ago (2023-11-14 22:03 UTC), 20 "
            "KiB\nand 3 more");
}

/// What a watch sees of a game.
class Watched : public ::testing::Test {
 protected:
  Watched() { FPaths::ShimSetProject(scratch_.path()); }
  ~Watched() override { FPaths::ShimSetProject("."); }
  AConsacTrainer* Spawn(EConsacMode mode, bool auto_start = true) {
    return game_.SpawnWith<AConsacTrainer>([&](AConsacTrainer& made) {
      made.Mode = mode;
      made.bAutoStart = auto_start;
      made.LogSeconds = 0.0f;
    });
  }
  /// A frame: so long of the game's tick, the rest of it around.
  void Frame(double tick_s, double rest_s) {
    tick_s_ = tick_s;
    FPlatformTime::shim_seconds_ += rest_s;
    game_.Tick();
  }

  const ScratchFolder scratch_{"unreal_panel"};
  PlayedGame game_;
  FConsacWatch watch_;
  double tick_s_ = 0.0;
};

TEST_F(Watched, ATrainerIsShownToTheNumber) {
  EXPECT_TRUE(watch_.Look(false).bPlays);
  EXPECT_EQ(watch_.Look(false).Trainers.Num(), 0);
  RoadAgent one(game_, 1), two(game_, 2);
  one.agent->MaxEpisodeSteps = two.agent->MaxEpisodeSteps = 10;
  one.agent->OnAction.ShimBind(one.agent, [this](UConsacAgentComponent*) { FPlatformTime::shim_seconds_ += tick_s_; });
  AConsacTrainer* trainer = Spawn(EConsacMode::ByHand);
  AConsacTrainer* second = Spawn(EConsacMode::ByHand);
  for (int k = 0; k < 35; ++k) game_.Tick();
  watch_.Look(false);
  for (int k = 0; k < 4; ++k) Frame(0.003, 0.013);
  const FConsacPanelState& state = watch_.Look(false);
  ASSERT_EQ(state.Trainers.Num(), 2);
  const FConsacPanelTrainer& row = state.Trainers[0];
  const FConsacProgress progress = trainer->GetTrainerProgress();
  EXPECT_EQ(Text(row.Name), Text(trainer->GetName()));
  EXPECT_EQ(Text(row.Mode), "By Hand");
  EXPECT_TRUE(row.bRuns && !row.bWaitsForTurn);
  EXPECT_EQ(row.Agents, 2);
  EXPECT_EQ(row.Progress.Steps, progress.Steps);
  EXPECT_GE(row.Progress.Steps, 70);
  EXPECT_EQ(row.Progress.Episodes, progress.Episodes);
  EXPECT_GE(row.Progress.Episodes, 6);
  EXPECT_EQ(Text(state.Trainers[1].Name), Text(second->GetName()));
  EXPECT_TRUE(state.Trainers[1].bWaitsForTurn);
  EXPECT_EQ(state.Times.Frames, 4);
  EXPECT_NEAR(state.Times.Frame, 16.0, 1e-6);
  EXPECT_NEAR(state.Times.Worlds, 3.0, 1e-6);
  const TArray<FConsacCurvePoint> points = state.Curve.GetPoints();
  ASSERT_EQ(points.Num(), 2) << "one for each look that saw other steps";
  EXPECT_EQ(points[1].Steps, progress.Steps);
  EXPECT_EQ(points[1].Reward, progress.MeanEpisodeReward);
}

TEST_F(Watched, StartAndStopActOnTheTrainerThatDrives) {
  RoadAgent agent(game_, 1);
  AConsacTrainer* trainer = Spawn(EConsacMode::ByHand, false);
  AConsacTrainer* second = Spawn(EConsacMode::ByHand, false);
  game_.Tick();
  const std::string name = Text(trainer->GetName());
  EXPECT_EQ(Text(watch_.Start()), name + " begins.");
  EXPECT_TRUE(trainer->IsTraining());
  EXPECT_FALSE(second->IsTraining());
  EXPECT_NE(Text(watch_.Start()).find(name + " does not begin: the training has begun already"), std::string::npos);
  EXPECT_EQ(Text(watch_.Stop()), name + " is stopped. Start begins a new training.");
  EXPECT_FALSE(trainer->IsTraining());
  EXPECT_EQ(Text(watch_.Stop()), name + " did not train, and does not begin by itself any more.");
  EXPECT_NE(Text(watch_.StartProgram()).find("its Mode is By Hand, not Serve"), std::string::npos);
  Shim::Destroy(*trainer);
  Shim::Destroy(*second);
  EXPECT_NE(Text(watch_.Start()).find("The game has no Consac Trainer"), std::string::npos);
  GEditor->PlayWorld = nullptr;
  EXPECT_EQ(Text(watch_.Start()), "Nothing plays: press Play first.");
  EXPECT_FALSE(watch_.Look(false).bPlays);
}

TEST_F(Watched, ATrainerWithoutAProgramSaysSoAmongTheErrors) {
  AConsacTrainer* trainer = Spawn(EConsacMode::Serve);
  trainer->Program.Program = TEXT("/no/such/program");
  EXPECT_NE(Text(watch_.StartProgram()).find("was asked to start its program"), std::string::npos);
  const FConsacPanelState& state = watch_.Look(false);
  ASSERT_GE(state.Faults.Num(), 1);
  EXPECT_NE(Text(state.Faults[0].Text).find("/no/such/program"), std::string::npos);
  EXPECT_NE(Text(watch_.ImportModels()).find(Text(trainer->GetName())), std::string::npos);
  EXPECT_NE(Text(watch_.Look(false).Faults[0].Text).find("train first"), std::string::npos);
}

TEST_F(Watched, ErrorsAreKeptInWordsTheLatestFirstAndEachOnce) {
  const auto say = [](const char* category, Shim::Verbosity verbosity, const char* line) {
    Shim::LogLine({category}, verbosity, Shim::Wide(line));
  };
  say("LogOther", Shim::Verbosity::Error, "not ours");
  say("LogConsac", Shim::Verbosity::Log, "no fault");
  say("LogConsac", Shim::Verbosity::Error, "the port is taken");
  FPlatformTime::shim_seconds_ += 120.0;
  say("LogConsacSamples", Shim::Verbosity::Warning, "a warning");
  say("LogConsac", Shim::Verbosity::Error, "the port is taken");
  const FConsacPanelState& state = watch_.Look(false);
  ASSERT_EQ(state.Faults.Num(), 2);
  EXPECT_EQ(Text(ConsacPanelWords::Faults(state)),
            "Error (just now, 2 times): the port is taken\nWarning (just now): a warning");
  for (int k = 0; k < 2 * FConsacLogTail::Most; ++k)
    say("LogConsac", Shim::Verbosity::Error, std::to_string(k).c_str());
  ASSERT_EQ(watch_.Look(false).Faults.Num(), FConsacLogTail::Most);
  EXPECT_EQ(Text(state.Faults[0].Text), std::to_string(2 * FConsacLogTail::Most - 1));
}

TEST_F(Watched, ModelsBelowSavedAreListedTheLatestFirst) {
  EXPECT_TRUE(watch_.Look(true).Models.IsEmpty());
  const std::filesystem::path saved = scratch_.path() + "/Saved/Consac";
  const auto now = std::filesystem::file_time_type::clock::now();
  for (int k = 0; k < 10; ++k) {
    const std::filesystem::path file = saved / ("run-" + std::to_string(k)) / "model.consac";
    std::filesystem::create_directories(file.parent_path());
    ASSERT_TRUE(WriteFileAtomically(file.string(), std::as_bytes(std::span("0123456789"))).ok());
    std::filesystem::last_write_time(file, now - std::chrono::hours(k == 7 ? 0 : 20 - k));
  }
  ASSERT_TRUE(WriteFileAtomically((saved / "progress.csv").string(), std::as_bytes(std::span("x"))).ok());
  EXPECT_TRUE(watch_.Look(true).Models.IsEmpty()) << "looked for a moment ago";
  FPlatformTime::shim_seconds_ += 5.0;
  EXPECT_TRUE(watch_.Look(false).Models.IsEmpty()) << "nobody sees it";
  const FConsacPanelState& state = watch_.Look(true);
  ASSERT_EQ(state.Models.Num(), FConsacPanelState::MostModels);
  EXPECT_EQ(state.MoreModels, 2);
  EXPECT_EQ(Text(state.Models[0].File), "run-7/model.consac");
  EXPECT_EQ(Text(state.Models[1].File), "run-9/model.consac");
  EXPECT_EQ(state.Models[0].Bytes, 11);
}

TEST_F(Watched, AGraphsEnvironmentIsShownToo) {
  RoadGraph graph(game_);
  ASSERT_EQ(graph.Setup(100, 0), EConsacResult::Success);
  graph.Tick();
  const FConsacPanelState& state = watch_.Look(false);
  ASSERT_EQ(state.Trainers.Num(), 1);
  EXPECT_TRUE(state.Trainers[0].bGraph && state.Trainers[0].bRuns);
  EXPECT_EQ(state.Trainers[0].Port, graph.environment().GetTrainingPort());
  EXPECT_NE(Text(ConsacPanelWords::Slow(state)).find("Nobody trains yet"), std::string::npos);
}

TEST_F(Watched, WhatDoesNotPlayInTheEditorIsNotShown) {
  game_.world().WorldType = EWorldType::Game;
  Spawn(EConsacMode::ByHand);
  EXPECT_EQ(watch_.Look(false).Trainers.Num(), 0);
  game_.world().WorldType = EWorldType::PIE;
  EXPECT_EQ(watch_.Look(false).Trainers.Num(), 1);
  game_.world().shim_net_mode_ = NM_Client;
  EXPECT_EQ(watch_.Look(false).Trainers.Num(), 0) << "a client trains nothing";
  game_.world().shim_net_mode_ = NM_Standalone;
}

/// A training of the hello level, two minutes old.
FConsacPanelState OfThePicture() {
  FConsacPanelState panel = Playing(Learner());
  panel.Times.Frames = 30;
  panel.Times.Frame = 8.3;
  panel.Times.Worlds = 1.6;
  for (int k = 0; k <= 60; ++k) {
    const auto way = static_cast<float>(k) / 60.0f;
    panel.Curve.Add(200 * k, 4.0f + 57.25f * way * way * (3.0f - 2.0f * way) +
                                 3.0f * std::sin(0.9f * static_cast<float>(k)) * (1.0f - way));
  }
  panel.Now = 120.0;
  panel.NowUtc.shim_unix_ = 1700000000.0;
  FConsacFault fault;
  fault.Text = TEXT("agent 3: the observation 'places' has 3 numbers; expected 2");
  fault.Times = 2;
  fault.When = 30.0;
  panel.Faults.Add(fault);
  for (const auto& [file, age_s] :
       {std::pair(TEXT("hello/default.consac"), 600.0), std::pair(TEXT("chase/hunter.consac"), 9000.0)}) {
    FConsacPanelModel model;
    model.File = file;
    model.Changed.shim_unix_ = 1700000000.0 - age_s;
    model.Bytes = 20000;
    panel.Models.Add(model);
  }
  return panel;
}

// To draw it anew after a change of the panel: CONSAC_DRAW=1 consac_unreal_tests --gtest_filter=PanelPicture.*
TEST(PanelPicture, OfItsPageIsDrawnByThePanelItself) {
  const TSharedRef<SConsacPanel> panel = SNew(SConsacPanel);
  panel->Show(OfThePicture());
  const std::string drawn =
      PanelPicture::Of(*panel, "A drawing of the panel's widgets and words by its own code; not a screenshot.");
  const std::string path = std::string(CONSAC_SOURCE_DIR) + "/docs/images/editor-panel.svg";
  if (std::getenv("CONSAC_DRAW") != nullptr) Put(path, drawn);
  EXPECT_EQ(TextOf(path), drawn) << "the panel has changed: draw its picture anew, as is said above";
}

/// Everything that is written in a widget and what is in it, from top to bottom.
std::string Written(const SWidget& widget) {
  std::string all = widget.ShimText().empty() ? "" : widget.ShimText() + "\n";
  for (const TSharedRef<SWidget>& child : widget.shim_children_) all += Written(*child);
  return all;
}

bool Click(const SWidget& widget, const std::string& button) {
  for (const TSharedRef<SWidget>& child : widget.shim_children_)
    if ((child->ShimText() == button && child->ShimClick()) || Click(*child, button)) return true;
  return false;
}

/// What a widget and what is in it draw, each in as much room as it asks for.
FSlateWindowElementList Painted(const SWidget& widget) {
  FSlateWindowElementList all;
  const FVector2D size = widget.ComputeDesiredSize(1.0f);
  widget.OnPaint(FPaintArgs(), FGeometry{{size.X, size.Y}}, FSlateRect(), all, 0, FWidgetStyle(), true);
  for (const TSharedRef<SWidget>& child : widget.shim_children_)
    for (const auto& lines : Painted(*child).shim_lines_) all.shim_lines_.push_back(lines);
  return all;
}

/// The editor has started, with the plugin's module.
class Panel : public ::testing::Test {
 protected:
  Panel() {
    Shim::StopModules();  // so that no earlier training's curve is there
    Shim::StartModules();
    UToolMenus::ShimStart();
    FPaths::ShimSetProject(scratch_.path());
  }
  ~Panel() override {
    FGlobalTabmanager::Get()->ShimClose(u"ConsacPanel");
    FPaths::ShimSetProject(".");
  }
  const SWidget& Open() {
    EXPECT_TRUE(UToolMenus::ShimChoose(kTools, u"ConsacPanel"));
    return *FGlobalTabmanager::Get()->ShimOpen(u"ConsacPanel");
  }

  const ScratchFolder scratch_{"unreal_panel_tab"};
};

TEST_F(Panel, AnEntryInToolsOpensItAndItSaysWhatToDo) {
  ASSERT_EQ(UToolMenus::ShimEntries(kTools).size(), 2u);
  const std::string written = Written(Open());
  EXPECT_EQ(written.find("Start\nStop\nStart Program\nImport Models\n"), 0u) << written;
  EXPECT_NE(written.find("Nothing plays"), std::string::npos);
  EXPECT_NE(written.find("No models below Saved/Consac yet."), std::string::npos);
  EXPECT_EQ(&Open(), &Open()) << "one tab, which is put in front";
  EXPECT_EQ(Painted(Open()).shim_lines_.size(), 1u) << "the sides of the curve alone";
}

TEST_F(Panel, ItsButtonsActAndItsCurveGrowsWhileTheGamePlays) {
  PlayedGame game;
  RoadAgent agent(game, 1);
  agent.agent->MaxEpisodeSteps = 5;
  AConsacTrainer* trainer = game.SpawnWith<AConsacTrainer>([](AConsacTrainer& made) {
    made.Mode = EConsacMode::ByHand;
    made.bAutoStart = false;
  });
  const SWidget& panel = Open();
  ASSERT_TRUE(Click(panel, "Start"));
  EXPECT_NE(Written(panel).find(Text(trainer->GetName()) + " begins."), std::string::npos) << Written(panel);
  for (int k = 0; k < 120; ++k) game.Tick(0.05f);
  EXPECT_TRUE(trainer->IsTraining());
  EXPECT_NE(Written(panel).find("played by hand\nstep "), std::string::npos) << Written(panel);
  EXPECT_NE(Written(panel).find("Mean reward of an episode, from step "), std::string::npos);
  const FSlateWindowElementList drawn = Painted(panel);
  ASSERT_EQ(drawn.shim_lines_.size(), 2u);
  EXPECT_GT(drawn.shim_lines_[1].points.size(), 10u) << "looked at four times a second";
  EXPECT_GT(drawn.shim_lines_[1].layer, drawn.shim_lines_[0].layer) << "over its sides";
  ASSERT_TRUE(Click(panel, "Stop"));
  EXPECT_FALSE(trainer->IsTraining());
  EXPECT_TRUE(Click(panel, "Import Models"));
  EXPECT_NE(Written(panel).find("Error (just now): "), std::string::npos) << Written(panel);
  EXPECT_TRUE(Click(panel, "Start Program"));
  EXPECT_NE(Written(panel).find("not Serve"), std::string::npos);
}

TEST_F(Panel, ATrainingThatWasNotLookedAtHasItsCurve) {
  PlayedGame game;
  RoadAgent agent(game, 1);
  agent.agent->MaxEpisodeSteps = 5;
  game.SpawnWith<AConsacTrainer>([](AConsacTrainer& made) { made.Mode = EConsacMode::ByHand; });
  for (int k = 0; k < 60; ++k) game.Tick(0.05f);
  EXPECT_EQ(Painted(Open()).shim_lines_.size(), 2u);
}

TEST_F(Panel, NothingIsLeftOfAModuleThatEnds) {
  const TSharedPtr<SDockTab> tab = (Open(), FGlobalTabmanager::Get()->ShimOpen(u"ConsacPanel"));
  const std::size_t hearing = GLog->shim_devices_.size();
  Shim::StopModules();
  EXPECT_TRUE(UToolMenus::ShimEntries(kTools).empty());
  EXPECT_FALSE(FGlobalTabmanager::Get()->TryInvokeTab(FTabId(FName(u"ConsacPanel"))).IsValid());
  EXPECT_EQ(GLog->shim_devices_.size(), hearing - 1);
  EXPECT_TRUE(Click(*tab, "Start")) << "a tab that is still there does nothing";
  {
    PlayedGame game;
    game.Tick(1.0f);
  }
  Shim::StartModules();
  UToolMenus::ShimStart();
  EXPECT_EQ(UToolMenus::ShimEntries(kTools).size(), 2u);
}

}  // namespace
}  // namespace consac::testing
