#pragma once
// What every learner from a replay says of itself in the same words: it collects, counts, reports and hands out its
// model. How one acts and learns is its own file's. Private to learn.

#include <string>
#include <utility>
#include <vector>

#include "algo/training_json.h"
#include "collect/learned_network.h"
#include "collect/replay_collector.h"
#include "consac/learn/algo/learner.h"

namespace consac::learn {

/// A complete acting model: `acts` with what `collector` normalises; `training_json` is told to people.
PolicyData ActingModel(const BehaviourSpec& behaviour, const ReplayCollector& collector, const LearnedNetwork& acts,
                       std::string training_json);
/// Takes over a model's normaliser, and its parameters where its network is that of `acts`; the error says that it is
/// another.
Status StartActingFrom(const PolicyData& model, ReplayCollector* collector, LearnedNetwork* acts);

/// See learner.h. An update is one gradient step. `Collector`: ReplayCollector, or ContinuousCollector.
template <class Collector>
class OffPolicyLearner : public Learner {
 public:
  // Collecting: collect/replay_collector.h.
  Batch Stage(std::span<const std::int32_t> slots) override { return collector_.Stage(slots); }
  void Begin(const Batch& batch) override { collector_.Begin(batch); }
  void Record(const Batch& batch) override {
    const std::int64_t before = reports();
    collector_.Record(batch);
    if (reports() != before) WriteMetrics();
  }
  bool LearningDue() const override { return collector_.due() > 0; }

  std::int64_t steps() const override { return collector_.steps(); }
  std::int64_t updates() const override { return updates_; }
  std::int64_t reports() const override { return collector_.episodes().count() / report_every_; }
  std::int64_t steps_per_update() const override { return 0; }
  std::int64_t memory_bytes() const override { return collector_.memory_bytes(); }
  void SetTotalSteps(std::int64_t total_steps) override { total_steps_ = total_steps; }
  std::span<const Metric> metrics() const override { return metrics_; }
  /// What they list, besides what the algorithm does.
  void Visit(Archive& archive) override {
    collector_.Visit(archive);
    archive("learning_rate", learning_rate_);
    archive("updates", updates_);
  }

 protected:
  /// Reports after every `report_every` episodes; `hyperparameters` is JSON, for the model file; `collecting` is what
  /// the collector takes behind its behaviour.
  template <class... Collecting>
  OffPolicyLearner(const LearnerOptions& options, std::string hyperparameters, std::int64_t report_every,
                   Collecting&&... collecting)
      : behaviour_(options.behaviour),
        executor_(options.executor),
        total_steps_(options.total_steps),
        collector_(behaviour_, std::forward<Collecting>(collecting)...),
        hyperparameters_(std::move(hyperparameters)),
        report_every_(report_every) {
    metrics_.reserve(16);
  }

  /// Replaces `metrics_` by those of now.
  virtual void WriteMetrics() = 0;
  /// How actions follow from the network that acts.
  const ActionHead& head() const { return collector_.action_head(); }
  /// Episodes that have ended, for each agent.
  std::int64_t episodes_each() const { return collector_.episodes().count() / behaviour_.slots; }
  /// Learner::Snapshot of one that acts by `acts`.
  PolicyData SnapshotOf(const LearnedNetwork& acts) const {
    return ActingModel(behaviour_, collector_, acts, TrainingJson(hyperparameters_, steps(), updates_));
  }

  const BehaviourSpec behaviour_;
  const Executor executor_;
  std::int64_t total_steps_;
  Collector collector_;
  float learning_rate_ = 0;  // of the latest update
  std::int64_t updates_ = 0;
  std::vector<Metric> metrics_;

 private:
  const std::string hyperparameters_;
  const std::int64_t report_every_;
};

}  // namespace consac::learn
