// Hindsight by episodes that are counted by hand: which goals each strategy may draw, in either generation's form, what
// the world prices, what a minibatch makes of it, and which transitions are of one episode whatever came in between.
#include "collect/hindsight.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "collect/replay_minibatch.h"

namespace consac::learn {
namespace {

/// What is seen: where it is, where it shall be, and where it is once more.
struct Seen {
  float achieved, desired, observation;
};
constexpr float kMeant = 100.0f;

BehaviourSpec Goals(std::int32_t slots) {
  const Space number = *Space::Box(-1e6, 1e6, {1});
  return BehaviourSpec::Of("default",
                           *Space::Dict({{"observation", number}, {"achieved_goal", number}, {"desired_goal", number}}),
                           *Space::Discrete(2), slots);
}

const Seen& AsSeen(const std::byte* row) {
  return *reinterpret_cast<const Seen*>(row);
}

/// Writes steps into whatever takes batches.
class Hand {
 public:
  explicit Hand(std::int32_t slots) : buffer_(Goals(slots)), now_(static_cast<std::size_t>(slots)) {}

  template <class Takes>
  void Begin(Takes& takes, std::int32_t slot, float number) {
    takes.Begin(Of(slot, number));
  }
  enum class End : std::uint8_t { kNone, kTerminated, kTruncated };
  /// `slot` steps to `number`; after an end it begins anew at `next`.
  const Batch& Step(std::int32_t slot, float number, End end = End::kNone, float next = 0.0f) {
    Batch& batch = Of(slot, end == End::kNone ? number : next);
    const Seen last = See(number);
    std::memcpy(batch.final_observations, &last, sizeof(last));
    batch.terminated[0] = end == End::kTerminated ? 1 : 0;
    batch.truncated[0] = end == End::kTruncated ? 1 : 0;
    batch.rewards[0] = -1.0f;
    return batch;
  }
  void Commit(Replay& replay, std::int32_t slot, float number, End end = End::kNone, float next = 0.0f) {
    const float action = 1.0f;
    replay.Commit(Step(slot, number, end, next), &action);
  }

