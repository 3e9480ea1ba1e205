// consac train: learn a built-in world in this process, or the world of an engine.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/verbs.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

/// Flags as given; what was not given does not overrule the file.
struct TrainFlags {
  std::string world, config_file;
  std::optional<std::string> algorithm, name, directory;
  std::optional<std::int64_t> steps, log_interval;
  std::optional<std::uint64_t> seed;
  std::optional<std::int32_t> envs, threads;
  std::optional<double> connect_timeout, deadline, quiet_time;
  std::vector<std::string> settings;
  bool resume = false, force = false, forever = false, answer_done = false, no_table = false, no_progress = false,
       no_tensorboard = false, json = false;
};

template <class T>
void Overrule(const std::optional<T>& flag, T* field) {
  if (flag.has_value()) *field = *flag;
}

Result<run::RunConfig> Resolve(const TrainFlags& flags) {
  run::RunConfig config;
  if (flags.algorithm.has_value()) config.algorithm = *flags.algorithm;  // decides which keys the file may hold
  if (!flags.config_file.empty()) CONSAC_RETURN_IF_ERROR(run::ReadYamlFile(flags.config_file, &config));
  if (!flags.world.empty()) config.world = flags.world;
  Overrule(flags.algorithm, &config.algorithm);
  Overrule(flags.name, &config.name);
  Overrule(flags.directory, &config.directory);
  Overrule(flags.steps, &config.steps);
  Overrule(flags.log_interval, &config.log_interval);
  Overrule(flags.seed, &config.seed);
  Overrule(flags.envs, &config.envs);
  Overrule(flags.threads, &config.threads);
  Overrule(flags.connect_timeout, &config.connect_timeout_s);
  Overrule(flags.deadline, &config.deadline_s);
  Overrule(flags.quiet_time, &config.quiet_s);
  for (const std::string& setting : flags.settings) CONSAC_RETURN_IF_ERROR(run::ApplySetting(setting, &config));
  config.resume = flags.resume;
  config.force = flags.force;
  config.forever = flags.forever;
  config.answer_done = config.answer_done || flags.answer_done;
  config.table = config.table && !flags.no_table && !flags.json;
  config.progress = config.progress && !flags.no_progress && !flags.json;
  config.tensorboard = config.tensorboard && !flags.no_tensorboard;
  return config;
}

void PrintJson(const run::RunSummary& summary) {
  nlohmann::json json = {
      {"directory", summary.directory},   {"model", summary.model_path},
      {"steps", summary.steps},           {"updates", summary.updates},
      {"seconds", summary.seconds},       {"interrupted", summary.interrupted},
      {"acted_only", summary.acted_only}, {"weights_hash", fmt::format("{:016x}", summary.weights_hash)}};
  json["mean_episode_reward"] =
      std::isfinite(summary.mean_episode_reward) ? nlohmann::json(summary.mean_episode_reward) : nlohmann::json();
  fmt::print("{}\n", json.dump());
}

int Train(const TrainFlags& flags) {
  const Result<run::RunConfig> config = Resolve(flags);
  if (!config.ok()) return Fail("train", config.status());
  const Result<run::RunSummary> summary = run::Train(*config, StopSignal());
  if (!summary.ok()) return Fail("train", summary.status());
  if (flags.json) PrintJson(*summary);
  if (!summary->interrupted) return 0;
  if (!summary->directory.empty()) {
    fmt::print(stderr,
               "consac train: interrupted after {} steps; everything is saved in {} (go on with --resume --name)\n",
               summary->steps, summary->directory);
  }
  return 130;
}

}  // namespace

Action AddTrain(CLI::App& app) {
  const auto flags = std::make_shared<TrainFlags>();
  app.add_option("world", flags->world, "a built-in world (consac list worlds) or an engine at tcp://host:port");
  app.add_option("--algo", flags->algorithm, "algorithm (consac list algorithms); ppo2 unless given");
  app.add_option("--steps", flags->steps, "agent steps; what the engine says, or 100000, unless given")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", flags->seed, "seed of everything");
  app.add_option("--envs", flags->envs, "copies of a built-in world")->check(CLI::Range(1, 1 << 20));
  app.add_option("--threads", flags->threads, "cores to learn on; never changes the result")->check(CLI::Range(1, 256));
  app.add_option("--set", flags->settings,
                 "key=value: a hyperparameter or a field of the configuration; may be repeated");
  app.add_option("--config", flags->config_file, "YAML file (docs/configuration.md)");
  app.add_option("--name", flags->name, "name of the run: its folder is DIR/NAME");
  app.add_option("--dir", flags->directory, "folder of the runs; 'runs' unless given");
  app.add_flag("--resume", flags->resume, "go on with a run that was stopped");
  app.add_flag("--force", flags->force, "overwrite a run of that name");
  app.add_flag("--forever", flags->forever,
               "serve one session of the engine after another, training or acting as it asks");
  app.add_flag("--answer-done", flags->answer_done,
               "answer an episode's last observation, for engines that wait there");
  app.add_option("--connect-timeout", flags->connect_timeout, "seconds to keep trying to reach an engine");
  app.add_option("--deadline", flags->deadline, "seconds of an engine's silence that end the session");
  app.add_option("--quiet-time", flags->quiet_time, "seconds of silence that end a message without newline");
  app.add_option("--log-interval", flags->log_interval, "updates between tables")->check(CLI::PositiveNumber);
  app.add_flag("--no-table", flags->no_table, "print no tables");
  app.add_flag("--no-progress", flags->no_progress, "print no progress");
  app.add_flag("--no-tensorboard", flags->no_tensorboard, "write no TensorBoard logs");
  app.add_flag("--json", flags->json, "print one line of JSON at the end instead of tables");
  return [flags] { return Train(*flags); };
}

}  // namespace consac::cli
