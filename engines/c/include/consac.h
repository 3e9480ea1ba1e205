// CONSAC for C, and for everything that binds to C: C#, Rust, Lua, Java, Python. Models that act, agents in an engine's
// ticks that learn inside or are served to a trainer. One shared library: libconsac.so.0, consac.dll, libconsac.dylib.
//
//   consac_model* model = NULL;                             load and act
//   if (consac_model_load("road.consac", &model) != CONSAC_OK) puts(consac_last_error());
//   float place[2] = {10, 37};
//   int32_t move = 0;
//   consac_model_act(model, place, sizeof(place), &move, sizeof(move));
//   consac_model_free(model);
//
// Errors.   What can fail returns a consac_status; consac_last_error() then has one sentence: what, the offending
//           value, what to do. Nothing aborts, throws or prints (but see consac_set_log). NULL, a wrong size or a call
//           at the wrong moment is an error like any other, and leaves everything as it was.
// Rows.     What is seen or done by one agent is a row of bytes: a box of float32 is its numbers, a discrete choice is
//           one int32_t (its start included). With several entries the row holds them sorted by name, each aligned to
//           its type; consac_model_leaf and consac_world_leaf say where. The rows themselves may lie anywhere.
// Units.    Seconds; what rows hold is the world's own.
// Lifetime. Whoever makes a handle frees it, in any order: nothing keeps another's handle. A pointer that is returned
//           says how long it lives. After it is freed a handle must not be used.
// Threads.  A handle is used by one thread at a time; different handles may be used by different threads at once. No
//           thread is started but by consac_world_train, and by consac_world_act where `pipelined` asks for it; both
//           end with their driver. consac_last_error() is the calling thread's own.
// Memory.   Acting and ticking allocate nothing once room was made. Where memory runs out, the call fails with
//           CONSAC_RESOURCE_EXHAUSTED as far as the system lets it; of a world that this happened to, nothing is left
//           but to free it.
// Text.     UTF-8, ended by NUL.
// ABI.      Functions and values are added, never changed, while CONSAC_ABI_MAJOR stays: a program that was compiled
//           with an older header goes on with a newer library. Structs begin with their size and may grow at their end;
//           a field that is 0 (or NULL) has its default, so zeroed structs are good beginnings.

#ifndef CONSAC_H
#define CONSAC_H

#include <stddef.h>
#include <stdint.h>

#if defined(CONSAC_STATIC)
#define CONSAC_API
#elif defined(_WIN32) && defined(CONSAC_BUILDING)
#define CONSAC_API __declspec(dllexport)
#elif defined(_WIN32)
#define CONSAC_API __declspec(dllimport)
#else
#define CONSAC_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- the library

/// The ABI of this header. Another major is another library (libconsac.so.MAJOR).
#define CONSAC_ABI_MAJOR 0
#define CONSAC_ABI_MINOR 1
#define CONSAC_ABI_VERSION ((CONSAC_ABI_MAJOR << 16) | CONSAC_ABI_MINOR)

/// What came of a call; CONSAC_OK is 0. The names are the values' own for ever.
typedef int32_t consac_status;
enum {
  CONSAC_OK = 0,
  CONSAC_INVALID_ARGUMENT = 1,     ///< a value that cannot be used: NULL, a wrong size, an unknown name, out of range
  CONSAC_NOT_FOUND = 2,            ///< no such file
  CONSAC_ALREADY_EXISTS = 3,       ///< a name or port that is taken
  CONSAC_FAILED_PRECONDITION = 4,  ///< right call, wrong moment
  CONSAC_DATA_LOSS = 5,            ///< a damaged, cut or foreign file; nothing of it was used
  CONSAC_PROTOCOL = 6,             ///< bytes from a trainer that do not fit the protocol
  CONSAC_NON_FINITE = 7,           ///< NaN or infinity where a number is needed
  CONSAC_UNAVAILABLE = 8,          ///< the trainer went away
  CONSAC_DEADLINE_EXCEEDED = 9,    ///< the trainer is silent past its deadline
  CONSAC_RESOURCE_EXHAUSTED = 10,  ///< no memory, disk, descriptor or thread is left
  CONSAC_CANCELLED = 11,           ///< somebody asked to stop
  CONSAC_INTERNAL = 12             ///< a mistake of CONSAC's own
};

