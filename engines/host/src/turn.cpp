#include "turn.h"

namespace consac::host {
namespace {

constexpr double kMeterWindow = 1.0;  // s

}  // namespace

Turn::Turn(TickWorld& world) : world_(world) {
  for (const BehaviourSpec& behaviour : world.spec().behaviours) {
    buffers_.emplace_back(behaviour);
    acting_.emplace_back(behaviour);
    arriving_.emplace_back(behaviour);
    episodes_.emplace_back(behaviour.slots);
  }
  for (BatchBuffer& buffer : buffers_) whole_.push_back(buffer.batch());
  parts_ = arrived_ = whole_;
  begins_.resize(whole_.size());
}

void Turn::Reset(std::uint64_t seed) {
  for (EpisodeBegins& episodes : episodes_) episodes.Restart();
  SetDefaultParameters(world_);  // whatever was set by who drove before
  world_.Reset(seed, whole_);
}

Batch& Turn::First(std::size_t b) {
  acting_[b].ChoosePresent(world_.present(b));
  parts_[b] = acting_[b].PartOf(whole_[b]);
  acting_[b].TakeNext(whole_[b], parts_[b]);
  return parts_[b];
}

Batch& Turn::ToAct(std::size_t b) {
  buffers_[b].Advance();
  whole_[b] = buffers_[b].batch();
  acting_[b].ChoosePresent(world_.present(b));
  parts_[b] = acting_[b].PartOf(whole_[b]);
  acting_[b].TakeObservations(whole_[b], parts_[b]);
  begins_[b] = episodes_[b].Next(whole_[b], acting_[b].slots());
  return parts_[b];
}

ActRows Turn::RowsOf(std::size_t b) const {
  const Batch& part = parts_[b];
  return {part.observations, part.action_masks, part.rows(), acting_[b].slots().data(), begins_[b].data()};
}

void Turn::Step() {
  for (std::size_t b = 0; b < whole_.size(); ++b) acting_[b].PutActions(parts_[b], whole_[b]);
  (void)TakeNoted();
  world_.Step(whole_);
}

std::span<const Statistic> Turn::TakeNoted() {
  noted_.clear();
  world_.TakeStatistics(&noted_);
  return noted_;
}

Batch& Turn::Outcome(std::size_t b) {
  acting_[b].TakeOutcome(whole_[b], parts_[b]);
  return parts_[b];
}

Batch& Turn::Arrived(std::size_t b) {
  arriving_[b].ChooseArrivals(world_.present(b), acting_[b]);
  arrived_[b] = arriving_[b].PartOf(whole_[b]);
  arriving_[b].TakeNext(whole_[b], arrived_[b]);
  return arrived_[b];
}

void Meter::Note(std::int64_t steps, double began) {
  const double now = Now();
  poll_ms_ = (now - began) * 1e3;
  if (since_ == 0.0) since_ = began;
  if (now - since_ < kMeterWindow) return;
  per_s_ = static_cast<double>(steps - steps_) / (now - since_);
  since_ = now;
  steps_ = steps;
}

}  // namespace consac::host
