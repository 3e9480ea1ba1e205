#pragma once
// Steps of a TickWorld as drivers in this process take them: rows of their own, and the agents that are there gathered.
// Private to host.

#include <vector>

#include "consac/env/begins.h"
#include "consac/env/buffer.h"
#include "consac/env/gathered.h"
#include "consac/host/driver.h"
#include "consac/policy/policy.h"

namespace consac::host {

/// One world's steps, one after another; between two of them the world settles.
class Turn {
 public:
  explicit Turn(TickWorld& world);
  ~Turn() { world_.Abandon(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  /// Asks for a beginning of everything, with the world's parameters at their defaults.
  void Reset(std::uint64_t seed);
  /// After a beginning: first observations of everyone there, one batch for each behaviour.
  Batch& First(std::size_t b);
  /// Observations of everyone there; actions are to be written.
  Batch& ToAct(std::size_t b);
  /// The same rows for a policy: whose they are, and where an episode begins. After ToAct.
  ActRows RowsOf(std::size_t b) const;
  /// What the game has noted since the latest Step, once; Step forgets what nobody has asked for. Until the next call.
  std::span<const Statistic> TakeNoted();
  /// Asks for the step. ToAct was called for every behaviour.
  void Step();
  /// What came of it. Comes before Arrived.
  Batch& Outcome(std::size_t b);
  /// The same once more. After Outcome, before ToAct.
  const Batch& Latest(std::size_t b) const { return parts_[b]; }
  /// First observations of agents that have come meanwhile.
  Batch& Arrived(std::size_t b);

 private:
  TickWorld& world_;
  std::vector<Statistic> noted_;
  std::vector<BatchBuffer> buffers_;
  std::vector<Batch> whole_, parts_, arrived_;
  std::vector<GatheredRows> acting_, arriving_;
  std::vector<EpisodeBegins> episodes_;
  std::vector<std::span<const std::uint8_t>> begins_;  // of those acting
};

/// Agent steps a second, and what a Poll takes.
class Meter {
 public:
  /// To be called at the end of each Poll that gave a cue; `began` is when it began.
  void Note(std::int64_t steps, double began);
  void Tell(Progress* progress) const {
    progress->agent_steps_per_s = per_s_;
    progress->poll_ms = poll_ms_;
  }

 private:
  double since_ = 0.0, per_s_ = 0.0, poll_ms_ = 0.0;
  std::int64_t steps_ = 0;
};

}  // namespace consac::host
