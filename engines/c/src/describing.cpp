// What a world is made of.
#include <limits>

#include "rows.h"
#include "world.h"

using consac::Result;
using consac::Space;
using consac::Status;
using consac::StatusCode;
using consac::c::Given;
using consac::c::Of;

namespace consac::c {

Status Usable(const consac_world* world) {
  CONSAC_RETURN_IF_ERROR(Given(world, "world"));
  if (!world->lost) return Status::Ok();
  return {StatusCode::kFailedPrecondition, "memory ran out in this world before; free it"};
}

Status CheckBehaviour(const consac_world& world, std::int32_t b) {
  const std::size_t behaviours = world.described.offerings.size();
  if (b >= 0 && static_cast<std::size_t>(b) < behaviours) return Status::Ok();
  return {StatusCode::kInvalidArgument,
          "there is no behaviour " + std::to_string(b) + "; there are " + std::to_string(behaviours)};
}

Status Build(consac_world* world) {
  if (world->agents != nullptr) return Status::Ok();
  Result<std::unique_ptr<host::TickWorld>> made = host::TickWorld::Create(world->described);
  if (!made.ok()) return made.status();
  std::vector<host::AgentId> first;
  host::AgentId next = 0;
  for (std::size_t b = 0; b < world->described.offerings.size(); ++b) {
    first.push_back(next);
    next += world->described.offerings[b].agents;
    for (host::AgentId a = first[b]; !world->described.agents_leave && a < next; ++a) {
      const Result<host::AgentId> joined = (*made)->Join(b);
      if (!joined.ok()) return joined.status();
    }
  }
  world->recorders.resize(first.size());
  world->first = std::move(first);
  world->agents = *std::move(made);
  return Status::Ok();
}

Status Ready(consac_world* world, std::int32_t b) {
  CONSAC_RETURN_IF_ERROR(Build(world));
  return CheckBehaviour(*world, b);
}

Status ReadyAgent(consac_world* world, consac_agent agent) {
  CONSAC_RETURN_IF_ERROR(Build(world));
  if (agent >= 0 && agent < world->agents->places()) return Status::Ok();
  return {StatusCode::kInvalidArgument, "there is no agent " + std::to_string(agent) + "; there is room for " +
                                            std::to_string(world->agents->places())};
}

namespace {

constexpr std::size_t kMostEntries = 4096;  // of one behaviour
constexpr std::size_t kMostBehaviours = 4096;
constexpr std::size_t kMostDimensions = 32;  // of an array

/// Ok while the world is being described.
Status Describable(const consac_world& world) {
  if (world.agents == nullptr) return Status::Ok();
  return {StatusCode::kFailedPrecondition,
          "the world's agents are there already; describe all of it before they are asked for or driven"};
}

/// The behaviour that is being described.
Status Described(consac_world* world, std::int32_t b, host::Offering** offering) {
  CONSAC_RETURN_IF_ERROR(Describable(*world));
  CONSAC_RETURN_IF_ERROR(CheckBehaviour(*world, b));
  *offering = &world->described.offerings[static_cast<std::size_t>(b)];
  return Status::Ok();
}

Status AddEntry(consac_world* world, std::int32_t b, consac_rows rows, const char* name, Result<Space> space) {
  host::Offering* offering = nullptr;
  CONSAC_RETURN_IF_ERROR(Described(world, b, &offering));
  CONSAC_RETURN_IF_ERROR(SeenOrDone(rows));
  CONSAC_RETURN_IF_ERROR(Given(name, "name"));
  if (!space.ok()) return {space.status().code(), "entry '" + std::string(name) + "': " + space.status().message()};
  std::vector<host::Entry>& entries = rows == CONSAC_OBSERVATION ? offering->observations : offering->actions;
  if (entries.size() >= kMostEntries)
    return {StatusCode::kResourceExhausted, "a behaviour has " + std::to_string(kMostEntries) + " entries at most"};
  for (const host::Entry& entry : entries) {
    if (entry.name == name)
      return {StatusCode::kAlreadyExists, "there is an entry '" + entry.name + "' already; give another name"};
  }
  entries.push_back({name, *std::move(space)});
  return Status::Ok();
}

/// Bounds of every element.
std::vector<double> BoundsOf(const double* given, double every, std::int64_t count) {
  if (given != nullptr) return {given, given + count};
  return std::vector<double>(static_cast<std::size_t>(count), every);
}

Result<Space> SpaceOf(const consac_box* given) {
  CONSAC_RETURN_IF_ERROR(Given(given, "box"));
  consac_box box;
  CONSAC_RETURN_IF_ERROR(TakeOptions(given, "box", &box));
  if (box.type < CONSAC_FLOAT32 || box.type > CONSAC_BOOL) {
    return Status{StatusCode::kInvalidArgument,
                  "box.type is " + std::to_string(box.type) + "; give CONSAC_FLOAT32 (0) to CONSAC_BOOL (10)"};
  }
  if (box.dimensions > kMostDimensions) {
    return Status{StatusCode::kInvalidArgument, "box.dimensions is " + std::to_string(box.dimensions) + "; give " +
                                                    std::to_string(kMostDimensions) + " at most"};
  }
  if (box.dimensions > 0) CONSAC_RETURN_IF_ERROR(Given(box.shape, "box.shape"));
  const std::vector<std::int64_t> shape(box.shape, box.shape + box.dimensions);
  constexpr std::int64_t kMostNumbers = std::int64_t{1} << 28;
  std::int64_t count = 1;
  for (const std::int64_t side : shape) {
    if (side < 1 || side > kMostNumbers / count) {
      return Status{StatusCode::kInvalidArgument, "box.shape has a side of " + std::to_string(side) +
                                                      "; give 1 or more, and no more than " +
                                                      std::to_string(kMostNumbers) + " numbers in all"};
    }
    count *= side;
  }
  return Space::Box(BoundsOf(box.low, box.every_low, count), BoundsOf(box.high, box.every_high, count), shape,
                    static_cast<DType>(box.type));
}

Result<Space> SpaceOf(const std::int64_t* choices, std::size_t count) {
  CONSAC_RETURN_IF_ERROR(Given(choices, "choices"));
  constexpr std::size_t kMostChoices = std::size_t{1} << 20;
  if (count > kMostChoices) {
    return Status{StatusCode::kInvalidArgument,
                  std::to_string(count) + " choices; give " + std::to_string(kMostChoices) + " at most"};
  }
  return Space::MultiDiscrete({choices, choices + count});
}

}  // namespace
}  // namespace consac::c

