// consac train: learn a built-in world in this process, or the world of an engine.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/flags.h"
#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/json.h"
#include "consac/run/training.h"

namespace consac::cli {
namespace {

/// Flags as given. Those that are fields of the configuration are kept as settings, so that flag, --set and file read
/// and refuse alike.
struct TrainFlags {
  std::vector<std::string> worlds;
  std::string config_file;
  std::optional<std::string> name, directory;
  std::string token;
  std::vector<std::string> fields;    // "steps=1e5", in the order given
  std::vector<std::string> settings;  // of --set
  bool resume = false, force = false, forever = false, json = false;
};

constexpr std::string_view kAlgorithmField = "algorithm=";

Status CheckCombination(const TrainFlags& flags, const run::RunConfig& config) {
  const auto refuse = [](const char* why) { return Status{StatusCode::kInvalidArgument, why}; };
  if (flags.resume && flags.force)
    return refuse("--resume goes on with a run and --force overwrites it; give one of them");
  if (flags.name.has_value() && flags.name->empty()) return refuse("--name is empty; give the run a name");
  if (flags.forever && !flags.resume && !run::IsUrl(config.world))
    return refuse("--forever serves an engine's sessions; it needs a world at tcp://host:port");
  return Status::Ok();
}

/// Before any other setting, wherever on the line it stands.
Status SetAlgorithm(const TrainFlags& flags, run::RunConfig* config) {
  for (const std::vector<std::string>* given : {&flags.fields, &flags.settings}) {
    for (const std::string& setting : *given) {
      if (setting.starts_with(kAlgorithmField)) CONSAC_RETURN_IF_ERROR(run::ApplySetting(setting, config));
    }
  }
  return Status::Ok();
}

/// A run that goes on has its algorithm: that is whose keys are given.
Status TakeRunsAlgorithm(const TrainFlags& flags, run::RunConfig* config) {
  if (!flags.resume || flags.force || flags.name.value_or("").empty()) return Status::Ok();
  const Result<run::RunConfig> began = run::ConfigOfRun(flags.directory.value_or(config->directory), *flags.name);
  if (!began.ok()) return began.status();
  config->algorithm = began->algorithm;
  return Status::Ok();
}

Result<run::RunConfig> Resolve(const TrainFlags& flags) {
  run::RunConfig config;
  CONSAC_RETURN_IF_ERROR(TakeRunsAlgorithm(flags, &config));
  CONSAC_RETURN_IF_ERROR(SetAlgorithm(flags, &config));  // it decides which keys the file may hold
  if (!flags.config_file.empty()) CONSAC_RETURN_IF_ERROR(run::ReadYamlFile(flags.config_file, &config));
  if (!flags.worlds.empty())
    CONSAC_RETURN_IF_ERROR(run::ApplySetting(fmt::format("world={}", fmt::join(flags.worlds, ",")), &config));
  CONSAC_RETURN_IF_ERROR(SetAlgorithm(flags, &config));  // and if it is another than the file's, with its own defaults
  for (const std::string& field : flags.fields) CONSAC_RETURN_IF_ERROR(run::ApplySetting(field, &config));
  for (const std::string& setting : flags.settings) CONSAC_RETURN_IF_ERROR(run::ApplySetting(setting, &config));
  if (flags.name.has_value()) config.name = *flags.name;
  if (flags.directory.has_value()) config.directory = *flags.directory;
  config.token = flags.token;
  config.resume = flags.resume;
  config.force = flags.force;
  config.forever = flags.forever;
  config.quiet = flags.json;
  if (flags.json) config.table = config.progress = false;
  CONSAC_RETURN_IF_ERROR(CheckCombination(flags, config));
  return config;
}

/// What to type to go on with an interrupted run.
std::string ResumeCommand(const run::RunSummary& summary) {
  const std::size_t slash = summary.directory.rfind('/');
  const std::string folder = summary.directory.substr(0, slash), name = summary.directory.substr(slash + 1);
  return fmt::format("{} train --resume --name {}{}", Argument(ProgramPath()), name,
                     folder == "runs" ? "" : " --dir " + Argument(folder));
}

nlohmann::json ModelJson(const run::ModelSummary& model) {
  return {{"model", model.path},
          {"updates", model.updates},
          {"mean_episode_reward",
           std::isfinite(model.mean_episode_reward) ? nlohmann::json(model.mean_episode_reward) : nlohmann::json()}};
}

void PrintJson(const run::RunSummary& summary) {
  nlohmann::json json = {
      {"directory", summary.directory},   {"steps", summary.steps},
      {"seconds", summary.seconds},       {"interrupted", summary.interrupted},
      {"acted_only", summary.acted_only}, {"weights_hash", fmt::format("{:016x}", summary.weights_hash)}};
  if (summary.models.size() <= 1)
    json.update(ModelJson(summary.models.empty() ? run::ModelSummary{} : summary.models[0]));
  for (std::size_t b = 0; summary.models.size() > 1 && b < summary.models.size(); ++b)
    json["behaviours"][summary.models[b].behaviour] = ModelJson(summary.models[b]);
  Print("{}\n", AsciiJsonText(json));
}

int Train(const TrainFlags& flags) {
  const Result<run::RunConfig> config = Resolve(flags);
  if (!config.ok()) return Fail("train", config.status());
  const Result<run::RunSummary> summary = run::Train(*config, StopSignal());
  if (!summary.ok()) return Fail("train", summary.status());
  if (flags.json) PrintJson(*summary);
  if (!summary->interrupted) return 0;
  if (config->forever)
    PrintError("consac train: stopped after {} sessions{}\n", summary->sessions,
               summary->models.empty() ? "" : "; the latest is " + run::ModelPaths(*summary));
  else if (summary->acted_only)
    PrintError("consac train: stopped after acting for {} steps\n", summary->steps);
  else if (summary->directory.empty())
    PrintError("consac train: interrupted; no run had begun\n");
  else
    PrintError("consac train: interrupted after {} steps; everything is saved in {}; go on with\n  {}\n",
               summary->steps, summary->directory, ResumeCommand(*summary));
  return 130;
}

/// A flag that sets a field of the configuration.
void AddField(CLI::App& app, const std::shared_ptr<TrainFlags>& flags, const char* flag, const char* field,
              const char* help) {
  const auto keep = [flags, field](const std::string& text) {
    flags->fields.push_back(std::string(field) + "=" + text);
  };
  app.add_option_function<std::string>(flag, keep, help);
}

/// A flag without value that sets a field.
void AddSwitch(CLI::App& app, const std::shared_ptr<TrainFlags>& flags, const char* flag, const char* setting,
               const char* help) {
  app.add_flag_callback(
      flag, [flags, setting] { flags->fields.emplace_back(setting); }, help);
}

}  // namespace

Action AddTrain(CLI::App& app) {
  const auto flags = std::make_shared<TrainFlags>();
  app.add_option(
      "world", flags->worlds,
      "a built-in world (consac list worlds) or an engine at tcp://host:port; several engines train one model");
  AddField(app, flags, "--algo", "algorithm", "algorithm (consac list algorithms); ppo2 unless given");
  AddField(app, flags, "--preset", "preset", "whose defaults the hyperparameters have: sb2 or sb3 of Stable Baselines");
  AddField(app, flags, "--steps", "steps", "agent steps; what the engine says, or 100000, unless given");
  AddField(app, flags, "--seed", "seed", "seed of everything");
  AddField(app, flags, "--envs", "envs", "copies of a built-in world");
  AddField(app, flags, "--init", "init_model", "begin with the weights of this model or run");
  AddField(
      app, flags, "--frozen", "frozen",
      "BEHAVIOUR=MODEL: this behaviour acts by a model or a run's and does not learn; several with commas between");
  AddField(app, flags, "--eval-every", "eval_every",
           "judge the models every so many agent steps and keep the best in DIR/NAME/best");
  AddField(app, flags, "--stop-reward", "stop_reward",
           "end once the mean reward of an evaluation, or of the last 100 episodes, is that high");
  AddField(app, flags, "--threads", "threads", "cores to learn on; never changes the result");
  app.add_option("--set", flags->settings,
                 "key=value: a hyperparameter or a field of the configuration; several may follow (--set gamma=0.9 "
                 "n_steps=64), and it may be repeated; 'consac list hyperparameters ALGO' shows them");
  app.add_option("--config", flags->config_file, "YAML file (docs/configuration.md)");
  app.add_option("--name", flags->name, "name of the run: its folder is DIR/NAME");
  app.add_option("--dir", flags->directory, "folder of the runs; 'runs' unless given");
  app.add_flag("--resume", flags->resume,
               "go on with a run that was stopped, or for longer: --steps are those of all of it, from its beginning");
  app.add_flag("--force", flags->force, "overwrite a run of that name");
  app.add_flag("--forever", flags->forever,
               "serve one session of the engine after another, training or acting as it asks");
  AddSwitch(app, flags, "--lockstep", "lockstep=true", "with engines: no step is under way while the model learns");
  AddSwitch(app, flags, "--answer-done", "answer_done=true",
            "answer an episode's last observation, for engines that wait there");
  AddField(app, flags, "--protocol", "protocol", "what to speak with an engine: auto, text1 or 2; auto unless given");
  AddToken(app, &flags->token, "access token that the engine asks for");
  AddField(app, flags, "--connect-timeout", "connect_timeout_s", "seconds to keep trying to reach an engine");
  AddField(app, flags, "--deadline", "deadline_s", "seconds of an engine's silence that end the session");
  AddField(app, flags, "--quiet-time", "quiet_s", "seconds of silence that end a message without newline");
  AddField(app, flags, "--log-interval", "log_interval", "reports of the algorithm between tables");
  AddField(app, flags, "--table-every", "table_every_s",
           "on a terminal: seconds between tables at least; 0: one for every update");
  AddSwitch(app, flags, "--no-table", "table=false", "print no tables");
  AddSwitch(app, flags, "--no-progress", "progress=false", "print no progress");
  AddSwitch(app, flags, "--no-tensorboard", "tensorboard=false", "write no TensorBoard logs");
  app.add_flag("--json", flags->json, "print one line of JSON at the end instead of tables");
  return [flags] { return Train(*flags); };
}

}  // namespace consac::cli
