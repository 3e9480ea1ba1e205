#pragma once
// A network with what belongs to learning it: parameters, the target network, which follows, what runs either,
// gradients and an optimiser. Private to learn.

#include <memory>
#include <utility>
#include <vector>

#include "collect/sliced_evaluator.h"
#include "consac/base/archive.h"
#include "consac/base/communicator.h"
#include "consac/base/executor.h"
#include "consac/learn/grad/backpropagation.h"
#include "consac/nn/activations.h"
#include "consac/nn/kernels.h"
#include "consac/nn/network.h"
#include "optim/gradient_step.h"

namespace consac::learn {

/// How it is learned and run.
struct LearnedNetworkOptions {
  std::int64_t run_rows = 1;    ///< most that are run at once
  std::int64_t batch_rows = 1;  ///< most of a minibatch
  AdamOptions adam;             ///< its optimiser
  double max_grad_norm = 0.0;   ///< gradients are clipped to this norm; 0: never
  std::int64_t extra = 0;       ///< parameters behind the network's: log standard deviations of actions
  float extra_initial = 0.0f;   ///< where those start
  bool clip_each = false;       ///< each tensor's gradient by itself, as Stable Baselines 2 does, instead of the whole
  Executor executor = {};       ///< parallel work; none: the calling thread
};

/// Stays where it was made. Parameters are packed when they are first run after a change.
class LearnedNetwork {
 public:
  /// Fresh parameters from the first rank's `rng`, the target's alike.
  LearnedNetwork(nn::Network network, Rng rng, const LearnedNetworkOptions& options, const Communicator& ranks = {})
      : network_(std::move(network)),
        run_rows_(options.run_rows),
        network_count_(static_cast<std::size_t>(network_.parameter_count())),
        parameters_(network_count_ + static_cast<std::size_t>(options.extra), options.extra_initial),
        executor_(options.executor),
        backpropagation_(network_, options.extra, options.batch_rows),
        evaluator_(network_, backpropagation_.packed(), options.run_rows, executor_),
        packed_target_(std::make_shared<nn::PackedNetwork>(network_)),
        target_evaluator_(network_, packed_target_, options.run_rows, executor_),
        step_(Optimiser(Adam(network_.parameter_count() + options.extra, options.adam)), options.max_grad_norm, ranks) {
    if (options.clip_each) step_.ClipEach(network_.parameters());
    network_.Initialise(rng, std::span(parameters_).first(network_count_));
    ranks.Broadcast(parameters_);
    target_ = parameters_;
  }
  LearnedNetwork(const LearnedNetwork&) = delete;
  LearnedNetwork& operator=(const LearnedNetwork&) = delete;

  /// The network.
  const nn::Network& network() const { return network_; }
  /// What its work is shared by.
  const Executor& executor() const { return executor_; }
  /// Most rows that are run at once.
  std::int64_t run_rows() const { return run_rows_; }
  /// [parameters], the extra ones behind the network's.
  std::span<const float> parameters() const { return parameters_; }
  /// [parameters of the network]
  std::span<const float> network_parameters() const { return parameters().first(network_count_); }
  /// [LearnedNetworkOptions::extra]
  std::span<const float> extra() const { return parameters().subspan(network_count_); }
  /// Other parameters from now on, for the target too; as many.
  void StartFrom(std::span<const float> parameters) {
    parameters_.assign(parameters.begin(), parameters.end());
    packed_ = false;
    UpdateTarget(1.0);
  }
  /// `change`(numbers) alters the parameters, [parameters], and the target's alike.
  template <class Change>
  void Alter(Change&& change) {
    for (std::vector<float>* of : {&parameters_, &target_}) change(std::span<float>(*of));
    packed_ = target_packed_ = false;
  }
  /// target = tau parameters + (1 - tau) target.
  void UpdateTarget(double tau) {
    nn::Polyak(static_cast<float>(tau), parameters_, target_);
    target_packed_ = false;
  }

  /// [parameters], packed: who else runs what packed() holds may do so until they change.
  std::span<const float> Loaded() {
    if (!std::exchange(packed_, true)) backpropagation_.Load(parameters_);
    return parameters_;
  }
  /// The parameters of the latest Loaded, Online or Gradient.
  std::shared_ptr<const nn::PackedNetwork> packed() const { return backpropagation_.packed(); }
  /// Runs the parameters of now.
  SlicedEvaluator& Online() {
    (void)Loaded();
    return evaluator_;
  }
  /// Runs the target's.
  SlicedEvaluator& Target() {
    if (!std::exchange(target_packed_, true))
      packed_target_->Load(std::span<const float>(target_).first(network_count_));
    return target_evaluator_;
  }
  /// The first output for features [rows, F]; until the same runs again.
  const float* Output(const float* features, std::int64_t rows) { return OutputOf(Online(), features, rows); }
  /// The target's.
  const float* TargetOutput(const float* features, std::int64_t rows) { return OutputOf(Target(), features, rows); }

  /// d loss / d parameters of a minibatch of `rows`.
  std::span<float> Gradient(std::int64_t rows, BlockLoss& loss) {
    (void)Loaded();
    backpropagation_.RunLoaded(rows, executor_, loss);
    return backpropagation_.gradient();
  }
  /// One step along it.
  void Step(std::span<float> gradient, float learning_rate) {
    step_.Apply(parameters_, gradient, learning_rate);
    packed_ = false;
    ++gradients_;
  }
  /// A round of gradient steps ends with update `update`: health, and a line where some were not finite.
  void FinishRound(std::int64_t update) {
    if (gradients_ > 0) step_.Finish(update, gradients_);
    step_.Begin();
    gradients_ = 0;
  }
  /// kNonFinite once a round had no finite gradient.
  const Status& health() const { return step_.health(); }

  /// Both networks' parameters, the optimiser, the round.
  void Visit(Archive& archive) {
    archive("parameters", std::span<float>(parameters_));
    archive("target", std::span<float>(target_));
    step_.Visit(archive);
    archive("gradients", gradients_);
    if (archive.loading()) packed_ = target_packed_ = false;
  }

 private:
  static const float* OutputOf(SlicedEvaluator& evaluator, const float* features, std::int64_t rows) {
    evaluator.Forward({&features, 1}, rows);
    return evaluator.output(0);
  }

  nn::Network network_;
  std::int64_t run_rows_;
  std::size_t network_count_;
  std::vector<float> parameters_, target_;  // [parameters]
  Executor executor_;
  Backpropagation backpropagation_;
  SlicedEvaluator evaluator_;  // runs what backpropagation_ packs
  std::shared_ptr<nn::PackedNetwork> packed_target_;
  SlicedEvaluator target_evaluator_;
  bool packed_ = false, target_packed_ = false;  // the parameters of now
  GradientStep step_;
  std::int64_t gradients_ = 0;  // of the round
};

}  // namespace consac::learn
