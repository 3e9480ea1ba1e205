#pragma once
// ConsacWorld: agents in the engine's ticks and whoever drives them, as scripts see it. A thin skin over
// consac/host/tick_world.h and driver.h that checks everything: no call in any order, with any argument, harms the
// engine. Arrays of a behaviour hold a row for every place, taken or not.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "binding/class.h"
#include "consac/host/driver.h"
#include "consac/host/recorder.h"
#include "rows.h"

namespace consac::godot {

/// What poll() says; the first three are the world's own (host::Cue).
enum class Cue : std::int64_t { kWait = 0, kAct = 1, kReset = 2, kDone = 3, kFailed = 4 };
/// How end_episode() and end_episodes() are told.
enum class End : std::int64_t { kGoesOn = 0, kTerminated = 1, kTruncated = 2 };

/// The class's name, methods and constants.
ClassTable WorldTable();

/// An object of it. One thread.
class World : public Instance {
 public:
  ~World() override;

  // ---- what it is made of (world.cpp)
  Status Create(const Dictionary& description);
  Result<std::int64_t> Join(std::int64_t behaviour);
  Result<std::int64_t> JoinGroup(std::int64_t behaviour, std::int64_t group);  // group: its place, -1: of none
  Status Leave(std::int64_t agent);
  bool Joined(std::int64_t agent);
  Result<std::int64_t> Agents(std::int64_t behaviour);
  Result<std::int64_t> FirstAgent(std::int64_t behaviour);

  // ---- who drives it (driving.cpp)
  Status Serve(const Dictionary& options);
  Status Train(const Dictionary& options);
  Status Act(const Dictionary& options);
  Status ByHand(std::int64_t seed);
  void Refuse(const std::string& why);
  void Close();
  std::int64_t Poll(double wait_s);
  Status Offer();
  std::int64_t Port();
  bool Finished();
  void WatchInterrupts();  // CatchInterrupts(), until Close()
  bool WasInterrupted();
  void SetPaused(bool paused);
  Dictionary Progress();
  bool Learned(std::int64_t behaviour);
  Status SaveModel(std::int64_t behaviour, const std::string& path);
  Status Record(std::int64_t behaviour);
  std::string FileOf(const std::string& name);  // FileNameOf, for a path with a behaviour in it
  std::int64_t RecordedSteps(std::int64_t behaviour);
  Status SaveRecording(std::int64_t behaviour, const std::string& path);
  Array ListAlgorithms();
  Result<Array> ListHyperparameters(const std::string& algorithm);

  // ---- what the agents see and do (exchange.cpp); all of a behaviour
  Result<Floats> Actions(std::int64_t behaviour);
  Status SetActions(std::int64_t behaviour, const Floats& numbers);
  Status SetObservations(std::int64_t behaviour, const Floats& numbers);
  Status SetObservationBytes(std::int64_t behaviour, const Bytes& bytes);
  Status SetFinalObservations(std::int64_t behaviour, const Floats& numbers);
  Status SetFinalObservationBytes(std::int64_t behaviour, const Bytes& bytes);
  Status SetMasks(std::int64_t behaviour, const Bytes& masks);
  Status AddRewards(std::int64_t behaviour, const Floats& rewards);
  Status EndEpisodes(std::int64_t behaviour, const Bytes& ends);
  Result<Bytes> Endings(std::int64_t behaviour);
  Result<Bytes> Resets(std::int64_t behaviour);
  // of one agent
  Result<Floats> Action(std::int64_t agent);
  Status SetAction(std::int64_t agent, const Floats& numbers);
  Status SetObservation(std::int64_t agent, const Floats& numbers);
  Status SetObservationBytesOf(std::int64_t agent, const Bytes& bytes);
  Status SetFinalObservation(std::int64_t agent, const Floats& numbers);
  Status SetFinalObservationBytesOf(std::int64_t agent, const Bytes& bytes);
  Status SetMask(std::int64_t agent, const Bytes& mask);
  Status AddReward(std::int64_t agent, double reward);
  Result<double> NextParameter(std::int64_t agent, const std::string& name);
  Status Note(const std::string& name, double value);
  Status TellGroupReward(std::int64_t group, double reward);
  Status EndEpisode(std::int64_t agent, std::int64_t end);
  bool Ending(std::int64_t agent);
  bool ResetsOne(std::int64_t agent);
  std::int64_t Seed(std::int64_t agent);

 private:
  // Rows of one behaviour: how they lie in a script's arrays, and which agents they are.
  struct Rows {
    host::AgentId first = 0;
    std::int64_t count = 0;
    RowMap observation, action;
    std::unique_ptr<host::Recorder> recorder;
  };
  // Some rows that a call is about.
  struct Part {
    Rows* rows = nullptr;
    host::AgentId first = 0;
    std::int64_t count = 0;
  };

  Status Ready() const;
  Result<Part> All(std::int64_t behaviour);
  Result<Part> One(std::int64_t agent);
  void Stop();  // nobody drives any more
  Status Drive(Result<std::unique_ptr<host::Driver>> driver);

  Result<Floats> ReadActions(const Result<Part>& part);
  Status WriteActions(const Result<Part>& part, const Floats& numbers);
  Status WriteObservations(const Result<Part>& part, const Floats& numbers, bool final);
  Status WriteBytes(const Result<Part>& part, const Bytes& bytes, bool final);
  Status WriteMasks(const Result<Part>& part, const Bytes& masks);

  std::unique_ptr<host::TickWorld> world_;
  std::vector<Rows> rows_;  // by behaviour; recorders go before the world
  std::unique_ptr<host::Driver> driver_;
  std::int64_t told_ended_ = 0;  // of the driver's sessions
  bool watches_ = false;         // for interrupts
};

}  // namespace consac::godot
