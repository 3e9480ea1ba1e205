#include "worker.h"

#include <cstring>
#include <numeric>

#include "consac/protocol/protocol2.h"

namespace consac::run {
namespace {

void CopyRow(const std::byte* from, std::size_t from_row, std::byte* to, std::size_t to_row, std::size_t bytes) {
  std::memcpy(to + to_row * bytes, from + from_row * bytes, bytes);
}

void CopyMask(const std::uint8_t* from, std::size_t from_row, std::uint8_t* to, std::size_t to_row, std::size_t bytes) {
  if (from != nullptr) std::memcpy(to + to_row * bytes, from + from_row * bytes, bytes);
}

}  // namespace

Worker::Part::Part(const BehaviourSpec& behaviour, std::int32_t first_slot)
    : spec(behaviour), ids(static_cast<std::size_t>(behaviour.slots)), whole(behaviour), some(behaviour) {
  std::iota(ids.begin(), ids.end(), first_slot);
  acting.reserve(ids.size());
  acting_ids.reserve(ids.size());
}

Worker::Worker(std::unique_ptr<WorldLink> link, std::vector<std::int32_t> first_slots, Connect connect)
    : link_(std::move(link)), connect_(std::move(connect)) {
  const std::vector<BehaviourSpec>& behaviours = link_->spec().behaviours;
  for (std::size_t b = 0; b < behaviours.size(); ++b) parts_.emplace_back(behaviours[b], first_slots[b]);
  batches_.resize(parts_.size());
  world_batches_.resize(parts_.size());
}

std::int64_t Worker::rows() const {
  std::int64_t sum = 0;
  for (const Batch& batch : batches_) sum += batch.rows();
  return sum;
}

void Worker::FindActing(std::size_t b) {
  Part& part = parts_[b];
  const std::span<const std::uint8_t> present = link_->present(b);
  if (present.empty() && part.everyone()) return;
  part.acting.clear();
  part.acting_ids.clear();
  for (std::size_t slot = 0; slot < part.ids.size(); ++slot) {
    if (!present.empty() && present[slot] == 0) continue;
    part.acting.push_back(static_cast<std::int32_t>(slot));
    part.acting_ids.push_back(part.ids[slot]);
  }
}

Status Worker::Reset(std::uint64_t seed) {
  for (std::size_t b = 0; b < parts_.size(); ++b) world_batches_[b] = parts_[b].whole.batch();
  latest_in_learners_ = in_learners_ = false;
  return (next_link_ != nullptr ? next_link_ : link_)->Reset(seed, world_batches_);
}

Status Worker::Begin(Trainees trainees) {
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    FindActing(b);
    parts_[b].arriving = parts_[b].acting;
    parts_[b].arriving_ids = parts_[b].acting_ids;
    CONSAC_RETURN_IF_ERROR(BeginArriving(parts_[b], trainees[b]));
  }
  return Status::Ok();
}

/// Agents whose observations are in part.whole begin.
Status Worker::BeginArriving(Part& part, Trainee& trainee) {
  if (part.arriving.empty()) return Status::Ok();
  const Batch& whole = part.whole.batch();
  Batch batch = part.some.batch();
  const std::size_t bytes = part.spec.observation_layout.row_bytes;
  for (std::size_t i = 0; i < part.arriving.size(); ++i) {
    const auto slot = static_cast<std::size_t>(part.arriving[i]);
    CopyRow(whole.next_observations, slot, batch.next_observations, i, bytes);
    CopyMask(whole.next_action_masks, slot, batch.next_action_masks, i,
             static_cast<std::size_t>(part.spec.action_layout.mask_bytes));
  }
  batch.slots = part.arriving_ids;
  CONSAC_RETURN_IF_ERROR(trainee.watch.Begin(batch));
  for (std::size_t i = 0; i < part.arriving.size(); ++i)  // as the watch has mended it
    CopyRow(batch.next_observations, i, whole.next_observations, static_cast<std::size_t>(part.arriving[i]), bytes);
  trainee.learner->Begin(batch);
  return Status::Ok();
}

void Worker::Act(Trainees trainees, Rows rows) {
  bool everyone = true;
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    FindActing(b);
    everyone = everyone && parts_[b].everyone();
  }
  in_learners_ = rows == Rows::kLearners && everyone;
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    if (rows == Rows::kLearners) {
      batches_[b] = trainees[b].learner->Stage(parts_[b].acting_ids);
      world_batches_[b] = in_learners_ ? batches_[b] : parts_[b].whole.batch();
    } else {
      PlaceObservations(b);
      batches_[b] = OwnRows(b);
    }
    if (batches_[b].rows() > 0) trainees[b].learner->Act(batches_[b]);
    if (in_learners_ || batches_[b].actions == world_batches_[b].actions) continue;
    const std::size_t bytes = parts_[b].spec.action_layout.row_bytes;
    for (std::size_t i = 0; i < parts_[b].acting.size(); ++i)
      CopyRow(batches_[b].actions, i, world_batches_[b].actions, static_cast<std::size_t>(parts_[b].acting[i]), bytes);
  }
}

