#pragma once
// A model behind its handle. Private to engines/c.

#include <cstdint>
#include <vector>

#include "calls.h"
#include "consac/policy/policy.h"

struct consac_model {
  explicit consac_model(consac::Policy loaded);

  consac::Policy policy;
  bool explores = false;              // what it draws follows the state by numbers of each agent's own
  consac::Rng rng;                    // of draws
  std::vector<std::int64_t> choices;  // mask bytes of each choice that it makes
  std::int64_t room = 1;              // rows at once, and agents that it can remember
};

namespace consac::c {

/// Hands a policy out as a handle.
Status GiveModel(Result<Policy> policy, consac_model** model);

}  // namespace consac::c
