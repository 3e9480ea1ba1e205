#include "consac/env/vector_env.h"

namespace consac {

BehaviourSpec BehaviourSpec::Of(std::string name, Space observation_space, Space action_space, std::int32_t slots) {
  BehaviourSpec behaviour;
  behaviour.name = std::move(name);
  behaviour.observation_layout = Layout::Of(observation_space);
  behaviour.action_layout = Layout::Of(action_space);
  behaviour.observation_space = std::move(observation_space);
  behaviour.action_space = std::move(action_space);
  behaviour.slots = slots;
  return behaviour;
}

void SetDefaultParameters(VectorEnv& env) {
  const std::vector<double> defaults = DefaultsOf(env.spec().parameters);
  for (std::int32_t world = 0; world < env.spec().environments() && !defaults.empty(); ++world)
    env.SetParameters(world, defaults);
}

}  // namespace consac
