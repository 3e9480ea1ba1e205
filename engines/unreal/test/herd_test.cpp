// What a learner gets of agents that end, die, come back and are reset alone: the rows themselves.
#include <cstring>
#include <limits>
#include <optional>

#include "ConsacHerd.h"
#include "ConsacRaySensorComponent.h"
#include "consac/env/buffer.h"
#include "graphs.h"

namespace consac::testing {
namespace {

constexpr float kStart = 100.0f;

/// An agent whose one number a test sets; a new episode sets it to kStart.
struct Seer {
  explicit Seer(Shim::Game& game) : actor(NewObject<AConsacTestActor>(&game.world())) {
    agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    FConsacEntry seen, done;
    seen.Name = TEXT("number");
    seen.Space = UConsacBlueprintLibrary::MakeBoxSpace(1, -1000.0f, 1000.0f);
    done.Name = TEXT("walk");
    done.Space = RoadDone();
    agent->Observations.Add(seen);
    agent->Actions.Add(done);
    agent->OnEpisodeBegin.ShimBind(agent, [this](UConsacAgentComponent*, int64) {
      ++begun;
      value = kStart;
    });
    agent->OnObserve.ShimBind(agent, [this](UConsacAgentComponent* which) {
      ++observed;
      const float number = sees ? sees() : value;
      EXPECT_TRUE(which->SetObservationNumbers(TEXT("number"), {number}));
    });
    agent->OnAction.ShimBind(agent, [this](UConsacAgentComponent* which) {
      ++acted;
      which->AddReward(1.0f);
    });
    Shim::Enter(game.world(), *actor, FVector());
  }

  AActor* actor;
  UConsacAgentComponent* agent;
  std::function<float()> sees;  // instead of `value`
  float value = 0.0f;
  int begun = 0, observed = 0, acted = 0;
};

/// A herd and a driver that asks by hand.
class HerdTest : public ::testing::Test {
 protected:
  Seer& Add() { return *seers_.emplace_back(std::make_unique<Seer>(game_)); }

  /// All seers so far, and their first observations.
  void Gather(int room) {
    TArray<UConsacAgentComponent*> agents;
    for (const auto& seer : seers_) agents.Add(seer->agent);
    const Status status = herd_.Gather(agents, room);
    ASSERT_TRUE(status.ok()) << status.message();
    buffer_.emplace(world().spec().behaviours[0]);
    world().Reset(7, std::span(&batch(), 1));
    ASSERT_TRUE(herd_.Begin().ok());
  }
  void Ask() {
    buffer_->Advance();
    world().Step(std::span(&batch(), 1));
    herd_.Act(false);
  }
  void Settle() {
    const Status status = herd_.Settle();
    ASSERT_TRUE(status.ok()) << status.message();
  }

  /// Of two, one ends its episode and takes the other one away in the event in which its next begins.
  void DestroyWhereAnotherBegins(std::size_t gone, std::size_t begins) {
    Add().value = 5.0f;
    Add().value = 5.0f;
    Gather(0);
    Ask();
    Settle();
    Ask();
    seers_[gone]->value = 6.0f;
    seers_[begins]->agent->OnEpisodeBegin.ShimBind(
        nullptr, [&](UConsacAgentComponent*, int64) { Shim::Destroy(*seers_[gone]->actor); });
    seers_[begins]->agent->EndEpisode(EConsacEpisodeEnd::Terminated);
    Settle();
    EXPECT_EQ(batch().truncated[gone], 1);
    EXPECT_EQ(Final(static_cast<int>(gone)), 6.0f);
  }

  host::TickWorld& world() { return herd_.World(); }
  Batch& batch() { return buffer_->batch(); }
  static float At(const std::byte* rows, int place) {
    float value;
    std::memcpy(&value, rows + static_cast<std::size_t>(place) * sizeof(float), sizeof(value));
    return value;
  }
  float Final(int place) { return At(batch().final_observations, place); }
  float Next(int place) { return At(batch().next_observations, place); }

