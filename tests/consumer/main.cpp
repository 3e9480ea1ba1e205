// Lists what an installed CONSAC can learn with, and steps one of its worlds.
#include <consac/env/buffer.h>
#include <consac/learn/algo/learner.h>
#include <worlds/registry.h>

#include <cstdio>

int main() {
  for (const consac::learn::Algorithm& algorithm : consac::learn::Algorithms()) std::printf("%s\n", algorithm.name);
  const std::unique_ptr<consac::VectorEnv> world = (*consac::worlds::FindWorld("road-v0"))->create(2);
  consac::BatchBuffer buffer(world->spec().behaviours[0]);
  world->Reset(1, {&buffer.batch(), 1});
  std::printf("%s has %zu agents\n", world->spec().id.c_str(), buffer.batch().slots.size());
}
