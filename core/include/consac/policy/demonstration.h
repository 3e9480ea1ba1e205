#pragma once
// Demonstrations: what agents saw and did, step by step, as spec/demonstration.md has it (engines/host/recorder.h
// writes it), for learners that learn from recorded steps.

#include <cstdint>
#include <string>
#include <vector>

#include "consac/env/vector_env.h"
#include "consac/model/model_file.h"

namespace consac {

/// Recorded steps of one behaviour's agents, in the order of time.
struct Demonstration {
  BehaviourSpec behaviour;                          ///< whose; a slot for each agent that was recorded
  std::vector<std::byte> observations;              ///< [steps, observation row_bytes] what was acted upon
  std::vector<std::byte> actions;                   ///< [steps, action row_bytes] what was done
  std::vector<float> rewards;                       ///< [steps] what came of it
  std::vector<std::uint8_t> terminated, truncated;  ///< [steps] 1: the agent's episode ended with this step
  std::vector<std::int32_t> slots;                  ///< [steps] which agent, from 0

  /// Steps of single agents.
  std::int64_t steps() const { return static_cast<std::int64_t>(rewards.size()); }

  /// Reads a file; kDataLoss with path and cause where it is no demonstration, or has a number that its spaces or a
  /// learner cannot have.
  static Result<Demonstration> Load(const std::string& path);
  /// The same from a file that has been read already.
  static Result<Demonstration> FromFile(const ModelFile& file);
};

}  // namespace consac