/// The ABI of the library that is loaded, CONSAC_ABI_VERSION of its own header: whoever loads it by name compares.
CONSAC_API uint32_t consac_abi_version(void);
/// CONSAC's version, "0.2.0". Lives for ever.
CONSAC_API const char* consac_version(void);
/// "INVALID_ARGUMENT"; "UNKNOWN" for what is no status. Lives for ever.
CONSAC_API const char* consac_status_name(consac_status status);
/// Why the calling thread's latest call that failed did so; "" before there was one. Lives until the next such.
CONSAC_API const char* consac_last_error(void);
/// A learning algorithm's name by its number from 0, "ppo2"; NULL past the last. Lives for ever.
CONSAC_API const char* consac_algorithm(size_t index);

/// How loud a line is.
enum { CONSAC_LOG_DEBUG = 0, CONSAC_LOG_INFO = 1, CONSAC_LOG_WARNING = 2, CONSAC_LOG_ERROR = 3 };
/// Takes one line without its end; `line` lives during the call. Called by any thread that calls into CONSAC, and by
/// those of CONSAC's own; must not throw.
typedef void (*consac_log_function)(void* user, int32_t level, const char* line);
/// Where CONSAC's lines go, of all handles; `user` is handed back. NULL: to the standard error, as in the beginning. To
/// be called while no other call is under way and nothing learns: first of all, that is.
CONSAC_API void consac_set_log(consac_log_function log, void* user);

// ---- spaces and rows

/// Which rows.
typedef int32_t consac_rows;
enum {
  CONSAC_OBSERVATION = 0,  ///< what is seen
  CONSAC_ACTION = 1,       ///< what is done
  CONSAC_MASK = 2          ///< which choices are legal: a byte each, 0 or 1
};

/// What kind of numbers a leaf holds.
typedef int32_t consac_kind;
enum {
  CONSAC_DISCRETE = 0,        ///< one of n: an int32_t from `start`
  CONSAC_BOX = 1,             ///< numbers between bounds, of the type that was asked for
  CONSAC_MULTI_DISCRETE = 2,  ///< several choices: an int32_t each, from 0
  CONSAC_MULTI_BINARY = 3     ///< bits: a uint8_t each
};

/// Types of numbers in a row.
typedef int32_t consac_type;
enum {
  CONSAC_FLOAT32 = 0,
  CONSAC_FLOAT64 = 1,
  CONSAC_UINT8 = 2,
  CONSAC_INT8 = 3,
  CONSAC_INT16 = 4,
  CONSAC_INT32 = 5,
  CONSAC_INT64 = 6,
  CONSAC_UINT16 = 7,
  CONSAC_UINT32 = 8,
  CONSAC_UINT64 = 9,
  CONSAC_BOOL = 10
};

/// One named part of a row. `size` is set by the caller, the rest by the library.
typedef struct consac_leaf {
  size_t size;       ///< sizeof(consac_leaf)
  const char* name;  ///< "" where the whole row is one; lives as long as the handle
  consac_kind kind;
  consac_type type;     ///< of each number in the row
  int64_t count;        ///< numbers
  size_t offset;        ///< bytes from the row's start
  int64_t mask_offset;  ///< bytes from the start of a row of masks
  int64_t mask_count;   ///< bytes of masks: n of a choice, 2 of a bit, 0 of a box
} consac_leaf;

// ---- models

/// A trained model that acts, with all that it needs.
typedef struct consac_model consac_model;

