#pragma once
// A world behind its handle. Private to engines/c.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calls.h"
#include "consac/host/driver.h"
#include "consac/host/recorder.h"
#include "consac/host/tick_world.h"

struct consac_world {
  consac::host::TickWorldOptions described;
  std::unique_ptr<consac::host::TickWorld> agents;                 // null while it is described
  std::vector<consac::host::AgentId> first;                        // [behaviours] then
  std::vector<std::unique_ptr<consac::host::Recorder>> recorders;  // [behaviours] null: nothing is taken down
  std::unique_ptr<consac::host::Driver> driver;                    // null: nobody drives it
  std::string state;                                               // of the latest consac_world_progress
  bool lost = false;                                               // memory ran out in the midst of a call
};

namespace consac::c {

/// Ok where the world can be asked for anything.
Status Usable(const consac_world* world);
/// Ok where there is such a behaviour.
Status CheckBehaviour(const consac_world& world, std::int32_t b);
/// Ends the description: from now on the agents are there.
Status Build(consac_world* world);
/// Built, and there is such a behaviour.
Status Ready(consac_world* world, std::int32_t b);
/// Built, and there is such an agent.
Status ReadyAgent(consac_world* world, consac_agent agent);

/// Makes a call of a world: what is thrown leaves it lost, since what it was doing is half done.
template <class Call>
consac_status Of(consac_world* world, const Call& call) noexcept {
  try {
    const Status usable = Usable(world);
    return Tell(usable.ok() ? call() : usable);
  } catch (...) {
    if (world != nullptr) world->lost = true;
    return Tell(CONSAC_RESOURCE_EXHAUSTED, "memory ran out in this world; free it");
  }
}
/// The same for an answer; `none` where it fails.
template <class Answer, class Call>
Answer Ask(consac_world* world, Answer none, const Call& call) noexcept {
  Answer answer = none;
  (void)Of(world, [&] { return call(&answer); });
  return answer;
}

}  // namespace consac::c
