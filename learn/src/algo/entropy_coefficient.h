#pragma once
// SAC's weight of the entropy: how ent_coef and target_entropy are written, and the coefficient that follows the
// target. Private to learn.

#include <cmath>
#include <string_view>

#include "consac/base/text.h"
#include "optim/gradient_step.h"

namespace consac::learn {

/// ent_coef: "auto", "auto_0.1" or a number.
struct EntropyCoefficientOptions {
  bool learned = true;   ///< it follows the target entropy
  double initial = 1.0;  ///< where it starts, or stays

  /// "auto" starts at 1, "auto_X" at X > 0; a number stays.
  static Result<EntropyCoefficientOptions> Parse(std::string_view text) {
    EntropyCoefficientOptions result;
    if (text == "auto") return result;
    constexpr std::string_view kFrom = "auto_";
    result.learned = text.starts_with(kFrom);
    const std::string_view number = result.learned ? text.substr(kFrom.size()) : text;
    const bool usable = ParseNumber(number, &result.initial) && result.initial >= (result.learned ? 1e-30 : 0.0);
    if (usable) return result;
    return Status{
        StatusCode::kInvalidArgument,
        "= " + Quote(text) + " cannot be used; expected auto, auto_0.1 to start at 0.1, or a number from 0 on"};
  }
};

/// target_entropy: "auto" or a number.
struct TargetEntropy {
  bool automatic = true;  ///< minus the number of the action's elements
  double value = 0.0;     ///< otherwise

  /// Of actions of `size` elements. Source: Haarnoja et al. 2018, arXiv:1812.05905, appendix D.
  double Of(std::int64_t size) const { return automatic ? -static_cast<double>(size) : value; }

  /// "auto" or a number.
  static Result<TargetEntropy> Parse(std::string_view text) {
    TargetEntropy result;
    if (text == "auto") return result;
    result.automatic = false;
    if (ParseNumber(text, &result.value)) return result;
    return Status{StatusCode::kInvalidArgument, "= " + Quote(text) + " cannot be used; expected auto or a number"};
  }
};

/// The coefficient: exp of a parameter with an optimiser of its own, or a constant.
class EntropyCoefficient {
 public:
  /// As the options say.
  EntropyCoefficient(const EntropyCoefficientOptions& options, const AdamOptions& adam, const Communicator& ranks)
      : options_(options),
        log_{static_cast<float>(options.learned ? std::log(options.initial) : 0.0)},
        step_(Optimiser(Adam(1, adam)), 0.0, ranks) {}

  /// Whether it follows the target.
  bool learned() const { return options_.learned; }
  /// The coefficient.
  float coefficient() const { return options_.learned ? std::exp(log_[0]) : static_cast<float>(options_.initial); }
  /// Its loss for a mean of log pi + target entropy: -log coefficient times that.
  double Loss(double mean) const { return -static_cast<double>(log_[0]) * mean; }
  /// One step down that loss; `mean` is this rank's share of the mean over all rows.
  void Step(double mean, float learning_rate) {
    float gradient[] = {static_cast<float>(-mean)};
    if (!options_.learned) return;
    step_.Apply(log_, gradient, learning_rate);
    ++steps_;
  }

  /// As LearnedNetwork's.
  void FinishRound(std::int64_t update) {
    if (steps_ > 0) step_.Finish(update, steps_);
    step_.Begin();
    steps_ = 0;
  }
  /// As LearnedNetwork's.
  const Status& health() const { return step_.health(); }
  /// Parameter and optimiser.
  void Visit(Archive& archive) {
    archive("log_ent_coef", std::span<float>(log_));
    step_.Visit(archive);
    archive("steps", steps_);
  }

 private:
  EntropyCoefficientOptions options_;
  float log_[1];
  GradientStep step_;
  std::int64_t steps_ = 0;  // of the round
};

}  // namespace consac::learn
