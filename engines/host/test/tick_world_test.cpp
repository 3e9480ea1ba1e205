#include "consac/host/tick_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "consac/env/buffer.h"
#include "consac/env/noted_means.h"

namespace consac::host {
namespace {

using ::testing::HasSubstr;

Offering Walker(std::int32_t agents) {
  Offering offering;
  offering.name = "walker";
  offering.observations = {{"place", *Space::Box(-1, 1, {2})}, {"colour", *Space::Discrete(3)}};
  offering.actions = {{"move", *Space::Discrete(4)}};
  offering.agents = agents;
  return offering;
}

TickWorldOptions Walkers(std::int32_t agents, std::int64_t max_steps = 0) {
  TickWorldOptions options;
  options.id = "walkers-v0";
  options.offerings = {Walker(agents)};
  options.max_episode_steps = max_steps;
  return options;
}

/// Both ends of a world, each agent of which sees the number of its step in 'place'[0].
struct World {
  explicit World(const TickWorldOptions& options) : world(*TickWorld::Create(options)) {
    for (const BehaviourSpec& behaviour : world->spec().behaviours) buffers.emplace_back(behaviour);
    for (BatchBuffer& buffer : buffers) batches.push_back(buffer.batch());
  }
  void JoinAll() {
    for (std::size_t b = 0; b < buffers.size(); ++b) {
      while (world->Join(b).ok()) {
      }
    }
  }
  void See(AgentId agent, float value) {
    const Leaf& leaf = world->ObservationLeaf(world->BehaviourOf(agent), 0);
    WriteElement(leaf, world->Observation(agent), 0, value);
  }
  float Seen(std::size_t slot, const std::byte* rows) {
    const Leaf& leaf = world->ObservationLeaf(0, 0);
    return static_cast<float>(
        ReadElement(leaf, rows + slot * world->spec().behaviours[0].observation_layout.row_bytes, 0));
  }
  std::unique_ptr<TickWorld> world;
  std::vector<BatchBuffer> buffers;
  std::vector<Batch> batches;
};

TEST(TickWorld, SaysWhatIsWrongWithAnOffering) {
  const auto message = [](TickWorldOptions options) {
    return TickWorld::Create(std::move(options)).status().message();
  };
  EXPECT_THAT(message({}), HasSubstr("no behaviour"));
  TickWorldOptions options = Walkers(0);
  EXPECT_THAT(message(options), HasSubstr("behaviour 'walker' has room for 0 agents"));
  options = Walkers(1);
  options.offerings[0].observations.clear();
  EXPECT_THAT(message(options), HasSubstr("(observations) has no entry"));
  options = Walkers(1);
  options.offerings[0].observations.push_back({"place", *Space::Discrete(2)});
  EXPECT_THAT(message(options), HasSubstr("place"));
  options = Walkers(1);
  options.offerings.push_back(Walker(1));
  EXPECT_THAT(message(options), HasSubstr("behaviour name 'walker' is there twice"));
  options = Walkers(1);
  options.offerings[0].actions = {{"push", *Space::Box(-1, 1, {1})}};
  options.offerings[0].masks_actions = true;
  EXPECT_THAT(message(options), HasSubstr("none of them is a choice"));
  EXPECT_THAT(message(Walkers(1, -1)), HasSubstr("max_episode_steps is -1"));
}

TEST(TickWorld, PromisesNoEqualResults) {
  EXPECT_FALSE(World(Walkers(1)).world->spec().deterministic);
}

TEST(TickWorld, OneEntryIsTheSpaceItselfAndSeveralAreADictOfThem) {
  const World world(Walkers(2));
  const BehaviourSpec& behaviour = world.world->spec().behaviours[0];
  EXPECT_EQ(behaviour.action_space.kind(), SpaceKind::kDiscrete);
  EXPECT_EQ(behaviour.observation_space.kind(), SpaceKind::kDict);
  EXPECT_EQ(world.world->ObservationLeaf(0, 0).name, "place");
  EXPECT_EQ(world.world->ObservationLeaf(0, 1).name, "colour");
  EXPECT_EQ(world.world->spec().environments(), 2);
}

TEST(TickWorld, WhereNothingIsLegalEverythingIsAndItIsSaid) {
  TickWorldOptions options = Walkers(1);
  options.offerings[0].actions = {{"move", *Space::MultiDiscrete({2, 3})}};
  options.offerings[0].masks_actions = true;
  World w(options);
  w.JoinAll();
  w.world->Reset(1, w.batches);
  const std::uint8_t mask[5] = {1, 0, 0, 0, 0};
  std::memcpy(w.world->ActionMask(0), mask, sizeof(mask));
  EXPECT_THAT(w.world->Offer().message(), HasSubstr("agent 0 of 'walker' has nothing legal in choice 1"));
  const std::uint8_t* sent = w.batches[0].next_action_masks;
  EXPECT_EQ(std::vector<std::uint8_t>(sent, sent + 5), (std::vector<std::uint8_t>{1, 0, 1, 1, 1}));
}

TEST(TickWorld, AgentsOfSeveralBehavioursShareOneEnvironment) {
  TickWorldOptions options = Walkers(3);
  options.offerings.push_back(Walker(2));
  options.offerings[1].name = "hunter";
  const World world(options);
  EXPECT_EQ(world.world->spec().environments(), 1);
  EXPECT_EQ(world.world->spec().behaviours[1].agents[1], "hunter_1");
  EXPECT_EQ(world.world->places(), 5);
  EXPECT_EQ(world.world->BehaviourOf(4), 1u);
}

TEST(TickWorld, AStepSettlesWhenItIsOffered) {
  World w(Walkers(2));
  w.JoinAll();
  EXPECT_EQ(w.world->Offer().code(), StatusCode::kFailedPrecondition);
  w.world->Reset(7, w.batches);
  EXPECT_FALSE(w.world->settled());
  EXPECT_EQ(w.world->cue(), Cue::kReset);
  EXPECT_EQ(w.world->Seed(1), 8u);
  w.See(0, 0.25f);
  w.See(1, 0.5f);
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_TRUE(w.world->settled());
  EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 0.5f);

