#pragma once
// Adam and RMSProp over one flat arena, in TensorFlow's and in PyTorch's form, with the global gradient clip folded
// into the same pass. The forms differ in where epsilon stands (and where RMSProp starts): it is visible in results.

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "consac/base/archive.h"

namespace consac::learn {

/// Whose formula. TensorFlow 1: Adam divides by (sqrt(v) + eps) with the bias correction in the step size; RMSProp
/// starts its mean square at 1 and adds eps inside the root. PyTorch: Adam adds eps after the bias-corrected root;
/// RMSProp starts at 0 and adds eps outside.
enum class OptimiserForm : std::uint8_t { kTensorFlow, kPyTorch };

/// Global L2 norm of a gradient, summed in a fixed order in float64.
double GlobalNorm(std::span<const float> gradient);
/// Factor that brings a gradient of this norm to at most `max_norm` (1 when it is within, or max_norm <= 0).
/// TensorFlow: max/max(norm, max). PyTorch: min(1, max / (norm + 1e-6)).
float ClipFactor(double norm, double max_norm, OptimiserForm form);

/// Settings of Adam.
struct AdamOptions {
  OptimiserForm form = OptimiserForm::kPyTorch;  ///< whose formula
  float beta1 = 0.9f;                            ///< decay of the first moment
  float beta2 = 0.999f;                          ///< decay of the second moment
  float epsilon = 1e-5f;                         ///< Stable Baselines' for PPO
};

/// Adam. Source: Kingma and Ba 2015, arXiv:1412.6980.
class Adam {
 public:
  /// For `size` parameters.
  Adam(std::int64_t size, const AdamOptions& options);
  /// One step: parameters -= step(learning_rate, gradient * gradient_scale). One pass, no allocation.
  void Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate, float gradient_scale);
  /// Whose formula.
  OptimiserForm form() const { return options_.form; }
  /// Moments and step count.
  void Visit(Archive& archive);

 private:
  AdamOptions options_;
  std::int64_t steps_ = 0;
  std::vector<float> m_, v_;  // [size]
};

/// Settings of RMSProp.
struct RmsPropOptions {
  OptimiserForm form = OptimiserForm::kTensorFlow;  ///< whose formula
  float decay = 0.99f;                              ///< of the mean square
  float momentum = 0.0f;                            ///< 0: none
  float epsilon = 1e-5f;                            ///< Stable Baselines' for A2C
};

/// RMSProp. Source: Tieleman and Hinton 2012, lecture 6.5.
class RmsProp {
 public:
  /// For `size` parameters.
  RmsProp(std::int64_t size, const RmsPropOptions& options);
  /// One step, as Adam::Step.
  void Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate, float gradient_scale);
  /// Whose formula.
  OptimiserForm form() const { return options_.form; }
  /// Mean square and momentum.
  void Visit(Archive& archive);

 private:
  RmsPropOptions options_;
  std::vector<float> mean_square_, momentum_;  // [size]
};

/// Either of them, for algorithms that leave the choice to their user.
class Optimiser {
 public:
  /// Takes `adam`.
  explicit Optimiser(Adam adam) : either_(std::move(adam)) {}
  /// Takes `rms_prop`.
  explicit Optimiser(RmsProp rms_prop) : either_(std::move(rms_prop)) {}
  /// One step, as Adam::Step.
  void Step(std::span<float> parameters, std::span<const float> gradient, float learning_rate, float gradient_scale);
  /// Whose formula.
  OptimiserForm form() const;
  /// "adam" or "rmsprop".
  std::string_view name() const { return either_.index() == 0 ? "adam" : "rmsprop"; }
  /// The state of the one that it is.
  void Visit(Archive& archive);

 private:
  std::variant<Adam, RmsProp> either_;
};

}  // namespace consac::learn
