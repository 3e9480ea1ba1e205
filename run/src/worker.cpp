#include "worker.h"

#include <numeric>

#include "consac/protocol/protocol2.h"

namespace consac::run {
Worker::Part::Part(const BehaviourSpec& behaviour, std::int32_t first_slot)
    : spec(behaviour),
      ids(static_cast<std::size_t>(behaviour.slots)),
      whole(behaviour),
      acting(behaviour),
      arriving(behaviour) {
  std::iota(ids.begin(), ids.end(), first_slot);
  acting_ids.reserve(ids.size());
  arriving_ids.reserve(ids.size());
  goes_on.reserve(ids.size());
}

std::span<const std::int32_t> Worker::Part::Named(const GatheredRows& rows, std::vector<std::int32_t>* to) const {
  to->clear();
  for (const std::int32_t slot : rows.slots()) to->push_back(ids[static_cast<std::size_t>(slot)]);
  return *to;
}

std::span<const std::uint8_t> Worker::Part::GoingOn(std::span<const std::uint8_t> present) {
  goes_on.clear();
  if (present.empty()) return goes_on;
  for (const std::int32_t slot : acting.slots()) goes_on.push_back(present[static_cast<std::size_t>(slot)]);
  return goes_on;
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
  if (present.empty() && part.acting_ids.size() == part.ids.size()) return;
  part.acting.ChoosePresent(present);
  part.Named(part.acting, &part.acting_ids);
}

Status Worker::Reset(std::uint64_t seed) {
  if (parameters_.has_value()) parameters_->LookAtSteps();
  return BeginWorld(*link_, seed, parameters_);
}

Status Worker::BeginWorld(WorldLink& link, std::uint64_t seed, std::optional<EnvironmentParameters>& parameters) {
  for (std::size_t b = 0; b < parts_.size(); ++b) world_batches_[b] = parts_[b].whole.batch();
  if (parameters.has_value()) parameters->ChooseForAll(link);
  const Status status = link.Reset(seed, world_batches_);
  if (!status.ok() || !parameters.has_value()) return status;
  for (std::int32_t i = 0; i < link.spec().environments(); ++i) parameters->ChooseNext(link, i);
  return status;
}

void Worker::ChooseParameters() {
  if (!parameters_.has_value()) return;
  parameters_->LookAtSteps();
  began_.assign(static_cast<std::size_t>(link_->spec().environments()), 0);
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    const std::size_t agents = parts_[b].spec.agents.size();
    const std::span<const std::int32_t> slots = parts_[b].acting.slots();
    for (std::size_t row = 0; row < slots.size(); ++row) {
      if ((batches_[b].terminated[row] | batches_[b].truncated[row]) != 0)
        began_[static_cast<std::size_t>(slots[row]) / agents] = 1;
    }
  }
  for (std::size_t i = 0; i < began_.size(); ++i) {
    if (began_[i] != 0) parameters_->ChooseNext(*link_, static_cast<std::int32_t>(i));
  }
}

Status Worker::Begin(Trainees trainees) {
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    parts_[b].arriving.ChoosePresent(link_->present(b));
    CONSAC_RETURN_IF_ERROR(BeginArriving(parts_[b], trainees[b]));
  }
  return Status::Ok();
}

/// Agents whose observations are in part.whole begin.
Status Worker::BeginArriving(Part& part, Trainee& trainee) {
  if (part.arriving.slots().empty()) return Status::Ok();
  Batch batch = part.arriving.PartOf(part.whole.batch());
  part.arriving.TakeNext(part.whole.batch(), batch);
  batch.slots = part.Named(part.arriving, &part.arriving_ids);
  CONSAC_RETURN_IF_ERROR(trainee.watch.Begin(batch));
  part.arriving.PutNext(batch, part.whole.batch());  // as the watch has mended it
  trainee.learner->Begin(batch);
  return Status::Ok();
}

void Worker::Act(Trainees trainees, Rows rows) {
  bool everyone = true;
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    FindActing(b);
    everyone = everyone && parts_[b].acting.everyone();
  }
  const bool in_learners = rows == Rows::kLearners && everyone;
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    Part& part = parts_[b];
    if (rows == Rows::kLearners) {
      batches_[b] = trainees[b].learner->Stage(part.acting_ids);
      world_batches_[b] = in_learners ? batches_[b] : part.whole.batch();
    } else {
      part.whole.Advance();  // what came last is what is acted upon
      world_batches_[b] = part.whole.batch();
      batches_[b] = part.acting.PartOf(world_batches_[b]);
      part.acting.TakeObservations(world_batches_[b], batches_[b]);
      batches_[b].slots = part.acting_ids;
    }
    if (batches_[b].rows() > 0) trainees[b].learner->Act(batches_[b]);
    part.acting.PutActions(batches_[b], world_batches_[b]);
  }
}

Status Worker::Step(MoreSteps more) {
  return link_->Step(world_batches_, more);
}

Status Worker::TakeOutcome(Trainees trainees) {
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    const GatheredRows& acting = parts_[b].acting;
    acting.TakeOutcome(world_batches_[b], batches_[b]);
    if (batches_[b].rows() == 0) continue;
    CONSAC_RETURN_IF_ERROR(trainees[b].watch.Check(batches_[b], parts_[b].GoingOn(link_->present(b))));
    acting.PutNext(batches_[b], world_batches_[b]);  // as the watch has mended it
  }
  return Status::Ok();
}

Status Worker::Record(Trainees trainees) {
  ChooseParameters();
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    if (batches_[b].rows() > 0) trainees[b].learner->Record(batches_[b]);
    batches_[b] = {};  // what the learner had staged is its own again
    parts_[b].arriving.ChooseArrivals(link_->present(b), parts_[b].acting);
    CONSAC_RETURN_IF_ERROR(BeginArriving(parts_[b], trainees[b]));
  }
  return Status::Ok();
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
  next_parameters_ = parameters_;  // a copy, since a checkpoint may be saved meanwhile
  return BeginWorld(*next_link_, seed, next_parameters_);
}

void Worker::Adopt() {
  link_ = std::move(next_link_);
  parameters_ = std::move(next_parameters_);
}

}  // namespace consac::run