  const std::int32_t actions[2] = {3, 1};
  std::memcpy(w.batches[0].actions, actions, sizeof(actions));
  w.world->Step(w.batches);
  ASSERT_EQ(w.world->cue(), Cue::kAct);
  EXPECT_EQ(ReadElement(w.world->ActionLeaf(0, 0), w.world->Action(0), 0), 3);
  EXPECT_EQ(ReadElement(w.world->ActionLeaf(0, 0), w.world->Action(1), 0), 1);
  w.world->AddReward(0, 1.0f);
  w.world->AddReward(0, 0.5f);
  w.world->EndEpisode(1, EpisodeEnd::kTerminated);
  w.world->EndEpisode(1, EpisodeEnd::kTruncated);
  EXPECT_TRUE(w.world->Ending(1));
  EXPECT_FALSE(w.world->Ending(0));
  std::memcpy(w.world->FinalObservation(1), w.world->Observation(1),
              w.world->spec().behaviours[0].observation_layout.row_bytes);
  w.See(0, 0.75f);
  w.See(1, -1.0f);
  ASSERT_TRUE(w.world->Offer().ok());
  const Batch& batch = w.batches[0];
  EXPECT_EQ(batch.rewards[0], 1.5f);
  EXPECT_EQ(batch.rewards[1], 0.0f);
  EXPECT_EQ(batch.terminated[0], 0);
  EXPECT_EQ(batch.terminated[1], 1);
  EXPECT_EQ(batch.truncated[1], 0);
  EXPECT_EQ(w.Seen(1, batch.final_observations), 0.5f);
  EXPECT_EQ(w.Seen(1, batch.next_observations), -1.0f);
  EXPECT_EQ(w.world->tally().steps, 2);
  EXPECT_EQ(w.world->tally().episodes, 1);
}

TEST(TickWorld, TheTimeLimitTruncates) {
  World w(Walkers(1, 3));
  w.JoinAll();
  w.world->Reset(0, w.batches);
  ASSERT_TRUE(w.world->Offer().ok());
  for (int step = 1; step <= 7; ++step) {
    w.world->Step(w.batches);
    EXPECT_EQ(w.world->Ending(0), step % 3 == 0) << step;
    w.world->AddReward(0, 2.0f);
    ASSERT_TRUE(w.world->Offer().ok());
    EXPECT_EQ(w.batches[0].truncated[0], step % 3 == 0 ? 1 : 0) << step;
    EXPECT_EQ(w.batches[0].terminated[0], 0);
  }
  EXPECT_EQ(w.world->tally().mean_episode_length, 3.0);
  EXPECT_EQ(w.world->tally().mean_episode_reward, 6.0);
}

TEST(TickWorld, NumbersThatAreNoneAreNamedAndOfferedAsZero) {
  World w(Walkers(2));
  w.JoinAll();
  w.world->Reset(0, w.batches);
  w.See(1, std::numeric_limits<float>::quiet_NaN());
  Status status = w.world->Offer();
  EXPECT_EQ(status.code(), StatusCode::kNonFinite);
  EXPECT_THAT(status.message(), HasSubstr("agent 1 of 'walker' sees NaN in number 0 of 'place'"));
  EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 0.0f);
  w.world->Step(w.batches);
  w.world->AddReward(0, std::numeric_limits<float>::infinity());
  status = w.world->Offer();
  EXPECT_THAT(status.message(), HasSubstr("reward of agent 0"));
  EXPECT_EQ(w.batches[0].rewards[0], 0.0f);
}

