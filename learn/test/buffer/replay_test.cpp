// The replay against a naive one that keeps every transition whole: several slots that come and go, episodes that end
// and are cut, wraparound, n-step sums over ends, priorities, and all of it once more after a restore.
#include "buffer/replay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <deque>
#include <map>
#include <set>

namespace consac::learn {
namespace {

/// A transition as it was, for the naive replay. Observations are numbers that never come twice.
struct Whole {
  std::int32_t observation, next_observation, slot;
  float action, reward;
  bool terminated, ended;
  std::uint8_t next_mask;  // of action 0
};

ReplayOptions Holding(std::int64_t capacity, bool prioritised = false) {
  ReplayOptions options;
  options.capacity = capacity;
  options.prioritised = prioritised;
  return options;
}

/// Drives a Replay and the naive one alike.
class Twins {
 public:
  Twins(std::int32_t slots, ReplayOptions options, bool masks = false)
      : behaviour(BehaviourSpec::Of("default", *Space::Discrete(1 << 20), *Space::Discrete(2), slots)),
        now_(static_cast<std::size_t>(slots)),
        now_mask_(now_.size(), 1),
        own_((behaviour.masks_actions = masks, behaviour)) {
    replay.emplace(behaviour, 1, options);
  }

  void Begin(const std::vector<std::int32_t>& slots) {
    Batch batch = own_.batch();
    batch.slots = slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      // What a slot had of an episode is cut: its latest transition has ended.
      for (auto whole = held.rbegin(); whole != held.rend(); ++whole) {
        if (whole->slot != slots[i]) continue;
        whole->ended = true;
        whole->next_mask = 1;  // of what was seen last nothing is known
        break;
      }
      See(batch, i);
    }
    replay->Begin(batch);
  }

  /// One step of `slots`: in place where they are all and `own` is false.
  void Step(const std::vector<std::int32_t>& slots, bool own) {
    Batch batch = own ? own_.batch() : replay->Stage(slots);
    batch.slots = slots;
    std::vector<float> actions;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(slots[i]);
      std::int32_t seen = 0;
      if (!own) std::memcpy(&seen, batch.observations + i * sizeof(seen), sizeof(seen));
      if (!own) {
        EXPECT_EQ(seen, now_[slot]) << "what is staged is what was seen last";
      }
      Whole whole{now_[slot], 0, slots[i], static_cast<float>(rng.Below(2)), rng.Normal(), false, false, 1};
      const std::uint32_t end = rng.Below(12);
      whole.terminated = end == 0;
      whole.ended = end <= 1;
      actions.push_back(whole.action);
      batch.rewards[i] = whole.reward;
      batch.terminated[i] = whole.terminated ? 1 : 0;
      batch.truncated[i] = whole.ended && !whole.terminated ? 1 : 0;
      const std::int32_t last = ++number_;
      std::memcpy(batch.final_observations + i * sizeof(last), &last, sizeof(last));
      See(batch, i);
      whole.next_observation = whole.ended ? last : now_[slot];
      whole.next_mask = whole.ended ? 1 : now_mask_[slot];
      held.push_back(whole);
      if (static_cast<std::int64_t>(held.size()) > replay->capacity()) held.pop_front();
    }
    replay->Commit(batch, actions.data());
  }

  /// Every transition that is held, and what follows it.
  void ExpectAlike(double gamma, std::int64_t n) {
    ASSERT_EQ(replay->size(), static_cast<std::int64_t>(held.size()));
    std::map<std::int32_t, std::int64_t> places;
    Rng draw(1, 2);
    for (std::int64_t i = 0; i < 40 * replay->size() + 400; ++i) {
      const std::int64_t place = replay->Sample(draw);
      std::int32_t seen = 0;
      std::memcpy(&seen, replay->observation(place), sizeof(seen));
      places[seen] = place;
    }
    ASSERT_EQ(places.size(), held.size()) << "each can be drawn, and nothing else";
    for (std::size_t i = 0; i < held.size(); ++i) {
      const Whole& whole = held[i];
      ASSERT_TRUE(places.contains(whole.observation));
      const std::int64_t place = places[whole.observation];
      EXPECT_EQ(*replay->raw_action(place), whole.action);
      EXPECT_EQ(replay->reward(place), whole.reward);
      EXPECT_EQ(replay->slot(place), whole.slot);
      EXPECT_EQ(replay->terminated(place), whole.terminated);
      ExpectAhead(i, place, gamma, n);
      ExpectAhead(i, place, gamma, 1);
    }
  }

