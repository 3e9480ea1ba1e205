#pragma once
// A trained model that moves a twin: the world of its robot steps in real time, and says how the robot stands.

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "consac/robot/robot.h"
#include "consac/run/actors.h"
#include "worlds/registry.h"

namespace consac::cli {

/// How the robot of a world stands, as the page draws it.
struct PlayState {
  std::string world;  ///< "yumi-reach-v0"
  bool running = false;
  std::int64_t episode = 1, step = 0;                  ///< of the episode
  double reward = 0.0;                                 ///< of the latest step
  std::vector<std::pair<std::string, double>> joints;  ///< names and positions, rad
  std::vector<std::array<double, 3>> targets, tools;   ///< as many of each, in the robot's frame, m
};

/// One world, one copy, and the model that acts in it. One thread.
class TwinPlay {
 public:
  /// Reads the models and finds the world that they were trained in. kInvalidArgument where that world has no robot, or
  /// the twin lacks a joint of it.
  static Result<TwinPlay> Open(const std::vector<std::string>& models, const robot::Robot& twin, std::int64_t seed);
  /// "start", "pause" or "reset"; false for another word.
  bool Do(std::string_view what);
  /// Steps as often as is due.
  void Advance();
  PlayState State() const;

 private:
  TwinPlay(const worlds::World& world, std::unique_ptr<VectorEnv> env, run::Actors actors, std::int64_t seed);
  void Reset();
  void Step();

  using Clock = std::chrono::steady_clock;
  const worlds::World* world_;
  std::unique_ptr<VectorEnv> env_;
  run::Actors actors_;
  std::uint64_t seed_;
  Rng rng_{0};
  Clock::time_point due_{};
  PlayState state_;
};

}  // namespace consac::cli