TEST(TickWorld, ANumberBeyondItsBoundsIsToldOfOnce) {
  static std::vector<std::string> told;
  told.clear();
  Hooks hooks;
  hooks.log = [](void*, LogLevel, std::string_view line) { told.emplace_back(line); };
  SetHooks(hooks);
  World w(Walkers(2));
  w.JoinAll();
  w.world->Reset(0, w.batches);
  w.See(0, 1.0f);
  w.See(1, -1.0f);
  EXPECT_TRUE(w.world->Offer().ok());
  EXPECT_THAT(told, ::testing::IsEmpty()) << "the bounds themselves are within";
  for (int step = 0; step < 3; ++step) {
    w.world->Step(w.batches);
    w.See(1, 7.5f);
    EXPECT_TRUE(w.world->Offer().ok());
  }
  EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 7.5f);
  for (const float wild : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    w.world->Step(w.batches);
    w.See(1, wild);
    EXPECT_EQ(w.world->Offer().code(), StatusCode::kNonFinite)
        << "widened bounds let nothing through that is no number";
    EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 0.0f);
  }
  SetHooks({});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_THAT(told[0], HasSubstr("agent 1 of 'walker' sees 7.5 in number 0 of 'place', beyond its bounds -1 to 1"));
}

TEST(TickWorld, EveryoneMustHaveJoinedUnlessAgentsLeave) {
  World w(Walkers(2));
  EXPECT_THAT(w.world->EveryoneJoined().message(), HasSubstr("'walker' has 0 of 2 agents"));
  w.JoinAll();
  EXPECT_TRUE(w.world->EveryoneJoined().ok());
  EXPECT_THAT(w.world->Join(0).status().message(), HasSubstr("room for 2 agents"));
  EXPECT_THAT(w.world->Join(5).status().message(), HasSubstr("no behaviour 5"));
  EXPECT_TRUE(w.world->present(0).empty());
}