/// Loads a `.consac` file, which then answers its own self-test. On failure `*model` is NULL.
CONSAC_API consac_status consac_model_load(const char* path, consac_model** model);
/// The same from `size` bytes in memory, which are not kept.
CONSAC_API consac_status consac_model_load_bytes(const void* bytes, size_t size, consac_model** model);
/// Frees it; NULL is nothing to free.
CONSAC_API void consac_model_free(consac_model* model);
/// Writes it as a file, by a temporary file, sync and rename.
CONSAC_API consac_status consac_model_save(const consac_model* model, const char* path);
/// The file's bytes. `*size` holds the room of `bytes` [*size], and then how long the file is. `bytes` NULL: asks for
/// the length alone. CONSAC_RESOURCE_EXHAUSTED where the room does not do; `*size` says what does.
CONSAC_API consac_status consac_model_bytes(const consac_model* model, void* bytes, size_t* size);

/// The behaviour that it was learned for, "default"; NULL for NULL. Lives as long as the model.
CONSAC_API const char* consac_model_behaviour(const consac_model* model);
/// What it says of its training, as JSON: algorithm, steps, hyperparameters. Lives as long as the model.
CONSAC_API const char* consac_model_training(const consac_model* model);
/// 1 where rows are agents that stay and `begins` says who begins: it is recurrent, or what it draws (`sample`) follows
/// the state by noise of each agent's own (gSDE).
CONSAC_API int32_t consac_model_remembers(const consac_model* model);
/// Bytes of one row; of masks 0 where nothing can be masked. 0 for NULL.
CONSAC_API size_t consac_model_row_bytes(const consac_model* model, consac_rows rows);
/// Leaves of a row of observations or actions. 0 for NULL.
CONSAC_API size_t consac_model_leaf_count(const consac_model* model, consac_rows rows);
/// Leaf `index` of a row of observations or actions, in the row's order.
CONSAC_API consac_status consac_model_leaf(const consac_model* model, consac_rows rows, size_t index,
                                           consac_leaf* leaf);
/// The bounds of number `element` of that leaf; infinite where a box is open.
CONSAC_API consac_status consac_model_bounds(const consac_model* model, consac_rows rows, size_t index, int64_t element,
                                             double* low, double* high);

/// Makes room for `rows` rows at once (and as many agents, where it remembers). The one call of those that act which
/// allocates; without it, it is made by the first act of so many rows. What agents remember stays.
CONSAC_API consac_status consac_model_reserve(consac_model* model, int64_t rows);
/// What draws begin from (consac_acting.sample); 0 in the beginning.
CONSAC_API consac_status consac_model_seed(consac_model* model, uint64_t seed);
/// The best actions for any number of rows: `observations` [rows, row bytes], `actions` [rows, row bytes] out. Sizes
/// are in bytes, and as many rows must be in both. CONSAC_NON_FINITE for an observation that is no number. Where the
/// model remembers, row r is agent r, and everybody goes on.
CONSAC_API consac_status consac_model_act(consac_model* model, const void* observations, size_t observations_size,
                                          void* actions, size_t actions_size);

/// Everything that an act may be told.
typedef struct consac_acting {
  size_t size;               ///< sizeof(consac_acting)
  const void* observations;  ///< [rows, observation row bytes]
  void* actions;             ///< [rows, action row bytes] out
  int64_t rows;              ///< how many
  const uint8_t* masks;      ///< [rows, mask row bytes] 1: legal; NULL: everything is
  const int32_t* agents;  ///< [rows] where the model remembers: which agent each row is, from 0 below the room that was
                          ///< made; NULL: row r is agent r
  const uint8_t* begins;  ///< [rows] 1: the agent's episode begins, it remembers nothing; NULL: none does
  int32_t sample;         ///< 0: the best action; 1: one drawn
} consac_acting;
/// As consac_model_act, with masks, agents that stay, and draws. Buffers are the caller's, of the sizes that `rows`
/// says.
CONSAC_API consac_status consac_model_act_rows(consac_model* model, const consac_acting* acting);

// ---- a world of agents, in an engine's ticks

