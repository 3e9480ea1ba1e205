#pragma once
// Players that do not learn: of a world's behaviours some may act by models that stay as they are, while the others
// learn against them or beside them (self-play). To a run each is a learner that never has anything to learn. Private
// to run.

#include <map>
#include <memory>
#include <string>

#include "consac/learn/algo/learner.h"
#include "consac/run/config.h"

namespace consac::run {

/// The models of players that do not learn, by behaviour: a file, a run, or a folder that holds the behaviour's model.
using FrozenModels = std::map<std::string, std::string, std::less<>>;

/// "prey=runs/a/prey.consac,owl=runs/b", which is RunConfig::frozen, taken apart. The error quotes what it is not.
Result<FrozenModels> ParseFrozen(std::string_view text);
/// The same as files, checked against a world: every name is a behaviour's, and one of them is left to learn. A resumed
/// run goes on with what it began with, which lies in its own folder.
Result<FrozenModels> FrozenFilesOf(const RunConfig& config, const EnvSpec& spec);
/// The player: draws actions as its model did while it was trained. The error says what does not fit.
Result<std::unique_ptr<learn::Learner>> MakeFrozenPlayer(const std::string& file, const BehaviourSpec& behaviour,
                                                         std::uint64_t seed);

}  // namespace consac::run