  BehaviourSpec behaviour;
  std::optional<Replay> replay;
  std::deque<Whole> held;  // in the order in which they came
  Rng rng{5, 6};

 private:
  void See(Batch& batch, std::size_t row) {
    const auto slot = static_cast<std::size_t>(batch.slots[row]);
    now_[slot] = ++number_;
    std::memcpy(batch.next_observations + row * sizeof(std::int32_t), &now_[slot], sizeof(std::int32_t));
    if (!behaviour.masks_actions) return;
    now_mask_[slot] = static_cast<std::uint8_t>(rng.Below(2));
    batch.next_action_masks[2 * row] = now_mask_[slot];
    batch.next_action_masks[2 * row + 1] = 1;
  }

  void ExpectAhead(std::size_t first, std::int64_t place, double gamma, std::int64_t n) const {
    double reward = 0.0, discount = 1.0;
    const Whole* last = nullptr;
    std::int64_t left = n;
    for (std::size_t at = first; at < held.size() && left > 0; ++at) {
      if (held[at].slot != held[first].slot) continue;
      last = &held[at];
      reward += discount * static_cast<double>(last->reward);
      discount *= gamma;
      --left;
      if (last->ended) break;
    }
    const Lookahead ahead = replay->Look(place, n, gamma, [](float r) { return r; });
    EXPECT_NEAR(ahead.reward, reward, 1e-9);
    EXPECT_DOUBLE_EQ(ahead.discount, last->terminated ? 0.0 : discount);
    std::int32_t next = 0;
    std::memcpy(&next, ahead.next_observation, sizeof(next));
    EXPECT_EQ(next, last->next_observation);
    EXPECT_EQ(ahead.next_mask == nullptr ? 1 : ahead.next_mask[0], last->next_mask);
  }

  std::vector<std::int32_t> now_;
  std::vector<std::uint8_t> now_mask_;
  std::int32_t number_ = 0;
  BatchBuffer own_;
};

constexpr std::int64_t kRoomy = 400;  // capacity / 16 tails, and episodes of six steps: the tails run out first

std::vector<std::int32_t> All(std::int32_t slots) {
  std::vector<std::int32_t> all;
  for (std::int32_t slot = 0; slot < slots; ++slot) all.push_back(slot);
  return all;
}

std::vector<std::int32_t> Some(std::int32_t slots, Rng& rng) {
  std::vector<std::int32_t> some;
  for (std::int32_t slot = 0; slot < slots; ++slot) {
    if (rng.Below(3) != 0) some.push_back(slot);
  }
  return some.empty() ? std::vector<std::int32_t>{0} : some;
}

/// Tails share the ring, so short episodes let fewer transitions stay: the naive one forgets those too.
void ForgetWhatTailsPushedOut(Twins& twins) {
  while (static_cast<std::int64_t>(twins.held.size()) > twins.replay->size()) twins.held.pop_front();
}

TEST(Replay, HoldsTheLatestTransitionsOfASlot) {
  Twins twins(1, Holding(kRoomy));
  twins.Begin({0});
  for (int i = 0; i < 30; ++i) twins.Step({0}, false);
  twins.ExpectAlike(0.9, 3);
  for (int i = 0; i < 1500; ++i) twins.Step({0}, false);
  EXPECT_GE(twins.replay->size(), kRoomy * 85 / 100);
  ForgetWhatTailsPushedOut(twins);
  twins.ExpectAlike(0.9, 3);
  twins.ExpectAlike(0.99, 100);
}