// A world is described (add_behaviour, add_...), then driven (serve, train, act or by_hand), and ticked by its engine:
//
//   consac_world_poll(world, 0.0, &cue);          once a tick: never waits
//   if (cue == CONSAC_WAIT) return;               nobody wants anything of the agents yet
//   CONSAC_RESET: for every agent that consac_agent_resets(): put it at its start
//   CONSAC_ACT:   for every agent: carry out consac_agent_action(), let ticks pass, add_reward, perhaps end_episode;
//                 for every agent that is_ending(): write final_observation, put it at its start
//   for every agent: write consac_agent_observation()
//   consac_world_offer(world);
//
// Who drives it makes no other difference to the engine. A description that is wrong is an error at the first call that
// drives the world or asks for its agents; after that call nothing more is described.

/// Agents and whoever drives them.
typedef struct consac_world consac_world;
/// An agent: a number from 0 over all behaviours, in the order in which they were added. Its own until it leaves.
typedef int32_t consac_agent;

/// A world without behaviours. `id` is its name for trainers, "road-v0"; NULL: none. On failure `*world` is NULL.
CONSAC_API consac_status consac_world_new(const char* id, consac_world** world);
/// Frees it and what drives it: a training ends where it is, a trainer elsewhere loses its connection. NULL is nothing.
CONSAC_API void consac_world_free(consac_world* world);

/// One kind of agent: `agents` of them, which share what they learn. `*behaviour` (may be NULL) is its number, from 0.
/// Every behaviour then needs at least one entry that is seen and one that is done:
CONSAC_API consac_status consac_world_add_behaviour(consac_world* world, const char* name, int32_t agents,
                                                    int32_t* behaviour);
/// `count` float32 numbers between `low` and `high`; -INFINITY and INFINITY are open sides. `rows` is
/// CONSAC_OBSERVATION or CONSAC_ACTION, here and below.
CONSAC_API consac_status consac_world_add_numbers(consac_world* world, int32_t behaviour, consac_rows rows,
                                                  const char* name, int64_t count, double low, double high);

/// An array with bounds of its own.
typedef struct consac_box {
  size_t size;           ///< sizeof(consac_box)
  consac_type type;      ///< of its numbers
  const int64_t* shape;  ///< [dimensions]; a picture is height, width, channels
  size_t dimensions;     ///< 0 is one number
  const double* low;     ///< [product(shape)] row-major; NULL: `every_low` for all
  const double* high;    ///< [product(shape)]; NULL: `every_high` for all
  double every_low, every_high;
} consac_box;
/// An array of numbers.
CONSAC_API consac_status consac_world_add_box(consac_world* world, int32_t behaviour, consac_rows rows,
                                              const char* name, const consac_box* box);
/// One of `n`: `start`, ..., `start` + n - 1.
CONSAC_API consac_status consac_world_add_discrete(consac_world* world, int32_t behaviour, consac_rows rows,
                                                   const char* name, int64_t n, int64_t start);
/// `count` choices: one of choices[i] each, [count].
CONSAC_API consac_status consac_world_add_multi_discrete(consac_world* world, int32_t behaviour, consac_rows rows,
                                                         const char* name, const int64_t* choices, size_t count);
/// `n` bits.
CONSAC_API consac_status consac_world_add_multi_binary(consac_world* world, int32_t behaviour, consac_rows rows,
                                                       const char* name, int64_t n);
/// The engine writes consac_agent_mask() at every step: which choices are legal.
CONSAC_API consac_status consac_world_mask_actions(consac_world* world, int32_t behaviour);
/// An agent's episode is truncated after so many steps; 0: never.
CONSAC_API consac_status consac_world_set_time_limit(consac_world* world, int64_t steps);
/// Agents join and leave while it runs (consac_world_join). Otherwise all of them are there from the beginning.
CONSAC_API consac_status consac_world_set_agents_leave(consac_world* world);

