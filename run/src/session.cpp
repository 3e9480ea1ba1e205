#include "session.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "acting.h"
#include "config_fields.h"
#include "consac/base/names.h"
#include "consac/base/path.h"
#include "consac/nn/kernels.h"
#include "consac/run/shortage.h"

namespace consac::run {
namespace {

constexpr std::int64_t kDefaultSteps = 100000;

/// Of processors, by all threads of this process; by std::clock where no other clock says that.
double ProcessSeconds() {
#if defined(CLOCK_PROCESS_CPUTIME_ID)
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
#else
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
#endif
}

/// World, algorithm and seed; a world's long name is cut, with room left for UnusedName's number.
std::string DefaultName(const RunConfig& config, const WorldLink& link) {
  constexpr std::size_t kNumber = 8;
  const std::string& id = link.spec().id;
  const std::string rest = fmt::format("__{}__{}", config.algorithm, config.seed);
  const std::size_t room = kLongestFolder - std::min(kLongestFolder - 1, rest.size() + kNumber);
  return (id.empty() ? "engine" : AsFolderName(id, room)) + rest;
}

/// The name, or the name with the first number behind it that no run has: one session after another has its own.
std::string UnusedName(const RunConfig& config) {
  std::error_code ignored;
  std::string name = config.name;
  for (int i = 2; std::filesystem::exists(ToPath(config.directory + "/" + name + "/config.yaml"), ignored); ++i)
    name = fmt::format("{}_{}", config.name, i);
  return name;
}

/// Length 0 with a model's name. Whoever goes on with a run by hand means to train, whatever the engine asks for.
bool AsksToAct(const RunConfig& config, const SessionRequest& request) {
  if (!IsUrl(config.world) || request.training_length != 0 || request.model_name.empty()) return false;
  return !config.resume || config.forever;
}

/// Fills in what the configuration leaves to the engine, or to nobody: how long, and under which name.
Status Settle(const WorldLink& first, RunConfig* config) {
  const SessionRequest request = IsUrl(config->world) ? first.request() : SessionRequest();
  if (config->steps < 0)
    config->steps = request.training_length > 0 ? std::min(request.training_length, kMostSteps) : kDefaultSteps;
  if (config->name.empty())
    config->name = request.model_name.empty() ? DefaultName(*config, first) : request.model_name;
  CONSAC_RETURN_IF_ERROR(CheckFolderName("run", config->name));
  const bool further = config->forever && request.model_name.empty() && !config->force && !config->resume;
  if (further) config->name = UnusedName(*config);
  if (config->steps == 0) return {StatusCode::kInvalidArgument, "0 steps train nothing; give --steps at least 1"};
  return Status::Ok();
}

void TellBegin(const RunConfig& config, const std::string& where, Training& training) {
  const std::int64_t steps = training.config().steps, rollout = training.steps_per_update();
  if (config.table || config.progress) {
    training.report().Line(fmt::format("training {} on {} for {} steps, seed {}, {} kernels -> {}/{}", config.algorithm,
                                       where, steps, config.seed, nn::InstructionSet(), config.directory, config.name));
  }
  if (const std::int64_t bytes = training.memory_bytes(); bytes > 0 && (config.table || config.progress)) {
    training.report().Line(
        fmt::format("what is remembered takes up to {} MiB of memory as it fills", (bytes + (1 << 20) - 1) >> 20));
  }
  if (!config.frozen.empty() && (config.table || config.progress))
    training.report().Line("acting by a model that does not learn: " + config.frozen);
  if (steps < rollout) {
    training.report().Line(fmt::format(
        "warning: {} steps are fewer than the {} of one rollout, so nothing will be learned; raise --steps or lower "
        "n_steps",
        steps, rollout));
  }
}

}  // namespace

Result<RunSummary> RunSession(RunConfig config, Length length, std::vector<WorldSource> worlds,
                              const std::atomic<bool>& stop) {
  WorldLink& first = *worlds[0].link;
  if (length == Length::kOfEngine && AsksToAct(config, first.request())) return ActForEngine(config, first, stop);
  CONSAC_RETURN_IF_ERROR(Settle(first, &config));
  std::string where = first.description();
  for (std::size_t i = 1; i < worlds.size(); ++i) where += " and " + worlds[i].link->description();

  Training training(config, length, stop);
  const Status started = Guarded([&] { return training.Start(std::move(worlds)); });
  if (!started.ok()) return Guarded([&] { return training.GiveUp(started); });
  TellBegin(config, where, training);
  const double start = Now();
  const double used = ProcessSeconds();
  const Status looped = Guarded([&] { return training.Loop(); });
  const double processor_seconds = ProcessSeconds() - used;
  const bool failed = !looped.ok() && looped.code() != StatusCode::kCancelled;
  if (training.replaces() && (failed || stop.load()))  // no step was taken
    return Guarded([&] { return training.GiveUp(failed ? looped : Status{StatusCode::kCancelled, "stopped"}); });
  Result<RunSummary> summary = Guarded([&] { return training.Finish(Now() - start); });
  if (!summary.ok() && training.replaces()) return Guarded([&] { return training.GiveUp(summary.status()); });
  if (!summary.ok()) {
    if (!failed || looped.message() == summary.status().message()) return summary;
    return Status{looped.code(), looped.message() + "; and then: " + summary.status().message()};
  }
  summary->processor_seconds = processor_seconds;
  if (failed) {
    return Status{looped.code(),
                  fmt::format("{}; {} of {} {} are missing, {} in '{}' (go on with --resume --name {})",
                              looped.message(), training.config().steps - summary->steps, training.config().steps,
                              training.slots() > 1 ? "agent steps" : "steps",
                              summary->steps > 0 ? "what was learned is saved" : "the run lies as it began",
                              summary->directory, config.name)};
  }
  if (!summary->interrupted && !config.quiet) {
    training.report().Line(fmt::format("training completed: {} steps in {:.2f} s, {} {}", summary->steps,
                                       summary->seconds, summary->models.size() == 1 ? "model" : "models",
                                       ModelPaths(*summary)));
  }
  return summary;
}

}  // namespace consac::run
