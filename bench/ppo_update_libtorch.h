#pragma once
// The same PPO update in LibTorch, written as its users write it: modules, autograd, torch::optim::Adam, one thread.

#include <torch/torch.h>

#include "bench/ppo_update_net.h"

namespace consac::bench {

/// Counterpart of PpoUpdate, on the same synthetic data.
class TorchPpoUpdate {
 public:
  TorchPpoUpdate(std::int64_t width, std::int64_t rows)
      : data_(rows),
        actor_(Tower(width, 2)),
        critic_(Tower(width, 1)),
        optimiser_(Parameters(), torch::optim::AdamOptions(3e-4).eps(1e-5)) {
    torch::set_num_threads(1);
    observations_ = torch::tensor(data_.observations).reshape({rows, 4});
    old_log_probability_ = torch::tensor(data_.old_log_probability);
    advantage_ = torch::tensor(data_.advantage);
    returns_ = torch::tensor(data_.returns);
    actions_ = torch::tensor(data_.actions).to(torch::kInt64).reshape({rows, 1});
  }

  void Run() {
    const torch::Tensor log_p = torch::log_softmax(actor_->forward(observations_), 1);
    const torch::Tensor value = critic_->forward(observations_).squeeze(1);
    const torch::Tensor ratio = (log_p.gather(1, actions_).squeeze(1) - old_log_probability_).exp();
    const torch::Tensor surrogate = torch::min(ratio * advantage_, ratio.clamp(0.8, 1.2) * advantage_).mean();
    const torch::Tensor entropy = -(log_p.exp() * log_p).sum(1).mean();
    const torch::Tensor loss = -surrogate + 0.5 * (value - returns_).square().mean() - 0.01 * entropy;
    optimiser_.zero_grad();
    loss.backward();
    torch::nn::utils::clip_grad_norm_(Parameters(), 0.5);
    optimiser_.step();
  }

 private:
  static torch::nn::Sequential Tower(std::int64_t width, std::int64_t out) {
    return torch::nn::Sequential(torch::nn::Linear(4, width), torch::nn::Tanh(), torch::nn::Linear(width, width),
                                 torch::nn::Tanh(), torch::nn::Linear(width, out));
  }
  std::vector<torch::Tensor> Parameters() {
    std::vector<torch::Tensor> all = actor_->parameters();
    for (const torch::Tensor& parameter : critic_->parameters()) all.push_back(parameter);
    return all;
  }

  PpoMinibatch data_;
  torch::nn::Sequential actor_, critic_;
  torch::optim::Adam optimiser_;
  torch::Tensor observations_, old_log_probability_, advantage_, returns_, actions_;
};

}  // namespace consac::bench