/// What a step pays that leads to an observation with the entries "achieved_goal" and "desired_goal".
enum {
  CONSAC_GOALS_NONE = 0,     ///< goals are not priced
  CONSAC_GOALS_SPARSE = 1,   ///< 0 where the two are within `threshold`, else -1
  CONSAC_GOALS_DENSE = 2,    ///< minus their distance
  CONSAC_GOALS_FUNCTION = 3  ///< what `price` says
};
/// Writes what steps pay that lead to `observations` [rows, row bytes] into `rewards` [rows]; follows from the goals of
/// a row alone. Called during calls of the world, by the thread that makes them; must not throw.
typedef void (*consac_price_function)(void* user, const void* observations, int64_t rows, float* rewards);
/// Goals, for those algorithms that learn from goals that were not meant (hindsight experience replay).
typedef struct consac_goals {
  size_t size;                  ///< sizeof(consac_goals)
  int32_t reward;               ///< CONSAC_GOALS_...
  int32_t rewards_are_added;    ///< 0: the world pays by its goals; 1: add_reward does, and comes to the same
  double threshold;             ///< CONSAC_GOALS_SPARSE; 0: 0.05
  consac_price_function price;  ///< CONSAC_GOALS_FUNCTION
  void* user;                   ///< handed to `price`
} consac_goals;
/// Says what the behaviour's goals pay.
CONSAC_API consac_status consac_world_set_goals(consac_world* world, int32_t behaviour, const consac_goals* goals);

/// The behaviour's first agent; the others follow it, and so do their rows in memory.
CONSAC_API consac_status consac_world_first_agent(consac_world* world, int32_t behaviour, consac_agent* agent);
/// Bytes of one row of the behaviour; of masks 0 where none are written.
CONSAC_API consac_status consac_world_row_bytes(consac_world* world, int32_t behaviour, consac_rows rows,
                                                size_t* bytes);
/// Where entry `index`, in the order in which they were added, lies in a row of observations or actions.
CONSAC_API consac_status consac_world_leaf(consac_world* world, int32_t behaviour, consac_rows rows, size_t index,
                                           consac_leaf* leaf);
/// An agent takes a free place of the behaviour; from the next consac_world_offer on it takes part.
CONSAC_API consac_status consac_world_join(consac_world* world, int32_t behaviour, consac_agent* agent);
/// Its place is free again; an episode that was under way is truncated where it was last seen.
CONSAC_API consac_status consac_world_leave(consac_world* world, consac_agent agent);

// ---- who drives it

// Each of these takes the place of the one before, which ends even where the next cannot begin.

/// A trainer elsewhere: how it is let in.
typedef struct consac_serving {
  size_t size;              ///< sizeof(consac_serving)
  const char* host;         ///< NULL: "127.0.0.1", this computer alone
  int32_t port;             ///< 0: any free one, see consac_world_port
  int32_t text_protocol;    ///< 1: text protocol 1 alone; 0: whichever the trainer speaks
  int32_t no_newline;       ///< 1: messages of text protocol 1 without an end, as the thesis has them
  int64_t training_length;  ///< steps that the trainer is told to take; 0: 100000, or with a model_name to act only
  const char* model_name;   ///< what the trainer is told to call its model, or to act by; NULL: nothing
  const char* token;        ///< what a trainer must show; needed beyond this computer. NULL: none
  uint64_t seed;            ///< of the first session; each further one has the next
  double deadline_s;        ///< a trainer silent for longer has left; 0: 60
} consac_serving;
/// Serves the world to one trainer after another, `consac train tcp://127.0.0.1:PORT` for instance. NULL: the defaults.
/// CONSAC_ALREADY_EXISTS when the port is taken.
CONSAC_API consac_status consac_world_serve(consac_world* world, const consac_serving* serving);

