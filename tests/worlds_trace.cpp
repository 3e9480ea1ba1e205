// For tests/python/test_gymnasium.py: reads episodes on stdin, a line each, and prints every transition.
//   cartpole-v1 x x_dot theta theta_dot : action action ...
//   pendulum-v1 angle speed : torque torque ...
// A printed line is "reward terminated observation...", an empty line ends an episode.
#include <cstdio>
#include <iostream>
#include <sstream>
#include <string>

#include "worlds/cartpole/cartpole.h"
#include "worlds/pendulum/pendulum.h"

namespace {

template <class W, std::size_t StateSize>
void Trace(std::istringstream& line, std::size_t observation_size) {
  double state[StateSize];
  std::string colon;
  for (double& value : state) line >> value;
  line >> colon;
  W world;
  world.SetState(state);
  consac::Rng rng;
  for (double number = 0; line >> number;) {
    float observation[4];
    const auto action = static_cast<typename W::Action>(number);
    const consac::worlds::StepResult result = world.Step(&action, rng, observation);
    std::printf("%.9g %d", static_cast<double>(result.reward), result.terminated ? 1 : 0);
    for (std::size_t i = 0; i < observation_size; ++i) std::printf(" %.9g", static_cast<double>(observation[i]));
    std::printf("\n");
    if (result.terminated) break;
  }
  std::printf("\n");
}

}  // namespace

int main() {
  for (std::string text; std::getline(std::cin, text);) {
    std::istringstream line(text);
    std::string world;
    line >> world;
    if (world == "cartpole-v1")
      Trace<consac::worlds::CartPole, 4>(line, 4);
    else
      Trace<consac::worlds::Pendulum, 2>(line, 3);
  }
}
