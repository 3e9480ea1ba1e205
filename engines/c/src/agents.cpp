// The agents of a world: who is there, what they see, do and earn.
#include "rows.h"
#include "world.h"

using consac::Result;
using consac::Status;
using consac::StatusCode;
using consac::c::Ask;
using consac::c::Given;
using consac::c::Of;
using consac::c::Ready;
using consac::c::ReadyAgent;

namespace consac::c {
namespace {

static_assert(static_cast<int>(host::Cue::kAct) == CONSAC_ACT && static_cast<int>(host::Cue::kReset) == CONSAC_RESET);

std::size_t RowBytes(const consac_world& world, std::int32_t b, consac_rows rows) {
  const BehaviourSpec& behaviour = world.agents->spec().behaviours[static_cast<std::size_t>(b)];
  if (rows == CONSAC_MASK)
    return behaviour.masks_actions ? static_cast<std::size_t>(behaviour.action_layout.mask_bytes) : 0;
  return (rows == CONSAC_OBSERVATION ? behaviour.observation_layout : behaviour.action_layout).row_bytes;
}

Status CheckEnd(std::int32_t end) {
  if (end >= CONSAC_GOES_ON && end <= CONSAC_TRUNCATED) return Status::Ok();
  return {StatusCode::kInvalidArgument, std::to_string(end) + " is no end of an episode; give CONSAC_GOES_ON (0), " +
                                            "CONSAC_TERMINATED (1) or CONSAC_TRUNCATED (2)"};
}

void End(consac_world* world, consac_agent agent, std::int32_t end) {
  if (end == CONSAC_GOES_ON) return;
  world->agents->EndEpisode(agent,
                            end == CONSAC_TERMINATED ? host::EpisodeEnd::kTerminated : host::EpisodeEnd::kTruncated);
}

/// Ok where an array of the caller's has one for each agent of a behaviour.
Status CheckArray(consac_world* world, std::int32_t b, const void* array, std::size_t count, const char* what) {
  CONSAC_RETURN_IF_ERROR(Ready(world, b));
  CONSAC_RETURN_IF_ERROR(Given(array, what));
  const auto agents = static_cast<std::size_t>(world->described.offerings[static_cast<std::size_t>(b)].agents);
  if (count == agents) return Status::Ok();
  return {StatusCode::kInvalidArgument, std::to_string(count) + " " + what + "; give " + std::to_string(agents) +
                                            ", one for each agent of the behaviour"};
}

/// Calls `each(agent, i)` for every agent of a behaviour.
template <class Each>
void ForAgents(const consac_world& world, std::int32_t b, std::size_t count, const Each& each) {
  const host::AgentId first = world.first[static_cast<std::size_t>(b)];
  for (std::size_t i = 0; i < count; ++i) each(first + static_cast<host::AgentId>(i), i);
}

}  // namespace
}  // namespace consac::c

extern "C" {

consac_status consac_world_first_agent(consac_world* world, int32_t behaviour, consac_agent* agent) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    CONSAC_RETURN_IF_ERROR(Given(agent, "agent"));
    *agent = world->first[static_cast<std::size_t>(behaviour)];
    return Status::Ok();
  });
}

consac_status consac_world_row_bytes(consac_world* world, int32_t behaviour, consac_rows rows, size_t* bytes) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    if (rows != CONSAC_MASK) CONSAC_RETURN_IF_ERROR(consac::c::SeenOrDone(rows));
    CONSAC_RETURN_IF_ERROR(Given(bytes, "bytes"));
    *bytes = consac::c::RowBytes(*world, behaviour, rows);
    return Status::Ok();
  });
}

consac_status consac_world_leaf(consac_world* world, int32_t behaviour, consac_rows rows, size_t index,
                                consac_leaf* leaf) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    CONSAC_RETURN_IF_ERROR(consac::c::SeenOrDone(rows));
    const auto b = static_cast<std::size_t>(behaviour);
    const consac::host::Offering& offering = world->described.offerings[b];
    const auto& entries = rows == CONSAC_OBSERVATION ? offering.observations : offering.actions;
    if (index >= entries.size()) {
      return {StatusCode::kInvalidArgument,
              "there is no entry " + std::to_string(index) + "; there are " + std::to_string(entries.size())};
    }
    const consac::Leaf& found =
        rows == CONSAC_OBSERVATION ? world->agents->ObservationLeaf(b, index) : world->agents->ActionLeaf(b, index);
    return consac::c::DescribeLeaf(found, entries[index].name.c_str(), leaf);
  });
}

consac_status consac_world_join(consac_world* world, int32_t behaviour, consac_agent* agent) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Ready(world, behaviour));
    CONSAC_RETURN_IF_ERROR(Given(agent, "agent"));
    const Result<consac::host::AgentId> joined = world->agents->Join(static_cast<std::size_t>(behaviour));
    if (!joined.ok()) return joined.status();
    *agent = *joined;
    return Status::Ok();
  });
}

