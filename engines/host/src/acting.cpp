// A trained model drives the world, or the host itself.
#include "consac/policy/policy.h"
#include "learning_thread.h"
#include "turn.h"

namespace consac::host {
namespace {

class ActingDriver final : public Driver {
 public:
  /// No policies: the host writes the actions.
  ActingDriver(TickWorld& world, std::vector<Policy> policies, const ActOptions& options)
      : world_(world),
        turn_(world),
        policies_(std::move(policies)),
        options_(options),
        rng_(options.seed, StreamId("acting")),
        asked_(world.spec().behaviours.size()) {}

  /// The thread that the models compute on, where they have one.
  Status Begin() { return options_.pipelined ? thread_.Start() : Status::Ok(); }

  Status Poll(double) override {
    if (!world_.settled()) return Status::Ok();
    const double began = Now();
    if (!begun_) {
      begun_ = true;
      turn_.Reset(options_.seed);
      return Status::Ok();
    }
    if (thinking_) {
      thread_.Await();
      thinking_ = false;
    } else {
      for (std::size_t b = 0; b < asked_.size(); ++b) asked_[b] = &turn_.ToAct(b);
      if (options_.pipelined) {
        thinking_ = true;
        thread_.Begin([this] { Think(); });
        return Status::Ok();
      }
      Think();
    }
    turn_.Step();
    meter_.Note(world_.tally().steps, began);
    return Status::Ok();
  }

  bool finished() const override { return false; }

  Progress progress() const override {
    Progress progress;
    progress.state = policies_.empty() ? "played by hand" : "acting by a model";
    progress.tally = world_.tally();
    progress.steps = progress.tally.steps;
    meter_.Tell(&progress);
    return progress;
  }

  Result<ModelFile> Model(std::size_t b) const override {
    if (b >= policies_.size()) return Driver::Model(b);
    return policies_[b].ToFile();
  }

 private:
  /// What every behaviour is to do. Touches nothing of the world: the rows are the turn's own.
  void Think() {
    for (std::size_t b = 0; b < policies_.size(); ++b) {
      if (asked_[b]->rows() > 0) policies_[b].Act(turn_.RowsOf(b), options_.mode, rng_, asked_[b]->actions);
    }
  }

  TickWorld& world_;
  Turn turn_;
  std::vector<Policy> policies_;
  const ActOptions options_;
  Rng rng_;
  std::vector<Batch*> asked_;  // [behaviours] the turn's
  bool begun_ = false;
  bool thinking_ = false;  // the thread has the turn and the models
  Meter meter_;
  LearningThread thread_;  // last: its job uses what is above
};

/// `load` gives the policy of behaviour b.
template <class Load>
Result<std::unique_ptr<Driver>> ActByPolicies(TickWorld& world, std::size_t models, const ActOptions& options,
                                              const Load& load) {
  CONSAC_RETURN_IF_ERROR(world.EveryoneJoined());
  const std::vector<BehaviourSpec>& behaviours = world.spec().behaviours;
  if (models != behaviours.size()) {
    return Status{
        StatusCode::kInvalidArgument,
        std::to_string(models) + " models for " + std::to_string(behaviours.size()) + " behaviours; give one for each"};
  }
  std::vector<Policy> policies;
  for (std::size_t b = 0; b < behaviours.size(); ++b) {
    Result<Policy> policy = load(b, static_cast<std::int64_t>(behaviours[b].slots));
    Status fits = policy.ok() ? policy->Fits(behaviours[b]) : policy.status();
    if (fits.ok() && behaviours.size() > 1 && policy->data().behaviour != behaviours[b].name)
      fits = {StatusCode::kInvalidArgument, "it was learned for behaviour '" + policy->data().behaviour + "'"};
    if (!fits.ok())
      return Status{fits.code(), "the model of behaviour '" + behaviours[b].name + "': " + fits.message()};
    policies.push_back(std::move(*policy));
  }
  auto driver = std::make_unique<ActingDriver>(world, std::move(policies), options);
  CONSAC_RETURN_IF_ERROR(driver->Begin());
  return std::unique_ptr<Driver>(std::move(driver));
}

}  // namespace

Result<std::unique_ptr<Driver>> Act(TickWorld& world, const ActOptions& options) {
  return ActByPolicies(world, options.models.size(), options,
                       [&](std::size_t b, std::int64_t rows) { return Policy::Load(options.models[b], rows); });
}

Result<std::unique_ptr<Driver>> Act(TickWorld& world, std::span<const std::vector<std::byte>> models,
                                    const ActOptions& options) {
  return ActByPolicies(world, models.size(), options,
                       [&](std::size_t b, std::int64_t rows) { return Policy::FromBytes(models[b], rows); });
}

std::unique_ptr<Driver> ByHand(TickWorld& world, std::uint64_t seed) {
  ActOptions options;
  options.seed = seed;
  return std::make_unique<ActingDriver>(world, std::vector<Policy>(), options);
}

}  // namespace consac::host
