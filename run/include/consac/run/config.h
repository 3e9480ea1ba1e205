#pragma once
// Everything that decides a training run: from defaults, a YAML file, --set and flags, in that order. Written,
// resolved, to runs/NAME/config.yaml, from which the same run can be started again.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/status.h"

namespace consac::run {

/// A training run. Unset numbers are -1 where the engine or the algorithm has a say.
struct RunConfig {
  std::string world;               ///< "road-v0" or "tcp://host:port"; several engines with commas between
  std::string algorithm = "ppo2";  ///< a row of learn::Algorithms()
  std::string preset;              ///< "sb2", "sb3": whose defaults the hyperparameters have; "": the algorithm's own
  std::string name;                ///< runs/NAME; "": made from world, algorithm and seed
  std::string directory = "runs";  ///< where runs live
  std::int64_t steps = -1;         ///< agent steps; -1: what the engine says, else 100000
  std::uint64_t seed = 0;          ///< of everything
  std::int32_t envs = 1;           ///< copies of a built-in world
  std::int32_t threads = 1;        ///< cores to learn on; never changes the result
  std::int64_t max_memory_mib = 8192;  ///< of all learners' buffers and networks together; needing more is an error
  std::vector<std::pair<std::string, std::string>> hyperparameters;  ///< name, value as given
  std::int64_t checkpoint_every_s = 10;       ///< seconds between checkpoints; 0: only at the end and on Ctrl-C
  std::int64_t checkpoint_every_updates = 0;  ///< updates between checkpoints; 0: by time
  std::int64_t keep_checkpoints = 3;          ///< older ones are deleted
  std::int64_t eval_every = 0;                ///< agent steps between evaluations; 0: none
  std::int64_t eval_episodes = 5;             ///< of an evaluation
  std::string eval_world;                     ///< where models are evaluated; "": a world like the training's own
  std::string stop_reward;                    ///< a mean reward that ends the training; "": none does
  std::string init_model;                     ///< model or run whose weights the training begins with; "": fresh ones
  std::string demonstrations;                 ///< recorded steps to learn from (spec/demonstration.md); "": none
  std::string frozen;                         ///< "prey=MODEL,...": behaviours that act by a model and do not learn
  std::int64_t log_interval = 1;              ///< reports of the algorithm between console tables
  bool table = true;                          ///< console table
  double table_every_s = 1.0;                 ///< on a terminal: seconds between tables at least; 0: each is shown
  bool progress = true;                       ///< progress bar or lines
  bool quiet = false;                         ///< not even the lines that say where a run goes on and what it came to
  bool tensorboard = true;                    ///< event files
  double connect_timeout_s = 60.0;            ///< keep trying to reach an engine for so long
  double deadline_s = 60.0;                   ///< longest silence of an engine
  double quiet_s = 0.002;                     ///< text protocol 1 without terminators
  std::string protocol = "auto";              ///< auto, text1 or 2: what to speak with an engine
  std::string token;                          ///< access token that an engine asks for
  bool lockstep = false;                      ///< no step is under way while the model learns
  bool answer_done = false;                   ///< text protocol 1: answer an episode's last observation
  std::string environment_parameters;         ///< "gravity=uniform 5 15, mass=2": of the world; "": its defaults
  std::string non_finite = "error";           ///< error or replace: what is done with NaN and infinity from a world
  double max_abs_reward = 0.0;                ///< a larger reward is treated as NaN is; 0: any finite one is taken
  bool one_step_episodes = false;             ///< episodes of a single step are no fault of the world
  bool resume = false;                        ///< go on with runs/NAME
  bool force = false;                         ///< overwrite runs/NAME
  bool forever = false;                       ///< serve one session of the engine after another
  double hold_until = 0.0;                    ///< lines wait until then [s, Now()], and go with a session that is over
  /// Names of fields that a file or a setting has set. --resume takes these over, and any other that is not as the
  /// defaults above say.
  std::vector<std::string> given;
};

/// Reads YAML text over `config`: fields of RunConfig, hyperparameters of its algorithm below `hyperparameters:` or
/// beside the fields. An unknown key is an error that names the nearest known one, with its line. A failure leaves
/// `config` as it was. Where a flag names the algorithm, set config->algorithm before this call and after it.
Status ReadYaml(std::string_view text, std::string_view origin, RunConfig* config);
/// Reads a YAML file over `config`: a regular one, of at most 1 MiB.
Status ReadYamlFile(const std::string& path, RunConfig* config);
/// Applies "key=value": a field of the configuration or a hyperparameter of its algorithm. Another algorithm begins
/// with its own defaults: hyperparameters set before are forgotten.
Status ApplySetting(std::string_view assignment, RunConfig* config);
/// The YAML text that ReadYaml turns into the same configuration; hyperparameters resolved in full.
std::string WriteYaml(const RunConfig& config);

/// One field of RunConfig, for help texts and documents.
struct ConfigField {
  std::string name;           ///< the key in YAML and in --set
  std::string type;           ///< "text", "whole number", "number", "true or false"
  std::string default_value;  ///< as text
  std::string meaning;        ///< one line
};
/// Every field that a file or --set may give, in the order in which they are written. Name, directory, quiet, resume,
/// force and forever are not among them: they belong to one start of a run.
std::vector<ConfigField> ConfigFields();

}  // namespace consac::run
