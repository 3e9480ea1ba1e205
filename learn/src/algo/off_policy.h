#pragma once
// What off-policy algorithms share besides their pieces: options with the rows that fill them, and what must hold
// before a learner is made. Each algorithm lists the rows that it has, with its own defaults. Private to learn.

#include "algo/normalise_rows.h"
#include "algo/parameter_rows.h"
#include "algo/training_json.h"
#include "collect/replay_collector.h"
#include "consac/learn/algo/learner.h"

namespace consac::learn {

/// A step size after `steps` of `total_steps` steps.
float RateAt(const Schedule& rate, std::int64_t steps, std::int64_t total_steps);

/// Options of every algorithm that learns from a replay.
struct OffPolicyOptions {
  ReplayCollectorOptions collect;           ///< how it collects
  Schedule learning_rate;                   ///< of the optimiser
  std::int64_t batch_size = 32;             ///< transitions of a gradient step
  std::int64_t n_steps = 1;                 ///< steps that a target looks ahead
  double tau = 1.0;                         ///< share of the target network that an update replaces
  std::int64_t target_update_interval = 1;  ///< agent steps between those
  double prioritized_beta0 = 0.4;           ///< exponent of the weights of a prioritised replay at the start
  std::int64_t prioritized_beta_steps = 0;  ///< agent steps until it is 1; 0: the whole training
  Generation log_keys = Generation::kStableBaselines3;  ///< whose names the metrics have