consac_status consac_world_leave(consac_world* world, consac_agent agent) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    if (!world->described.agents_leave) {
      return {StatusCode::kFailedPrecondition, "agents of this world stay; see consac_world_set_agents_leave"};
    }
    world->agents->Leave(agent);
    return Status::Ok();
  });
}

void* consac_agent_observation(consac_world* world, consac_agent agent) {
  return Ask<void*>(world, nullptr, [&](void** row) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *row = world->agents->Observation(agent);
    return Status::Ok();
  });
}

void* consac_agent_final_observation(consac_world* world, consac_agent agent) {
  return Ask<void*>(world, nullptr, [&](void** row) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *row = world->agents->FinalObservation(agent);
    return Status::Ok();
  });
}

void* consac_agent_action(consac_world* world, consac_agent agent) {
  return Ask<void*>(world, nullptr, [&](void** row) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *row = world->agents->Action(agent);
    return Status::Ok();
  });
}

uint8_t* consac_agent_mask(consac_world* world, consac_agent agent) {
  return Ask<uint8_t*>(world, nullptr, [&](uint8_t** row) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *row = world->agents->ActionMask(agent);
    if (*row != nullptr) return Status::Ok();
    return {StatusCode::kFailedPrecondition, "this behaviour masks no actions; see consac_world_mask_actions"};
  });
}

consac_status consac_agent_add_reward(consac_world* world, consac_agent agent, float reward) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    world->agents->AddReward(agent, reward);
    return Status::Ok();
  });
}

consac_status consac_agent_end_episode(consac_world* world, consac_agent agent, int32_t end) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    CONSAC_RETURN_IF_ERROR(consac::c::CheckEnd(end));
    consac::c::End(world, agent, end);
    return Status::Ok();
  });
}

int32_t consac_agent_is_ending(consac_world* world, consac_agent agent) {
  return Ask<int32_t>(world, 0, [&](int32_t* ending) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *ending = world->agents->Ending(agent) ? 1 : 0;
    return Status::Ok();
  });
}

int32_t consac_agent_resets(consac_world* world, consac_agent agent) {
  return Ask<int32_t>(world, 0, [&](int32_t* resets) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    *resets = world->agents->Resets(agent) ? 1 : 0;
    return Status::Ok();
  });
}

int32_t consac_agent_seed(consac_world* world, consac_agent agent, uint64_t* seed) {
  return Ask<int32_t>(world, 0, [&](int32_t* seeded) -> Status {
    CONSAC_RETURN_IF_ERROR(ReadyAgent(world, agent));
    CONSAC_RETURN_IF_ERROR(Given(seed, "seed"));
    const std::optional<std::uint64_t> wanted = world->agents->Seed(agent);
    if (!wanted.has_value()) return Status::Ok();
    *seed = *wanted;
    *seeded = 1;
    return Status::Ok();
  });
}

consac_status consac_world_add_rewards(consac_world* world, int32_t behaviour, const float* rewards, size_t count) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::CheckArray(world, behaviour, rewards, count, "rewards"));
    consac::c::ForAgents(*world, behaviour, count,
                         [&](consac_agent agent, size_t i) { world->agents->AddReward(agent, rewards[i]); });
    return Status::Ok();
  });
}

consac_status consac_world_end_episodes(consac_world* world, int32_t behaviour, const uint8_t* ends, size_t count) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::CheckArray(world, behaviour, ends, count, "ends"));
    for (size_t i = 0; i < count; ++i) CONSAC_RETURN_IF_ERROR(consac::c::CheckEnd(ends[i]));
    consac::c::ForAgents(*world, behaviour, count,
                         [&](consac_agent agent, size_t i) { consac::c::End(world, agent, ends[i]); });
    return Status::Ok();
  });
}

consac_status consac_world_endings(consac_world* world, int32_t behaviour, uint8_t* endings, size_t count) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::CheckArray(world, behaviour, endings, count, "endings"));
    consac::c::ForAgents(*world, behaviour, count,
                         [&](consac_agent agent, size_t i) { endings[i] = world->agents->Ending(agent) ? 1 : 0; });
    return Status::Ok();
  });
}

consac_status consac_world_resets(consac_world* world, int32_t behaviour, uint8_t* resets, size_t count) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::CheckArray(world, behaviour, resets, count, "resets"));
    consac::c::ForAgents(*world, behaviour, count,
                         [&](consac_agent agent, size_t i) { resets[i] = world->agents->Resets(agent) ? 1 : 0; });
    return Status::Ok();
  });
}

}  // extern "C"
