#pragma once
// Spaces and behaviours as scripts write them, and back: Dictionaries with the keys "name", "type", "low", ...
//
//   {name = "default", agents = 4, masks_actions = false,
//    observations = [{name = "position", type = "box", shape = [2], low = -1.0, high = 1.0}],
//    actions = [{name = "steer", type = "discrete", n = 3}],
//    goals = {reward = "sparse", threshold = 0.05, pays = true}}
//
// goals only where the observations have an achieved_goal and a desired_goal; reward is sparse or dense (host::Goals).
// type is box (low, high, shape, dtype "float32" or "uint8"), discrete (n, start), multi_discrete (nvec) or
// multi_binary (n).

#include <string>

#include "binding/values.h"
#include "consac/host/tick_world.h"

namespace consac::godot {

/// Reads one behaviour. The error names behaviour, entry and key.
Result<host::Offering> ReadOffering(const Dictionary& table);
/// Reads a whole world: {id, max_episode_steps, agents_leave, behaviours = [...], notes, parameters = [{name, default,
/// low, high, description}], groups = [{name, agents = [behaviour, place, ...]}]}. What it would take in memory is
/// bounded.
Result<host::TickWorldOptions> ReadWorld(const Dictionary& table);

/// Entries as tables, in this order.
Array DescribeEntries(const std::vector<Leaf>& leaves);

}  // namespace consac::godot