/// Learning inside.
typedef struct consac_training {
  size_t size;                  ///< sizeof(consac_training)
  const char* algorithm;        ///< see consac_algorithm; NULL: "ppo2"
  const char* hyperparameters;  ///< "n_steps=64; net_arch=[32, 32]", see `consac list`; NULL: defaults
  int64_t total_steps;          ///< of single agents; 0: 100000
  uint64_t seed;                ///< of learner and world
  int32_t agents_go_on;  ///< what they do while a model learns. 0: wait, and every step is learned from. 1: act on
  const consac_model* const* start_from;  ///< [start_from_count] a model for each behaviour, copied; NULL: from nothing
  size_t start_from_count;
  /// Where progress.csv and TensorBoard's events are written, with the keys of the program's runs, in a folder of their
  /// own below this one: PPO2_1, or the next number that is free; NULL: nothing is written.
  const char* log_folder;
} consac_training;
/// Learns on a thread of its own; after total_steps the agents go on by what was learned. NULL: the defaults. The error
/// names the hyperparameter, space or model that does not fit.
CONSAC_API consac_status consac_world_train(consac_world* world, const consac_training* training);

/// Acting by models.
typedef struct consac_playing {
  size_t size;        ///< sizeof(consac_playing)
  uint64_t seed;      ///< of world and draws
  int32_t sample;     ///< 0: the best action; 1: one drawn
  int32_t pipelined;  ///< 1: the models compute on a thread of their own, and agents act one tick later
} consac_playing;
/// The agents act by `models` [count], one for each behaviour, which are copied. `playing` NULL: the defaults. The
/// error names what differs between model and world.
CONSAC_API consac_status consac_world_act(consac_world* world, const consac_model* const* models, size_t count,
                                          const consac_playing* playing);
/// A person plays, or rules do: every step is asked for at once, and the engine writes consac_agent_action() itself.
CONSAC_API consac_status consac_world_by_hand(consac_world* world, uint64_t seed);
/// Nobody drives it any more; what was learned and not saved is gone.
CONSAC_API consac_status consac_world_stop(consac_world* world);

// ---- its ticks

/// What the engine is to do now.
typedef int32_t consac_cue;
enum { CONSAC_WAIT = 0, CONSAC_RESET = 1, CONSAC_ACT = 2 };
/// How an episode ends: in a terminal state, or cut (a time limit).
enum { CONSAC_GOES_ON = 0, CONSAC_TERMINATED = 1, CONSAC_TRUNCATED = 2 };

/// Does what is due and gives the next cue when it is known; waits for that at most `wait_s` seconds (0: never waits;
/// 60 at most). An error, a trainer that broke off for instance, is told once, and the driver begins anew where it can.
CONSAC_API consac_status consac_world_poll(consac_world* world, double wait_s, consac_cue* cue);
/// Everything is written: the cue is done with. CONSAC_NON_FINITE names a number that was none; 0 was offered in its
/// place, and the cue is done with all the same.
CONSAC_API consac_status consac_world_offer(consac_world* world);

/// What the agent sees, or sees first in its next episode: [observation row bytes], for the engine to write. NULL for
/// an agent that there is not, here and below. The pointer stays the same while the world lives.
CONSAC_API void* consac_agent_observation(consac_world* world, consac_agent agent);
/// The last observation of an episode that is ending: [observation row bytes], for the engine to write. Only then.
CONSAC_API void* consac_agent_final_observation(consac_world* world, consac_agent agent);
/// CONSAC_ACT: what the agent is to do: [action row bytes].
CONSAC_API void* consac_agent_action(consac_world* world, consac_agent agent);
/// Which of its choices are legal: [mask row bytes], for the engine to write; NULL where the behaviour masks none.
CONSAC_API uint8_t* consac_agent_mask(consac_world* world, consac_agent agent);
/// Adds to what the agent's step has paid so far.
CONSAC_API consac_status consac_agent_add_reward(consac_world* world, consac_agent agent, float reward);
/// Ends the agent's episode with this step; the first end counts.
CONSAC_API consac_status consac_agent_end_episode(consac_world* world, consac_agent agent, int32_t end);
/// 1 where the coming consac_world_offer ends its episode, by end_episode or the time limit.
CONSAC_API int32_t consac_agent_is_ending(consac_world* world, consac_agent agent);
/// CONSAC_RESET: 1 where the agent is to begin anew; others go on as they are.
CONSAC_API int32_t consac_agent_resets(consac_world* world, consac_agent agent);
/// CONSAC_RESET: 1 and `*seed` where the agent's episode is to be seeded; 0: its random numbers go on.
CONSAC_API int32_t consac_agent_seed(consac_world* world, consac_agent agent, uint64_t* seed);

