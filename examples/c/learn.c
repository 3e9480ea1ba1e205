// Learns inside the game, in its ticks, and writes a model.
//   cc -std=c11 learn.c -lconsac -lm -o learn && ./learn ball.consac
#include "tick.h"

int main(int count, char** arguments) {
  consac_world* world;
  ball balls[BALLS] = {{0.0f, 0.0f}};
  consac_status status = describe(&world);
  if (status != CONSAC_OK) return failed("describing", status);

  const consac_training training = {.size = sizeof(training),
                                    .algorithm = "ppo2",
                                    .hyperparameters = "n_steps=64; learning_rate=1e-3",
                                    .total_steps = 40000,
                                    .seed = 1};
  status = consac_world_train(world, &training);
  while (status == CONSAC_OK && !consac_world_finished(world)) status = tick(world, balls, 0.01);
  if (status != CONSAC_OK) return failed("learning", status);

  consac_progress progress = {.size = sizeof(progress)};
  consac_world_progress(world, &progress);
  printf("%s: %lld steps, mean reward %.1f\n", progress.state, (long long)progress.steps, progress.mean_episode_reward);
  status = consac_world_save_model(world, 0, count > 1 ? arguments[1] : "ball.consac");
  if (status != CONSAC_OK) return failed("saving", status);
  consac_world_free(world);
  return 0;
}
