#pragma once
// A training run from start to saved model: in process or with an engine over TCP, interruptible, resumable to the
// bit, one function for the command line, tests and whoever embeds it.

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/batch.h"
#include "consac/policy/policy.h"
#include "consac/run/actors.h"
#include "consac/run/config.h"

namespace consac::run {

/// A behaviour's share in a run.
struct ModelSummary {
  std::string behaviour;             ///< "default", "hunter"
  std::string path;                  ///< runs/NAME/model.consac, or runs/NAME/hunter.consac beside others
  std::int64_t updates = 0;          ///< rounds of learning in total
  double mean_episode_reward = 0.0;  ///< over the last 100 episodes; NaN without one
};

/// What a run came to.
struct RunSummary {
  std::string directory;             ///< runs/NAME
  std::vector<ModelSummary> models;  ///< one per behaviour, in the world's order; none when no run had begun
  std::int64_t steps = 0;            ///< agent steps trained in total
  double seconds = 0.0;              ///< wall time of this call
  double processor_seconds = 0.0;    ///< of all threads of this process in that time
  double saving_seconds = 0.0;       ///< of that, what checkpoints and models took; the last ones come after it
  std::uint64_t weights_hash = 0;    ///< StateHasher of the learners' parameters: equal runs, equal hashes
  bool interrupted = false;          ///< stopped by `stop`; everything is saved
  bool acted_only = false;           ///< the engine asked for a model to act, nothing was learned
  std::int64_t sessions = 0;         ///< that were served, of config.forever; the rest is of the latest one
};

/// The path of every model: "runs/a/model.consac", "runs/b/hunter.consac and runs/b/prey.consac".
std::string ModelPaths(const RunSummary& summary);

/// What the run directory/name was begun with: its config.yaml, as --resume reads it. The error says why it cannot be
/// gone on with.
Result<RunConfig> ConfigOfRun(const std::string& directory, const std::string& name);

/// Trains (or, where an engine asks for it, acts) as `config` says; returns early, saved, once `stop` is set.
/// With config.forever it serves one session after another until `stop`.
Result<RunSummary> Train(const RunConfig& config, const std::atomic<bool>& stop);

/// Whether a training makes its networks, during which it does not look at `stop` and has nothing to save: whoever asks
/// it to stop may end the process.
bool NothingToLose();

/// How a model is judged, or the models of a run.
struct EvaluateOptions {
  std::string model;               ///< path of a .consac file, a run's name or its folder (FindModels)
  std::string world;               ///< "road-v0" or "tcp://host:port"; "": the world it was trained on
  std::string directory = "runs";  ///< where run names are looked up
  std::int64_t episodes = 100;     ///< to average over, of each behaviour
  std::uint64_t seed = 1000;       ///< of the worlds
  bool deterministic = true;       ///< the mode, or a sample
  /// A world without a time limit of its own: after so many steps an episode counts as one; the world is not reset.
  std::int64_t max_episode_steps = 1000;
  double connect_timeout_s = 60.0;  ///< keep trying to reach an engine for so long
  double deadline_s = 60.0;         ///< longest silence of an engine
  std::string token;                ///< access token that an engine asks for
  /// Hears at once, and every few seconds, what is waited for: an engine that is not there, agents that do not come.
  std::function<void(const std::string&)> say = [](const std::string& line) { Log(LogLevel::kInfo, line); };
};

/// The verdict on one model.
struct EvaluateSummary {
  std::string behaviour;      ///< "default", "hunter"
  std::int64_t episodes = 0;  ///< that were finished
  double mean_reward = 0.0;   ///< of their returns
  double std_reward = 0.0;    ///< population standard deviation
  double min_reward = 0.0;    ///< worst
  double max_reward = 0.0;    ///< best
  double mean_length = 0.0;   ///< steps
  /// Part of the episodes whose last step was where it should be, 0 to 1; NaN where the world does not say: built-in
  /// worlds that have the info is_success do.
  double success_rate = std::numeric_limits<double>::quiet_NaN();
};

/// Mean return over episodes for each behaviour of the world, in its order; of fewer than asked for once `stop` is set.
/// Behaviours act together, each by its own model. Source: Stable Baselines, evaluate_policy.
Result<std::vector<EvaluateSummary>> Evaluate(const EvaluateOptions& options, const std::atomic<bool>& stop);

/// Ok when the rewards of the slots `acting` in a batch of all slots are numbers; kNonFinite names one that is none.
Status CheckRewards(std::string_view behaviour, const Batch& batch, std::span<const std::int32_t> acting);

/// The world that a model says it was trained on; "" when it does not.
std::string TrainedWorld(const Policy& policy);
/// True for an engine's address, "tcp://...", as opposed to a built-in world's id.
bool IsUrl(const std::string& world);

}  // namespace consac::run
