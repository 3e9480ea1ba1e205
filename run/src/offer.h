#pragma once
// What a run's worlds offer, as its checkpoints keep it: whoever goes on with a run goes on in the same world. Private
// to run.

#include <span>
#include <string>

#include "consac/env/vector_env.h"

namespace consac::run {

/// The world's id, and of each behaviour name, spaces, masks and number of agents, `slots` in all worlds together; as
/// JSON. Agents' own names are left out: engines count on in them.
std::string OfferText(const EnvSpec& spec, std::span<const std::int64_t> slots);
/// Ok when both are the same; an id that is not said equals any. Otherwise the first difference with both values, and
/// kInvalidArgument.
Status CompareOffers(const std::string& before, const std::string& now);

}  // namespace consac::run