TEST(TickWorld, AgentsComeAndGo) {
  TickWorldOptions options = Walkers(2);
  options.agents_leave = true;
  World w(options);
  const AgentId first = *w.world->Join(0);
  w.world->Reset(0, w.batches);
  w.See(first, 0.25f);
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_EQ(w.world->present(0)[0], 1);
  EXPECT_EQ(w.world->present(0)[1], 0);

  w.world->Step(w.batches);
  const AgentId second = *w.world->Join(0);
  w.world->AddReward(second, 9.0f);  // it does not take part yet
  w.world->EndEpisode(second, EpisodeEnd::kTerminated);
  w.See(second, 0.5f);
  w.world->Leave(first);
  w.world->Leave(first);
  EXPECT_FALSE(w.world->Joined(first));
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_EQ(w.batches[0].truncated[0], 1);
  EXPECT_EQ(w.Seen(0, w.batches[0].final_observations), 0.25f);
  EXPECT_EQ(w.batches[0].rewards[1], 0.0f);
  EXPECT_EQ(w.batches[0].terminated[1], 0);
  EXPECT_EQ(w.world->present(0)[0], 0);
  EXPECT_EQ(w.world->present(0)[1], 1);
  EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 0.5f);
}

TEST(TickWorld, APlaceThatIsTakenAgainAtOnceBeginsAnEpisodeOfItsOwn) {
  TickWorldOptions options = Walkers(1);
  options.agents_leave = true;
  World w(options);
  (void)*w.world->Join(0);
  w.world->Reset(0, w.batches);
  ASSERT_TRUE(w.world->Offer().ok());
  w.world->Step(w.batches);
  w.world->AddReward(0, 3.0f);
  w.world->Leave(0);
  ASSERT_EQ(*w.world->Join(0), 0);
  w.See(0, 0.125f);
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_EQ(w.batches[0].rewards[0], 3.0f);
  EXPECT_EQ(w.batches[0].truncated[0], 1);
  EXPECT_EQ(w.Seen(0, w.batches[0].next_observations), 0.125f);
}

// The newcomer's doings are not the departed one's.
TEST(TickWorld, ANewcomerInTheSameStepIsNotEnding) {
  TickWorldOptions options = Walkers(1);
  options.agents_leave = true;
  World w(options);
  (void)*w.world->Join(0);
  w.world->Reset(0, w.batches);
  w.See(0, 0.25f);
  ASSERT_TRUE(w.world->Offer().ok());
  w.world->Step(w.batches);
  w.world->EndEpisode(0, EpisodeEnd::kTerminated);
  w.world->Leave(0);
  (void)*w.world->Join(0);
  EXPECT_FALSE(w.world->Ending(0));
  w.world->AddReward(0, 5.0f);
  w.See(0, 0.5f);
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_EQ(w.batches[0].rewards[0], 0.0f);
  EXPECT_EQ(w.batches[0].terminated[0], 1);
  EXPECT_EQ(w.Seen(0, w.batches[0].final_observations), 0.25f) << "where it was last seen";
}

