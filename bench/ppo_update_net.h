#pragma once
// The PPO minibatch update that the benches time: two separate tanh towers, observation 4, two actions, clipped
// surrogate + 0.5 value error - 0.01 entropy, gradient clipped at 0.5, Adam. Synthetic data; nothing is learned.

#include <cmath>
#include <cstring>
#include <vector>

#include "consac/base/hooks.h"
#include "consac/learn/grad/backpropagation.h"
#include "consac/learn/optim/optimiser.h"
#include "consac/nn/net_arch.h"

namespace consac::bench {

/// One minibatch of rollout data and its loss.
class PpoMinibatch final : public learn::BlockLoss {
 public:
  explicit PpoMinibatch(std::int64_t row_count) : rows(row_count) {
    Rng rng(1, StreamId("bench"));
    for (std::int64_t i = 0; i < rows; ++i) {
      for (int k = 0; k < 4; ++k) observations.push_back(rng.Normal());
      actions.push_back(static_cast<int>(rng.Below(2)));
      old_log_probability.push_back(-0.7f + 0.05f * rng.Normal());
      advantage.push_back(rng.Normal());
      returns.push_back(rng.Normal());
    }
  }

  void Gather(const learn::LossBlock& block) override {
    std::memcpy(block.inputs[0], observations.data() + block.first_row * 4,
                static_cast<std::size_t>(block.rows) * 4 * sizeof(float));
  }

  void Loss(const learn::LossBlock& block) override {
    const float share = 1.0f / static_cast<float>(rows);
    for (std::int64_t r = 0; r < block.rows; ++r) {
      const auto i = static_cast<std::size_t>(block.first_row + r);
      const float* logits = block.outputs[0] + 2 * r;
      const float top = logits[0] > logits[1] ? logits[0] : logits[1];
      const float e[2] = {std::exp(logits[0] - top), std::exp(logits[1] - top)};
      const float sum = e[0] + e[1];
      const float log_sum = std::log(sum);
      const float p[2] = {e[0] / sum, e[1] / sum};
      const float log_p[2] = {logits[0] - top - log_sum, logits[1] - top - log_sum};
      const float ratio = std::exp(log_p[actions[i]] - old_log_probability[i]);
      const bool clipped = advantage[i] > 0 ? ratio > 1.2f : ratio < 0.8f;
      const float d_log_p = clipped ? 0.0f : -advantage[i] * ratio;
      const float entropy = -(p[0] * log_p[0] + p[1] * log_p[1]);
      for (int k = 0; k < 2; ++k) {
        const float picked = k == actions[i] ? 1.0f : 0.0f;
        block.output_gradients[0][2 * r + k] =
            share * (d_log_p * (picked - p[k]) + 0.01f * p[k] * (log_p[k] + entropy));
      }
      block.output_gradients[1][r] = share * (block.outputs[1][r] - returns[i]);
    }
  }

  std::int64_t rows;
  std::vector<float> observations, old_log_probability, advantage, returns;
  std::vector<int> actions;
};

/// The two towers and everything an update needs.
class PpoUpdate {
 public:
  PpoUpdate(std::int64_t width, std::int64_t rows)
      : network(Towers(width)),
        minibatch(rows),
        backpropagation(network, 0, rows),
        adam(network.parameter_count(), {}) {
    parameters.resize(static_cast<std::size_t>(network.parameter_count()));
    Rng rng(2, StreamId("bench"));
    network.Initialise(rng, parameters);
  }

  static nn::Network Towers(std::int64_t width) {
    nn::ActorCriticOptions options;
    options.arch = {{}, {width, width}, {width, width}};
    options.observation_size = 4;
    options.action_size = 2;
    Result<nn::Network> created = nn::Network::Create(nn::ActorCritic(options));
    return *std::move(created);
  }

  /// Multiply-adds count two; forward, weight gradients, input gradients of all but the first layers.
  double FlopsPerSample() const {
    double flops = 0.0;
    for (const nn::Block& block : network.spec().blocks) {
      flops += (block.inputs[0] == "obs" ? 4.0 : 6.0) * static_cast<double>(block.in_size * block.out_size);
    }
    return flops;
  }

  void Run(const Executor& executor = {}) {
    backpropagation.Run(parameters, minibatch.rows, executor, minibatch);
    const double norm = learn::GlobalNorm(backpropagation.gradient());
    adam.Step(parameters, backpropagation.gradient(), 3e-4f,
              learn::ClipFactor(norm, 0.5, learn::OptimiserForm::kPyTorch));
  }

  nn::Network network;
  PpoMinibatch minibatch;
  learn::Backpropagation backpropagation;
  learn::Adam adam;
  std::vector<float> parameters;
};

}  // namespace consac::bench
