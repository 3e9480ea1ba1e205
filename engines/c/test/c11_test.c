/* The header as C11 has it: sizes, defaults, errors. Links the shared library. */
#include <consac.h>
#include <stdio.h>
#include <string.h>

#define EXPECT(what)                                          \
  do {                                                        \
    if (!(what)) {                                            \
      fprintf(stderr, "line %d: %s\n", __LINE__, #what);      \
      return 1;                                               \
    }                                                         \
  } while (0)

/* What the ABI has promised: offsets and sizes of version 0.1. */
_Static_assert(sizeof(void*) != 8 || sizeof(consac_leaf) == 56, "consac_leaf");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_acting) == 64, "consac_acting");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_box) == 64, "consac_box");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_goals) == 40, "consac_goals");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_serving) == 72, "consac_serving");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_training) == 72, "consac_training");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_playing) == 24, "consac_playing");
_Static_assert(sizeof(void*) != 8 || sizeof(consac_progress) == 96, "consac_progress");

static int lines;
static void count_line(void* user, int32_t level, const char* line) {
  (void)level, (void)line;
  *(int*)user += 1;
}

int main(void) {
  EXPECT(consac_abi_version() == CONSAC_ABI_VERSION);
  EXPECT(strchr(consac_version(), '.') != NULL);
  EXPECT(strcmp(consac_last_error(), "") == 0);
  EXPECT(strcmp(consac_status_name(CONSAC_DATA_LOSS), "DATA_LOSS") == 0);
  EXPECT(strcmp(consac_status_name(77), "UNKNOWN") == 0);
  EXPECT(strcmp(consac_algorithm(0), "ppo2") == 0 && consac_algorithm(1000) == NULL);

  consac_model* model = (consac_model*)&lines;
  EXPECT(consac_model_load("no such file", &model) == CONSAC_NOT_FOUND && model == NULL);
  EXPECT(strstr(consac_last_error(), "no such file") != NULL);
  consac_model_free(NULL);

  /* A world that is played by hand; a number that is none is told of, and so is one beyond its bounds, to the log. */
  consac_set_log(count_line, &lines);
  consac_world* world;
  consac_cue cue;
  EXPECT(consac_world_new(NULL, &world) == CONSAC_OK);
  EXPECT(consac_world_add_behaviour(world, "default", 1, NULL) == CONSAC_OK);
  EXPECT(consac_world_add_numbers(world, 0, CONSAC_OBSERVATION, "seen", 1, -1.0, 1.0) == CONSAC_OK);
  EXPECT(consac_world_add_discrete(world, 0, CONSAC_ACTION, "done", 2, 0) == CONSAC_OK);
  EXPECT(consac_world_poll(world, 0.0, &cue) == CONSAC_FAILED_PRECONDITION);
  EXPECT(consac_world_by_hand(world, 1) == CONSAC_OK);
  EXPECT(consac_world_poll(world, 0.0, &cue) == CONSAC_OK && cue == CONSAC_RESET);
  float seen = 5.0f;
  memcpy(consac_agent_observation(world, 0), &seen, sizeof(seen));
  EXPECT(consac_world_offer(world) == CONSAC_OK && lines == 1);
  EXPECT(consac_world_poll(world, 0.0, &cue) == CONSAC_OK && cue == CONSAC_ACT);
  EXPECT(consac_agent_add_reward(world, 0, 1e38f * 1e38f) == CONSAC_OK);
  EXPECT(consac_world_offer(world) == CONSAC_NON_FINITE);
  consac_progress progress = {.size = sizeof(progress)};
  EXPECT(consac_world_progress(world, &progress) == CONSAC_OK && progress.all_steps == 1);
  consac_world_free(world);
  consac_set_log(NULL, NULL);
  puts("holds");
  return 0;
}
