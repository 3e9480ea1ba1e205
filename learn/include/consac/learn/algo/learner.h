#pragma once
// What every algorithm is, seen from outside: an object that is driven and never owns the loop. Worlds in this
// process, engines over a transport and an engine's own tick drive it alike:
//
//   Batch batch = learner.Stage(slots);   // spans into the learner's own buffers
//   learner.Act(batch);                   // reads observations, writes actions
//   env.Step({&batch, 1});                // writes rewards, ends, next observations, in place
//   learner.Record(batch);
//   while (learner.Learn(budget)) {}      // a bounded piece of what is due
//
// Worlds that answer at their own pace do without Stage: each has a batch of its own, with the slots that are its, and
// Act and Record take it. Several may be under way at once, and learning may come between a batch's Act and its Record.
//
// How an algorithm works reads from top to bottom in its one file, beside this one.

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/archive.h"
#include "consac/base/communicator.h"
#include "consac/base/executor.h"
#include "consac/env/batch.h"
#include "consac/env/vector_env.h"
#include "consac/learn/algo/hyperparameters.h"
#include "consac/policy/demonstration.h"
#include "consac/policy/policy.h"

namespace consac::learn {

/// A number that an update produced, under its log names. An empty name: not shown there.
struct Metric {
  std::string_view table_key;        ///< Stable Baselines' table and CSV key: "approxkl", "train/approx_kl"
  std::string_view tensorboard_tag;  ///< "loss/approximate_kullback-leibler"
  double value = 0.0;                ///< NaN allowed (explained_variance of a constant)
  bool single_precision = false;     ///< printed as Stable Baselines prints a float32: with all its digits
};

/// How much learning one call may do.
struct LearnBudget {
  std::int64_t gradient_steps = INT64_MAX;  ///< at most so many optimiser steps
};

/// The seed of the learner of a world's behaviour `b`: the run's own for the first, for each of the others another one,
/// so that no two of them draw the same numbers.
std::uint64_t BehaviourSeed(std::uint64_t seed, std::size_t b);

/// What a learner is made for.
struct LearnerOptions {
  BehaviourSpec behaviour;                          ///< spaces, layouts and the number of slots
  std::uint64_t seed = 0;                           ///< every stream of the learner derives from it
  std::int64_t total_steps = 0;                     ///< planned length in agent steps, for schedules
  Executor executor;                                ///< parallel work; none: this thread
  Communicator ranks;                               ///< other processes of this training; none: this one
  std::int64_t max_bytes = std::int64_t{64} << 30;  ///< of its buffers; needing more is an error, not a crash
  std::int64_t max_state_bytes = INT64_MAX;         ///< of what Visit saves of a rollout; needing more is an error too
  /// Recorded steps to learn from, for algorithms that take them (Algorithm::demonstrations); they outlive the learner.
  const Demonstration* demonstration = nullptr;
  /// VectorEnv::PriceGoals of this behaviour, for algorithms that relabel goals; empty where the world cannot. A world
  /// behind a connection may fail: then what it was asked for has not been learned, and health says why.
  std::function<Status(const std::byte* observations, std::int64_t rows, float* rewards)> price_goals;
};

/// One algorithm at work on one behaviour. One that needs no world is never staged and never told of a step: learning
/// is due from the beginning until it has learned all. Not thread-safe, but Snapshot may be called between any two
/// calls.
class Learner {
 public:
  virtual ~Learner() = default;

  /// Where the next transition of `slots` (ascending, unique) goes. After Begin or Record the observations of
  /// these slots are already in place. Spans are valid until Record. Must not be called while learning is due.
  virtual Batch Stage(std::span<const std::int32_t> slots) = 0;
  /// First observations of slots that begin (or begin again after a lost connection): copies
  /// batch.next_observations (and masks) in, forgets an unfinished episode of these slots.
  virtual void Begin(const Batch& batch) = 0;
  /// Chooses actions (writes batch.actions, legal as the world takes them). `batch` is staged, or of the caller's own
  /// memory: then its observations are those that were recorded, or begun with, last.
  virtual void Act(Batch& batch) = 0;
  /// Takes what came of the batch. Not while learning is due, but for batches that were acted upon before it was; of a
  /// learner that learns continuously between any two calls of Learn: what is due adds up.
  virtual void Record(const Batch& batch) = 0;
  /// True when Learn has something to do before the next Stage.
  virtual bool LearningDue() const = 0;
  /// Does a bounded piece of the learning that is due; true while more is. Calling it with nothing due does nothing.
  /// What of it could not be done, health says.
  virtual bool Learn(const LearnBudget& budget) = 0;

