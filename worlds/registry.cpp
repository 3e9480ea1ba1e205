// The table of built-in worlds.
#include "worlds/registry.h"

#include <limits>

#include "consac/base/text.h"
#include "worlds/bit_flipping/bit_flipping.h"
#include "worlds/cartpole/cartpole.h"
#include "worlds/identity/identity.h"
#include "worlds/maze/maze.h"
#include "worlds/pendulum/pendulum.h"
#include "worlds/pixel_catch/pixel_catch.h"
#include "worlds/point/point.h"
#include "worlds/point_reach/point_reach.h"
#include "worlds/reach3/reach3.h"
#include "worlds/road/road.h"
#include "worlds/twin_reach/twin_reach.h"
#include "worlds/yumi_reach/yumi_reach.h"

namespace consac::worlds {
namespace {

// A piece of road around what matters: "....A.......o....".
std::string DescribeRoad(const VectorEnv& env, std::int32_t index) {
  const Road& road = static_cast<const Batched<Road>&>(env).world(static_cast<std::size_t>(index));
  std::string line(Road::kLast - Road::kFirst + 1, '.');
  line[static_cast<std::size_t>(road.coin())] = 'o';
  line[static_cast<std::size_t>(road.actor())] = 'A';
  return line;
}

std::string DescribePixelCatch(const VectorEnv& env, std::int32_t index) {
  const PixelCatch& game = static_cast<const Batched<PixelCatch>&>(env).world(static_cast<std::size_t>(index));
  return "ball in column " + std::to_string(game.ball_column()) + ", row " + std::to_string(game.ball_row()) +
         "; paddle in column " + std::to_string(game.paddle());
}

// Source: RL Baselines3 Zoo, FetchReach-v1 with HER.
constexpr const char* kReachSac =
    "sac: replay_buffer_class=HerReplayBuffer gamma=0.95 learning_rate=1e-3 batch_size=256 learning_starts=1000 "
    "buffer_size=100000 net_arch=[64,64] norm_obs=true";

constexpr World kWorlds[] = {
    {"road-v0", "walk along a road to a coin: the thesis' worked example", "CONSAC master thesis, Tallinn 2021",
     MakeBatched<Road>, DescribeRoad,
     "ppo2: n_steps=256 learning_rate=lin_2e-3 gamma=0.7 ent_coef=0.001 noptepochs=10 norm_obs=true"},
    {"cartpole-v1", "balance a pole on a cart", "Gymnasium CartPole-v1; Barto, Sutton and Anderson 1983",
     MakeBatched<CartPole>, nullptr,
     "ppo2: n_steps=32 nminibatches=1 noptepochs=20 gamma=0.98 lam=0.8 ent_coef=0 learning_rate=lin_1e-3 "
     "cliprange=lin_0.2"},
    {"pendulum-v1", "swing a pendulum up and hold it", "Gymnasium Pendulum-v1", MakeBatched<Pendulum>, nullptr,
     "ppo: gamma=0.9 learning_rate=lin_1e-3 n_steps=1024"},
    {"point-v0", "push a point mass over a plane to a goal", "CONSAC", MakeBatched<Point>, nullptr, ""},
    {"maze-v0", "find the way out of a small maze", "CONSAC", MakeBatched<Maze>, nullptr, ""},
    {"reach3-v0", "reach for a point in space with three joints", "CONSAC", MakeBatched<Reach3>, nullptr, ""},
    {"pixel-catch-v0", "catch falling balls, seen as an image", "CONSAC, after bsuite's catch (Osband et al. 2020)",
     MakeBatched<PixelCatch>, DescribePixelCatch, ""},
    {"identity-discrete-v0", "do what is observed: a number", "Stable Baselines, identity_env.py",
     MakeBatched<IdentityDiscrete>, nullptr, ""},
    {"identity-box-v0", "do what is observed: a real number", "Stable Baselines, identity_env.py",
     MakeBatched<IdentityBox>, nullptr, ""},
    {"identity-multidiscrete-v0", "do what is observed: two numbers", "Stable Baselines, identity_env.py",
     MakeBatched<IdentityMultiDiscrete>, nullptr, ""},
    {"identity-multibinary-v0", "do what is observed: four bits", "Stable Baselines, identity_env.py",
     MakeBatched<IdentityMultiBinary>, nullptr, ""},
    {"bit-flipping-v0", "flip one of ten bits at a time until all are ones; nothing else pays",
     "Andrychowicz et al. 2017; Stable Baselines, bit_flipping_env.py", MakeBatched<BitFlippingDiscrete>, nullptr, ""},
    {"bit-flipping-continuous-v0", "the same by ten numbers, of which the positive ones flip",
     "Andrychowicz et al. 2017; Stable Baselines, bit_flipping_env.py", MakeBatched<BitFlippingContinuous>, nullptr,
     ""},
    {"point-reach-v0", "move a point over a plane to where it is wanted; nothing else pays",
     "CONSAC, after Plappert et al. 2018 (FetchReach)", MakeBatched<PointReachSparse>, nullptr,
     "sac: replay_buffer_class=HerReplayBuffer learning_rate=1e-3 gamma=0.95 net_arch=[64,64] learning_starts=500"},
    {"point-reach-dense-v0", "the same, paid by the distance", "CONSAC, after Plappert et al. 2018 (FetchReach)",
     MakeBatched<PointReachDense>, nullptr, ""},
    {"yumi-reach-v0", "bring an arm of ABB's YuMi to a point, by its tool",
     "FetchReach-v4 of Gymnasium-Robotics, with ABB's YuMi", MakeYumiReach<YumiReach::kPlain>, nullptr, kReachSac,
     RobotReach::FirstOf},
    {"yumi-reach-dense-v0", "the same, paid by the distance", "as yumi-reach-v0", MakeYumiReach<YumiReach::kDense>,
     nullptr, "", RobotReach::FirstOf},
    {"yumi-reach-joints-v0", "the same by seven joints", "as yumi-reach-v0", MakeYumiReach<YumiReach::kJoints>, nullptr,
     kReachSac, RobotReach::FirstOf},
    {"yumi-reach-precise-v0", "the same to 1 cm", "as yumi-reach-v0", MakeYumiReach<YumiReach::kPrecise>, nullptr,
     kReachSac, RobotReach::FirstOf},
    {"yumi-reach-dual-v0", "both arms at once, which must not touch", "as yumi-reach-v0",
     MakeYumiReach<YumiReach::kDual>, nullptr, kReachSac, RobotReach::FirstOf},
    {"twin-reach-v0", "bring the tool of any robot that `consac twin import` made to a point", "as yumi-reach-v0",
     nullptr, nullptr, kReachSac, RobotReach::FirstOf, "TWIN", MakeTwinReach<TwinReachPhysics::kKinematic>},
    {"twin-reach-mujoco-v0", "the same with masses, motors and contacts, by MuJoCo", "as yumi-reach-v0", nullptr,
     nullptr, kReachSac, RobotReach::FirstOf, "TWIN", MakeTwinReach<TwinReachPhysics::kMujoco>},
};

}  // namespace

std::span<const World> Worlds() {
  return kWorlds;
}

Result<const World*> FindWorld(std::string_view name) {
  const std::size_t colon = name.find(':');
  const std::string_view id = name.substr(0, colon);
  std::vector<std::string_view> known;
  for (const World& world : kWorlds) {
    known.emplace_back(world.id);
    if (world.id != id) continue;
    const bool told = colon != std::string_view::npos;
    if (told && world.argument == nullptr)
      return Status{StatusCode::kInvalidArgument, Quote(name) + ": " + world.id + " takes nothing after its name"};
    if (world.argument != nullptr && (!told || colon + 1 == name.size()))
      return Status{StatusCode::kInvalidArgument, std::string(world.id) + " needs to be told more: " + world.id + ":" +
                                                      world.argument + " (docs/worlds.md)"};
    return &world;
  }
  return Status{StatusCode::kNotFound, "unknown world " + Quote(id) + Suggestion(id, known)};
}

Result<std::unique_ptr<VectorEnv>> MakeWorld(std::string_view name, std::int32_t count) {
  const Result<const World*> world = FindWorld(name);
  if (!world.ok()) return world.status();
  if ((*world)->argument != nullptr) return (*world)->create_of(name.substr(name.find(':') + 1), count);
  return (*world)->create(count);
}

}  // namespace consac::worlds
