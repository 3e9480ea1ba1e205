// What scripts find in ConsacWorld: the one list of its methods and constants.
#include "world.h"

namespace consac::godot {
namespace {

// What it is made of, and what went wrong.
std::vector<Method> MakingMethods() {
  return {
      Bind<World, &World::LastError>("last_error"),
      Bind<World, &World::Create>("create", {"description"}),
      Bind<World, &World::Join>("join", {"behaviour"}),
      Bind<World, &World::Leave>("leave", {"agent"}),
      Bind<World, &World::Joined>("joined", {"agent"}),
      Bind<World, &World::Agents>("agents", {"behaviour"}),
      Bind<World, &World::FirstAgent>("first_agent", {"behaviour"}),
  };
}

// Who drives it.
std::vector<Method> DrivingMethods() {
  return {
      Bind<World, &World::Serve>("serve", {"options"}),
      Bind<World, &World::Train>("train", {"options"}),
      Bind<World, &World::Act>("act", {"options"}),
      Bind<World, &World::ByHand>("by_hand", {"seed"}),
      Bind<World, &World::Refuse>("refuse", {"why"}),
      Bind<World, &World::Close>("close"),
      Bind<World, &World::Poll>("poll", {"wait_s"}),
      Bind<World, &World::Offer>("offer"),
      Bind<World, &World::Port>("port"),
      Bind<World, &World::Finished>("finished"),
      Bind<World, &World::SetPaused>("set_paused", {"paused"}),
      Bind<World, &World::Progress>("progress"),
      Bind<World, &World::Learned>("learned", {"behaviour"}),
      Bind<World, &World::SaveModel>("save_model", {"behaviour", "path"}),
      Bind<World, &World::Record>("record", {"behaviour"}),
      Bind<World, &World::FileOf>("file_of", {"name"}),
      Bind<World, &World::RecordedSteps>("recorded_steps", {"behaviour"}),
      Bind<World, &World::SaveRecording>("save_recording", {"behaviour", "path"}),
      Bind<World, &World::ListAlgorithms>("algorithms"),
      Bind<World, &World::ListHyperparameters>("hyperparameters", {"algorithm"}),
  };
}

// All agents of a behaviour.
std::vector<Method> BehaviourMethods() {
  return {
      Bind<World, &World::Actions>("actions", {"behaviour"}),
      Bind<World, &World::SetActions>("set_actions", {"behaviour", "numbers"}),
      Bind<World, &World::SetObservations>("set_observations", {"behaviour", "numbers"}),
      Bind<World, &World::SetObservationBytes>("set_observation_bytes", {"behaviour", "bytes"}),
      Bind<World, &World::SetFinalObservations>("set_final_observations", {"behaviour", "numbers"}),
      Bind<World, &World::SetFinalObservationBytes>("set_final_observation_bytes", {"behaviour", "bytes"}),
      Bind<World, &World::SetMasks>("set_masks", {"behaviour", "masks"}),
      Bind<World, &World::AddRewards>("add_rewards", {"behaviour", "rewards"}),
      Bind<World, &World::EndEpisodes>("end_episodes", {"behaviour", "ends"}),
      Bind<World, &World::Endings>("endings", {"behaviour"}),
      Bind<World, &World::Resets>("resets", {"behaviour"}),
  };
}

// One agent.
std::vector<Method> AgentMethods() {
  return {
      Bind<World, &World::Action>("action_of", {"agent"}),
      Bind<World, &World::SetAction>("set_action_of", {"agent", "numbers"}),
      Bind<World, &World::SetObservation>("set_observation_of", {"agent", "numbers"}),
      Bind<World, &World::SetObservationBytesOf>("set_observation_bytes_of", {"agent", "bytes"}),
      Bind<World, &World::SetFinalObservation>("set_final_observation_of", {"agent", "numbers"}),
      Bind<World, &World::SetFinalObservationBytesOf>("set_final_observation_bytes_of", {"agent", "bytes"}),
      Bind<World, &World::SetMask>("set_mask_of", {"agent", "mask"}),
      Bind<World, &World::AddReward>("add_reward", {"agent", "reward"}),
      Bind<World, &World::EndEpisode>("end_episode", {"agent", "end"}),
      Bind<World, &World::Ending>("ending", {"agent"}),
      Bind<World, &World::ResetsOne>("resets_agent", {"agent"}),
      Bind<World, &World::Seed>("seed_of", {"agent"}),
  };
}

Constant ConstantOf(std::string name, Cue value) {
  return {"Cue", std::move(name), static_cast<std::int64_t>(value)};
}
Constant ConstantOf(std::string name, End value) {
  return {"End", std::move(name), static_cast<std::int64_t>(value)};
}

}  // namespace

ClassTable WorldTable() {
  ClassTable table;
  table.name = "ConsacWorld";
  table.make = []() -> Instance* { return new World; };
  for (const std::vector<Method>& some : {MakingMethods(), DrivingMethods(), BehaviourMethods(), AgentMethods()})
    table.methods.insert(table.methods.end(), some.begin(), some.end());
  table.constants = {ConstantOf("WAIT", Cue::kWait),
                     ConstantOf("ACT", Cue::kAct),
                     ConstantOf("RESET", Cue::kReset),
                     ConstantOf("DONE", Cue::kDone),
                     ConstantOf("FAILED", Cue::kFailed),
                     ConstantOf("GOES_ON", End::kGoesOn),
                     ConstantOf("TERMINATED", End::kTerminated),
                     ConstantOf("TRUNCATED", End::kTruncated)};
  return table;
}

}  // namespace consac::godot
