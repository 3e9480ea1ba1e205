#include "world.h"

#include "describe.h"

namespace consac::godot {

World::~World() {
  Close();
}

Status World::Create(const Dictionary& description) {
  Result<host::TickWorldOptions> options = ReadWorld(description);
  if (!options.ok()) return options.status();
  const std::vector<host::Offering> offerings = options->offerings;
  Result<std::unique_ptr<host::TickWorld>> world = host::TickWorld::Create(*std::move(options));
  if (!world.ok()) return world.status();
  Stop();
  rows_.clear();
  world_ = *std::move(world);
  host::AgentId first = 0;
  for (std::size_t b = 0; b < offerings.size(); ++b) {
    const BehaviourSpec& behaviour = world_->spec().behaviours[b];
    std::vector<Leaf> seen, done;
    for (std::size_t i = 0; i < offerings[b].observations.size(); ++i) seen.push_back(world_->ObservationLeaf(b, i));
    for (std::size_t i = 0; i < offerings[b].actions.size(); ++i) done.push_back(world_->ActionLeaf(b, i));
    rows_.push_back({first, offerings[b].agents, RowMap(behaviour.observation_layout, seen),
                     RowMap(behaviour.action_layout, done), nullptr});
    rows_[b].observation.Clear(rows_[b].count, world_->Observation(first));
    rows_[b].observation.Clear(rows_[b].count, world_->FinalObservation(first));
    rows_[b].action.Clear(rows_[b].count, world_->Action(first));
    first += offerings[b].agents;
  }
  return Status::Ok();
}

Status World::Ready() const {
  if (world_ != nullptr) return Status::Ok();
  return {StatusCode::kFailedPrecondition, "the world is not made yet; call create() first"};
}

Result<World::Part> World::All(std::int64_t behaviour) {
  CONSAC_RETURN_IF_ERROR(Ready());
  if (behaviour < 0 || static_cast<std::size_t>(behaviour) >= rows_.size()) {
    return Status{StatusCode::kInvalidArgument, "there is no behaviour " + std::to_string(behaviour) +
                                                    "; this world has " + std::to_string(rows_.size()) + ", from 0"};
  }
  Rows& rows = rows_[static_cast<std::size_t>(behaviour)];
  return Part{&rows, rows.first, rows.count};
}

Result<World::Part> World::One(std::int64_t agent) {
  CONSAC_RETURN_IF_ERROR(Ready());
  if (agent < 0 || agent >= world_->places() || !world_->Joined(static_cast<host::AgentId>(agent))) {
    return Status{StatusCode::kInvalidArgument,
                  "there is no agent " + std::to_string(agent) + "; join() gives an agent its number"};
  }
  const auto id = static_cast<host::AgentId>(agent);
  return Part{&rows_[world_->BehaviourOf(id)], id, 1};
}

Result<std::int64_t> World::Join(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  const Result<host::AgentId> agent = world_->Join(static_cast<std::size_t>(behaviour));
  if (!agent.ok()) return agent.status();
  return std::int64_t{*agent};
}

Result<std::int64_t> World::JoinGroup(std::int64_t behaviour, std::int64_t group) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  const Result<host::AgentId> agent = world_->JoinGroup(static_cast<std::size_t>(behaviour),
                                                        group < 0 ? host::kNoGroup : static_cast<std::size_t>(group));
  if (!agent.ok()) return agent.status();
  return std::int64_t{*agent};
}

Status World::Leave(std::int64_t agent) {
  const Result<Part> part = One(agent);
  if (!part.ok()) return part.status();
  world_->Leave(part->first);
  return Status::Ok();
}

bool World::Joined(std::int64_t agent) {
  return One(agent).ok();
}

Result<std::int64_t> World::Agents(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  return part->count;
}

Result<std::int64_t> World::FirstAgent(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  return std::int64_t{part->first};
}

}  // namespace consac::godot