/// All agents of a behaviour in one call, [agents] each; `count` is checked. add_reward:
CONSAC_API consac_status consac_world_add_rewards(consac_world* world, int32_t behaviour, const float* rewards,
                                                  size_t count);
/// end_episode: CONSAC_GOES_ON, CONSAC_TERMINATED or CONSAC_TRUNCATED for each.
CONSAC_API consac_status consac_world_end_episodes(consac_world* world, int32_t behaviour, const uint8_t* ends,
                                                   size_t count);
/// is_ending of each, out.
CONSAC_API consac_status consac_world_endings(consac_world* world, int32_t behaviour, uint8_t* endings, size_t count);
/// resets of each, out.
CONSAC_API consac_status consac_world_resets(consac_world* world, int32_t behaviour, uint8_t* resets, size_t count);

// ---- how things stand, and what was learned

/// For a line on the screen. `size` is set by the caller, the rest by the library.
typedef struct consac_progress {
  size_t size;                 ///< sizeof(consac_progress)
  const char* state;           ///< "learning"; lives until it is asked for again
  int64_t steps;               ///< of the present training, session or act
  int64_t total_steps;         ///< planned; 0: no end
  int64_t updates;             ///< rounds of learning in this process
  int64_t all_steps;           ///< of single agents since the world was made
  int64_t episodes;            ///< that ended since then
  int64_t sessions;            ///< of trainers elsewhere that ended in order
  double mean_episode_reward;  ///< of the last 100 that ended; NaN before the first
  double mean_episode_length;  ///< likewise, steps
  double steps_per_s;          ///< of single agents, over the last second or so
  double poll_s;               ///< how long the latest consac_world_poll took that gave a cue
} consac_progress;
/// How things stand.
CONSAC_API consac_status consac_world_progress(consac_world* world, consac_progress* progress);
/// 1 once a training has come to its end with all of its steps, here or at the other end of the connection.
CONSAC_API int32_t consac_world_finished(consac_world* world);
/// The port that is open; 0: none is.
CONSAC_API int32_t consac_world_port(consac_world* world);
/// The engine stands still on purpose (1), or goes on (0): a trainer's deadlines stop meanwhile.
CONSAC_API consac_status consac_world_pause(consac_world* world, int32_t paused);
/// The engine cannot go on: ends what is under way for good. A trainer elsewhere is told `why`, one line.
CONSAC_API consac_status consac_world_refuse(consac_world* world, const char* why);
/// 1 where the behaviour's model has learned anything here.
CONSAC_API int32_t consac_world_learned(consac_world* world, int32_t behaviour);
/// The behaviour's model as it is now, of which the caller has a copy: to act by, to keep. At any time of a training.
CONSAC_API consac_status consac_world_model(consac_world* world, int32_t behaviour, consac_model** model);
/// Writes it as a file, by a temporary file, sync and rename.
CONSAC_API consac_status consac_world_save_model(consac_world* world, int32_t behaviour, const char* path);

/// From now on every step of the behaviour's agents is taken down, up to 1 GiB; what was taken down before is gone.
CONSAC_API consac_status consac_world_record(consac_world* world, int32_t behaviour);
/// Steps of single agents that were taken down.
CONSAC_API int64_t consac_world_recorded_steps(consac_world* world, int32_t behaviour);
/// Writes them as a file (spec/demonstration.md), and goes on.
CONSAC_API consac_status consac_world_save_recording(consac_world* world, int32_t behaviour, const char* path);

#ifdef __cplusplus
}
#endif

#endif
