// What a TickWorld's driver asks for, and how it gets what the host has offered.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "consac/base/hooks.h"
#include "consac/base/text.h"
#include "consac/protocol/relabel.h"
#include "tick_world_state.h"

namespace consac::host {
namespace {

/// "agent 3 of 'walker' sees 7 in number 0 of 'place'".
std::string Sight(const BehaviourSpec& behaviour, std::int64_t place, const Leaf& leaf, std::int64_t i,
                  const std::string& value) {
  return "agent " + std::to_string(place) + " of '" + behaviour.name + "' sees " + value + " in number " +
         std::to_string(i) + (leaf.name.empty() ? "" : " of '" + leaf.name + "'");
}

/// Warns, once for each entry, of a number beyond its bounds.
void WatchBounds(const BehaviourSpec& behaviour, Herd& herd, std::int64_t place, std::size_t l, std::int64_t i,
                 float value) {
  if (herd.outside[l] != 0) return;
  const Leaf& leaf = behaviour.observation_layout.leaves[l];
  const double low = leaf.space.low()[static_cast<std::size_t>(i)];
  const double high = leaf.space.high()[static_cast<std::size_t>(i)];
  if (value >= static_cast<float>(low) && value <= static_cast<float>(high)) return;
  herd.outside[l] = 1;
  herd.usual[l].Widen();
  Log(LogLevel::kWarning, Sight(behaviour, place, leaf, i, NumberText(value)) + ", beyond its bounds " +
                              NumberText(low) + " to " + NumberText(high) +
                              "; it is offered as it is; widen the bounds, or keep within them");
}

/// Makes every number of a row finite, as the float32 that learners take it for; names the first that was not.
Status MendRow(const BehaviourSpec& behaviour, Herd& herd, std::int64_t place, std::byte* row) {
  Status status;
  for (std::size_t l = 0; l < behaviour.observation_layout.leaves.size(); ++l) {
    const Leaf& leaf = behaviour.observation_layout.leaves[l];
    if ((leaf.dtype != DType::kF32 && leaf.dtype != DType::kF64) || herd.usual[l].Holds(leaf, row)) continue;
    for (std::int64_t i = 0; i < leaf.count; ++i) {
      const auto value = static_cast<float>(ReadElement(leaf, row, i));
      if (std::isfinite(value)) {
        WatchBounds(behaviour, herd, place, l, i, value);
        continue;
      }
      if (status.ok()) {
        status = {StatusCode::kNonFinite,
                  Sight(behaviour, place, leaf, i, std::isnan(value) ? "NaN" : "infinity") + "; 0 was taken instead"};
      }
      WriteElement(leaf, row, i, 0.0);
    }
  }
  return status;
}

Status MendReward(const BehaviourSpec& behaviour, std::int64_t place, float* reward) {
  if (std::isfinite(*reward)) return Status::Ok();
  *reward = 0.0f;
  return {StatusCode::kNonFinite, "the reward of agent " + std::to_string(place) + " of '" + behaviour.name +
                                      "' is NaN or infinite; 0 was taken instead"};
}

/// Warns, once for each behaviour, where an agent was given something else than its goals are worth.
void WatchPay(const BehaviourSpec& behaviour, Herd& herd, std::int64_t place, float given, float worth) {
  constexpr float kRounding = 1e-4f;  // as protocol 2 has it (R96)
  const bool silent = herd.goals.pays() && given == 0.0f;
  if (herd.differed || silent || !std::isfinite(worth) ||
      std::fabs(given - worth) <= kRounding * (1.0f + std::fabs(worth)))
    return;
  herd.differed = true;
  Log(LogLevel::kWarning,
      "agent " + std::to_string(place) + " of '" + behaviour.name + "' was given a reward of " + NumberText(given) +
          ", but its goals are worth " + NumberText(worth) +
          (herd.goals.pays() ? "; they alone pay here: give none, or turn off that goals pay"
                             : "; what is learned from other goals will not be what is paid: make the two agree"));
}

/// Where nothing is legal, everything is: an agent has to do something.
Status MendMask(const BehaviourSpec& behaviour, const Herd& herd, std::int64_t place, std::uint8_t* mask) {
  Status status;
  for (std::int64_t choice; (choice = ChoiceWithNothingLegal(herd.choices, mask)) >= 0;) {
    const auto end = herd.choices.begin() + choice;
    std::fill_n(mask + std::accumulate(herd.choices.begin(), end, std::int64_t{0}), *end, std::uint8_t{1});
    if (!status.ok()) continue;
    status = {StatusCode::kInvalidArgument, "agent " + std::to_string(place) + " of '" + behaviour.name +
                                                "' has nothing legal in choice " + std::to_string(choice) +
                                                " of its action mask; all of it was taken as legal"};
  }
  return status;
}

}  // namespace

void TickWorld::Reset(std::uint64_t seed, std::span<Batch> batches) {
  State& state = *state_;
  state.asked.assign(batches.begin(), batches.end());
  state.cue = Cue::kReset;
  for (Herd& herd : state.herds) {
    for (std::size_t i = 0; i < herd.places.size(); ++i) {
      Place& place = herd.places[i];
      place.resets = place.joined;
      place.seed = seed + static_cast<std::uint64_t>(herd.first) + i;
    }
  }
}

bool TickWorld::ResetWorld(std::int32_t world, std::optional<std::uint64_t> seed, std::span<Batch> batches) {
  State& state = *state_;
  if (state.cue != Cue::kReset) {
    for (Herd& herd : state.herds) {
      for (Place& place : herd.places) place.resets = false;
    }
  }
  state.asked.assign(batches.begin(), batches.end());
  state.cue = Cue::kReset;
  for (Herd& herd : state.herds) {
    for (std::size_t i = 0; i < herd.places.size(); ++i) {
      if (state.herds.size() == 1 && i != static_cast<std::size_t>(world)) continue;
      Place& place = herd.places[i];
      place.resets = place.joined;
      place.seed = seed;
      if (seed.has_value() && state.herds.size() > 1) *place.seed += static_cast<std::uint64_t>(herd.first) + i;
    }
  }
  return true;
}

void TickWorld::Step(std::span<Batch> batches) {
  State& state = *state_;
  state.asked.assign(batches.begin(), batches.end());
  state.cue = Cue::kAct;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    Herd& herd = state.herds[b];
    for (std::size_t i = 0; i < batches[b].slots.size(); ++i) {
      const auto place = static_cast<std::size_t>(batches[b].slots[i]);
      std::memcpy(herd.done.data() + place * herd.action_bytes, batches[b].actions + i * herd.action_bytes,
                  herd.action_bytes);
    }
  }
}

