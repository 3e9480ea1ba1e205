#include "frozen_player.h"

#include <algorithm>
#include <cstring>

#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/base/text.h"
#include "consac/env/buffer.h"
#include "consac/policy/policy.h"
#include "consac/run/actors.h"

namespace consac::run {
namespace {

/// See learner.h. What an agent sees last lies by slot until it acts upon it.
class FrozenPlayer final : public learn::Learner {
 public:
  FrozenPlayer(const BehaviourSpec& behaviour, Policy policy, std::uint64_t seed)
      : behaviour_(behaviour),
        policy_(std::move(policy)),
        rng_(seed, StreamId("frozen_player")),
        rows_(behaviour),
        seen_(static_cast<std::size_t>(behaviour.slots) * row_bytes()),
        masks_(static_cast<std::size_t>(behaviour.slots) * mask_bytes()),
        begins_(static_cast<std::size_t>(behaviour.slots), 1),
        acting_begins_(begins_.size()) {}

  Batch Stage(std::span<const std::int32_t> slots) override {
    Batch batch = rows_.batch();
    batch.slots = slots;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(slots[i]);
      std::memcpy(batch.observations + i * row_bytes(), seen_.data() + slot * row_bytes(), row_bytes());
      if (mask_bytes() > 0)
        std::memcpy(batch.action_masks + i * mask_bytes(), masks_.data() + slot * mask_bytes(), mask_bytes());
    }
    return batch;
  }
  void Begin(const Batch& batch) override {
    Keep(batch);
    for (const std::int32_t slot : batch.slots) begins_[static_cast<std::size_t>(slot)] = 1;
  }
  void Act(Batch& batch) override {
    for (std::size_t i = 0; i < batch.slots.size(); ++i)
      acting_begins_[i] = std::exchange(begins_[static_cast<std::size_t>(batch.slots[i])], std::uint8_t{0});
    policy_.Act({batch.observations, batch.action_masks, batch.rows(), batch.slots.data(), acting_begins_.data()},
                ActionMode::kSample, rng_, batch.actions);
  }
  void Record(const Batch& batch) override {
    Keep(batch);
    for (std::size_t i = 0; i < batch.slots.size(); ++i)
      begins_[static_cast<std::size_t>(batch.slots[i])] = batch.terminated[i] | batch.truncated[i];
    steps_ += batch.rows();
  }

  bool LearningDue() const override { return false; }
  bool Learn(const learn::LearnBudget&) override { return false; }
  std::int64_t steps() const override { return steps_; }
  std::int64_t updates() const override { return 0; }
  std::int64_t steps_per_update() const override { return 0; }
  Status StartFrom(const PolicyData&) override { return Status::Ok(); }
  void SetTotalSteps(std::int64_t) override {}
  std::span<const learn::Metric> metrics() const override { return {}; }
  Status health() const override { return Status::Ok(); }
  PolicyData Snapshot() const override {
    PolicyData data = policy_.data();
    data.behaviour = behaviour_.name;
    return data;
  }
  void Visit(Archive& archive) override {
    archive("seen", std::span<std::uint8_t>(seen_));
    archive("masks", std::span<std::uint8_t>(masks_));
    archive("begins", std::span<std::uint8_t>(begins_));
    archive("memory", policy_);
    archive("rng", rng_);
    archive("steps", steps_);
  }

 private:
  std::size_t row_bytes() const { return behaviour_.observation_layout.row_bytes; }
  std::size_t mask_bytes() const {
    return behaviour_.masks_actions ? static_cast<std::size_t>(behaviour_.action_layout.mask_bytes) : 0;
  }
  void Keep(const Batch& batch) {
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(batch.slots[i]);
      std::memcpy(seen_.data() + slot * row_bytes(), batch.next_observations + i * row_bytes(), row_bytes());
      if (mask_bytes() > 0)
        std::memcpy(masks_.data() + slot * mask_bytes(), batch.next_action_masks + i * mask_bytes(), mask_bytes());
    }
  }

  const BehaviourSpec behaviour_;
  Policy policy_;
  Rng rng_;
  BatchBuffer rows_;                         // of Stage
  std::vector<std::uint8_t> seen_, masks_;   // [N, row_bytes], [N, mask_bytes] what is acted upon next
  std::vector<std::uint8_t> begins_;         // [N] of the episode that goes on there
  std::vector<std::uint8_t> acting_begins_;  // [N] of a batch
  std::int64_t steps_ = 0;
};

/// Of the files that a model's name leads to, the behaviour's.
Result<std::string> FileOfBehaviour(const std::string& model, const std::string& behaviour,
                                    const std::string& directory) {
  const Result<std::vector<std::string>> files = FindModels(model, directory);
  if (!files.ok()) return files.status();
  if (files->size() == 1) return files->front();
  const std::string own = "/" + FileNameOf(behaviour, ".consac");
  for (const std::string& file : *files) {
    if (file.ends_with(own)) return file;
  }
  return Status{StatusCode::kNotFound, Quote(model) + " holds several models and none of behaviour " +
                                           Quote(behaviour) + "; name one of them"};
}

}  // namespace

Result<FrozenModels> ParseFrozen(std::string_view text) {
  FrozenModels models;
  while (!text.empty()) {
    const std::string_view part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(part.size() + 1, text.size()));
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || equals == 0 || equals + 1 == part.size()) {
      return Status{StatusCode::kInvalidArgument, "frozen = " + Quote(part) +
                                                      " cannot be used; expected a behaviour and its model, as "
                                                      "prey=runs/a/prey.consac, several with commas between"};
    }
    models[std::string(part.substr(0, equals))] = part.substr(equals + 1);
  }
  return models;
}

Result<FrozenModels> FrozenFilesOf(const RunConfig& config, const EnvSpec& spec) {
  Result<FrozenModels> models = ParseFrozen(config.frozen);
  if (!models.ok()) return models.status();
  std::vector<std::string_view> names;
  for (const BehaviourSpec& behaviour : spec.behaviours) names.push_back(behaviour.name);
  for (auto& [behaviour, model] : *models) {
    if (std::find(names.begin(), names.end(), behaviour) == names.end())
      return Status{StatusCode::kInvalidArgument,
                    "frozen: the world has no behaviour " + Quote(behaviour) + Suggestion(behaviour, names)};
    const std::string own =
        config.directory + "/" + FileNameOf(config.name, "") + "/" + FileNameOf(behaviour, ".consac");
    std::error_code ignored;
    const bool there = config.resume && std::filesystem::exists(ToPath(own), ignored);
    Result<std::string> file = FileOfBehaviour(there ? own : model, behaviour, config.directory);
    if (!file.ok()) return Status{file.status().code(), "frozen " + Quote(behaviour) + ": " + file.status().message()};
    model = std::move(*file);
  }
  if (!models->empty() && models->size() == names.size())
    return Status{StatusCode::kInvalidArgument, "every behaviour of the world is frozen, so nothing would be learned"};
  return models;
}

Result<std::unique_ptr<learn::Learner>> MakeFrozenPlayer(const std::string& file, const BehaviourSpec& behaviour,
                                                         std::uint64_t seed) {
  Result<Policy> policy = Policy::Load(file, behaviour.slots);
  if (!policy.ok()) return policy.status();
  if (const Status fits = policy->Fits(behaviour); !fits.ok())
    return Status{fits.code(), "'" + file + "' cannot act for " + Quote(behaviour.name) + ": " + fits.message()};
  return std::unique_ptr<learn::Learner>(std::make_unique<FrozenPlayer>(behaviour, std::move(*policy), seed));
}

}  // namespace consac::run
