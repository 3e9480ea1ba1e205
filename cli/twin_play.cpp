#include "cli/twin_play.h"

#include <algorithm>

#include "consac/base/text.h"
#include "consac/run/training.h"
#include "worlds/yumi_reach/yumi_reach.h"

namespace consac::cli {
namespace {

constexpr std::string_view kRobotWorlds = "yumi-reach";  // what ids of worlds with a robot begin with
constexpr auto kStepTime = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
    std::chrono::duration<double>(worlds::YumiArmState::kStep));
constexpr int kMostAtOnce = 5;  // steps; after a stop of the machine the rest is not made up
// In a row: achieved_goal, desired_goal, observation.
constexpr std::size_t kToolAt = 0, kTargetAt = worlds::YumiArmState::kGoal, kJointsAt = 2 * kTargetAt;

}  // namespace

TwinPlay::TwinPlay(std::unique_ptr<VectorEnv> env, run::Actors actors, std::int64_t seed)
    : env_(std::move(env)), actors_(std::move(actors)), seed_(static_cast<std::uint64_t>(seed)) {
  state_.world = env_->spec().id;
  Reset();
}

Result<TwinPlay> TwinPlay::Open(const std::vector<std::string>& models, const robot::Robot& twin, std::int64_t seed) {
  const Result<Policy> policy = Policy::Load(models[0]);
  if (!policy.ok()) return policy.status();
  const std::string id = run::TrainedWorld(*policy);
  if (!id.starts_with(kRobotWorlds))
    return Status{StatusCode::kInvalidArgument, "--model was trained in " + Quote(id) +
                                                    ", which has no robot; yumi-reach-v0 and its variants have one"};
  const Result<const worlds::World*> world = worlds::FindWorld(id);
  if (!world.ok()) return world.status();
  for (const robot::Joint& joint : worlds::YumiRightArm().joints) {
    if (twin.FindJoint(joint.name) < 0)
      return Status{StatusCode::kInvalidArgument, "the twin " + Quote(twin.name) + " has no joint " +
                                                      Quote(joint.name) + ", which " + id +
                                                      " moves; take examples/robots/yumi"};
  }
  std::unique_ptr<VectorEnv> env = (*world)->create(1);
  Result<run::Actors> actors = run::Actors::Load(models, env->spec());
  if (!actors.ok()) return actors.status();
  return TwinPlay(std::move(env), std::move(*actors), seed);
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

PlayState TwinPlay::State() {
  PlayState state = state_;
  const Batch& batch = actors_.batches()[0];
  const Layout& layout = actors_.policy(0).observation_layout();
  std::vector<double> row;
  for (const Leaf& leaf : layout.leaves) {
    for (std::int64_t i = 0; i < leaf.count; ++i) row.push_back(ReadElement(leaf, batch.next_observations, i));
  }
  for (std::size_t i = 0; i < 3; ++i) state.tool[i] = row[kToolAt + i], state.target[i] = row[kTargetAt + i];
  const robot::Robot& arm = worlds::YumiRightArm();
  for (std::size_t i = 0; i < arm.joints.size(); ++i) state.joints.emplace_back(arm.joints[i].name, row[kJointsAt + i]);
  return state;
}

}  // namespace consac::cli
