#pragma once
// Graphs of nodes, as a person would draw them, in C++: each call is a node.

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ConsacAgentComponent.h"
#include "ConsacBlueprintLibrary.h"
#include "ConsacEnvironmentComponent.h"
#include "ConsacModel.h"
#include "ConsacSocket.h"
#include "ConsacTrainer.h"
#include "ConsacTrainerProgram.h"
#include "ConsacWaitMessageAction.h"
#include "HAL/PlatformProcess.h"
#include "Shim/Runtime.h"
#include "UObject/UObjectGlobals.h"
#pragma push_macro("check")  // Unreal's short macros are none of these headers' business
#pragma push_macro("verify")
#pragma push_macro("ensure")
#pragma push_macro("PI")
#undef check
#undef verify
#undef ensure
#undef PI
#include "consac/base/file.h"
#include "tests/support.h"
#include "worlds/road/road.h"
#pragma pop_macro("PI")
#pragma pop_macro("ensure")
#pragma pop_macro("verify")
#pragma pop_macro("check")

namespace consac::testing {

/// A text of ours as Unreal's, and back.
inline FString Text(const std::string& text) {
  return FString(Shim::Wide(text).c_str());
}
inline FString Text(const char* text) {
  return Text(std::string(text));
}
inline std::string Text(const FString& text) {
  return Shim::Narrow(*text);
}

/// A folder that programs write to, which the test starts: those that go on by themselves are ended before it goes.
class ProgramFolder : public ScratchFolder {
 public:
  using ScratchFolder::ScratchFolder;
  ~ProgramFolder() { FPlatformProcess::ShimEndAll(); }
};

/// An actor that nothing is known of.
class AConsacTestActor : public AActor {
  SHIM_CLASS(AConsacTestActor, AActor)
};

/// The spaces of the road.
inline FConsacSpace RoadSeen() {
  return UConsacBlueprintLibrary::MakeBoxSpace(2, 0.0f, 40.0f);
}
inline FConsacSpace RoadDone() {
  return UConsacBlueprintLibrary::MakeDiscreteSpace(3);
}

/// Calls `tick` until `done`, at most for so long.
inline bool TickUntil(double seconds, const std::function<void()>& tick, const std::function<bool()>& done) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!done()) {
    if (std::chrono::steady_clock::now() > until) return false;
    tick();
  }
  return true;
}

/// The thesis' graph on the road: Begin Play -> Setup Environment; Tick -> Training Connection -> Training -> ...
class RoadGraph {
 public:
  explicit RoadGraph(Shim::Game& game) : rng_(1, 0) {
    AActor* actor = game.Spawn<AConsacTestActor>();
    environment_ = game.AddComponent<UConsacEnvironmentComponent>(*actor);
    road_.Reset(rng_, seen_);
  }

  UConsacEnvironmentComponent& environment() { return *environment_; }

  /// Setup Environment.
  EConsacResult Setup(std::int64_t length, int port, const std::string& model = "road") {
    EConsacResult result = EConsacResult::Failed;
    environment_->SetupEnvironment(RoadSeen(), RoadDone(), length, Text(model), result, error, TEXT("127.0.0.1"), port);
    return result;
  }

  /// One tick: Training Connection, and where somebody is connected so many Trainings.
  EConsacConnection Tick(int trainings = 1) {
    EConsacConnection connection = EConsacConnection::Failed;
    environment_->TrainingConnection(connection, error);
    for (int k = 0; k < trainings && connection == EConsacConnection::Connected; ++k) {
      const EConsacTraining training = Train();
      if (training != EConsacTraining::Step && training != EConsacTraining::Reset) break;
    }
    return connection;
  }

