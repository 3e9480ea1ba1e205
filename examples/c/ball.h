// The game of these examples: a ball on a line is pushed to the middle and held there. No CONSAC in here.
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { BALLS = 4, BALL_STEPS = 50 };  // balls that play beside each other; steps of an episode

typedef struct ball {
  float place, speed;  // -1.5 to 1.5; a step is a tenth of a second
} ball;

static void ball_begin(ball* b) {
  b->place = 2.0f * (float)rand() / (float)RAND_MAX - 1.0f;
  b->speed = 0.0f;
}

// `push` is 0 (left), 1 (not at all) or 2 (right). What the step pays: the nearer to the middle, the more.
static float ball_step(ball* b, int32_t push) {
  b->speed = 0.8f * b->speed + 0.1f * (float)(push - 1);
  b->place += b->speed;
  return 1.0f - fabsf(b->place);
}

static int ball_is_lost(const ball* b) {
  return fabsf(b->place) > 1.5f;
}
