// What scripts find in ConsacWorld: the one list of its methods and constants.
#include "world.h"

namespace consac::godot {
namespace {

// What it is made of, and what went wrong.
std::vector<Method> MakingMethods() {
  return {
      Bind<World, &World::LastError>("last_error", {},
                                     "Why the latest call that can fail did; \"\" where it went well."),
      Bind<World, &World::Create>(
          "create", {"description"},
          "Makes the world: [code]{id, max_episode_steps, agents_leave, behaviours = [{name, agents, "
          "masks_actions, observations = [entries], actions = [entries], goals = {reward = \"sparse\" or \"dense\", "
          "threshold, "
          "pays}}]}[/code], goals where it observes achieved_goal and desired_goal. An entry is [code]{name, "
          "type, ...}[/code]: [code]box[/code] (low, high, shape, dtype \"float32\" or \"uint8\"), "
          "[code]discrete[/code] (n, start), [code]multi_discrete[/code] (nvec) or "
          "[code]multi_binary[/code] (n). Also [code]parameters = [{name, default, low, high, description}][/code] "
          "that a trainer may set, [code]notes = true[/code] where [method note] is called, and [code]groups = "
          "[{name, agents = [behaviour, place, behaviour, place, ...]}][/code] of agents of several behaviours."),
      Bind<World, &World::Join>("join", {"behaviour"},
                                "An agent takes a free place of a behaviour. Its number, or -1 when there is none."),
      Bind<World, &World::JoinGroup>("join_group", {"behaviour", "group"},
                                     "The same for a place of this group alone, or -1: of none."),
      Bind<World, &World::Leave>("leave", {"agent"},
                                 "Its place is free again; its episode is truncated where it was last seen."),
      Bind<World, &World::Joined>("joined", {"agent"}, "Whether this agent is there."),
      Bind<World, &World::Agents>("agents", {"behaviour"}, "Places of a behaviour, taken or not."),
      Bind<World, &World::FirstAgent>("first_agent", {"behaviour"}, "The number of the first place of a behaviour."),
  };
}

// Who drives it.
std::vector<Method> DrivingMethods() {
  return {
      Bind<World, &World::Serve>(
          "serve", {"options"},
          "A trainer elsewhere decides, one after another: [code]{host, port, training_length, model_name, "
          "seed, protocol, token, deadline_s, ...}[/code]. Port 0 takes any free one, see [method port]."),
      Bind<World, &World::Train>(
          "train", {"options"},
          "A learner in this process decides: [code]{algorithm, hyperparameters = {}, total_steps, seed, "
          "while_learning = \"wait\" or \"go_on\", start_from = [a model for each behaviour], environment_parameters = "
          "\"gravity=uniform 5 15, mass=2\"}[/code]."),
      Bind<World, &World::Act>(
          "act", {"options"},
          "Models decide: [code]{models = [a path for each behaviour], mode = \"deterministic\" or "
          "\"sample\", seed}[/code]."),
      Bind<World, &World::ByHand>("by_hand", {"seed"}, "The game decides, with [method set_actions]."),
      Bind<World, &World::Refuse>("refuse", {"why"},
                                  "The world cannot go on: ends what is under way for good. A trainer is told why."),
      Bind<World, &World::Close>("close", {}, "Nobody drives any more; agents stay where they are."),
      Bind<World, &World::Poll>("poll", {"wait_s"},
                                "What is next, as a [enum Cue]; waits for it for so many seconds at most."),
      Bind<World, &World::Offer>("offer", {},
                                 "Everything is written: observations, rewards, ends. What is wrong with it, or \"\"."),
      Bind<World, &World::Port>("port", {}, "The port that is open; 0 for none."),
      Bind<World, &World::Finished>("finished", {}, "Whether a training has come to its end with all of its steps."),
      Bind<World, &World::WatchInterrupts>("watch_interrupts", {},
                                           "From now on, until [method close], Ctrl-C and SIGTERM are noted, and only "
                                           "the second one ends the program. In an engine "
                                           "without a window that is the place to save what was learned."),
      Bind<World, &World::WasInterrupted>("interrupted", {},
                                          "Whether Ctrl-C or SIGTERM has come since [method watch_interrupts]."),
      Bind<World, &World::SetPaused>(
          "set_paused", {"paused"},
          "The game stands still on purpose, or goes on; a trainer of protocol 2 waits so long."),
      Bind<World, &World::Progress>(
          "progress", {},
          "How things stand: [code]{state, steps, total_steps, updates, episodes, mean_episode_reward, "
          "mean_episode_length, agent_steps_per_s, poll_ms, all_steps}[/code]."),
      Bind<World, &World::Learned>("learned", {"behaviour"},
                                   "Whether the model of a behaviour has learned anything here."),
      Bind<World, &World::SaveModel>("save_model", {"behaviour", "path"},
                                     "Writes the model of a behaviour as it is now. What is wrong, or \"\"."),
      Bind<World, &World::Record>("record", {"behaviour"},
                                  "From now on everything that the agents of a behaviour see and do is kept."),
      Bind<World, &World::FileOf>("file_of", {"name"}, "A behaviour's name as a file is named by it."),
      Bind<World, &World::RecordedSteps>("recorded_steps", {"behaviour"}, "Steps of a behaviour that are kept."),
      Bind<World, &World::SaveRecording>("save_recording", {"behaviour", "path"},
                                         "Writes what was kept of a behaviour as a demonstration."),
      Bind<World, &World::ListAlgorithms>("algorithms", {}, "All algorithms: [code][{name, description}][/code]."),
      Bind<World, &World::ListHyperparameters>(
          "hyperparameters", {"algorithm"},
          "What can be set of an algorithm: [code][{name, type, default, low, high, choices, "
          "meaning}][/code]."),
  };
}

// All agents of a behaviour.
std::vector<Method> BehaviourMethods() {
  return {
      Bind<World, &World::Actions>("actions", {"behaviour"},
                                   "What all agents of a behaviour are to do: a row for each place."),
      Bind<World, &World::SetActions>("set_actions", {"behaviour", "numbers"}, "What they do, where the game decides."),
      Bind<World, &World::SetObservations>(
          "set_observations", {"behaviour", "numbers"},
          "What all agents of a behaviour see, or see first in their next episodes: a row for each place, "
          "entries in the order of [method create]."),
      Bind<World, &World::SetObservationBytes>("set_observation_bytes", {"behaviour", "bytes"},
                                               "Their entries of uint8 (pictures), which travel apart."),
      Bind<World, &World::SetFinalObservations>("set_final_observations", {"behaviour", "numbers"},
                                                "The last observations of episodes that end."),
      Bind<World, &World::SetFinalObservationBytes>("set_final_observation_bytes", {"behaviour", "bytes"},
                                                    "Their entries of uint8."),
      Bind<World, &World::SetMasks>(
          "set_masks", {"behaviour", "masks"},
          "Which choices are legal: a byte for each choice of each place, 0 for an illegal one. The "
          "behaviour was made with masks_actions."),
      Bind<World, &World::AddRewards>("add_rewards", {"behaviour", "rewards"},
                                      "Rewards since the latest [method offer], one for each place."),
      Bind<World, &World::EndEpisodes>("end_episodes", {"behaviour", "ends"},
                                       "Who ends: an [enum End] for each place."),
      Bind<World, &World::Endings>("endings", {"behaviour"}, "1 for each place whose episode the coming offer ends."),
      Bind<World, &World::Resets>("resets", {"behaviour"},
                                  "1 for each place that begins anew, where [method poll] has said RESET."),
  };
}

// One agent.
std::vector<Method> AgentMethods() {
  return {
      Bind<World, &World::Action>("action_of", {"agent"}, "What one agent is to do."),
      Bind<World, &World::SetAction>("set_action_of", {"agent", "numbers"}, "What one agent does."),
      Bind<World, &World::SetObservation>("set_observation_of", {"agent", "numbers"}, "What one agent sees."),
      Bind<World, &World::SetObservationBytesOf>("set_observation_bytes_of", {"agent", "bytes"},
                                                 "Its entries of uint8."),
      Bind<World, &World::SetFinalObservation>("set_final_observation_of", {"agent", "numbers"},
                                               "The last observation of its episode."),
      Bind<World, &World::SetFinalObservationBytesOf>("set_final_observation_bytes_of", {"agent", "bytes"},
                                                      "Its entries of uint8."),
      Bind<World, &World::SetMask>("set_mask_of", {"agent", "mask"}, "Which choices are legal for one agent."),
      Bind<World, &World::AddReward>("add_reward", {"agent", "reward"}, "Adds to the reward of one agent."),
      Bind<World, &World::NextParameter>(
          "next_parameter", {"agent", "name"},
          "What the episode of one agent has of a parameter that begins now; 0 where there is no such one."),
      Bind<World, &World::Note>("note", {"name", "value"},
                                "A number of the game's own, for the log of who trains. What is wrong with it, or "
                                "\"\"."),
      Bind<World, &World::TellGroupReward>("tell_group_reward", {"group", "reward"},
                                           "What a group has earned together since the latest [method offer], beside "
                                           "[method add_reward] of each of its agents, which is called too."),
      Bind<World, &World::EndEpisode>("end_episode", {"agent", "end"},
                                      "Ends the episode of one agent, by an [enum End]."),
      Bind<World, &World::Ending>("ending", {"agent"}, "Whether the coming offer ends its episode."),
      Bind<World, &World::ResetsOne>("resets_agent", {"agent"}, "Whether it begins anew."),
      Bind<World, &World::Seed>("seed_of", {"agent"}, "From what its episode begins; -1: from its own random numbers."),
  };
}

Constant ConstantOf(std::string name, Cue value, std::string help) {
  return {"Cue", std::move(name), static_cast<std::int64_t>(value), std::move(help)};
}
Constant ConstantOf(std::string name, End value, std::string help) {
  return {"End", std::move(name), static_cast<std::int64_t>(value), std::move(help)};
}

}  // namespace

ClassTable WorldTable() {
  ClassTable table;
  table.name = "ConsacWorld";
  table.brief = "Agents of a game and whoever decides what they do: a trainer, a learner in here, a model, the game.";
  table.help =
      "What [ConsacSync] and [ConsacAgent] stand on, for games that would rather call it themselves. Every call may "
      "come "
      "at any time with anything: what does not fit is one line, returned, kept as [method last_error] and written "
      "into "
      "the log.";
  table.make = []() -> Instance* { return new World; };
  for (const std::vector<Method>& some : {MakingMethods(), DrivingMethods(), BehaviourMethods(), AgentMethods()})
    table.methods.insert(table.methods.end(), some.begin(), some.end());
  table.constants = {ConstantOf("WAIT", Cue::kWait, "Nothing is wanted yet."),
                     ConstantOf("ACT", Cue::kAct, "Carry out the actions, then offer."),
                     ConstantOf("RESET", Cue::kReset, "Begin episodes anew, then offer."),
                     ConstantOf("DONE", Cue::kDone, "A session or a training is over."),
                     ConstantOf("FAILED", Cue::kFailed, "It went wrong; [method last_error] says how."),
                     ConstantOf("GOES_ON", End::kGoesOn, "Its episode goes on."),
                     ConstantOf("TERMINATED", End::kTerminated, "It has come to its end."),
                     ConstantOf("TRUNCATED", End::kTruncated, "It was cut off; there would have been more.")};
  return table;
}

}  // namespace consac::godot
