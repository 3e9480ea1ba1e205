// Serves the game to a trainer, until one has taken all of its steps.
//   cc -std=c11 serve.c -lconsac -lm -o serve && ./serve 5005
//   consac train tcp://127.0.0.1:5005
#include "tick.h"

int main(int count, char** arguments) {
  consac_world* world;
  ball balls[BALLS] = {{0.0f, 0.0f}};
  consac_status status = describe(&world);
  if (status != CONSAC_OK) return failed("describing", status);

  const consac_serving serving = {
      .size = sizeof(serving), .port = count > 1 ? atoi(arguments[1]) : 5005, .training_length = 40000};
  status = consac_world_serve(world, &serving);
  if (status != CONSAC_OK) return failed("serving", status);
  printf("listening on tcp://127.0.0.1:%d\n", consac_world_port(world));
  fflush(stdout);
  while (!consac_world_finished(world)) {
    status = tick(world, balls, 0.01);
    if (status != CONSAC_OK) failed("a tick", status);  // a trainer that broke off: the next one may come
  }
  printf("trained\n");
  consac_world_free(world);
  return 0;
}