 private:
  static Seen See(float number) { return {number, kMeant, number}; }
  Batch& Of(std::int32_t slot, float number) {
    now_[0] = slot;
    batch_ = buffer_.batch();
    batch_.slots = {now_.data(), 1};
    const Seen seen = See(number);
    std::memcpy(batch_.next_observations, &seen, sizeof(seen));
    return batch_;
  }
  BatchBuffer buffer_;
  Batch batch_;
  std::vector<std::int32_t> now_;
};

ReplayOptions Remembering(std::int64_t capacity) {
  ReplayOptions options;
  options.capacity = capacity;
  options.episodes = true;
  return options;
}

// 0 -> 1 -> 2 -> 3 -> 4 by slot 0, which ends there, and 10 -> 11 -> 12 by slot 1, which is cut there, turn by turn;
// then each goes on: 20 -> 21 and 30 -> 31, not finished.
void FillByHand(Replay& replay) {
  Hand hand(2);
  hand.Begin(replay, 0, 0);
  hand.Begin(replay, 1, 10);
  hand.Commit(replay, 0, 1);
  hand.Commit(replay, 1, 11);
  hand.Commit(replay, 0, 2);
  hand.Commit(replay, 0, 3);
  hand.Commit(replay, 1, 12, Hand::End::kTruncated, 30);
  hand.Commit(replay, 0, 4, Hand::End::kTerminated, 20);
  hand.Commit(replay, 0, 21);
  hand.Commit(replay, 1, 31);
}

/// goals[n]: how often each number was the goal of the transition that began at n.
using GoalCounts = std::map<float, std::map<float, int>>;

GoalCounts CountGoals(GoalStrategy strategy, GoalForm form, int minibatches) {
  const BehaviourSpec behaviour = Goals(2);
  Replay replay(behaviour, 1, Remembering(100));
  FillByHand(replay);
  HindsightOptions options;
  options.buffer = ReplayBufferClass::kHindsight;
  options.rows = 50;
  options.n_sampled_goal = 4;
  options.strategy = strategy;
  options.form = form;
  std::int64_t priced = 0;
  options.price = [&priced](const std::byte* rows, std::int64_t count, float* rewards) {
    priced += count;
    for (std::int64_t i = 0; i < count; ++i) {
      const Seen& seen = AsSeen(rows + static_cast<std::size_t>(i) * sizeof(Seen));
      rewards[i] = seen.achieved == seen.desired ? 0.0f : -1.0f;
    }
    return Status::Ok();
  };
  Hindsight hindsight(behaviour, options);
  std::vector<std::int64_t> places(50);
  Rng rng(1, 1);
  GoalCounts counts;
  for (int i = 0; i < minibatches; ++i) {
    const std::int64_t drawn = hindsight.Draw(replay, rng, places);
    if (form == GoalForm::kAfter) {
      EXPECT_EQ(drawn, 40) << "4 of 5 rows of a minibatch of 50";
    }
    priced = 0;
    EXPECT_TRUE(hindsight.Price());
    const std::span<const float> paid = hindsight.paid();
    EXPECT_EQ(priced, drawn) << "all at once";
    for (std::int64_t d = 0; d < drawn; ++d) {
      const Seen &from = AsSeen(hindsight.observation(d)), &to = AsSeen(hindsight.next_observation(d));
      const std::int64_t place = places[static_cast<std::size_t>(d)];
      EXPECT_EQ(from.observation, AsSeen(replay.observation(place)).observation);
      EXPECT_EQ(from.achieved, from.observation) << "but for the goal it is what was seen";
      EXPECT_EQ(to.observation, from.observation + 1);
      EXPECT_EQ(to.achieved, to.observation);
      EXPECT_EQ(to.desired, from.desired) << "one goal before the step and after it";
      EXPECT_EQ(paid[static_cast<std::size_t>(d)], to.achieved == to.desired ? 0.0f : -1.0f);
      EXPECT_EQ(AsSeen(replay.observation(place)).desired, kMeant) << "what is remembered stays as it was";
      ++counts[from.observation][from.desired];
    }
  }
  return counts;
}

/// Of each transition exactly these goals, each as often as the others.
void ExpectGoals(GoalStrategy strategy, GoalForm form, const std::map<float, std::set<float>>& goals) {
  const GoalCounts counts = CountGoals(strategy, form, 400);
  std::set<float> began;
  for (const auto& [from, of] : counts) {
    began.insert(from);
    ASSERT_TRUE(goals.contains(from)) << from;
    int total = 0;
    std::set<float> found;
    for (const auto& [goal, count] : of) {
      found.insert(goal);
      total += count;
    }
    EXPECT_EQ(found, goals.at(from)) << "of the transition from " << from;
    for (const auto& [goal, count] : of)
      EXPECT_NEAR(count * static_cast<double>(found.size()) / total, 1.0, 0.25) << goal << " from " << from;
  }
  EXPECT_EQ(began.size(), goals.size());
}

TEST(Hindsight, GoalsOfStableBaselines3AreWhatAStepLedTo) {
  constexpr GoalForm kForm = GoalForm::kAfter;
  ExpectGoals(GoalStrategy::kFuture, kForm,
              {{0, {1, 2, 3, 4}}, {1, {2, 3, 4}}, {2, {3, 4}}, {3, {4}}, {10, {11, 12}}, {11, {12}}});
  ExpectGoals(GoalStrategy::kFinal, kForm, {{0, {4}}, {1, {4}}, {2, {4}}, {3, {4}}, {10, {12}}, {11, {12}}});
  const std::set<float> first = {1, 2, 3, 4}, second = {11, 12}, any = {1, 2, 3, 4, 11, 12};
  ExpectGoals(GoalStrategy::kEpisode, kForm,
              {{0, first}, {1, first}, {2, first}, {3, first}, {10, second}, {11, second}});
  ExpectGoals(GoalStrategy::kRandom, kForm, {{0, any}, {1, any}, {2, any}, {3, any}, {10, any}, {11, any}});
}

// Where its episode's later transitions began; the last one has none to look forward to.
TEST(Hindsight, GoalsOfStableBaselines2AreWhatAStepBeganAt) {
  constexpr GoalForm kForm = GoalForm::kBefore;
  ExpectGoals(GoalStrategy::kFuture, kForm, {{0, {1, 2, 3}}, {1, {2, 3}}, {2, {3}}, {10, {11}}});
  ExpectGoals(GoalStrategy::kFinal, kForm, {{0, {3}}, {1, {3}}, {2, {3}}, {3, {3}}, {10, {11}}, {11, {11}}});
  const std::set<float> first = {0, 1, 2, 3}, second = {10, 11}, any = {0, 1, 2, 3, 10, 11};
  ExpectGoals(GoalStrategy::kEpisode, kForm,
              {{0, first}, {1, first}, {2, first}, {3, first}, {10, second}, {11, second}});
  ExpectGoals(GoalStrategy::kRandom, kForm, {{0, any}, {1, any}, {2, any}, {3, any}, {10, any}, {11, any}});
}

TEST(Hindsight, WhereNoEpisodeHasFinishedNothingHasAnotherGoal) {
  Replay replay(Goals(1), 1, Remembering(100));
  Hand hand(1);
  hand.Begin(replay, 0, 0);
  hand.Commit(replay, 0, 1);
  HindsightOptions options;
  options.rows = 10;
  Hindsight hindsight(Goals(1), options);
  std::vector<std::int64_t> places(10);
  Rng rng(1, 1);
  EXPECT_EQ(hindsight.Draw(replay, rng, places), 0);
  EXPECT_TRUE(hindsight.Price()) << "nobody is asked";
  EXPECT_TRUE(hindsight.paid().empty());
  EXPECT_EQ(hindsight.Sample(replay, rng), 0) << "it is drawn as it was";
  hand.Begin(replay, 0, 5);  // cut: what was seen last was its end
  EXPECT_EQ(hindsight.Draw(replay, rng, places), 8);
  EXPECT_EQ(AsSeen(hindsight.observation(0)).desired, 1.0f);
}

TEST(Hindsight, WhatHasNoGoalsIsRefusedInOneLine) {
  EXPECT_TRUE(Hindsight::GoalsFit(Goals(1)).ok());
  const Space number = *Space::Box(-1, 1, {1}), two = *Space::Box(-1, 1, {2});
  const auto why = [](const Space& space) {
    return Hindsight::GoalsFit(BehaviourSpec::Of("arm", space, *Space::Discrete(2), 1)).message();
  };
  EXPECT_EQ(why(number),
            "HerReplayBuffer wants observations with achieved_goal and desired_goal, alike, as Gymnasium's worlds with "
            "goals have them, and there are none in those of 'arm'; choose ReplayBuffer");
  EXPECT_NE(why(*Space::Dict({{"achieved_goal", number}, {"observation", number}}))
                .find("'achieved_goal' has no like in those of 'arm'"),
            std::string::npos);
  EXPECT_NE(why(*Space::Dict({{"achieved_goal", number}, {"desired_goal", two}})).find("'achieved_goal'"),
            std::string::npos);
  EXPECT_NE(why(*Space::Dict({{"achieved_goals", number}, {"desired_goals", number}})).find("there are none"),
            std::string::npos);
  const Space nested = *Space::Dict({{"x", number}, {"y", two}});
  EXPECT_EQ(why(*Space::Dict({{"achieved_goal", nested}, {"desired_goal", nested}})), "");
}

// Of six rows: four with other goals in front, priced; behind them two as they came.
TEST(Hindsight, AMinibatchHasOtherGoalsInFront) {
  for (const GoalForm form : {GoalForm::kAfter, GoalForm::kBefore}) {
    const BehaviourSpec behaviour = Goals(1);
    ReplayCollectorOptions options;
    options.replay = Remembering(100);
    options.gamma = 0.9;
    options.hindsight.buffer = ReplayBufferClass::kHindsight;
    options.hindsight.rows = 6;
    options.hindsight.n_sampled_goal = 2;
    options.hindsight.strategy = GoalStrategy::kFinal;
    options.hindsight.form = form;
    options.hindsight.price = [](const std::byte*, std::int64_t count, float* rewards) {
      for (std::int64_t i = 0; i < count; ++i) rewards[i] = static_cast<float>(7 + i);
      return Status::Ok();
    };
    const HeadSpec values{"", "q_values"};
    ReplayCollector collector(behaviour, *ActionHead::Create(behaviour.action_layout, {&values, 1}), options, 3);
    Hand hand(1);
    hand.Begin(collector, 0, 0);
    EXPECT_FALSE(collector.Record(hand.Step(0, 1))) << "four episodes make a report";
    EXPECT_FALSE(collector.Record(hand.Step(0, 2, Hand::End::kTerminated, 0)));
    ReplayMinibatch minibatch(behaviour, 6, 1);
    ASSERT_TRUE(minibatch.Draw(collector, 0.0));
    const float goal = form == GoalForm::kAfter ? 2.0f : 1.0f;
    std::vector<float> features(18);
    minibatch.Encode(features.data());
    for (std::size_t i = 0; i < 6; ++i) {
      const float *from = features.data() + 3 * i, *to = minibatch.next_features.data() + 3 * i;
      const bool other = i < 4;
      EXPECT_EQ(from[1], other ? goal : kMeant) << i;
      EXPECT_EQ(to[1], other ? goal : kMeant) << i;
      EXPECT_EQ(to[0], from[0] + 1);
      EXPECT_EQ(minibatch.rewards[i], other ? static_cast<float>(7 + i) : -1.0f);
      const bool ends = to[0] == 2.0f && !(other && form == GoalForm::kBefore);
      EXPECT_EQ(minibatch.discounts[i], ends ? 0.0 : 0.9) << i;
    }
  }
}

/// Where a transition stood when it came.
struct Stood {
  int episode, step;
};

// Several slots, episodes of all lengths, a ring that is full many times over, and all of it once more after a restore.
TEST(EpisodeIndex, KnowsWhatIsHeldOfEachEpisodeWhateverCameInBetween) {
  for (const std::int64_t capacity : {1, 7, 40, 200}) {
    const BehaviourSpec behaviour = Goals(3);
    Replay replay(behaviour, 1, Remembering(capacity)), other(behaviour, 1, Remembering(capacity));
    Hand hand(3);
    Rng rng(static_cast<std::uint64_t>(capacity), 1);
    std::map<float, Stood> stood;  // by the number where it began, which comes once
    std::map<int, int> lengths;    // of finished episodes
    int episodes = 3, steps[] = {0, 0, 0}, of[] = {0, 1, 2};
    float number = 0, at[] = {1, 2, 3};
    for (std::int32_t slot = 0; slot < 3; ++slot) hand.Begin(replay, slot, at[slot]);
    number = 3;
    const auto check = [&](const Replay& held) {
      std::map<int, std::map<int, std::int64_t>> places;  // of an episode: by step
      Rng draw(5, 5);
      for (std::int64_t i = 0; i < 30 * held.size(); ++i) {
        const std::int64_t place = held.Sample(draw);
        const Stood& where = stood.at(AsSeen(held.observation(place)).observation);
        places[where.episode][where.step] = place;
      }
      const EpisodeIndex& index = *held.episodes();
      for (const auto& [episode, members] : places) {
        for (const auto& [step, place] : members) {
          ASSERT_EQ(index.Finished(place), lengths.contains(episode));
          if (!index.Finished(place)) continue;
          ASSERT_EQ(index.Left(place), lengths.at(episode) - step);
          ASSERT_EQ(index.Before(place), step - members.begin()->first) << "those that are still held";
          for (const auto& [to, where] : members) ASSERT_EQ(index.Along(place, to - step), where);
        }
      }
    };
    for (int i = 0; i < 1500; ++i) {
      const auto slot = static_cast<std::int32_t>(i / 100 % 5 == 4 ? 2 : rng.Below(3));  // at times one alone
      const std::uint32_t end = rng.Below(slot == 0 ? 60 : 9);
      stood[at[slot]] = {of[slot], steps[slot]++};
      const float next = ++number;
      if (end <= 2) {
        const float last = ++number;
        lengths[of[slot]] = steps[slot];
        if (end == 2) {
          hand.Commit(replay, slot, last);
          hand.Begin(replay, slot, next);  // a lost connection
        } else {
          hand.Commit(replay, slot, last, end == 0 ? Hand::End::kTerminated : Hand::End::kTruncated, next);
        }
        of[slot] = episodes++;
        steps[slot] = 0;
      } else {
        hand.Commit(replay, slot, next);
      }
      at[slot] = next;
      if (i % 50 == 49) check(replay);
    }
    StateWriter writer;
    writer("replay", replay);
    StateReader reader(writer.fields());
    reader("replay", other);
    ASSERT_TRUE(reader.status().ok()) << reader.status().message();
    check(other);
  }
}

TEST(EpisodeIndex, IsPartOfWhatAReplaySaysItTakes) {
  ReplayOptions options = Remembering(1600), without = options;
  without.episodes = false;
  EXPECT_EQ(Replay::Bytes(Goals(1), 1, options) - Replay::Bytes(Goals(1), 1, without), 1700 * 24)
      << "24 bytes for each of its rows";
}

}  // namespace
}  // namespace consac::learn