  /// Training and what follows from its pins.
  EConsacTraining Train() {
    EConsacTraining training = EConsacTraining::Failed;
    FConsacAction action;
    environment_->Train({seen_[0], seen_[1]}, reward_, done_, training, action, error);
    if (training == EConsacTraining::Step) {
      const std::int32_t choice = action.Choice;
      const worlds::StepResult result = road_.Step(&choice, rng_, seen_);
      reward_ = result.reward;
      done_ = result.terminated;
      ++steps;
      rewards.push_back(reward_);
      if (rewards.size() > 1000) rewards.pop_front();
    } else if (training == EConsacTraining::Reset) {
      road_.Reset(rng_, seen_);
      reward_ = 0.0f;
      done_ = false;
      ++resets;
    }
    return training;
  }

  /// Mean reward of the last steps, 1000 at most.
  double MeanReward() const {
    double sum = 0.0;
    for (const float reward : rewards) sum += static_cast<double>(reward);
    return rewards.empty() ? 0.0 : sum / static_cast<double>(rewards.size());
  }

  long steps = 0, resets = 0;
  std::deque<float> rewards;
  FString error;

 private:
  UConsacEnvironmentComponent* environment_;
  worlds::Road road_;
  Rng rng_;
  float seen_[2] = {};
  float reward_ = 0.0f;
  bool done_ = false;
};

/// An actor on the road as an agent component, with the events that a person would bind. What they work on lives as
/// long as they do, as a Blueprint's variables do: the actor may outlive this.
class RoadAgent {
  struct Walk {
    explicit Walk(std::uint64_t seed) : rng(seed, 0) {}
    std::vector<int64> seeds;
    double reward = 0.0;
    long steps = 0;
    worlds::Road road;
    Rng rng;
    float seen[2] = {};
  };
  std::shared_ptr<Walk> walk_;

 public:
  RoadAgent(Shim::Game& game, std::uint64_t seed, AActor* on = nullptr) : walk_(std::make_shared<Walk>(seed)) {
    actor = on != nullptr ? on : NewObject<AConsacTestActor>(&game.world());
    agent = NewObject<UConsacAgentComponent>(actor);
    actor->ShimAddSubobject(agent);
    FConsacEntry seen, done;
    seen.Name = TEXT("places");
    seen.Space = RoadSeen();
    done.Name = TEXT("walk");
    done.Space = RoadDone();
    agent->Observations.Add(seen);
    agent->Actions.Add(done);
    agent->OnEpisodeBegin.ShimBind(agent, [walk = walk_](UConsacAgentComponent*, int64 seed_or_none) {
      walk->seeds.push_back(seed_or_none);
      walk->road.Reset(walk->rng, walk->seen);
    });
    agent->OnObserve.ShimBind(agent, [walk = walk_](UConsacAgentComponent* which) {
      EXPECT_TRUE(which->SetObservationNumbers(TEXT("places"), {walk->seen[0], walk->seen[1]}));
    });
    agent->OnHeuristic.ShimBind(agent, [walk = walk_](UConsacAgentComponent* which) {
      EXPECT_TRUE(which->SetActionChoice(TEXT("walk"), walk->seen[1] > walk->seen[0] ? 2 : 0));
    });
    agent->OnAction.ShimBind(agent, [walk = walk_](UConsacAgentComponent* which) {
      const std::int32_t choice = which->GetActionChoice(TEXT("walk"));
      const worlds::StepResult result = walk->road.Step(&choice, walk->rng, walk->seen);
      which->AddReward(result.reward);
      walk->reward += static_cast<double>(result.reward);
      ++walk->steps;
      if (result.terminated) which->EndEpisode(EConsacEpisodeEnd::Terminated);
    });
    Shim::Enter(game.world(), *actor, FVector());
  }
  RoadAgent(const RoadAgent&) = delete;
  RoadAgent& operator=(const RoadAgent&) = delete;

  AActor* actor;
  UConsacAgentComponent* agent;
  std::vector<int64>& seeds = walk_->seeds;
  double& reward = walk_->reward;
  long& steps = walk_->steps;
};

}  // namespace consac::testing
