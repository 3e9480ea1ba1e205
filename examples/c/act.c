// Loads a model and asks it what to do.
//   cc -std=c11 act.c -lconsac -lm -o act && ./act ball.consac
#include <consac.h>
#include <stdio.h>

#include "ball.h"

int main(int count, char** arguments) {
  consac_model* model;
  if (consac_model_load(count > 1 ? arguments[1] : "ball.consac", &model) != CONSAC_OK) {
    fprintf(stderr, "%s\n", consac_last_error());
    return 1;
  }
  ball ours = {.place = 1.0f, .speed = 0.0f};
  for (int step = 0; step < BALL_STEPS; ++step) {
    int32_t push;
    if (consac_model_act(model, &ours, sizeof(ours), &push, sizeof(push)) != CONSAC_OK) {
      fprintf(stderr, "%s\n", consac_last_error());
      return 1;
    }
    ball_step(&ours, push);
  }
  printf("from 1.00 to %.2f\n", ours.place);
  consac_model_free(model);
  return 0;
}