  /// The step size after `steps` of `total_steps` steps.
  float LearningRateAt(std::int64_t steps, std::int64_t total_steps) const {
    return RateAt(learning_rate, steps, total_steps);
  }
  /// The exponent after `steps` of `total_steps` steps.
  double BetaAt(std::int64_t steps, std::int64_t total_steps) const;
};

/// The rows of OffPolicyOptions. Defaults are DQN's unless an algorithm has others.
namespace off_policy_rows {
using O = OffPolicyOptions;
using C = ReplayCollectorOptions;
using enum ParameterSource;
using Row = ParameterRow<OffPolicyOptions>;

inline constexpr Row kGamma = {
    "gamma", "gamma", Into<O, &O::collect, &C::gamma>, "0.99", "0.99", 0, 1, "", "discount per step", kBoth};
inline constexpr Row kLearningRate = {"learning_rate",
                                      "learning_rate",
                                      Into<O, &O::learning_rate>,
                                      "5e-4",
                                      "1e-4",
                                      0,
                                      kUnlimited,
                                      "",
                                      "the optimiser's step size",
                                      kBoth};
inline constexpr Row kReplay[] = {
    {"buffer_size", "buffer_size", Into<O, &O::collect, &C::replay, &ReplayOptions::capacity>, "50000", "1000000", 1,
     1e9, "", "transitions that are remembered, of all agents together", kBoth},
    {"learning_starts", "learning_starts", Into<O, &O::collect, &C::learning_starts>, "1000", "100", 0, 1e9, "",
     "agent steps before the first gradient", kBoth},
    {"batch_size", "batch_size", Into<O, &O::batch_size>, "32", "32", 1, 1e6, "", "transitions of a gradient step",
     kBoth},
    {"n_steps", "n_steps", Into<O, &O::n_steps>, "1", "1", 1, 1e6, "", "steps that a target looks ahead", kSb3},
};
inline constexpr Row kTrainFreq = {
    "train_freq", "train_freq", Into<O, &O::collect, &C::train_freq>,
    "1",          "4",          1,
    1e9,          "",           "steps of each agent, or episodes, between rounds of learning",
    kBoth};
inline constexpr Row kRounds[] = {
    {"train_freq_unit", "train_freq_unit", Into<O, &O::collect, &C::train_freq_unit>, "step", "step", 0, 0,
     "step|episode", "what train_freq counts", kSb3},
    {"gradient_steps", "gradient_steps", Into<O, &O::collect, &C::gradient_steps>, "1", "1", -1, 1e9, "",
     "of each round; -1: one for every transition since the last", kSb3},
};
inline constexpr Row kTruncation = {"truncation",
                                    "truncation",
                                    Into<O, &O::collect, &C::truncation>,
                                    "bootstrap",
                                    "bootstrap",
                                    0,
                                    0,
                                    "bootstrap|terminal",
                                    "a cut episode goes on in the value estimate (SB3), or counts as ended (SB2)",
                                    kConsac};
inline constexpr Row kTau = {
    "tau", "tau", Into<O, &O::tau>, "1", "1", 0, 1, "", "share of the target network that an update replaces", kSb3};
inline constexpr Row kPrioritized[] = {
    {"prioritized_replay", "prioritized_replay", Into<O, &O::collect, &C::replay, &ReplayOptions::prioritised>, "false",
     "false", 0, 0, "", "draw by how wrong the values were", kSb2},
    {"prioritized_replay_alpha", "prioritized_replay_alpha",
     Into<O, &O::collect, &C::replay, &ReplayOptions::priority, &PriorityOptions::alpha>, "0.6", "0.6", 0, 10, "",
     "exponent of the priorities", kSb2},
    {"prioritized_replay_beta0", "prioritized_replay_beta0", Into<O, &O::prioritized_beta0>, "0.4", "0.4", 0, 1, "",
     "exponent of the weights that make up for it, at the start", kSb2},
    {"prioritized_replay_beta_iters", "prioritized_replay_beta_iters", Into<O, &O::prioritized_beta_steps>, "none",
     "none", 1, 1e9, "none", "agent steps until that is 1; none: all of the training", kSb2},
    {"prioritized_replay_eps", "prioritized_replay_eps",
     Into<O, &O::collect, &C::replay, &ReplayOptions::priority, &PriorityOptions::epsilon>, "1e-6", "1e-6", 1e-30, 1,
     "", "added to every error that becomes a priority", kSb2},
};
inline constexpr Row kLogKeys = {"log_keys", "log_keys", Into<O, &O::log_keys>,       "sb2",  "sb3", 0,
                                 0,          "sb2|sb3",  "whose names the logs have", kConsac};
inline constexpr Row kHer[] = {
    {"replay_buffer_class", "replay_buffer_class", Into<O, &O::collect, &C::hindsight, &HindsightOptions::buffer>,
     "ReplayBuffer", "ReplayBuffer", 0, 0, "ReplayBuffer|HerReplayBuffer",
     "draw what is remembered as it was, or also as if other goals had been meant (HER)", kSb3},
    {"n_sampled_goal", "n_sampled_goal", Into<O, &O::collect, &C::hindsight, &HindsightOptions::n_sampled_goal>, "4",
     "4", 0, 1e6, "", "HER: transitions drawn with another goal for each with its own", kBoth},
    {"goal_selection_strategy", "goal_selection_strategy",
     Into<O, &O::collect, &C::hindsight, &HindsightOptions::strategy>, "future", "future", 0, 0,
     "future|final|episode|random", "HER: whose goal, of later in the episode, its end, any of it, any episode", kBoth},
    {"her_form", "her_form", Into<O, &O::collect, &C::hindsight, &HindsightOptions::form>, "sb2", "sb3", 0, 0,
     "sb2|sb3", "HER: goals from before a step and no ends (SB2), or from after it and ends as they were (SB3)",
     kConsac},
};
inline constexpr auto& kNormalise = kNormaliseRows<O, &O::collect, &C::normalise>;
}  // namespace off_policy_rows

/// Makes what HerReplayBuffer needs ready where `own` asks for it; the error says what it cannot be had with.
Status TakeHindsight(const LearnerOptions& options, OffPolicyOptions* own);
/// Fills what the rows of `groups` name, with that; the error names the parameter.
template <class Groups, class Options>
Status ReadOffPolicyRows(const Groups& groups, const HyperparameterSet& values, const LearnerOptions& options,
                         Options* own) {
  CONSAC_RETURN_IF_ERROR(ReadRows(groups, values, own));
  CONSAC_RETURN_IF_ERROR(CheckTogether(values));
  return TakeHindsight(options, own);
}

/// What a learner's memory depends on besides its options.
struct OffPolicySizes {
  std::int64_t raw_action = 0;   ///< elements of one raw action
  std::int64_t parameters = 0;   ///< of its networks
  std::int64_t copies = 0;       ///< of all parameters that learning takes
  std::int64_t activations = 0;  ///< bytes of what flows through them (Backpropagation::ActivationBytes)
};
/// Checks that there is memory for what is remembered and for learning; the error says what does not fit and what
/// would.
Status CheckOffPolicyMemory(const LearnerOptions& options, const OffPolicyOptions& own, const OffPolicySizes& sizes);

}  // namespace consac::learn