bool TickWorld::steps_some() const {
  return state_->spec.environments() == 1;
}

std::span<const std::uint8_t> TickWorld::present(std::size_t b) const {
  if (!state_->agents_leave) return {};
  return state_->herds[b].present;
}

bool TickWorld::settled() const {
  return state_->cue == Cue::kWait;
}

void TickWorld::Abandon() {
  state_->asked.clear();
  state_->cue = Cue::kWait;
}

bool TickWorld::prices_goals() const {
  bool any = false;
  for (std::size_t b = 0; b < state_->herds.size(); ++b) {
    if (!prices_goals_of(b) && protocol2::HasGoals(state_->spec.behaviours[b].observation_layout)) return false;
    any = any || prices_goals_of(b);
  }
  return any;
}

bool TickWorld::prices_goals_of(std::size_t b) const {
  return state_->herds[b].goals.reward() != GoalReward::kNone;
}

bool TickWorld::prices_here_only(std::size_t b) const {
  return state_->herds[b].goals.reward() == GoalReward::kFunction;
}

void TickWorld::PriceGoals(std::size_t b, const std::byte* observations, std::int64_t rows, float* rewards) const {
  state_->herds[b].goals.Price(observations, rows, rewards);
}

float TickWorld::Reward(AgentId agent) const {
  Herd& herd = state_->HerdOf(agent);
  const std::size_t index = state_->PlaceOf(agent);
  const Place& place = herd.places[index];
  if (!place.takes_part || herd.goals.reward() == GoalReward::kNone) return place.reward;
  const bool ends = place.going != Going::kOn || Ending(agent);
  float worth = 0.0f;
  herd.goals.Price((ends ? herd.last : herd.seen).data() + index * herd.observation_bytes, 1, &worth);
  WatchPay(state_->spec.behaviours[BehaviourOf(agent)], herd, static_cast<std::int64_t>(index), place.reward, worth);
  return herd.goals.pays() ? worth : place.reward;
}

void TickWorld::SetParameters(std::int32_t world, std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) state_->set[static_cast<std::size_t>(world) * values.size() + i] = values[i];
  }
}

bool TickWorld::tells_statistics() const {
  return state_->notes;
}

