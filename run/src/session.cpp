#include "session.h"

#include <fmt/format.h>

#include "acting.h"
#include "consac/nn/kernels.h"
#include "consac/run/path.h"

namespace consac::run {
namespace {

constexpr std::int64_t kDefaultSteps = 100000;

std::string DefaultName(const RunConfig& config, const WorldLink& link) {
  const std::string& id = link.spec().id;
  return fmt::format("{}__{}__{}", id.empty() ? "engine" : id, config.algorithm, config.seed);
}

/// The name, or the name with the first number behind it that no run has: one session after another has its own.
std::string UnusedName(const RunConfig& config) {
  std::error_code ignored;
  std::string name = config.name;
  for (int i = 2; std::filesystem::exists(ToPath(config.directory + "/" + name + "/config.yaml"), ignored); ++i)
    name = fmt::format("{}_{}", config.name, i);
  return name;
}

}  // namespace

Result<RunSummary> RunSession(RunConfig config, Length length, std::vector<WorldSource> worlds,
                              const std::atomic<bool>& stop) {
  WorldLink& first = *worlds[0].link;
  const SessionRequest request = first.request();
  const bool engine = IsUrl(config.world);
  if (engine && request.training_length == 0 && length == Length::kOfEngine) return ActForEngine(config, first, stop);
  if (config.steps < 0) config.steps = engine ? request.training_length : kDefaultSteps;
  if (config.name.empty())
    config.name = engine && !request.model_name.empty() ? request.model_name : DefaultName(config, first);
  if (config.forever && request.model_name.empty() && !config.force && !config.resume) config.name = UnusedName(config);
  if (config.steps == 0) return Status{StatusCode::kInvalidArgument, "0 steps train nothing; give --steps at least 1"};
  std::string where = first.description();
  for (std::size_t i = 1; i < worlds.size(); ++i) where += " and " + worlds[i].link->description();

  Training training(config, length, stop);
  CONSAC_RETURN_IF_ERROR(training.Start(std::move(worlds)));
  if (config.table || config.progress) {
    training.report().Line(fmt::format("training {} on {} for {} steps, seed {}, {} kernels -> {}/{}", config.algorithm,
                                       where, training.config().steps, config.seed, nn::InstructionSet(),
                                       config.directory, config.name));
    const std::int64_t rollout = training.steps_per_update();
    if (training.config().steps < rollout) {
      training.report().Line(fmt::format(
          "warning: {} steps are fewer than the {} of one rollout, so nothing will be learned; raise --steps or lower "
          "n_steps",
          training.config().steps, rollout));
    }
  }
  const double start = Now();
  const Status looped = training.Loop();
  Result<RunSummary> summary = training.Finish(Now() - start);
  const bool failed = !looped.ok() && looped.code() != StatusCode::kCancelled;
  if (!summary.ok()) {
    if (!failed) return summary;
    return Status{looped.code(), looped.message() + "; and then: " + summary.status().message()};
  }
  if (failed) {
    return Status{
        looped.code(),
        fmt::format("{}; {} of {} steps are missing, what was learned is saved in '{}' (go on with --resume --name {})",
                    looped.message(), training.config().steps - summary->steps, training.config().steps,
                    summary->directory, config.name)};
  }
  if (!summary->interrupted && (config.table || config.progress)) {
    training.report().Line(fmt::format("training completed: {} steps in {:.2f} s, model {}", summary->steps,
                                       summary->seconds, summary->model_path));
  }
  return summary;
}

}  // namespace consac::run
