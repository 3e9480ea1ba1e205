#pragma once
// One world of a run at work: which slots of the learners are its, and the rows of the step that it is taking. Agents
// may come and go; a world that fails can be connected anew. Private to run.

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "consac/env/buffer.h"
#include "consac/env/gathered.h"
#include "environment_parameters.h"
#include "link.h"
#include "trainee.h"

namespace consac::run {

/// One per behaviour, in the world's order.
using Trainees = std::span<Trainee>;

/// Whose memory a step is taken in: the learner's own, without copies where every agent is there, or the worker's, so
/// that several may step at once and the learner may learn meanwhile. A worker's steps are all of one kind.
enum class Rows : std::uint8_t { kLearners, kOwn };

/// A world and its slots.
class Worker {
 public:
  /// Connects anew; null: cannot be done.
  using Connect = std::function<Result<std::unique_ptr<WorldLink>>()>;

  /// `first_slots[b]` is the learner's slot of the world's slot 0 of behaviour b.
  Worker(std::unique_ptr<WorldLink> link, std::vector<std::int32_t> first_slots, Connect connect);

  /// The world.
  WorldLink& link() { return *link_; }

  /// The world's parameters are chosen by these from now on.
  void UseParameters(const EnvironmentParameters& parameters) { parameters_.emplace(parameters); }
  /// Their exact state under `name`; nothing without.
  void VisitParameters(std::string_view name, Archive& archive) {
    if (parameters_.has_value()) archive(name, *parameters_);
  }

  /// The world afresh; the learners hear of it by Begin.
  Status Reset(std::uint64_t seed);
  /// Every agent that is there begins an episode. An error where its observation is none.
  Status Begin(Trainees trainees);
  /// Chooses the actions of every agent that is there.
  void Act(Trainees trainees, Rows rows);
  /// Takes the step. Touches no learner, unless the step is taken in its memory.
  Status Step(MoreSteps more);
  /// Looks at what came of it; batches() then hold it, until Record. An error where it cannot be learned from.
  Status TakeOutcome(Trainees trainees);
  /// Tells the learners what came of it, and which agents came. An error where these cannot be learned from.
  Status Record(Trainees trainees);
  /// A new connection after a failure, and the world afresh. Nothing else changes until Adopt, so that it may be called
  /// on another thread.
  Status ConnectAnew(std::uint64_t seed);
  /// The new connection takes the place of the old one; agents that were there are gone.
  void Adopt();

  /// Agents that are taking the present step; none once it is recorded.
  std::int64_t rows() const;
  /// The present step, one batch per behaviour, with the learners' slots; empty once it is recorded.
  std::span<const Batch> batches() const { return batches_; }
  /// The learner's slots of behaviour `b` that are this world's.
  std::span<const std::int32_t> slots(std::size_t b) const { return parts_[b].ids; }
  /// Which part of the latest Step's time the world itself worked, 0 to 1.
  double world_share() const { return link_->world_share(); }

 private:
  /// What one behaviour needs.
  struct Part {
    Part(const BehaviourSpec& behaviour, std::int32_t first_slot);
    const BehaviourSpec spec;
    std::vector<std::int32_t> ids;                       // [slots] the learner's
    BatchBuffer whole;                                   // every slot of the world
    GatheredRows acting, arriving;                       // those that take the present step; those whose agents begin
    std::vector<std::int32_t> acting_ids, arriving_ids;  // the same as the learner's
    /// The learner's names of `rows`, into `to`.
    std::span<const std::int32_t> Named(const GatheredRows& rows, std::vector<std::int32_t>* to) const;
    std::vector<std::uint8_t> goes_on;  // [acting] takes the next step too
    /// That, by who is present after the step; empty: all do.
    std::span<const std::uint8_t> GoingOn(std::span<const std::uint8_t> present);
  };

  Status BeginWorld(WorldLink& link, std::uint64_t seed, std::optional<EnvironmentParameters>& parameters);
  void FindActing(std::size_t b);
  /// Parameters of the episodes behind those that have just begun.
  void ChooseParameters();
  static Status BeginArriving(Part& part, Trainee& trainee);

  std::unique_ptr<WorldLink> link_, next_link_;
  const Connect connect_;
  std::optional<EnvironmentParameters> parameters_, next_parameters_;
  std::vector<std::uint8_t> began_;  // [environments]
  std::vector<Part> parts_;
  std::vector<Batch> batches_;        // as the learners see the step
  std::vector<Batch> world_batches_;  // as the world does
};

}  // namespace consac::run