TEST(Replay, SlotsShareOneBudgetAndComeAndGo) {
  for (const bool masks : {false, true}) {
    Twins twins(5, Holding(kRoomy), masks);
    Rng rng(8, 8);
    twins.Begin(All(5));
    for (int round = 0; round < 8; ++round) {
      for (int i = 0; i < 60; ++i) twins.Step(All(5), false);
      for (int i = 0; i < 60; ++i) twins.Step(Some(5, rng), i % 2 == 0);
      for (int i = 0; i < 700; ++i) twins.Step({3}, i % 2 == 0);  // the others are away, and what they had is forgotten
      if (round % 2 == 0) twins.Begin({0, 4});
      ForgetWhatTailsPushedOut(twins);
      twins.ExpectAlike(0.95, 4);
    }
  }
}

TEST(Replay, TheSmallestHoldsTheLatest) {
  Twins twins(2, Holding(1));
  twins.Begin({0, 1});
  for (int i = 0; i < 50; ++i) {
    twins.Step({0, 1}, false);
    ASSERT_LE(twins.replay->size(), 1);
    ForgetWhatTailsPushedOut(twins);
    if (twins.replay->size() > 0) twins.ExpectAlike(0.9, 3);
  }
}

TEST(Replay, WhatIsReadBackIsTheSame) {
  for (const bool prioritised : {false, true}) {
    for (const int steps : {0, 7, 200, 900}) {
      const ReplayOptions options = Holding(kRoomy, prioritised);
      Twins twins(3, options, true), other(3, options, true);
      twins.Begin(All(3));
      for (int i = 0; i < steps; ++i) twins.Step(i % 3 == 0 ? std::vector<std::int32_t>{1} : All(3), i % 2 == 0);
      if (prioritised && steps > 0) {
        Rng draw(3, 3);
        for (int i = 0; i < 300; ++i) twins.replay->priorities()->Update(twins.replay->Sample(draw), draw.Normal());
      }
      StateWriter writer;
      writer("replay", *twins.replay);
      ASSERT_TRUE(writer.status().ok()) << writer.status().message();
      StateReader reader(writer.fields());
      reader("replay", *other.replay);
      ASSERT_TRUE(reader.status().ok()) << reader.status().message();
      EXPECT_EQ(HashState(*twins.replay), HashState(*other.replay));
      if (steps == 0) continue;
      Rng one(4, 4), two(4, 4);
      for (int i = 0; i < 500; ++i) {
        const std::int64_t a = twins.replay->Sample(one), b = other.replay->Sample(two);
        ASSERT_EQ(a, b);
        const Lookahead x = twins.replay->Look(a, 5, 0.9, [](float r) { return r; }),
                        y = other.replay->Look(b, 5, 0.9, [](float r) { return r; });
        ASSERT_EQ(x.reward, y.reward);
        ASSERT_EQ(x.discount, y.discount);
        ASSERT_EQ(std::memcmp(x.next_observation, y.next_observation, sizeof(std::int32_t)), 0);
      }
    }
  }
}

TEST(Replay, ASavedOneOfAnotherSizeIsRefused) {
  Twins twins(2, Holding(50)), smaller(2, Holding(20));
  twins.Begin(All(2));
  for (int i = 0; i < 40; ++i) twins.Step(All(2), false);
  StateWriter writer;
  writer("replay", *twins.replay);
  StateReader reader(writer.fields());
  reader("replay", *smaller.replay);
  EXPECT_EQ(reader.status().code(), StatusCode::kDataLoss);
  EXPECT_NE(reader.status().message().find("'replay/rows'"), std::string::npos) << reader.status().message();
}