  /// Agent steps recorded so far; of one that needs no world, steps learned from.
  virtual std::int64_t steps() const = 0;
  /// Updates (rounds of learning) finished so far.
  virtual std::int64_t updates() const = 0;
  /// Reports made so far; metrics() are those of the latest. How often one is made is the algorithm's own: after each
  /// update unless it says otherwise.
  virtual std::int64_t reports() const { return updates(); }
  /// Agent steps of one round of collection, or 0 when the algorithm learns continuously.
  virtual std::int64_t steps_per_update() const = 0;
  /// Steps that it is to learn from in all, of one that needs no world: how long it trains is its own to say.
  virtual std::int64_t planned_steps() const { return 0; }
  /// Begins with the weights and the observation statistics of `model`, before anything is recorded; the error says
  /// what of it does not fit.
  virtual Status StartFrom(const PolicyData& model) = 0;
  /// Bytes that what it remembers takes once full, where that is worth telling; 0: it keeps a rollout at most.
  virtual std::int64_t memory_bytes() const { return 0; }
  /// Changes the planned length (a resumed run that goes on for longer).
  virtual void SetTotalSteps(std::int64_t total_steps) = 0;
  /// Numbers of the latest report; valid until the next Learn.
  virtual std::span<const Metric> metrics() const = 0;
  /// Ok while learning makes sense; kNonFinite once a whole update had no finite gradient; what price_goals said where
  /// it failed, until it does not: learning is due as before, and Learn tries again.
  virtual Status health() const = 0;
  /// A complete acting model of this moment.
  virtual PolicyData Snapshot() const = 0;
  /// Everything that the future depends on. Whole numbers of 64 bits are counts: a run saves and takes them from 0 to
  /// 2^53.
  virtual void Visit(Archive& archive) = 0;
};

/// How the log table of an algorithm family looks.
enum class LogStyle : std::uint8_t {
  kStableBaselines2,  ///< flat keys: "approxkl", "ep_reward_mean", "fps" ...
  kStableBaselines3,  ///< sections: "rollout/ep_rew_mean", "time/fps", "train/approx_kl" ...
};

/// What an algorithm does with demonstrations.
enum class Demonstrations : std::uint8_t {
  kNone,   ///< it takes none
  kTakes,  ///< it learns from them besides, where there are any
  kNeeds,  ///< it cannot do without
};

/// One row of the table of algorithms (algo/registry.cpp).
struct Algorithm {
  const char* name;                                 ///< "ppo2"
  const char* description;                          ///< one line
  LogStyle log_style;                               ///< whose keys it logs under
  std::span<const Hyperparameter> hyperparameters;  ///< its table
  /// Makes a learner; the error says which hyperparameter or space does not fit and what would.
  Result<std::unique_ptr<Learner>> (*create)(const LearnerOptions& options, const HyperparameterSet& values);
  bool needs_world = true;      ///< false: it acts nowhere, and learns from demonstrations alone
  bool relabels_goals = false;  ///< it needs a world that prices goals, whatever its hyperparameters
  Demonstrations demonstrations = Demonstrations::kNone;  ///< what it does with them
};

/// Whose keys it logs under with these values: its `log_keys` where it has that hyperparameter.
LogStyle LogStyleOf(const Algorithm& algorithm, const HyperparameterSet& values);
/// Whether it needs a world that prices goals with these values: its `replay_buffer_class` where it has that one.
bool RelabelsGoals(const Algorithm& algorithm, const HyperparameterSet& values);
/// Ok where these values go together, whatever the world; the error says which do not. Making a learner asks it too.
Status CheckTogether(const HyperparameterSet& values);
/// Adds a row to the table, for an algorithm that is not part of this library: 32 at most. Not thread-safe: call it
/// before learners are made.
void AddAlgorithm(const Algorithm& algorithm);
/// Every algorithm, in the order of the table.
std::span<const Algorithm> Algorithms();
/// The row of that name; kNotFound names the nearest.
Result<const Algorithm*> FindAlgorithm(std::string_view name);

}  // namespace consac::learn
