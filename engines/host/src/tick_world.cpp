// The host's side of a TickWorld and how one is made; what its driver asks for and gets is in offering.cpp.
#include "consac/host/tick_world.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "consac/base/names.h"
#include "tick_world_state.h"

namespace consac::host {
namespace {

constexpr std::int32_t kMostNamed = 100'000;                 // agents that share an environment have a name each
constexpr std::size_t kMostRowBytes = std::size_t{1} << 30;  // of all agents' rows, the driver's included

/// In the world and in its driver's batches, of which there are three.
std::size_t BytesOfPlace(const BehaviourSpec& behaviour) {
  const std::size_t seen = behaviour.observation_layout.row_bytes, done = behaviour.action_layout.row_bytes;
  constexpr std::size_t kRows = 11, kActions = 4, kBesides = 128;
  return kRows * seen + kActions * done + kActions * static_cast<std::size_t>(behaviour.action_layout.mask_bytes) +
         sizeof(Place) + kBesides;
}

Result<Space> SpaceOfEntries(const std::vector<Entry>& entries) {
  for (const Entry& entry : entries) {
    if (entry.name.empty()) return Status{StatusCode::kInvalidArgument, "has an entry without a name; name it"};
    if (entry.space.kind() == SpaceKind::kDict || entry.space.kind() == SpaceKind::kTuple)
      return Status{StatusCode::kInvalidArgument, "entry '" + entry.name + "' is a Dict or Tuple; use several entries"};
  }
  if (entries.empty()) return Status{StatusCode::kInvalidArgument, "has no entry; give at least one"};
  if (entries.size() == 1) return entries[0].space;
  std::vector<std::pair<std::string, Space>> children;
  for (const Entry& entry : entries) children.emplace_back(entry.name, entry.space);
  return Space::Dict(std::move(children));
}

std::vector<std::size_t> LeavesOfEntries(const std::vector<Entry>& entries, const Layout& layout) {
  std::vector<std::size_t> leaves;
  for (const Entry& entry : entries) {
    const auto named = [&](const Leaf& leaf) { return leaf.name == entry.name; };
    const auto found = std::find_if(layout.leaves.begin(), layout.leaves.end(), named);
    leaves.push_back(found == layout.leaves.end() ? 0 : static_cast<std::size_t>(found - layout.leaves.begin()));
  }
  return leaves;
}

Result<BehaviourSpec> BehaviourOfOffering(const Offering& offering, bool alone) {
  const auto wrong = [&](const std::string& what) {
    return Status{StatusCode::kInvalidArgument, "behaviour '" + offering.name + "' " + what};
  };
  CONSAC_RETURN_IF_ERROR(CheckName("behaviour", offering.name));
  if (offering.agents < 1) return wrong("has room for " + std::to_string(offering.agents) + " agents; at least 1");
  const Result<Space> seen = SpaceOfEntries(offering.observations);
  if (!seen.ok()) return wrong("(observations) " + seen.status().message());
  const Result<Space> done = SpaceOfEntries(offering.actions);
  if (!done.ok()) return wrong("(actions) " + done.status().message());
  BehaviourSpec behaviour = BehaviourSpec::Of(offering.name, *seen, *done, offering.agents);
  behaviour.masks_actions = offering.masks_actions;
  if (offering.masks_actions && behaviour.action_layout.mask_bytes == 0)
    return wrong("masks its actions, but none of them is a choice");
  if (alone) return behaviour;
  behaviour.agents.clear();
  if (offering.agents > kMostNamed) {
    return wrong("has room for " + std::to_string(offering.agents) + " agents; beside other behaviours at most " +
                 std::to_string(kMostNamed));
  }
  for (std::int32_t a = 0; a < offering.agents; ++a)
    behaviour.agents.push_back(offering.name + "_" + std::to_string(a));
  return behaviour;
}

/// Groups are of one world's agents, each of one group; a world of one offering has one agent.
Status CheckGroups(const std::vector<GroupSpec>& groups, const EnvSpec& spec, const std::vector<Herd>& herds) {
  const auto wrong = [](const GroupSpec& group, const std::string& what) {
    return Status{StatusCode::kInvalidArgument, "group '" + group.name + "' " + what};
  };
  std::vector<std::string> names;
  std::vector<GroupSpec::Member> taken;
  for (const GroupSpec& group : groups) {
    names.push_back(group.name);
    if (spec.behaviours.size() == 1)
      return wrong(group,
                   "is of agents of one kind, each of which has a world of its own; give the kinds two behaviours");
    if (group.members.empty()) return wrong(group, "has no agents");
    for (const GroupSpec::Member& member : group.members) {
      if (member.behaviour >= spec.behaviours.size() || member.agent >= spec.behaviours[member.behaviour].agents.size())
        return wrong(group, "has an agent that there is no place for");
      if (herds[member.behaviour].goals.reward() != GoalReward::kNone) {
        return wrong(group,
                     "has an agent of '" + spec.behaviours[member.behaviour].name +
                         "', whose goals say what it is paid; leave it out of groups, or give its goals no reward");
      }
      for (const GroupSpec::Member& other : taken) {
        if (other.behaviour == member.behaviour && other.agent == member.agent)
          return wrong(group, "has an agent that is in a group already");
      }
      taken.push_back(member);
    }
  }
  return CheckNamesApart("group", names);
}

}  // namespace

Herd::Herd(const BehaviourSpec& behaviour)
    : observation_bytes(behaviour.observation_layout.row_bytes),
      action_bytes(behaviour.action_layout.row_bytes),
      mask_bytes(behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0),
      places(static_cast<std::size_t>(behaviour.slots)),
      present(places.size()),
      seen(places.size() * observation_bytes),
      last(seen.size()),
      done(places.size() * action_bytes),
      masks(places.size() * mask_bytes, 1),
      choices(mask_bytes > 0 ? MaskedChoices(behaviour.action_layout) : std::vector<std::int64_t>()),
      usual(behaviour.observation_layout.leaves.begin(), behaviour.observation_layout.leaves.end()),
      outside(behaviour.observation_layout.leaves.size()) {}

Usual::Usual(const Leaf& leaf) {
  for (std::int64_t i = 0; leaf.dtype == DType::kF32 && i < leaf.count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    low.push_back(std::max(static_cast<float>(leaf.space.low()[at]), std::numeric_limits<float>::lowest()));
    high.push_back(std::min(static_cast<float>(leaf.space.high()[at]), std::numeric_limits<float>::max()));
  }
}

bool Usual::Holds(const Leaf& leaf, const std::byte* row) const {
  if (leaf.dtype != DType::kF32) return false;
  int beyond = 0;
  for (std::size_t i = 0; i < low.size(); ++i) {
    float value;
    std::memcpy(&value, row + leaf.offset + i * sizeof(value), sizeof(value));
    beyond += static_cast<int>(!(value >= low[i])) + static_cast<int>(!(value <= high[i]));
  }
  return beyond == 0;
}

void Usual::Widen() {
  std::fill(low.begin(), low.end(), std::numeric_limits<float>::lowest());
  std::fill(high.begin(), high.end(), std::numeric_limits<float>::max());
}

Result<std::unique_ptr<TickWorld>> TickWorld::Create(TickWorldOptions options) {
  auto state = std::make_unique<State>();
  if (options.offerings.empty()) return Status{StatusCode::kInvalidArgument, "the world has no behaviour"};
  if (options.max_episode_steps < 0) {
    return Status{StatusCode::kInvalidArgument, "max_episode_steps is " + std::to_string(options.max_episode_steps) +
                                                    "; give 0 for no limit, or more"};
  }
  CONSAC_RETURN_IF_ERROR(CheckOptionalName("environment", options.id));
  std::size_t bytes = 0;
  std::vector<std::string_view> names;
  state->spec.id = std::move(options.id);
  state->spec.deterministic = false;  // frames, physics and people are the engine's own
  state->spec.max_episode_steps = state->max_episode_steps = options.max_episode_steps;
  state->agents_leave = options.agents_leave;
  for (const Offering& offering : options.offerings) {
    Result<BehaviourSpec> behaviour = BehaviourOfOffering(offering, options.offerings.size() == 1);
    if (!behaviour.ok()) return behaviour.status();
    names.emplace_back(offering.name);
    CONSAC_RETURN_IF_ERROR(CheckNamesTogether("behaviour", names));
    bytes += static_cast<std::size_t>(behaviour->slots) * BytesOfPlace(*behaviour);
    if (bytes > kMostRowBytes) {
      return Status{StatusCode::kResourceExhausted,
                    "with behaviour '" + behaviour->name + "' the agents' rows take more than " +
                        std::to_string(kMostRowBytes >> 20) + " MiB; offer less room or smaller observations"};
    }
    Result<GoalPrices> goals = GoalPrices::Of(offering.goals, *behaviour);
    if (!goals.ok()) return goals.status();
    Herd& herd = state->herds.emplace_back(*behaviour);
    herd.goals = *std::move(goals);
    herd.first = static_cast<AgentId>(state->behaviour_of.size());
    herd.observation_leaves = LeavesOfEntries(offering.observations, behaviour->observation_layout);
    herd.action_leaves = LeavesOfEntries(offering.actions, behaviour->action_layout);
    state->behaviour_of.insert(state->behaviour_of.end(), herd.places.size(), state->spec.behaviours.size());
    state->spec.behaviours.push_back(std::move(*behaviour));
  }
  CONSAC_RETURN_IF_ERROR(CheckParameters(options.parameters));
  CONSAC_RETURN_IF_ERROR(CheckGroups(options.groups, state->spec, state->herds));
  state->spec.parameters = std::move(options.parameters);
  state->spec.groups = std::move(options.groups);
  state->notes = options.notes;
  const std::vector<double> defaults = DefaultsOf(state->spec.parameters);
  for (std::int32_t i = 0; i < state->spec.environments(); ++i)
    state->set.insert(state->set.end(), defaults.begin(), defaults.end());
  for (std::size_t i = 0; i < state->behaviour_of.size(); ++i)
    state->has.insert(state->has.end(), defaults.begin(), defaults.end());
  state->group_of.assign(state->behaviour_of.size(), kNoGroup);
  for (std::size_t g = 0; g < state->spec.groups.size(); ++g) {
    for (const GroupSpec::Member& member : state->spec.groups[g].members)
      state->group_of[static_cast<std::size_t>(state->herds[member.behaviour].first) + member.agent] = g;
  }
  state->earned.resize(state->spec.groups.size());
  state->paid.resize(state->spec.groups.size());
  return std::unique_ptr<TickWorld>(new TickWorld(std::move(state)));
}

TickWorld::TickWorld(std::unique_ptr<State> state) : state_(std::move(state)) {}
TickWorld::~TickWorld() = default;

const EnvSpec& TickWorld::spec() const {
  return state_->spec;
}

// ---- who is there

Result<AgentId> TickWorld::JoinOne(std::size_t b, std::optional<std::size_t> group) {
  if (b >= state_->herds.size())
    return Status{StatusCode::kInvalidArgument, "there is no behaviour " + std::to_string(b)};
  Herd& herd = state_->herds[b];
  for (std::size_t i = 0; i < herd.places.size(); ++i) {
    Place& place = herd.places[i];
    const AgentId agent = herd.first + static_cast<AgentId>(i);
    if (place.joined || GroupOf(agent) != group.value_or(GroupOf(agent))) continue;
    place.joined = place.fresh = true;
    place.resets = state_->cue == Cue::kReset;
    return agent;
  }
  return Status{StatusCode::kResourceExhausted, "behaviour '" + state_->spec.behaviours[b].name + "' has room for " +
                                                    std::to_string(herd.places.size()) +
                                                    " agents, and all of them are there" +
                                                    (group.has_value() ? " or of other groups" : "")};
}

Result<AgentId> TickWorld::Join(std::size_t b) {
  return JoinOne(b, std::nullopt);
}

Result<AgentId> TickWorld::JoinGroup(std::size_t b, std::size_t group) {
  return JoinOne(b, group);
}

void TickWorld::Leave(AgentId agent) {
  if (!Joined(agent)) return;
  Place& place = state_->At(agent);
  if (place.takes_part && !place.fresh) {
    if (place.going == Going::kOn) place.going = Going::kTruncated;
    if (!place.has_final)
      std::copy_n(Observation(agent), state_->HerdOf(agent).observation_bytes, FinalObservation(agent));
  }
  place.joined = place.resets = place.fresh = false;
}

bool TickWorld::Joined(AgentId agent) const {
  return state_->Known(agent) && state_->At(agent).joined;
}

std::int32_t TickWorld::places() const {
  return static_cast<std::int32_t>(state_->behaviour_of.size());
}

std::size_t TickWorld::BehaviourOf(AgentId agent) const {
  return state_->behaviour_of[static_cast<std::size_t>(agent)];
}

const Leaf& TickWorld::ObservationLeaf(std::size_t b, std::size_t index) const {
  return state_->spec.behaviours[b].observation_layout.leaves[state_->herds[b].observation_leaves[index]];
}

const Leaf& TickWorld::ActionLeaf(std::size_t b, std::size_t index) const {
  return state_->spec.behaviours[b].action_layout.leaves[state_->herds[b].action_leaves[index]];
}

Status TickWorld::EveryoneJoined() const {
  if (state_->agents_leave) return Status::Ok();
  for (std::size_t b = 0; b < state_->herds.size(); ++b) {
    const std::vector<Place>& places = state_->herds[b].places;
    const auto joined = std::count_if(places.begin(), places.end(), [](const Place& p) { return p.joined; });
    if (joined == static_cast<std::ptrdiff_t>(places.size())) continue;
    return {StatusCode::kFailedPrecondition, "behaviour '" + state_->spec.behaviours[b].name + "' has " +
                                                 std::to_string(joined) + " of " + std::to_string(places.size()) +
                                                 " agents; all of them join before it begins, unless agents leave"};
  }
  return Status::Ok();
}

// ---- one agent

Cue TickWorld::cue() const {
  return state_->cue;
}

bool TickWorld::Resets(AgentId agent) const {
  return Joined(agent) && state_->cue == Cue::kReset && state_->At(agent).resets;
}

std::optional<std::uint64_t> TickWorld::Seed(AgentId agent) const {
  return state_->Known(agent) ? state_->At(agent).seed : std::nullopt;
}

std::byte* TickWorld::Action(AgentId agent) {
  return state_->HerdOf(agent).done.data() + state_->PlaceOf(agent) * state_->HerdOf(agent).action_bytes;
}

std::byte* TickWorld::Observation(AgentId agent) {
  return state_->HerdOf(agent).seen.data() + state_->PlaceOf(agent) * state_->HerdOf(agent).observation_bytes;
}

std::byte* TickWorld::FinalObservation(AgentId agent) {
  state_->At(agent).has_final = true;
  return state_->HerdOf(agent).last.data() + state_->PlaceOf(agent) * state_->HerdOf(agent).observation_bytes;
}

std::uint8_t* TickWorld::ActionMask(AgentId agent) {
  Herd& herd = state_->HerdOf(agent);
  return herd.mask_bytes > 0 ? herd.masks.data() + state_->PlaceOf(agent) * herd.mask_bytes : nullptr;
}

/// Whether it is the agent that was there at the latest Offer.
bool TickWorld::Acts(AgentId agent) const {
  if (!state_->Known(agent)) return false;
  const Place& place = state_->At(agent);
  return place.joined && place.takes_part && !place.fresh;
}

void TickWorld::AddReward(AgentId agent, float reward) {
  if (Acts(agent)) state_->At(agent).reward += reward;
}

void TickWorld::EndEpisode(AgentId agent, EpisodeEnd end) {
  if (!Acts(agent) || state_->At(agent).going != Going::kOn) return;
  state_->At(agent).going = end == EpisodeEnd::kTerminated ? Going::kTerminated : Going::kTruncated;
}

bool TickWorld::Ending(AgentId agent) const {
  if (!Acts(agent) || state_->cue != Cue::kAct) return false;
  const Place& place = state_->At(agent);
  return place.going != Going::kOn || (state_->max_episode_steps > 0 && place.length + 1 >= state_->max_episode_steps);
}

double TickWorld::Parameter(AgentId agent, std::size_t index) const {
  State& state = *state_;
  const std::size_t count = state.spec.parameters.size();
  if (!state.Known(agent) || index >= count) return 0.0;
  const bool begins = Resets(agent) || Ending(agent) || state.At(agent).fresh;
  return begins ? NextParameter(agent, index) : state.has[static_cast<std::size_t>(agent) * count + index];
}

double TickWorld::NextParameter(AgentId agent, std::size_t index) const {
  State& state = *state_;
  const std::size_t count = state.spec.parameters.size();
  return state.Known(agent) && index < count ? state.set[state.EnvironmentOf(agent) * count + index] : 0.0;
}

Status TickWorld::Note(std::string_view name, double value) {
  constexpr std::size_t kMostNoted = 4096;  // in a step, or while nobody takes them
  CONSAC_RETURN_IF_ERROR(CheckName("statistic", name));
  if (!std::isfinite(value))
    return {StatusCode::kNonFinite, "the statistic '" + std::string(name) + "' is NaN or infinite; it is left out"};
  (void)state_->means.Add(name, value);
  if (state_->notes && state_->noted.size() < kMostNoted) state_->noted.push_back({std::string(name), value});
  return Status::Ok();
}

std::vector<Statistic> TickWorld::TakeMeans() {
  std::vector<Statistic> means;
  state_->means.TellEach([&](const std::string& name, double mean) { means.push_back({name, mean}); });
  return means;
}

std::size_t TickWorld::GroupOf(AgentId agent) const {
  return state_->Known(agent) ? state_->group_of[static_cast<std::size_t>(agent)] : kNoGroup;
}

void TickWorld::AddGroupReward(std::size_t group, float reward) {
  if (group >= state_->earned.size() || !std::isfinite(reward)) return;
  TellGroupReward(group, reward);
  for (const GroupSpec::Member& member : state_->spec.groups[group].members)
    AddReward(state_->herds[member.behaviour].first + static_cast<AgentId>(member.agent), reward);
}

void TickWorld::TellGroupReward(std::size_t group, float reward) {
  if (group < state_->earned.size() && std::isfinite(reward)) state_->earned[group] += reward;
}

Tally TickWorld::tally() const {
  return {state_->steps, state_->window.count(), state_->window.mean_reward(), state_->window.mean_length()};
}

// ---- the window of episodes

void Window::Add(double reward, std::int64_t length) {
  const std::size_t at = static_cast<std::size_t>(count_++) % kEpisodes;
  if (rewards_.size() <= at) {
    rewards_.push_back(0.0);
    lengths_.push_back(0.0);
  }
  rewards_[at] = reward;
  lengths_[at] = static_cast<double>(length);
}

double Window::mean_reward() const {
  return std::accumulate(rewards_.begin(), rewards_.end(), 0.0) / static_cast<double>(rewards_.size());
}

double Window::mean_length() const {
  return std::accumulate(lengths_.begin(), lengths_.end(), 0.0) / static_cast<double>(lengths_.size());
}

}  // namespace consac::host
