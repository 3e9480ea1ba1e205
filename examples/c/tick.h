// What an engine does in a tick, whoever drives the balls: a trainer elsewhere, a learner inside, a model.
#include <consac.h>
#include <stdio.h>
#include <string.h>

#include "ball.h"

// The balls as a world: two numbers are seen, one of three is done.
static consac_status describe(consac_world** world) {
  consac_status status = consac_world_new("ball-v0", world);
  if (status == CONSAC_OK) status = consac_world_add_behaviour(*world, "ball", BALLS, NULL);
  if (status == CONSAC_OK) status = consac_world_add_numbers(*world, 0, CONSAC_OBSERVATION, "ball", 2, -2.0, 2.0);
  if (status == CONSAC_OK) status = consac_world_add_discrete(*world, 0, CONSAC_ACTION, "push", 3, 0);
  if (status == CONSAC_OK) status = consac_world_set_time_limit(*world, BALL_STEPS);
  return status;
}

static consac_status tick(consac_world* world, ball balls[BALLS], double wait_s) {
  consac_cue cue;
  const consac_status status = consac_world_poll(world, wait_s, &cue);
  if (status != CONSAC_OK || cue == CONSAC_WAIT) return status;
  for (consac_agent a = 0; a < BALLS; ++a) {
    uint64_t seed;
    if (cue == CONSAC_RESET && consac_agent_seed(world, a, &seed)) srand((unsigned)seed);
    if (cue == CONSAC_RESET && consac_agent_resets(world, a)) ball_begin(&balls[a]);
    if (cue == CONSAC_ACT) {
      int32_t push;
      memcpy(&push, consac_agent_action(world, a), sizeof(push));
      consac_agent_add_reward(world, a, ball_step(&balls[a], push));
      if (ball_is_lost(&balls[a])) consac_agent_end_episode(world, a, CONSAC_TERMINATED);
      if (consac_agent_is_ending(world, a)) {
        memcpy(consac_agent_final_observation(world, a), &balls[a], sizeof(ball));
        ball_begin(&balls[a]);
      }
    }
    memcpy(consac_agent_observation(world, a), &balls[a], sizeof(ball));
  }
  return consac_world_offer(world);
}

// Says what went wrong; the exit code.
static int failed(const char* what, consac_status status) {
  fprintf(stderr, "%s: %s: %s\n", what, consac_status_name(status), consac_last_error());
  return 1;
}