extern "C" {

consac_status consac_world_new(const char* id, consac_world** world) {
  if (world != nullptr) *world = nullptr;
  return consac::c::Make([&]() -> Status {
    CONSAC_RETURN_IF_ERROR(Given(world, "where the world goes"));
    auto made = std::make_unique<consac_world>();
    made->described.id = consac::c::TextOf(id);
    *world = made.release();
    return Status::Ok();
  });
}

void consac_world_free(consac_world* world) {
  // What a call left half done may hold what its end would wait for: it stays.
  if (world != nullptr && !world->lost) delete world;
}

consac_status consac_world_add_behaviour(consac_world* world, const char* name, int32_t agents, int32_t* behaviour) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Describable(*world));
    CONSAC_RETURN_IF_ERROR(Given(name, "name"));
    if (agents < 1) {
      return {StatusCode::kInvalidArgument,
              std::to_string(agents) + " agents of behaviour '" + name + "'; give 1 or more"};
    }
    if (world->described.offerings.size() >= consac::c::kMostBehaviours) {
      return {StatusCode::kResourceExhausted,
              "a world has " + std::to_string(consac::c::kMostBehaviours) + " behaviours at most"};
    }
    consac::host::Offering offering;
    offering.name = name;
    offering.agents = agents;
    world->described.offerings.push_back(std::move(offering));
    if (behaviour != nullptr) *behaviour = static_cast<int32_t>(world->described.offerings.size()) - 1;
    return Status::Ok();
  });
}