TEST(Replay, SaysWhatItTakesAndThatItDoesNotFit) {
  const BehaviourSpec images =
      BehaviourSpec::Of("default", *Space::Box(0, 255, {84, 84, 4}, DType::kU8), *Space::Discrete(4), 1);
  ReplayOptions options = Holding(1000000);
  const std::int64_t bytes = Replay::Bytes(images, 1, options);
  EXPECT_LT(bytes, std::int64_t{31} * 1000000000) << "an observation is stored once, a byte a number";
  EXPECT_GT(bytes, std::int64_t{28} * 1000000000);
  const Status status = Replay::CheckFits(images, 1, options, std::int64_t{1} << 30);
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(status.message().find("1000000 transitions takes 28"), std::string::npos) << status.message();
  EXPECT_NE(status.message().find("lower buffer_size"), std::string::npos) << status.message();
  options.capacity = 1000;
  EXPECT_TRUE(Replay::CheckFits(images, 1, options, std::int64_t{1} << 30).ok());
}

// Golden vector: priorities 1, 2, 0.5, 1.5 with alpha 0.6 and beta 0.4.
TEST(Priorities, ProbabilitiesAndWeightsAreTheFormulas) {
  Priorities priorities(5, {.alpha = 0.6, .epsilon = 0.0});
  const double given[] = {1.0, -2.0, 0.5, 1.5};  // of an error the size counts
  for (int i = 0; i < 4; ++i) {
    priorities.Add(i);
    priorities.Update(i, given[i]);
  }
  const double probabilities[] = {0.224674, 0.340542, 0.14823, 0.286555},
               weights[] = {0.846745, 0.716978, 1.0, 0.768229};
  std::vector<int> drawn(5);
  Rng rng(1, 1);
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) ++drawn[static_cast<std::size_t>(priorities.Sample(rng))];
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(priorities.Probability(i), probabilities[i], 1e-6);
    EXPECT_NEAR(priorities.Weight(i, 0.4), weights[i], 1e-6);
    EXPECT_NEAR(drawn[static_cast<std::size_t>(i)] / static_cast<double>(kDraws), probabilities[i], 0.005);
  }
  EXPECT_EQ(drawn[4], 0) << "nothing is there";
  priorities.Remove(1);
  for (int i = 0; i < 1000; ++i) EXPECT_NE(priorities.Sample(rng), 1);
  priorities.Add(1);
  EXPECT_NEAR(priorities.Weight(1, 0.4), std::pow(4.0, -0.24), 1e-6) << "what is new is as urgent as the most urgent";
  priorities.Update(1, std::nan(""));
  EXPECT_NEAR(priorities.Weight(1, 0.4), std::pow(4.0, -0.24), 1e-6);
}

TEST(Priorities, TheReplayDrawsByThemAndForgetsThemWithItsRows) {
  ReplayOptions options = Holding(40, true);
  options.priority = {.alpha = 1.0, .epsilon = 0.0};
  Twins twins(2, options);
  twins.Begin(All(2));
  for (int i = 0; i < 100; ++i) twins.Step(All(2), false);
  ForgetWhatTailsPushedOut(twins);
  twins.ExpectAlike(0.9, 3);
  Rng rng(2, 2);
  const std::int64_t urgent = twins.replay->Sample(rng);
  std::set<std::int64_t> others;
  for (int i = 0; i < 4000; ++i) others.insert(twins.replay->Sample(rng));
  others.erase(urgent);
  for (const std::int64_t place : others) twins.replay->priorities()->Update(place, 0.25 / 39.0);
  twins.replay->priorities()->Update(urgent, 0.75 * static_cast<double>(others.size()) / 39.0);
  int drawn = 0;
  for (int i = 0; i < 10000; ++i) drawn += twins.replay->Sample(rng) == urgent ? 1 : 0;
  EXPECT_NEAR(drawn / 10000.0, 0.75, 0.02);
}

}  // namespace
}  // namespace consac::learn
