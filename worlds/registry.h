#pragma once
// The table of built-in worlds: name, one line, what it needs. A new world is its own folder and one row here.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/status.h"
#include "consac/env/vector_env.h"

namespace consac::worlds {

/// One row.
struct World {
  const char* id;           ///< "road-v0"; the version rises when results may change
  const char* description;  ///< one line
  const char* source;       ///< where it comes from
  /// `count` >= 1 copies that step as one batch. Every world's generators start at Reset.
  std::unique_ptr<VectorEnv> (*create)(std::int32_t count);
  /// "position 12, coin 30": one line about copy `index`, for `consac play`; null when the numbers say enough.
  std::string (*describe)(const VectorEnv& env, std::int32_t index);
  /// Hyperparameters that suit this world, as "key=value key=value", per algorithm "ppo2: ... ; ppo: ..."; ""
  /// when the defaults do. Used by `consac demo` and the learning proofs, never silently by `train`.
  const char* suggested;
};

/// Every world, in the order of the table.
std::span<const World> Worlds();
/// The row with that id; kNotFound names the nearest.
Result<const World*> FindWorld(std::string_view id);

/// What `world.suggested` says for `algorithm`, as names and values; empty when the defaults do.
std::vector<std::pair<std::string, std::string>> SuggestedSettings(const World& world, std::string_view algorithm);

}  // namespace consac::worlds
