// What the agents of a ConsacWorld see and do: whole behaviours in one call, or an agent at a time.
#include "world.h"

namespace consac::godot {
namespace {

Status CheckSize(const char* what, std::size_t given, std::int64_t rows, std::size_t each) {
  const std::size_t expected = static_cast<std::size_t>(rows) * each;
  if (given == expected) return Status::Ok();
  return {StatusCode::kInvalidArgument, std::to_string(given) + " " + what + "; expected " + std::to_string(expected) +
                                            ", " + std::to_string(each) + " for each of " + std::to_string(rows)};
}

}  // namespace

Result<Floats> World::ReadActions(const Result<Part>& part) {
  if (!part.ok()) return part.status();
  const RowMap& map = part->rows->action;
  Floats numbers = Floats::OfSize(static_cast<std::size_t>(part->count) * map.numbers());
  map.Read(world_->Action(part->first), part->count, numbers.writable());
  return numbers;
}

Status World::WriteActions(const Result<Part>& part, const Floats& numbers) {
  if (!part.ok()) return part.status();
  const RowMap& map = part->rows->action;
  CONSAC_RETURN_IF_ERROR(CheckSize("numbers", numbers.span().size(), part->count, map.numbers()));
  return map.Write(numbers.span(), part->count, world_->Action(part->first));
}

Status World::WriteObservations(const Result<Part>& part, const Floats& numbers, bool final) {
  if (!part.ok()) return part.status();
  const RowMap& map = part->rows->observation;
  CONSAC_RETURN_IF_ERROR(CheckSize("numbers", numbers.span().size(), part->count, map.numbers()));
  std::byte* to = final ? world_->FinalObservation(part->first) : world_->Observation(part->first);
  return map.Write(numbers.span(), part->count, to);
}

Status World::WriteBytes(const Result<Part>& part, const Bytes& bytes, bool final) {
  if (!part.ok()) return part.status();
  const RowMap& map = part->rows->observation;
  CONSAC_RETURN_IF_ERROR(CheckSize("bytes", bytes.span().size(), part->count, map.bytes()));
  map.WriteBytes(bytes.span(), part->count,
                 final ? world_->FinalObservation(part->first) : world_->Observation(part->first));
  return Status::Ok();
}

Status World::WriteMasks(const Result<Part>& part, const Bytes& masks) {
  if (!part.ok()) return part.status();
  const RowMap& map = part->rows->action;
  std::uint8_t* to = world_->ActionMask(part->first);
  if (to == nullptr)
    return {StatusCode::kFailedPrecondition, "this behaviour masks no actions; create it with masks_actions"};
  CONSAC_RETURN_IF_ERROR(CheckSize("bytes", masks.span().size(), part->count, map.masks()));
  map.WriteMasks(masks.span(), part->count, to);
  return Status::Ok();
}

// ---- all of a behaviour

Result<Floats> World::Actions(std::int64_t behaviour) {
  return ReadActions(All(behaviour));
}
Status World::SetActions(std::int64_t behaviour, const Floats& numbers) {
  return WriteActions(All(behaviour), numbers);
}
Status World::SetObservations(std::int64_t behaviour, const Floats& numbers) {
  return WriteObservations(All(behaviour), numbers, false);
}
Status World::SetObservationBytes(std::int64_t behaviour, const Bytes& bytes) {
  return WriteBytes(All(behaviour), bytes, false);
}
Status World::SetFinalObservations(std::int64_t behaviour, const Floats& numbers) {
  return WriteObservations(All(behaviour), numbers, true);
}
Status World::SetFinalObservationBytes(std::int64_t behaviour, const Bytes& bytes) {
  return WriteBytes(All(behaviour), bytes, true);
}
Status World::SetMasks(std::int64_t behaviour, const Bytes& masks) {
  return WriteMasks(All(behaviour), masks);
}

Status World::AddRewards(std::int64_t behaviour, const Floats& rewards) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  const std::span<const float> values = rewards.span();
  CONSAC_RETURN_IF_ERROR(CheckSize("rewards", values.size(), part->count, 1));
  for (std::size_t i = 0; i < values.size(); ++i) {
    world_->AddReward(part->first + static_cast<host::AgentId>(i), values[i]);
  }
  return Status::Ok();
}

Status World::EndEpisodes(std::int64_t behaviour, const Bytes& ends) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  const std::span<const std::uint8_t> values = ends.span();
  CONSAC_RETURN_IF_ERROR(CheckSize("ends", values.size(), part->count, 1));
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] == 0 || !world_->Joined(part->first + static_cast<host::AgentId>(i))) continue;
    CONSAC_RETURN_IF_ERROR(EndEpisode(std::int64_t{part->first} + static_cast<std::int64_t>(i), values[i]));
  }
  return Status::Ok();
}

