#pragma once
// Who decides what the agents of a TickWorld do: a trainer at the other end of a connection, a learner in this process,
// a trained model, or a person. The host polls its driver once a tick; which one it is makes no other difference.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "consac/host/tick_world.h"
#include "consac/model/model_file.h"
#include "consac/policy/head.h"
#include "consac/server/env_server.h"

namespace consac::host {

/// How things stand, for a line on the screen.
struct Progress {
  std::string state;               ///< "waiting for a trainer on port 5005", "learning", ...
  Tally tally;                     ///< of the world, since it was made
  std::int64_t steps = 0;          ///< of the present training, session or act
  std::int64_t total_steps = 0;    ///< planned; 0: no end
  std::int64_t updates = 0;        ///< rounds of learning in this process
  double agent_steps_per_s = 0.0;  ///< over the last second or so
  double poll_ms = 0.0;            ///< how long the latest Poll took that gave a cue
};

/// Gives a TickWorld its cues. One thread: the world's.
class Driver {
 public:
  virtual ~Driver() = default;
  /// Does what is due and gives the world its next cue when it is known; waits for that at most `wait_s` (0: never
  /// waits, but for a gradient step where a learner learns at every step). An error is reported once; where it can, the
  /// driver then begins anew.
  virtual Status Poll(double wait_s) = 0;
  /// True once a training has come to its end in order, with all of its steps, here or at the other end of the
  /// connection; false again when a further trainer comes.
  virtual bool finished() const = 0;
  /// Sessions that ended in order so far, with all of their steps or before: a model that was tried, for instance.
  virtual std::int64_t ended() const { return finished() ? 1 : 0; }
  /// How things stand.
  virtual Progress progress() const = 0;
  /// The engine stands still on purpose, or goes on.
  virtual void SetPaused(bool paused) { (void)paused; }
  /// Whether the model of behaviour `b` has learned anything here: it has been through a round of learning that went
  /// well.
  virtual bool learned(std::size_t b) const { return (void)b, false; }
  /// The model of behaviour `b` as it is now, of which any thread may make a file; kFailedPrecondition for a driver
  /// that has none.
  virtual Result<ModelFile> Model(std::size_t b) const;
  /// Writes it, sync of the disk included.
  Status SaveModel(std::size_t b, const std::string& path) const;
  /// The host cannot go on: ends what is under way for good. A trainer elsewhere is told why.
  virtual void Refuse(const std::string& why) { (void)why; }
  /// The port that is open; 0 for a driver without one.
  virtual int port() const { return 0; }
};

/// A trainer somewhere else.
struct ServeOptions {
  Endpoint endpoint;        ///< where to listen; port 0: any free one
  EnvServerOptions server;  ///< training length or model name, protocol, token, deadlines
};
/// Serves the world to one trainer after another. kAlreadyExists when the port is taken, kInvalidArgument for an
/// address beyond this computer without a token.
Result<std::unique_ptr<Driver>> Serve(TickWorld& world, const ServeOptions& options);

/// What the agents do while a model learns from what they did.
enum class WhileLearning : std::uint8_t {
  kWait,  ///< nothing: Poll waits; every step is learned from
  kGoOn,  ///< they act on: Poll waits for a gradient step at most. Algorithms that learn in rounds act by their latest
          ///< model and do not learn from these steps; those that learn at every step (dqn) learn from all of them
};

/// Learning in this process.
struct TrainOptions {
  std::string algorithm = "ppo2";                                    ///< a row of learn::Algorithms()
  std::vector<std::pair<std::string, std::string>> hyperparameters;  ///< name, value
  std::int64_t total_steps = 100000;                                 ///< of single agents
  std::uint64_t seed = 0;                                            ///< of learner and world
  WhileLearning while_learning = WhileLearning::kWait;               ///< see there
  /// What is set of the world's parameters, "gravity=uniform 5 15, mass=2" (ParseParameterLaws); "": nothing.
  std::string environment_parameters;
  std::vector<std::vector<std::byte>> start_from;  ///< a model file's bytes for each behaviour; none: from nothing
  /// Where progress.csv and TensorBoard's events are written, with the keys of a run of the program (docs/logs.md), in
  /// a folder of their own below this one: PPO2_1, or the next number that is free. Poll() writes them, a row for each
  /// update. "": nothing is written.
  std::string log_folder;
};
/// Learns on a thread of its own; after total_steps the agents go on by what was learned. The error names the
/// hyperparameter, space or model that does not fit.
Result<std::unique_ptr<Driver>> Train(TickWorld& world, const TrainOptions& options);

/// A trained model.
struct ActOptions {
  std::vector<std::string> models;               ///< a path for each behaviour of the world
  ActionMode mode = ActionMode::kDeterministic;  ///< the best action, or one drawn
  std::uint64_t seed = 0;                        ///< of world and draws
  /// A Poll that finds observations only hands them to a thread of its own, and the next one has the cue: the models
  /// compute while the engine goes on. That next Poll waits for what is not ready by then.
  bool pipelined = false;
};
/// Loads the models (each tests itself) and acts: all agents of a tick in one go, no network, no other thread. The
/// error names what differs between model and world.
Result<std::unique_ptr<Driver>> Act(TickWorld& world, const ActOptions& options);
/// The same from memory: one file's bytes for each behaviour.
Result<std::unique_ptr<Driver>> Act(TickWorld& world, std::span<const std::vector<std::byte>> models,
                                    const ActOptions& options);

/// A person, or rules: every step is asked for at once, and the host writes Action() itself.
std::unique_ptr<Driver> ByHand(TickWorld& world, std::uint64_t seed);

}  // namespace consac::host
