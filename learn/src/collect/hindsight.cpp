#include "collect/hindsight.h"

#include <cstring>
#include <string>
#include <string_view>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr int kMostDraws = 64;  // of a transition whose episode has finished

std::size_t LeafBytes(const Leaf& leaf) {
  return static_cast<std::size_t>(leaf.count) * SizeOf(leaf.dtype);
}

/// Of a minibatch of `rows`, k of k + 1.
std::int64_t Wanted(std::int64_t rows, std::int64_t k) {
  return rows * k / (k + 1);
}

}  // namespace

Status Hindsight::GoalsFit(const BehaviourSpec& behaviour) {
  const Layout& layout = behaviour.observation_layout;
  const auto refuse = [&](const std::string& why) {
    return Status{
        StatusCode::kInvalidArgument,
        "HerReplayBuffer wants observations with achieved_goal and desired_goal, alike, as Gymnasium's worlds "
        "with goals have them, and " +
            why + " of " + Quote(behaviour.name) + "; choose ReplayBuffer"};
  };
  std::int64_t goals = 0;
  for (const Leaf& leaf : layout.leaves) {
    for (const bool achieved : {true, false}) {
      const auto rest = PathBelow(achieved ? kAchievedGoal : kDesiredGoal, leaf);
      if (!rest.has_value()) continue;
      ++goals;
      const Leaf* other = FindLeafBelow(layout, achieved ? kDesiredGoal : kAchievedGoal, *rest);
      if (other == nullptr || !(other->space == leaf.space)) return refuse(Quote(leaf.name) + " has no like in those");
    }
  }
  return goals > 0 ? Status::Ok() : refuse("there are none in those");
}

std::vector<Hindsight::Part> Hindsight::PartsOf(const BehaviourSpec& behaviour) {
  std::vector<Part> parts;
  const Layout& layout = behaviour.observation_layout;
  for (const Leaf& leaf : layout.leaves) {
    const auto rest = PathBelow(kAchievedGoal, leaf);
    if (!rest.has_value()) continue;
    const Leaf* desired = FindLeafBelow(layout, kDesiredGoal, *rest);
    CONSAC_ASSERT(desired != nullptr);
    if (desired != nullptr) parts.push_back({leaf.offset, desired->offset, LeafBytes(leaf)});
  }
  return parts;
}

std::int64_t Hindsight::Bytes(const BehaviourSpec& behaviour, std::int64_t rows) {
  return rows * static_cast<std::int64_t>(2 * behaviour.observation_layout.row_bytes + sizeof(float));
}

Hindsight::Hindsight(const BehaviourSpec& behaviour, const HindsightOptions& options)
    : options_(options),
      row_bytes_(behaviour.observation_layout.row_bytes),
      wanted_(Wanted(options.rows, options.n_sampled_goal)),
      parts_(PartsOf(behaviour)),
      observations_(static_cast<std::size_t>(wanted_) * row_bytes_),
      next_observations_(observations_.size()),
      rewards_(static_cast<std::size_t>(wanted_)) {}

std::int64_t Hindsight::Sample(const Replay& replay, Rng& rng) const {
  std::int64_t place = replay.Sample(rng);
  for (int draws = 1; draws < kMostDraws && !replay.episodes()->Finished(place); ++draws) place = replay.Sample(rng);
  return place;
}

// An observation whose achieved goal is wanted from now on: what a transition led to, or with 2.10.2 what it began at.
const std::byte* Hindsight::GoalOf(const Replay& replay, std::int64_t place, Rng& rng) const {
  const EpisodeIndex& episodes = *replay.episodes();
  const bool before = options_.form == GoalForm::kBefore;
  const std::int64_t left = episodes.Left(place);
  const auto draw = [&rng](std::int64_t n) {
    return static_cast<std::int64_t>(rng.Below(static_cast<std::uint32_t>(n)));
  };
  std::int64_t steps = 0;
  switch (options_.strategy) {
    case GoalStrategy::kFuture:
      if (before && left == 1) return nullptr;
      steps = before ? 1 + draw(left - 1) : draw(left);
      break;
    case GoalStrategy::kFinal:
      steps = left - 1;
      break;
    case GoalStrategy::kEpisode: {
      const std::int64_t held = episodes.Before(place);
      steps = draw(held + left) - held;
      break;
    }
    case GoalStrategy::kRandom:
      place = Sample(replay, rng);
      break;
  }
  const std::int64_t whose = steps == 0 ? place : episodes.Along(place, steps);
  return before ? replay.observation(whose) : replay.next_observation(whose);
}

// `observation` with another goal as the next of `rows`.
void Hindsight::Put(const std::byte* observation, const std::byte* goal, std::vector<std::byte>& rows) const {
  std::byte* row = rows.data() + static_cast<std::size_t>(count_) * row_bytes_;
  std::memcpy(row, observation, row_bytes_);
  for (const Part& part : parts_) std::memcpy(row + part.desired, goal + part.achieved, part.bytes);
}

// The transition with another goal is one more; false where there is none for it.
bool Hindsight::Relabel(const Replay& replay, std::int64_t place, Rng& rng) {
  if (!replay.episodes()->Finished(place)) return false;
  const std::byte* goal = GoalOf(replay, place, rng);
  if (goal == nullptr) return false;
  Put(replay.observation(place), goal, observations_);
  Put(replay.next_observation(place), goal, next_observations_);
  ++count_;
  return true;
}

std::int64_t Hindsight::Draw(const Replay& replay, Rng& rng, std::span<std::int64_t> places) {
  count_ = 0;
  for (std::int64_t i = 0; i < wanted_; ++i) {
    const std::int64_t place = Sample(replay, rng);
    if (Relabel(replay, place, rng)) places[static_cast<std::size_t>(count_ - 1)] = place;
  }
  return count_;
}

bool Hindsight::Price() {
  health_ = count_ > 0 ? options_.price(next_observations_.data(), count_, rewards_.data()) : Status::Ok();
  return health_.ok();
}

}  // namespace consac::learn