Result<Bytes> World::Endings(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  Bytes flags = Bytes::OfSize(static_cast<std::size_t>(part->count));
  host::AgentId agent = part->first;
  for (std::uint8_t& flag : flags.writable()) flag = world_->Ending(agent++) ? 1 : 0;
  return flags;
}

Result<Bytes> World::Resets(std::int64_t behaviour) {
  const Result<Part> part = All(behaviour);
  if (!part.ok()) return part.status();
  Bytes flags = Bytes::OfSize(static_cast<std::size_t>(part->count));
  host::AgentId agent = part->first;
  for (std::uint8_t& flag : flags.writable()) flag = world_->Resets(agent++) ? 1 : 0;
  return flags;
}

// ---- one agent

Result<Floats> World::Action(std::int64_t agent) {
  return ReadActions(One(agent));
}
Status World::SetAction(std::int64_t agent, const Floats& numbers) {
  return WriteActions(One(agent), numbers);
}
Status World::SetObservation(std::int64_t agent, const Floats& numbers) {
  return WriteObservations(One(agent), numbers, false);
}
Status World::SetObservationBytesOf(std::int64_t agent, const Bytes& bytes) {
  return WriteBytes(One(agent), bytes, false);
}
Status World::SetFinalObservation(std::int64_t agent, const Floats& numbers) {
  return WriteObservations(One(agent), numbers, true);
}
Status World::SetFinalObservationBytesOf(std::int64_t agent, const Bytes& bytes) {
  return WriteBytes(One(agent), bytes, true);
}
Status World::SetMask(std::int64_t agent, const Bytes& mask) {
  return WriteMasks(One(agent), mask);
}

Status World::AddReward(std::int64_t agent, double reward) {
  const Result<Part> part = One(agent);
  if (!part.ok()) return part.status();
  world_->AddReward(part->first, static_cast<float>(reward));
  return Status::Ok();
}

Result<double> World::NextParameter(std::int64_t agent, const std::string& name) {
  const Result<Part> part = One(agent);
  if (!part.ok()) return part.status();
  const Result<std::size_t> index = world_->ParameterNamed(name);
  if (!index.ok()) return index.status();
  return world_->NextParameter(part->first, *index);
}

Status World::Note(const std::string& name, double value) {
  CONSAC_RETURN_IF_ERROR(Ready());
  return world_->Note(name, value);
}

Status World::TellGroupReward(std::int64_t group, double reward) {
  CONSAC_RETURN_IF_ERROR(Ready());
  const auto groups = static_cast<std::int64_t>(world_->spec().groups.size());
  if (group < 0 || group >= groups) {
    return {StatusCode::kInvalidArgument,
            "there is no group " + std::to_string(group) + "; this world has " + std::to_string(groups) + ", from 0"};
  }
  world_->TellGroupReward(static_cast<std::size_t>(group), static_cast<float>(reward));
  return Status::Ok();
}

Status World::EndEpisode(std::int64_t agent, std::int64_t end) {
  const Result<Part> part = One(agent);
  if (!part.ok()) return part.status();
  if (end == static_cast<std::int64_t>(End::kGoesOn)) return Status::Ok();
  if (end != static_cast<std::int64_t>(End::kTerminated) && end != static_cast<std::int64_t>(End::kTruncated)) {
    return {StatusCode::kInvalidArgument, std::to_string(end) + " is no end of an episode; expected " +
                                              "GOES_ON (0), TERMINATED (1) or TRUNCATED (2)"};
  }
  world_->EndEpisode(part->first, end == static_cast<std::int64_t>(End::kTerminated) ? host::EpisodeEnd::kTerminated
                                                                                     : host::EpisodeEnd::kTruncated);
  return Status::Ok();
}

bool World::Ending(std::int64_t agent) {
  const Result<Part> part = One(agent);
  return part.ok() && world_->Ending(part->first);
}

bool World::ResetsOne(std::int64_t agent) {
  const Result<Part> part = One(agent);
  return part.ok() && world_->Resets(part->first);
}

std::int64_t World::Seed(std::int64_t agent) {
  const Result<Part> part = One(agent);
  if (!part.ok()) return -1;
  const std::optional<std::uint64_t> seed = world_->Seed(part->first);
  return seed.has_value() ? static_cast<std::int64_t>(*seed & 0x7fffffffffffffffULL) : -1;
}

}  // namespace consac::godot