void TickWorld::TakeStatistics(std::vector<Statistic>* noted) {
  noted->insert(noted->end(), state_->noted.begin(), state_->noted.end());
  state_->noted.clear();
}

std::span<const float> TickWorld::group_rewards() const {
  return state_->paid;
}

void TickWorld::Visit(Archive& archive) {
  archive("steps", state_->steps);
}

/// What was asked for about one place goes into row `row` of `batch`.
Status TickWorld::OfferPlace(std::size_t b, std::size_t index, std::size_t row, Batch& batch) {
  State& state = *state_;
  Herd& herd = state.herds[b];
  Place& place = herd.places[index];
  const BehaviourSpec& behaviour = state.spec.behaviours[b];
  const auto number = static_cast<std::int64_t>(index);
  std::byte* seen = herd.seen.data() + index * herd.observation_bytes;
  Status status = place.joined ? MendRow(behaviour, herd, number, seen) : Status::Ok();
  if (state.cue == Cue::kAct) {
    const bool acted = place.takes_part;
    if (acted && place.joined && Ending(herd.first + static_cast<AgentId>(index)) && place.going == Going::kOn)
      place.going = Going::kTruncated;
    if (place.going != Going::kOn) {
      std::byte* last = herd.last.data() + index * herd.observation_bytes;
      const Status final = MendRow(behaviour, herd, number, last);
      if (status.ok()) status = final;
      std::memcpy(batch.final_observations + row * herd.observation_bytes, last, herd.observation_bytes);
    }
    if (herd.goals.reward() != GoalReward::kNone) place.reward = Reward(herd.first + static_cast<AgentId>(index));
    const Status reward = MendReward(behaviour, number, &place.reward);
    if (status.ok()) status = reward;
    batch.rewards[row] = acted ? place.reward : 0.0f;
    batch.terminated[row] = place.going == Going::kTerminated ? 1 : 0;
    batch.truncated[row] = place.going == Going::kTruncated ? 1 : 0;
    if (acted) Count(place);
  } else if (!place.resets) {
    return status;
  }
  std::memcpy(batch.next_observations + row * herd.observation_bytes, seen, herd.observation_bytes);
  if (herd.mask_bytes > 0) {
    std::uint8_t* mask = herd.masks.data() + index * herd.mask_bytes;
    const Status mended = place.joined ? MendMask(behaviour, herd, number, mask) : Status::Ok();
    if (status.ok()) status = mended;
    std::memcpy(batch.next_action_masks + row * herd.mask_bytes, mask, herd.mask_bytes);
  }
  return status;
}

void TickWorld::Count(Place& place) {
  ++state_->steps;
  ++place.length;
  place.sum += place.reward;
  if (place.going == Going::kOn) return;
  state_->window.Add(place.sum, place.length);
  place.length = 0;
  place.sum = 0.0;
}

Status TickWorld::Offer() {
  State& state = *state_;
  if (state.cue == Cue::kWait) return {StatusCode::kFailedPrecondition, "nobody has asked the agents for anything"};
  Status first;
  for (std::size_t b = 0; b < state.asked.size(); ++b) {
    Batch& batch = state.asked[b];
    for (std::size_t row = 0; row < batch.slots.size(); ++row) {
      const Status status = OfferPlace(b, static_cast<std::size_t>(batch.slots[row]), row, batch);
      if (first.ok()) first = status;
    }
  }
  for (Herd& herd : state.herds) {
    for (std::size_t i = 0; i < herd.places.size(); ++i) {
      Place& place = herd.places[i];
      const bool begins = place.joined && (!place.takes_part || (state.cue == Cue::kReset && place.resets));
      if (begins || place.going != Going::kOn || place.fresh)
        state.TakeParameters(herd.first + static_cast<AgentId>(i));
      if (begins || !place.joined) {
        place.length = 0;
        place.sum = 0.0;
      }
      place.takes_part = place.joined;
      place.resets = place.fresh = place.has_final = false;
      place.going = Going::kOn;
      place.reward = 0.0f;
      place.seed.reset();
      herd.present[i] = place.joined ? 1 : 0;
    }
  }
  state.paid = state.earned;
  if (state.cue == Cue::kReset) std::fill(state.paid.begin(), state.paid.end(), 0.0f);
  std::fill(state.earned.begin(), state.earned.end(), 0.0f);
  state.asked.clear();
  state.cue = Cue::kWait;
  return first;
}

}  // namespace consac::host
