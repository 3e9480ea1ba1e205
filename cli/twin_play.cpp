#include "cli/twin_play.h"

#include <algorithm>

#include "consac/base/text.h"
#include "consac/run/training.h"
#include "worlds/robot_reach/robot_reach.h"

namespace consac::cli {
namespace {

constexpr auto kStepTime = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
    std::chrono::duration<double>(worlds::RobotReach::kStep));
constexpr int kMostAtOnce = 5;  // steps; after a stop of the machine the rest is not made up

}  // namespace

TwinPlay::TwinPlay(const worlds::World& world, std::unique_ptr<VectorEnv> env, run::Actors actors, std::int64_t seed)
    : world_(&world), env_(std::move(env)), actors_(std::move(actors)), seed_(static_cast<std::uint64_t>(seed)) {
  state_.world = env_->spec().id;
  Reset();
}

Result<TwinPlay> TwinPlay::Open(const std::vector<std::string>& models, const robot::Robot& twin, std::int64_t seed) {
  const Result<Policy> policy = Policy::Load(models[0]);
  if (!policy.ok()) return policy.status();
  const std::string id = run::TrainedWorld(*policy);
  const Result<const worlds::World*> world = worlds::FindWorld(id);
  if (!world.ok() || (*world)->robot == nullptr)
    return Status{StatusCode::kInvalidArgument,
                  "--model was trained in " + Quote(id) +
                      ", which has no robot; yumi-reach-v0, its variants and twin-reach-v0 have one"};
  Result<std::unique_ptr<VectorEnv>> env = worlds::MakeWorld(id, 1);
  if (!env.ok()) return env.status();
  for (const robot::Joint& joint : (*world)->robot(**env).task().robot.joints) {
    if (joint.position_index >= 0 && twin.FindJoint(joint.name) < 0)
      return Status{StatusCode::kInvalidArgument, "the twin " + Quote(twin.name) + " has no joint " +
                                                      Quote(joint.name) + ", which " + Quote(id) +
                                                      " moves; view the twin that it was trained with"};
  }
  Result<run::Actors> actors = run::Actors::Load(models, (*env)->spec());
  if (!actors.ok()) return actors.status();
  return TwinPlay(**world, std::move(*env), std::move(*actors), seed);
}

void TwinPlay::Reset() {
  env_->Reset(seed_, actors_.batches());
  actors_.Begin();
  rng_ = Rng(seed_, StreamId("action_sampling"));
  state_.episode = 1, state_.step = 0, state_.reward = 0.0;
}

bool TwinPlay::Do(std::string_view what) {
  if (what != "start" && what != "pause" && what != "reset") return false;
  state_.running = what == "start";
  if (what == "reset") Reset();
  due_ = Clock::now();
  return true;
}

void TwinPlay::Step() {
  actors_.Act(0, env_->present(0), ActionMode::kDeterministic, rng_);
  env_->Step(actors_.batches());
  const Batch& batch = actors_.batches()[0];
  state_.reward = static_cast<double>(batch.rewards[0]);
  state_.step += 1;
  if ((batch.terminated[0] | batch.truncated[0]) == 0) return;
  state_.episode += 1;
  state_.step = 0;
}

void TwinPlay::Advance() {
  if (!state_.running) return;
  const Clock::time_point now = Clock::now();
  due_ = std::max(due_, now - kMostAtOnce * kStepTime);
  for (; due_ <= now; due_ += kStepTime) Step();
}

PlayState TwinPlay::State() const {
  PlayState state = state_;
  const worlds::RobotReach& reach = world_->robot(*env_);
  const robot::Robot& robot = reach.task().robot;
  for (std::size_t i = 0; i < reach.goals().size(); i += 3) {
    state.targets.push_back({reach.goals()[i], reach.goals()[i + 1], reach.goals()[i + 2]});
    state.tools.push_back({reach.tools()[i], reach.tools()[i + 1], reach.tools()[i + 2]});
  }
  for (std::size_t i = 0; i < reach.joints().size(); ++i)
    state.joints.emplace_back(robot.joints[static_cast<std::size_t>(robot.position_joints[i])].name, reach.joints()[i]);
  return state;
}

}  // namespace consac::cli
