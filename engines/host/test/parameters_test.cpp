// Parameters of an engine's world, and what it notes, where who drives it is in the same process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "consac/env/buffer.h"
#include "consac/host/driver.h"
#include "tests/files.h"
#include "tests/folder.h"

namespace consac::host {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

/// Two agents, each a world of its own, whose episodes last three steps.
class WindyEngine {
 public:
  WindyEngine() {
    TickWorldOptions options;
    Offering& offering = options.offerings.emplace_back();
    offering.observations = {{"seen", *Space::Box(0.0, 1.0, {1})}};
    offering.actions = {{"done", *Space::Discrete(2)}};
    offering.agents = 2;
    options.max_episode_steps = 3;
    options.parameters = {{"wind", 1.0, 0.0, 9.0}, {"mass", 2.0}};
    options.notes = true;
    world_ = *TickWorld::Create(options);
    for (int a = 0; a < 2; ++a) (void)*world_->Join(0);
  }
  TickWorld& world() { return *world_; }
  /// What episodes had of each parameter that began since this was last emptied.
  std::vector<double> winds, masses;

  void Tick(Driver& driver) {
    const bool acts = world_->cue() == Cue::kAct;
    for (AgentId a = 0; a < 2; ++a) {
      if (acts && world_->Ending(a)) std::fill_n(world_->FinalObservation(a), sizeof(float), std::byte{0});
      if (!world_->Resets(a) && !(acts && world_->Ending(a))) continue;
      winds.push_back(world_->Parameter(a, 0));
      masses.push_back(world_->Parameter(a, 1));
    }
    if (world_->cue() != Cue::kWait) {
      ASSERT_TRUE(world_->Note("gust", 0.5).ok());
      ASSERT_TRUE(world_->Offer().ok());
    }
    ASSERT_TRUE(driver.Poll(0.01).ok());
  }
  void Tick(Driver& driver, int ticks) {
    for (int tick = 0; tick < ticks; ++tick) Tick(driver);
  }

 private:
  std::unique_ptr<TickWorld> world_;
};

TrainOptions WindyTraining(const std::string& parameters) {
  TrainOptions options;
  options.total_steps = 240;
  options.seed = 4;
  options.hyperparameters = {{"n_steps", "16"}};
  options.environment_parameters = parameters;
  return options;
}

TEST(ParametersInside, ATrainingSetsAndDrawsThem) {
  for (const WhileLearning meanwhile : {WhileLearning::kWait, WhileLearning::kGoOn}) {
    WindyEngine engine;
    TrainOptions options = WindyTraining("wind=uniform 2 5, mass=3");
    options.while_learning = meanwhile;
    const auto driver = *Train(engine.world(), options);
    for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) engine.Tick(*driver);
    ASSERT_TRUE(driver->finished());
    ASSERT_GE(engine.winds.size(), 80u);
    EXPECT_THAT(engine.masses, Each(3.0)) << "from the first episode on";
    EXPECT_GE(*std::min_element(engine.winds.begin(), engine.winds.end()), 2.0);
    EXPECT_LE(*std::max_element(engine.winds.begin(), engine.winds.end()), 5.0);
    const std::set<double> drawn(engine.winds.begin(), engine.winds.end());
    EXPECT_EQ(drawn.size(), engine.winds.size()) << "each episode has its own, also those that pass while it learns";
    engine.Tick(*driver, 8);
    engine.winds.clear();
    engine.masses.clear();
    engine.Tick(*driver, 30);
    ASSERT_GE(engine.winds.size(), 10u);
    EXPECT_THAT(engine.winds, Each(1.0)) << "who acts by what was learned is in no training";
    EXPECT_THAT(engine.masses, Each(2.0));
  }
}