TEST(TickWorld, MoreThanMemoryHoldsIsRefused) {
  TickWorldOptions options = Walkers(2'000'000'000);
  EXPECT_EQ(TickWorld::Create(options).status().code(), StatusCode::kResourceExhausted);
  options.offerings.push_back(Walker(2'000'000'000));
  options.offerings[1].name = "hunter";
  EXPECT_THAT(TickWorld::Create(options).status().message(), HasSubstr("at most 100000"));
}

TEST(TickWorld, ASingleWorldIsResetAlone) {
  World w(Walkers(3));
  w.JoinAll();
  w.world->Reset(0, w.batches);
  for (AgentId a = 0; a < 3; ++a) w.See(a, 0.5f);
  ASSERT_TRUE(w.world->Offer().ok());
  ASSERT_TRUE(w.world->ResetWorld(2, 40, w.batches));
  ASSERT_TRUE(w.world->ResetWorld(0, {}, w.batches));
  EXPECT_TRUE(w.world->Resets(0));
  EXPECT_FALSE(w.world->Resets(1));
  EXPECT_TRUE(w.world->Resets(2));
  EXPECT_EQ(w.world->Seed(2), 40u);
  EXPECT_FALSE(w.world->Seed(0).has_value());
  for (AgentId a = 0; a < 3; ++a) w.See(a, -0.5f);
  ASSERT_TRUE(w.world->Offer().ok());
  EXPECT_EQ(w.Seen(0, w.batches[0].next_observations), -0.5f);
  EXPECT_EQ(w.Seen(1, w.batches[0].next_observations), 0.5f);
}

/// A walker with a goal on a line of which it sees nothing else.
TickWorldOptions Seekers(const Goals& goals) {
  TickWorldOptions options = Walkers(1);
  const Space place = *Space::Box(-10, 10, {2});
  options.offerings[0].observations = {{"desired_goal", place}, {"achieved_goal", place}};
  options.offerings[0].goals = goals;
  return options;
}
Goals Priced(GoalReward reward, double threshold = 0.1) {
  Goals goals;
  goals.reward = reward;
  goals.threshold = threshold;
  return goals;
}

TEST(TickWorld, SaysWhatIsWrongWithItsGoals) {
  const auto message = [](TickWorldOptions options) {
    return TickWorld::Create(std::move(options)).status().message();
  };
  TickWorldOptions options = Walkers(1);
  options.offerings[0].goals = Priced(GoalReward::kDense);
  EXPECT_THAT(message(options), HasSubstr("'walker' has a goal reward, but no observations 'achieved_goal' and"));
  options = Seekers(Priced(GoalReward::kDense));
  options.offerings[0].observations[1].space = *Space::Box(-10, 10, {3});
  EXPECT_THAT(message(options), HasSubstr("that are alike"));
  EXPECT_THAT(message(Seekers(Priced(GoalReward::kSparse, -0.5))), HasSubstr("its threshold is -0.5"));
  EXPECT_THAT(message(Seekers(Priced(GoalReward::kFunction))), HasSubstr("no function that prices goals"));
}

TEST(TickWorld, PricesGoalsWhereEveryBehaviourThatHasThemSaysHow) {
  EXPECT_FALSE(World(Walkers(1)).world->prices_goals());
  EXPECT_FALSE(World(Seekers(Goals())).world->prices_goals());
  TickWorldOptions options = Seekers(Priced(GoalReward::kSparse));
  EXPECT_TRUE(World(options).world->prices_goals());
  options.offerings.push_back(Walker(1));
  options.offerings[1].name = "plain";
  EXPECT_TRUE(World(options).world->prices_goals());
  options.offerings.push_back(Seekers(Goals()).offerings[0]);
  options.offerings[2].name = "unpriced";
  EXPECT_FALSE(World(options).world->prices_goals());
}

TEST(TickWorld, GoalsAreWorthWhatTheirDistanceSays) {
  // achieved_goal and desired_goal lie in the order of their names.
  const float rows[3][4] = {{1, 2, 4, 6}, {0.1f, 0, 0, 0}, {0, 0, 0, 0.11f}};
  float worth[3];
  const auto price = [&](const Goals& goals) {
    World(Seekers(goals)).world->PriceGoals(0, reinterpret_cast<const std::byte*>(rows), 3, worth);
    return std::vector<float>(worth, worth + 3);
  };
  EXPECT_EQ(price(Priced(GoalReward::kDense)), (std::vector<float>{-5.0f, -0.1f, -0.11f}));
  EXPECT_EQ(price(Priced(GoalReward::kSparse)), (std::vector<float>{-1.0f, 0.0f, -1.0f}));
  Goals own = Priced(GoalReward::kFunction);
  own.price = [](const std::byte*, std::int64_t count, float* rewards) { std::fill_n(rewards, count, 7.0f); };
  EXPECT_EQ(price(own), (std::vector<float>{7.0f, 7.0f, 7.0f}));
}

/// Puts agent 0's achieved goal this far from the desired one, in `row`.
void Reach(World& w, std::byte* row, float far) {
  WriteElement(w.world->ObservationLeaf(0, 0), row, 0, 0.0);
  WriteElement(w.world->ObservationLeaf(0, 1), row, 0, far);
}

// By the observation that the step led to, which is the final one where the episode ended.
TEST(TickWorld, PaysByItsGoals) {
  for (const bool pays : {true, false}) {
    std::vector<std::string> told;
    Hooks hooks;
    hooks.user = &told;
    hooks.log = [](void* into, LogLevel, std::string_view message) {
      static_cast<std::vector<std::string>*>(into)->emplace_back(message);
    };
    SetHooks(hooks);
    Goals goals = Priced(GoalReward::kDense);
    goals.pays = pays;
    TickWorldOptions options = Seekers(goals);
    options.max_episode_steps = 2;
    World w(options);
    w.JoinAll();
    w.world->Reset(1, w.batches);
    ASSERT_TRUE(w.world->Offer().ok());
    w.world->Step(w.batches);
    w.world->AddReward(0, -3.0f);
    Reach(w, w.world->Observation(0), 3.0f);
    ASSERT_TRUE(w.world->Offer().ok());
    EXPECT_EQ(w.batches[0].rewards[0], -3.0f);
    EXPECT_TRUE(told.empty()) << told[0];
    for (int i = 0; i < 2; ++i) {
      w.world->Step(w.batches);
      w.world->AddReward(0, -1.0f);
      if (i == 0) Reach(w, w.world->FinalObservation(0), 2.0f);
      Reach(w, w.world->Observation(0), i == 0 ? 9.0f : 2.0f);
      ASSERT_TRUE(w.world->Offer().ok());
      EXPECT_EQ(w.batches[0].truncated[0], i == 0 ? 1 : 0);
      EXPECT_EQ(w.batches[0].rewards[0], pays ? -2.0f : -1.0f);
    }
    EXPECT_EQ(w.world->tally().mean_episode_reward, pays ? -5.0 : -4.0);
    SetHooks({});
    ASSERT_EQ(told.size(), 1u) << "once";
    EXPECT_THAT(told[0], HasSubstr("agent 0 of 'walker' was given a reward of -1, but its goals are worth -2"));
  }
}

TEST(TickWorld, WhatWasAbandonedIsWrittenNowhere) {
  World w(Walkers(1));
  w.JoinAll();
  w.world->Reset(0, w.batches);
  w.world->Abandon();
  EXPECT_TRUE(w.world->settled());
  EXPECT_EQ(w.world->Offer().code(), StatusCode::kFailedPrecondition);
}

/// One step in which nobody ends unless `ends` is an agent.
void StepAll(World& world, AgentId ends = kNoAgent) {
  for (BatchBuffer& buffer : world.buffers) buffer.Advance();
  for (std::size_t b = 0; b < world.buffers.size(); ++b) world.batches[b] = world.buffers[b].batch();
  world.world->Step(world.batches);
  if (ends != kNoAgent) world.world->EndEpisode(ends, EpisodeEnd::kTerminated);
}

TEST(TickWorld, AnEpisodeHasTheParametersThatWereSetWhenItBegan) {
  TickWorldOptions options = Walkers(2, 3);
  options.parameters = {{"gravity", 9.8, 0.0, 20.0}, {"wind", 0.0}};
  World world(options);
  world.JoinAll();
  TickWorld& ticks = *world.world;
  EXPECT_EQ(*ticks.ParameterNamed("wind"), 1u);
  EXPECT_THAT(ticks.ParameterNamed("gravty").status().message(), HasSubstr("is 'gravity' meant?"));
  EXPECT_EQ(ticks.Parameter(0, 0), 9.8);
  const double low[2] = {3.0, std::numeric_limits<double>::quiet_NaN()}, high[2] = {12.0, 1.0};
  ticks.SetParameters(0, low);
  ticks.Reset(1, world.batches);
  EXPECT_EQ(ticks.Parameter(0, 0), 3.0) << "it is being reset";
  EXPECT_EQ(ticks.Parameter(1, 0), 9.8) << "another's";
  ASSERT_TRUE(ticks.Offer().ok());
  ticks.SetParameters(0, high);
  StepAll(world);
  EXPECT_EQ(ticks.Parameter(0, 0), 3.0) << "under way";
  EXPECT_EQ(ticks.NextParameter(0, 0), 12.0);
  EXPECT_EQ(ticks.NextParameter(0, 9), 0.0);
  ASSERT_TRUE(ticks.Offer().ok());
  StepAll(world, 0);
  EXPECT_EQ(ticks.Parameter(0, 0), 12.0) << "it ends, and is put at its next start";
  EXPECT_EQ(ticks.Parameter(0, 1), 1.0);
  ASSERT_TRUE(ticks.Offer().ok());
  EXPECT_EQ(ticks.Parameter(0, 0), 12.0);
  StepAll(world);  // the third step of the other: out of time
  ticks.SetParameters(1, low);
  EXPECT_EQ(ticks.Parameter(1, 0), 3.0);
  ASSERT_TRUE(ticks.Offer().ok());
  options.parameters[1].high = -1.0;
  EXPECT_THAT(TickWorld::Create(options).status().message(), HasSubstr("parameter 'wind' is 0"));
}

TEST(TickWorld, WhatTheHostNotesIsTakenOnce) {
  TickWorldOptions options = Walkers(1);
  World silent(options);
  EXPECT_TRUE(silent.world->Note("hit", 1.0).ok());
  EXPECT_FALSE(silent.world->tells_statistics());
  options.notes = true;
  World world(options);
  EXPECT_TRUE(world.world->Note("hit", 1.0).ok());
  EXPECT_TRUE(world.world->Note("hit", 0.0).ok());
  EXPECT_EQ(world.world->Note("hit", std::nan("")).code(), StatusCode::kNonFinite);
  EXPECT_EQ(world.world->Note("a\nb", 1.0).code(), StatusCode::kInvalidArgument);
  std::vector<Statistic> noted;
  silent.world->TakeStatistics(&noted);
  EXPECT_TRUE(noted.empty());
  world.world->TakeStatistics(&noted);
  world.world->TakeStatistics(&noted);
  ASSERT_EQ(noted.size(), 2u);
  EXPECT_EQ(noted[0].name, "hit");
  EXPECT_EQ(noted[1].value, 0.0);
}

TEST(TickWorld, MeansOfWhatTheHostNotesAreForItsLogToo) {
  World world(Walkers(1));  // whether or not somebody elsewhere is told
  ASSERT_TRUE(world.world->Note("hit", 1.0).ok());
  ASSERT_TRUE(world.world->Note("far", 7.0).ok());
  ASSERT_TRUE(world.world->Note("hit", 0.0).ok());
  EXPECT_FALSE(world.world->Note("hit", std::nan("")).ok());
  std::vector<Statistic> means = world.world->TakeMeans();
  ASSERT_EQ(means.size(), 2u);
  EXPECT_EQ(means[0].name, "far");
  EXPECT_EQ(means[1].value, 0.5);
  ASSERT_TRUE(world.world->Note("hit", 3.0).ok());
  means = world.world->TakeMeans();
  ASSERT_EQ(means.size(), 1u) << "what was told is told once";
  EXPECT_EQ(means[0].value, 3.0);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(world.world->Note("name" + std::to_string(i), 1.0).ok());
  EXPECT_EQ(world.world->TakeMeans().size(), NotedMeans::kMostNames - 2) << "no endless list";
}

TEST(TickWorld, WhatAGroupEarnsIsInItsAgentsRewards) {
  TickWorldOptions options = Walkers(2);
  options.groups = {{"pair", {{0, 0}, {0, 1}}}};
  EXPECT_THAT(TickWorld::Create(options).status().message(), HasSubstr("group 'pair' is of agents of one kind"));
  options.offerings.push_back(Walker(1));
  options.offerings[1].name = "runner";
  options.groups = {{"pair", {{0, 1}, {1, 0}}}, {"other", {{1, 0}}}};
  EXPECT_THAT(TickWorld::Create(options).status().message(), HasSubstr("in a group already"));
  options.groups = {{"pair", {{0, 1}, {1, 1}}}};
  EXPECT_THAT(TickWorld::Create(options).status().message(), HasSubstr("no place for"));
  options.groups = {{"pair", {{0, 1}, {1, 0}}}};
  TickWorldOptions goal = options;
  goal.offerings[1].observations = {{"achieved_goal", *Space::Box(-1, 1, {2})},
                                    {"desired_goal", *Space::Box(-1, 1, {2})}};
  goal.offerings[1].goals.reward = GoalReward::kSparse;
  EXPECT_THAT(TickWorld::Create(goal).status().message(), HasSubstr("group 'pair' has an agent of 'runner', whose"));
  World world(options);
  world.JoinAll();
  world.world->Reset(1, world.batches);
  ASSERT_TRUE(world.world->Offer().ok());
  StepAll(world);
  world.world->AddReward(1, 1.0f);
  world.world->AddGroupReward(0, 0.5f);
  world.world->AddGroupReward(0, 0.25f);
  ASSERT_TRUE(world.world->Offer().ok());
  EXPECT_EQ(world.batches[0].rewards[0], 0.0f);
  EXPECT_EQ(world.batches[0].rewards[1], 1.75f);
  EXPECT_EQ(world.batches[1].rewards[0], 0.75f);
  EXPECT_EQ(world.world->group_rewards()[0], 0.75f);
  StepAll(world);
  world.world->TellGroupReward(0, 2.0f);
  world.world->TellGroupReward(0, std::numeric_limits<float>::infinity());
  world.world->TellGroupReward(9, 1.0f);
  ASSERT_TRUE(world.world->Offer().ok());
  EXPECT_EQ(world.world->group_rewards()[0], 2.0f);
  EXPECT_EQ(world.batches[0].rewards[1], 0.0f) << "the host pays by itself";
  StepAll(world);
  ASSERT_TRUE(world.world->Offer().ok());
  EXPECT_EQ(world.world->group_rewards()[0], 0.0f);
}

TEST(TickWorld, APlaceOfAGroupIsForItsAgents) {
  TickWorldOptions options = Walkers(3);
  options.agents_leave = true;
  options.offerings.push_back(Walker(1));
  options.offerings[1].name = "runner";
  options.groups = {{"red", {{0, 0}, {1, 0}}}, {"blue", {{0, 1}}}};
  World world(options);
  TickWorld& ticks = *world.world;
  EXPECT_EQ(*ticks.JoinGroup(0, 1), 1);
  EXPECT_EQ(*ticks.JoinGroup(0, kNoGroup), 2);
  EXPECT_THAT(ticks.JoinGroup(0, kNoGroup).status().message(), HasSubstr("all of them are there or of other groups"));
  EXPECT_EQ(ticks.JoinGroup(0, 1).status().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(*ticks.JoinGroup(0, 0), 0);
  EXPECT_EQ(ticks.GroupOf(0), 0u);
  EXPECT_EQ(ticks.GroupOf(1), 1u);
  EXPECT_EQ(ticks.GroupOf(2), kNoGroup);
  EXPECT_EQ(ticks.GroupOf(3), 0u) << "the runner's place";
  EXPECT_EQ(ticks.GroupOf(99), kNoGroup);
  ticks.Leave(1);
  EXPECT_EQ(*ticks.JoinGroup(0, 1), 1);
}

}  // namespace
}  // namespace consac::host