consac_status consac_world_add_numbers(consac_world* world, int32_t behaviour, consac_rows rows, const char* name,
                                       int64_t count, double low, double high) {
  consac_box box{};
  box.size = sizeof(box);
  box.shape = &count;
  box.dimensions = 1;
  box.every_low = low;
  box.every_high = high;
  return consac_world_add_box(world, behaviour, rows, name, &box);
}

consac_status consac_world_add_box(consac_world* world, int32_t behaviour, consac_rows rows, const char* name,
                                   const consac_box* box) {
  return Of(world, [&] { return consac::c::AddEntry(world, behaviour, rows, name, consac::c::SpaceOf(box)); });
}

consac_status consac_world_add_discrete(consac_world* world, int32_t behaviour, consac_rows rows, const char* name,
                                        int64_t n, int64_t start) {
  return Of(world, [&] { return consac::c::AddEntry(world, behaviour, rows, name, Space::Discrete(n, start)); });
}

consac_status consac_world_add_multi_discrete(consac_world* world, int32_t behaviour, consac_rows rows,
                                              const char* name, const int64_t* choices, size_t count) {
  return Of(world,
            [&] { return consac::c::AddEntry(world, behaviour, rows, name, consac::c::SpaceOf(choices, count)); });
}

consac_status consac_world_add_multi_binary(consac_world* world, int32_t behaviour, consac_rows rows, const char* name,
                                            int64_t n) {
  return Of(world, [&] { return consac::c::AddEntry(world, behaviour, rows, name, Space::MultiBinary(n)); });
}

consac_status consac_world_mask_actions(consac_world* world, int32_t behaviour) {
  return Of(world, [&]() -> Status {
    consac::host::Offering* offering = nullptr;
    CONSAC_RETURN_IF_ERROR(consac::c::Described(world, behaviour, &offering));
    offering->masks_actions = true;
    return Status::Ok();
  });
}

consac_status consac_world_set_time_limit(consac_world* world, int64_t steps) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Describable(*world));
    if (steps < 0)
      return {StatusCode::kInvalidArgument, std::to_string(steps) + " steps; give 0 for no limit, or more"};
    world->described.max_episode_steps = steps;
    return Status::Ok();
  });
}

consac_status consac_world_set_agents_leave(consac_world* world) {
  return Of(world, [&]() -> Status {
    CONSAC_RETURN_IF_ERROR(consac::c::Describable(*world));
    world->described.agents_leave = true;
    return Status::Ok();
  });
}

consac_status consac_world_set_goals(consac_world* world, int32_t behaviour, const consac_goals* goals) {
  return Of(world, [&]() -> Status {
    consac::host::Offering* offering = nullptr;
    CONSAC_RETURN_IF_ERROR(consac::c::Described(world, behaviour, &offering));
    CONSAC_RETURN_IF_ERROR(Given(goals, "goals"));
    consac_goals taken;
    CONSAC_RETURN_IF_ERROR(consac::c::TakeOptions(goals, "goals", &taken));
    if (taken.reward < CONSAC_GOALS_NONE || taken.reward > CONSAC_GOALS_FUNCTION) {
      return {StatusCode::kInvalidArgument, "goals.reward is " + std::to_string(taken.reward) +
                                                "; give CONSAC_GOALS_NONE (0) to CONSAC_GOALS_FUNCTION (3)"};
    }
    consac::host::Goals made;
    made.reward = static_cast<consac::host::GoalReward>(taken.reward);
    made.pays = taken.rewards_are_added == 0;
    if (taken.threshold != 0.0) made.threshold = taken.threshold;
    if (taken.reward == CONSAC_GOALS_FUNCTION) {
      if (taken.price == nullptr)
        return {StatusCode::kInvalidArgument, "goals.price is NULL; give the function that pays"};
      made.price = [price = taken.price, user = taken.user](const std::byte* observations, std::int64_t rows,
                                                            float* rewards) {
        price(user, observations, rows, rewards);
      };
    }
    offering->goals = std::move(made);
    return Status::Ok();
  });
}

}  // extern "C"
