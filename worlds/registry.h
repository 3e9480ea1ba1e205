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

class RobotReach;

/// One row.
struct World {
  const char* id;           ///< "road-v0"; the version rises when results may change
  const char* description;  ///< one line
  const char* source;       ///< where it comes from
  /// `count` >= 1 copies that step as one batch. Every world's generators start at Reset. Null where `argument` is not.
  std::unique_ptr<VectorEnv> (*create)(std::int32_t count);
  /// "position 12, coin 30": one line about copy `index`, for `consac play`; null when the numbers say enough.
  std::string (*describe)(const VectorEnv& env, std::int32_t index);
  /// Hyperparameters that suit this world, as "key=value key=value", per algorithm "ppo2: ... ; ppo: ..."; ""
  /// when the defaults do. Used by `consac demo` and the learning proofs, never silently by `train`.
  const char* suggested;
  /// The first copy's robot, of a world with a robot that reaches; else null.
  const RobotReach& (*robot)(const VectorEnv& env) = nullptr;
  /// What a name says after the id and a colon, "TWIN" of "twin-reach-v0:TWIN"; null of a world that needs no more.
  const char* argument = nullptr;
  /// `count` copies of the world of that argument; the error is one sentence. Null where `argument` is.
  Result<std::unique_ptr<VectorEnv>> (*create_of)(std::string_view argument, std::int32_t count) = nullptr;
};

/// Every world, in the order of the table.
std::span<const World> Worlds();
/// The row of a world's name, "road-v0" or "twin-reach-v0:arm"; kNotFound names the nearest. What follows a colon is
/// looked at only so far: kInvalidArgument where it is missing, or not wanted.
Result<const World*> FindWorld(std::string_view name);
/// `count` >= 1 copies of the world of that name. Errors are FindWorld's, and those of what its argument leads to.
Result<std::unique_ptr<VectorEnv>> MakeWorld(std::string_view name, std::int32_t count);

/// What `world.suggested` says for `algorithm`, as names and values; empty when the defaults do.
std::vector<std::pair<std::string, std::string>> SuggestedSettings(const World& world, std::string_view algorithm);

}  // namespace consac::worlds