/// What came last becomes what is acted upon, in the worker's own rows.
void Worker::PlaceObservations(std::size_t b) {
  Part& part = parts_[b];
  if (latest_in_learners_) {
    const Batch& latest = batches_[b];
    Batch& own = part.whole.batch();
    const std::size_t bytes = part.spec.observation_layout.row_bytes;
    std::memcpy(own.observations, latest.next_observations, part.ids.size() * bytes);
    if (own.action_masks != nullptr) {
      std::memcpy(own.action_masks, latest.next_action_masks,
                  part.ids.size() * static_cast<std::size_t>(part.spec.action_layout.mask_bytes));
    }
  } else {
    part.whole.Advance();
  }
  world_batches_[b] = part.whole.batch();
}

/// The rows of the agents that act: all of them in place, or gathered.
Batch Worker::OwnRows(std::size_t b) {
  Part& part = parts_[b];
  const Batch& whole = world_batches_[b];
  Batch batch = part.everyone() ? whole : part.some.batch();
  batch.slots = part.acting_ids;
  if (part.everyone()) return batch;
  for (std::size_t i = 0; i < part.acting.size(); ++i) {
    const auto slot = static_cast<std::size_t>(part.acting[i]);
    CopyRow(whole.observations, slot, batch.observations, i, part.spec.observation_layout.row_bytes);
    CopyMask(whole.action_masks, slot, batch.action_masks, i,
             static_cast<std::size_t>(part.spec.action_layout.mask_bytes));
  }
  return batch;
}

Status Worker::Step(MoreSteps more) {
  const double start = Now();
  const Status status = link_->Step(world_batches_, more);
  step_seconds_ = Now() - start;
  return status;
}

Status Worker::Record(Trainees trainees) {
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    if (batches_[b].actions != world_batches_[b].actions) GatherOutcome(b);
    if (batches_[b].rows() > 0) {
      CONSAC_RETURN_IF_ERROR(trainees[b].watch.Check(batches_[b]));
      if (batches_[b].actions != world_batches_[b].actions) ScatterMended(b);
      trainees[b].learner->Record(batches_[b]);
    }
    if (!parts_[b].everyone()) CONSAC_RETURN_IF_ERROR(BeginArrivals(b, trainees[b]));
  }
  latest_in_learners_ = in_learners_;
  return Status::Ok();
}

void Worker::GatherOutcome(std::size_t b) {
  const Part& part = parts_[b];
  const Batch &whole = world_batches_[b], &some = batches_[b];
  const std::size_t bytes = part.spec.observation_layout.row_bytes;
  for (std::size_t i = 0; i < part.acting.size(); ++i) {
    const auto slot = static_cast<std::size_t>(part.acting[i]);
    some.rewards[i] = whole.rewards[slot];
    some.terminated[i] = whole.terminated[slot];
    some.truncated[i] = whole.truncated[slot];
    CopyRow(whole.next_observations, slot, some.next_observations, i, bytes);
    CopyMask(whole.next_action_masks, slot, some.next_action_masks, i,
             static_cast<std::size_t>(part.spec.action_layout.mask_bytes));
    if ((some.terminated[i] | some.truncated[i]) != 0)
      CopyRow(whole.final_observations, slot, some.final_observations, i, bytes);
  }
}

/// What the watch has mended is what the next action is chosen from.
void Worker::ScatterMended(std::size_t b) {
  const Part& part = parts_[b];
  for (std::size_t i = 0; i < part.acting.size(); ++i) {
    CopyRow(batches_[b].next_observations, i, world_batches_[b].next_observations,
            static_cast<std::size_t>(part.acting[i]), part.spec.observation_layout.row_bytes);
  }
}

/// Agents that were absent in this step and are there now.
Status Worker::BeginArrivals(std::size_t b, Trainee& trainee) {
  Part& part = parts_[b];
  part.acted.assign(part.ids.size(), 0);
  for (const std::int32_t slot : part.acting) part.acted[static_cast<std::size_t>(slot)] = 1;
  part.arriving.clear();
  part.arriving_ids.clear();
  const std::span<const std::uint8_t> present = link_->present(b);
  for (std::size_t slot = 0; slot < part.ids.size(); ++slot) {
    if (part.acted[slot] != 0 || (!present.empty() && present[slot] == 0)) continue;
    part.arriving.push_back(static_cast<std::int32_t>(slot));
    part.arriving_ids.push_back(part.ids[slot]);
  }
  return BeginArriving(part, trainee);
}

Status Worker::ConnectAnew(std::uint64_t seed) {
  if (!connect_) return {StatusCode::kUnavailable, "this world cannot be connected to again"};
  Result<std::unique_ptr<WorldLink>> link = connect_();
  if (!link.ok()) return link.status();
  std::string path;
  const EnvSpec &now = (*link)->spec(), &before = link_->spec();
  const Status same =
      protocol2::CompareBehaviours(protocol2::BehavioursJson(before), protocol2::BehavioursJson(now), &path);
  if (!same.ok() || now.environments() != before.environments() || now.behaviours.size() != before.behaviours.size()) {
    return {StatusCode::kFailedPrecondition,
            (*link)->description() + " offers something else than before: " +
                (same.ok() ? "another number of environments" : protocol2::FaultText(same))};
  }
  next_link_ = std::move(*link);
  return Reset(seed);
}

void Worker::Adopt() {
  link_ = std::move(next_link_);
}

}  // namespace consac::run