  Shim::Game game_;
  std::vector<std::unique_ptr<Seer>> seers_;
  FConsacHerd herd_;
  std::optional<BatchBuffer> buffer_;
};

TEST_F(HerdTest, NobodysLastObservationShowsAnotherOneAtItsNewStart) {
  Seer& first = Add();
  Seer& second = Add();
  Gather(0);
  second.sees = [&] { return first.value; };
  first.sees = [&] { return second.value; };
  Ask();
  first.value = 1.0f;
  second.value = 2.0f;
  first.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
  second.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
  Settle();
  EXPECT_EQ(Final(0), 2.0f);
  EXPECT_EQ(Final(1), 1.0f) << "the first was at its new start already";
  // And nobody's first observation shows another one at its end.
  EXPECT_EQ(Next(0), kStart);
  EXPECT_EQ(Next(1), kStart);
}

TEST_F(HerdTest, WhoIsDestroyedWhereOneOfAHigherPlaceBeginsEndsWithWhatItSawInThisStep) {
  DestroyWhereAnotherBegins(0, 1);
}

TEST_F(HerdTest, WhoIsDestroyedWhereOneOfALowerPlaceBeginsEndsWithWhatItSawInThisStep) {
  DestroyWhereAnotherBegins(1, 0);
}

TEST_F(HerdTest, WhoeverLeavesEndsItsEpisodeAndANewcomerBeginsItsOwn) {
  Seer& first = Add();
  Seer& second = Add();
  Gather(0);
  first.value = 5.0f;
  Ask();
  Settle();
  Ask();
  first.value = 6.0f;
  Shim::Destroy(*first.actor);
  Settle();
  EXPECT_EQ(batch().truncated[0], 1);
  EXPECT_EQ(batch().rewards[0], 1.0f);
  EXPECT_EQ(Final(0), 5.0f) << "it was seen last when it was offered last";
  EXPECT_EQ(batch().truncated[1], 0);
  Ask();
  Settle();
  EXPECT_EQ(batch().truncated[0], 0) << "once";
  ASSERT_EQ(world().present(0).size(), 2U);
  EXPECT_EQ(world().present(0)[0], 0) << "a learner is to take nothing from its place";
  EXPECT_EQ(world().tally().steps, 2 * 2 + 1) << "of those that were there";
  Seer& newcomer = Add();
  Ask();
  ASSERT_TRUE(herd_.Join(*newcomer.agent).ok());
  newcomer.agent->AddReward(50.0f);
  Settle();
  EXPECT_EQ(batch().truncated[0], 0);
  EXPECT_EQ(batch().rewards[0], 0.0f);
  EXPECT_EQ(world().present(0)[0], 1);
  EXPECT_EQ(Next(0), kStart);
  EXPECT_EQ(newcomer.begun, 1);
  Ask();
  Settle();
  EXPECT_EQ(batch().truncated[0], 0);
  EXPECT_EQ(batch().rewards[0], 1.0f);
  EXPECT_EQ(newcomer.acted, 1);
  EXPECT_EQ(second.begun, 1);
}

TEST_F(HerdTest, APlaceThatIsTakenAgainInTheSameStepKeepsBothEpisodesApart) {
  for (const int room : {0, 1}) {
    for (const bool says_so : {false, true}) {
      Seer& old = Add();
      FConsacHerd herd;
      ASSERT_TRUE(herd.Gather({old.agent}, room).ok());
      BatchBuffer buffer(herd.World().spec().behaviours[0]);
      herd.World().Reset(1, std::span(&buffer.batch(), 1));
      old.sees = [] { return 3.0f; };
      ASSERT_TRUE(herd.Begin().ok());
      buffer.Advance();
      herd.World().Step(std::span(&buffer.batch(), 1));
      herd.Act(false);
      if (says_so) old.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
      Shim::Destroy(*old.actor);
      Seer& newcomer = Add();
      ASSERT_TRUE(herd.Join(*newcomer.agent).ok());
      ASSERT_TRUE(herd.Settle().ok());
      EXPECT_EQ(buffer.batch().terminated[0], says_so ? 1 : 0) << "room " << room;
      EXPECT_EQ(buffer.batch().truncated[0], says_so ? 0 : 1) << "room " << room;
      EXPECT_EQ(buffer.batch().rewards[0], 1.0f) << "room " << room;
      EXPECT_EQ(At(buffer.batch().final_observations, 0), 3.0f) << "room " << room << ", said " << says_so;
      EXPECT_EQ(At(buffer.batch().next_observations, 0), kStart) << "room " << room;
      EXPECT_EQ(newcomer.begun, 1) << "room " << room << ", said " << says_so;
    }
  }
}

TEST_F(HerdTest, WhoeverComesAfterTheDecisionWasAskedForDoesNotCarryItOut) {
  for (const int room : {0, 1}) {
    Seer& old = Add();
    FConsacHerd herd;
    ASSERT_TRUE(herd.Gather({old.agent}, room).ok());
    BatchBuffer buffer(herd.World().spec().behaviours[0]);
    herd.World().Reset(1, std::span(&buffer.batch(), 1));
    ASSERT_TRUE(herd.Begin().ok());
    // Between two steps, while the learner thinks.
    Shim::Destroy(*old.actor);
    Seer& newcomer = Add();
    ASSERT_TRUE(herd.Join(*newcomer.agent).ok());
    for (const int step : {0, 1}) {
      buffer.Advance();
      herd.World().Step(std::span(&buffer.batch(), 1));
      herd.Act(false);
      ASSERT_TRUE(herd.Settle().ok());
      EXPECT_EQ(newcomer.acted, step) << "room " << room;
      EXPECT_EQ(newcomer.agent->GetEpisodeSteps(), step) << "room " << room;
      EXPECT_EQ(buffer.batch().truncated[0], 1 - step) << "room " << room;
      EXPECT_EQ(At(buffer.batch().final_observations, 0), kStart);
    }
    EXPECT_EQ(newcomer.begun, 1);
  }
}

TEST_F(HerdTest, AResetOfOneLeavesTheOthersAlone) {
  Seer& first = Add();
  Seer& second = Add();
  Gather(0);
  Ask();
  Settle();
  const int before = second.observed;
  second.value = 77.0f;  // would be offered, though nobody has asked
  ASSERT_TRUE(world().ResetWorld(0, 5, std::span(&batch(), 1)));
  ASSERT_TRUE(herd_.Begin().ok());
  EXPECT_EQ(first.begun, 2);
  EXPECT_EQ(second.begun, 1);
  EXPECT_EQ(second.observed, before);
  EXPECT_EQ(At(world().Observation(1), 0), kStart);
}

TEST_F(HerdTest, NeighboursGetSeedsOfTheirOwnAndNoneIsNegative) {
  RoadAgent first(game_, 1), second(game_, 2);
  ASSERT_TRUE(herd_.Gather({first.agent, second.agent}, 0).ok());
  buffer_.emplace(world().spec().behaviours[0]);
  for (const std::uint64_t seed : {std::uint64_t{6}, std::uint64_t{0x8000000000000006}}) {
    world().Reset(seed, std::span(&batch(), 1));
    ASSERT_TRUE(herd_.Begin().ok());
    EXPECT_EQ(first.seeds.back(), 6);
    EXPECT_EQ(second.seeds.back(), 7);
  }
}

TEST_F(HerdTest, TheOrderOfEntriesIsNoDifferenceBetweenAgents) {
  Seer& first = Add();
  Seer& second = Add();
  FConsacEntry other;
  other.Name = TEXT("another");
  other.Space = UConsacBlueprintLibrary::MakeBoxSpace(2, -1000.0f, 1000.0f);
  const FConsacEntry number = first.agent->Observations[0];
  first.agent->Observations.Add(other);
  second.agent->Observations.Reset();
  second.agent->Observations.Add(other);
  second.agent->Observations.Add(number);
  Gather(0);
  const Leaf& leaf = world().ObservationLeaf(0, 0);
  second.value = 3.0f;
  Ask();
  Settle();
  EXPECT_EQ(ReadElement(leaf, world().Observation(1), 0), 3.0) << "by name, not by number";
  second.agent->Observations[0].Space.Size = 3;
  EXPECT_FALSE(FConsacHerd().Gather({first.agent, second.agent}, 0).ok());
}

TEST_F(HerdTest, AChoiceThatDoesNotExistIsRefusedAndNumbersAreKeptWithinTheirBounds) {
  Seer& seer = Add();
  FConsacEntry speed, lamp;
  speed.Name = TEXT("speed");
  speed.Space = UConsacBlueprintLibrary::MakeBoxSpace(2, -1.0f, 1.0f);
  lamp.Name = TEXT("lamp");
  lamp.Space = UConsacBlueprintLibrary::MakeDiscreteSpace(2);
  seer.agent->Actions.Add(speed);
  seer.agent->Observations.Add(lamp);
  Gather(0);
  buffer_->Advance();
  world().Step(std::span(&batch(), 1));
  int asked = 0;
  seer.agent->OnHeuristic.ShimBind(nullptr, [&](UConsacAgentComponent* which) {
    ++asked;
    EXPECT_TRUE(which->SetActionChoice(TEXT("walk"), 1));
    for (const int32 none : {-1, 3, std::numeric_limits<int32>::max()}) {
      Shim::ForgetLog();
      EXPECT_FALSE(which->SetActionChoice(TEXT("walk"), none));
      ASSERT_EQ(Shim::Log().size(), 1U);
      EXPECT_NE(Shim::Log()[0].find("no choice " + std::to_string(none)), std::string::npos) << Shim::Log()[0];
    }
    EXPECT_EQ(which->GetActionChoice(TEXT("walk")), 1);
    EXPECT_FALSE(which->SetActionChoice(TEXT("speed"), 0)) << "that is no choice";
    EXPECT_FALSE(which->SetObservationChoice(TEXT("lamp"), 2));
    EXPECT_TRUE(which->SetObservationChoice(TEXT("lamp"), 1));
    EXPECT_FALSE(which->SetObservationChoice(TEXT("number"), 0));
    EXPECT_TRUE(which->SetActionNumbers(TEXT("speed"), {-7.0f, 0.5f}));
    const TArray<float> taken = which->GetActionNumbers(TEXT("speed"));
    ASSERT_EQ(taken.Num(), 2);
    EXPECT_EQ(taken[0], -1.0f);
    EXPECT_EQ(taken[1], 0.5f);
  });
  herd_.Act(true);
  EXPECT_EQ(asked, 1);
}

TEST_F(HerdTest, AnAgentThatAnotherHerdHasGatheredIsThatOnes) {
  Seer& seer = Add();
  std::optional<FConsacHerd> dying(std::in_place);
  ASSERT_TRUE(dying->Gather({seer.agent}, 0).ok());
  BatchBuffer buffer(dying->World().spec().behaviours[0]);
  dying->World().Reset(1, std::span(&buffer.batch(), 1));
  ASSERT_TRUE(dying->Begin().ok());
  buffer.Advance();
  dying->World().Step(std::span(&buffer.batch(), 1));
  dying->Act(false);
  Gather(0);
  const int observed = seer.observed;
  ASSERT_TRUE(dying->Settle().ok()) << "it comes to the end of its step";
  EXPECT_EQ(seer.observed, observed) << "whom it asks nothing any more";
  EXPECT_EQ(buffer.batch().truncated[0], 1);
  dying.reset();
  Ask();
  Settle();
  EXPECT_EQ(seer.observed, observed + 1);
  EXPECT_EQ(batch().rewards[0], 1.0f);
}

TEST_F(HerdTest, AnAgentThatIsGarbageAlreadyForgetsAHerdThatGoes) {
  Seer& seer = Add();
  std::optional<FConsacHerd> herd(std::in_place);
  ASSERT_TRUE(herd->Gather({seer.agent}, 0).ok());
  seer.agent->ShimKill();  // marked as garbage before its End Play
  herd.reset();
  Shim::ForgetLog();
  EXPECT_FALSE(seer.agent->SetObservationNumber(TEXT("number"), 1.0f));
  ASSERT_EQ(Shim::Log().size(), 1U);
  EXPECT_NE(Shim::Log()[0].find("no Consac Trainer drives this agent"), std::string::npos) << Shim::Log()[0];
}

TEST_F(HerdTest, OnObserveSaysHowAnEpisodeEndsAlsoAtItsLastStep) {
  Seer& goal = Add();
  Seer& other = Add();
  Seer& silent = Add();
  for (const Seer* seer : {&goal, &other, &silent}) seer->agent->MaxEpisodeSteps = 2;
  Gather(0);
  Ask();
  Settle();
  EXPECT_EQ(batch().truncated[0] + batch().truncated[1] + batch().truncated[2], 0);
  // The last to look finds that it, and one that has looked already, are at a terminal state.
  silent.sees = [&] {
    other.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
    return 0.0f;
  };
  goal.sees = [&] {
    goal.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
    return 0.0f;
  };
  Ask();
  Settle();
  for (const int place : {0, 1}) {
    EXPECT_EQ(batch().terminated[place], 1) << "place " << place;
    EXPECT_EQ(batch().truncated[place], 0) << "place " << place;
  }
  EXPECT_EQ(batch().terminated[2], 0);
  EXPECT_EQ(batch().truncated[2], 1) << "time was up for it";
  // Whoever destroys an agent at its last step ends its episode there.
  goal.sees = silent.sees = nullptr;
  Ask();
  Settle();
  other.agent->OnObserve.ShimBind(nullptr, [&](UConsacAgentComponent*) { Shim::Destroy(*other.actor); });
  Ask();
  Settle();
  EXPECT_EQ(batch().truncated[1], 1);
  EXPECT_EQ(batch().truncated[0], 1);
}

TEST_F(HerdTest, ANewcomerHasNoActionYet) {
  Add();
  Gather(2);
  Ask();
  Seer& newcomer = Add();
  ASSERT_TRUE(herd_.Join(*newcomer.agent).ok());
  EXPECT_EQ(newcomer.agent->GetActionChoice(TEXT("walk")), -1);
  EXPECT_EQ(newcomer.agent->GetActionNumbers(TEXT("walk")).Num(), 0);
  EXPECT_FALSE(newcomer.agent->SetActionChoice(TEXT("walk"), 1));
  Settle();
  Ask();
  EXPECT_EQ(newcomer.agent->GetActionChoice(TEXT("walk")), 0);
  EXPECT_EQ(newcomer.agent->GetActionNumbers(TEXT("walk")).Num(), 1);
}

TEST_F(HerdTest, AnEventOfOneMayBeAboutAnotherFromTheFirstDecisionOn) {
  Seer& first = Add();
  Seer& second = Add();
  Gather(0);
  first.agent->OnAction.ShimBind(nullptr, [&](UConsacAgentComponent*) {
    EXPECT_EQ(second.agent->GetActionChoice(TEXT("walk")), 0);
    second.agent->AddReward(10.0f);
    second.agent->EndEpisode(EConsacEpisodeEnd::Terminated);
  });
  Ask();
  Settle();
  EXPECT_EQ(batch().rewards[1], 11.0f);
  EXPECT_EQ(batch().terminated[1], 1);
}

TEST_F(HerdTest, ASensorThatIsGoneIsNoObservationAnyMore) {
  AActor* actor = NewObject<AConsacTestActor>(&game_.world());
  UConsacRaySensorComponent* rays = game_.AddComponent<UConsacRaySensorComponent>(*actor);
  UConsacRaySensorComponent* others = game_.AddComponent<UConsacRaySensorComponent>(*actor);
  rays->ObservationName = TEXT("ahead");
  others->ObservationName = TEXT("behind");
  RoadAgent agent(game_, 1, actor);
  ASSERT_EQ(agent.agent->GetSensors().Num(), 2);
  Shim::Destroy(*rays);
  EXPECT_EQ(agent.agent->GetSensors().Num(), 1);
  others->ShimKill();  // marked as garbage before its End Play
  const Status status = herd_.Gather({agent.agent}, 0);
  ASSERT_TRUE(status.ok()) << status.message();
  EXPECT_EQ(world().spec().behaviours[0].observation_layout.leaves.size(), 1U);
}

}  // namespace
}  // namespace consac::testing