TEST(ParametersInside, ARampMovesAlongWithTheSteps) {
  WindyEngine engine;
  const auto driver = *Train(engine.world(), WindyTraining("wind=ramp 0 4 200"));
  for (int tick = 0; tick < 100'000 && !driver->finished(); ++tick) engine.Tick(*driver);
  ASSERT_TRUE(driver->finished());
  EXPECT_EQ(engine.winds.front(), 0.0);
  EXPECT_TRUE(std::is_sorted(engine.winds.begin(), engine.winds.end()));
  EXPECT_EQ(engine.winds.back(), 4.0);
  EXPECT_THAT(engine.masses, Each(2.0)) << "nobody sets it";
}

TEST(ParametersInside, WhatCannotBeSetIsRefusedBeforeAnythingIsLearned) {
  WindyEngine engine;
  const auto said = [&](const char* parameters) {
    return Train(engine.world(), WindyTraining(parameters)).status().message();
  };
  EXPECT_THAT(said("wnd=1"), HasSubstr("is 'wind' meant?"));
  EXPECT_THAT(said("wind=uniform 2 10"), HasSubstr("10"));
  EXPECT_THAT(said("wind"), HasSubstr("wind"));
}

TEST(ParametersInside, WhoComesNextBeginsWithTheDefaults) {
  WindyEngine engine;
  auto driver = *Train(engine.world(), WindyTraining("wind=7, mass=uniform 3 4"));
  engine.Tick(*driver, 30);
  ASSERT_THAT(engine.winds, Each(7.0));
  driver.reset();
  engine.winds.clear();
  engine.masses.clear();
  driver = *Train(engine.world(), WindyTraining("mass=5"));
  engine.Tick(*driver, 30);
  ASSERT_GE(engine.winds.size(), 10u);
  EXPECT_THAT(engine.winds, Each(1.0));
  EXPECT_THAT(engine.masses, Each(5.0));
  driver.reset();
  engine.winds.clear();
  engine.masses.clear();
  driver = ByHand(engine.world(), 1);
  engine.Tick(*driver, 30);
  ASSERT_GE(engine.winds.size(), 10u);
  EXPECT_THAT(engine.winds, Each(1.0));
  EXPECT_THAT(engine.masses, Each(2.0));
}

TEST(NotesInside, AreForTheHostsLogAndForNobodyElse) {
  WindyEngine engine;
  const auto driver = *Train(engine.world(), WindyTraining(""));
  engine.Tick(*driver, 30);
  const std::vector<Statistic> means = engine.world().TakeMeans();
  ASSERT_EQ(means.size(), 1u);
  EXPECT_EQ(means[0].name, "gust");
  EXPECT_EQ(means[0].value, 0.5);
  std::vector<Statistic> noted;
  engine.world().TakeStatistics(&noted);
  EXPECT_LE(noted.size(), 1u) << "they would pile up until a trainer elsewhere got those of another training";
}

TEST(NotesInside, StandInTheLogOfATrainingToo) {
  for (const WhileLearning meanwhile : {WhileLearning::kWait, WhileLearning::kGoOn}) {
    const testing::TestFolder folder;
    WindyEngine engine;
    TrainOptions options = WindyTraining("");
    options.while_learning = meanwhile;
    options.log_folder = folder.path();
    const auto driver = *Train(engine.world(), options);
    for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) engine.Tick(*driver);
    ASSERT_TRUE(driver->finished());
    const std::string csv = testing::TextOf(folder.File("PPO2_1/progress.csv"));
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 8) << csv;  // seven updates
    EXPECT_THAT(csv, HasSubstr("game/gust"));
    EXPECT_THAT(csv, HasSubstr(",0.5\n"));
    bool told = false;
    for (const auto& [path, text] : testing::FilesBelow(folder.path()))
      told = told || (path.find("tfevents") != std::string::npos && text.find("game/gust") != std::string::npos);
    EXPECT_TRUE(told);
  }
}

TEST(NotesInside, OfATimeWithoutStepsStandInTheLogToo) {
  const testing::TestFolder folder;
  WindyEngine engine;
  TrainOptions options = WindyTraining("");
  options.log_folder = folder.path();
  const auto driver = *Train(engine.world(), options);
  for (int tick = 0; tick < 10'000'000 && !driver->finished(); ++tick) {
    if (engine.world().cue() != Cue::kAct) {  // the world begins, or a model learns
      ASSERT_TRUE(engine.world().Note("waited", 2.0).ok());
    }
    engine.Tick(*driver);
  }
  ASSERT_TRUE(driver->finished());
  EXPECT_THAT(testing::TextOf(folder.File("PPO2_1/progress.csv")), HasSubstr("game/waited"));
}

}  // namespace
}  // namespace consac::host
