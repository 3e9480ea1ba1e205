#include "acting.h"

#include <fmt/format.h>

#include <limits>

#include "consac/base/names.h"
#include "consac/run/actors.h"
#include "report/console.h"

namespace consac::run {
namespace {

/// Mean return of the episodes that ended while it was looked at.
class MeanReturn {
 public:
  explicit MeanReturn(std::int32_t slots) : sums_(static_cast<std::size_t>(slots)) {}
  /// One step of the slots `acting` in a batch of all slots.
  void Add(const Batch& batch, std::span<const std::int32_t> acting) {
    for (const std::int32_t slot : acting) {
      const auto i = static_cast<std::size_t>(slot);
      double& sum = sums_[i];
      sum += batch.rewards[i];
      if ((batch.terminated[i] | batch.truncated[i]) == 0) continue;
      total_ += sum;
      ++episodes_;
      sum = 0.0;
    }
  }
  double mean() const {
    return episodes_ > 0 ? total_ / static_cast<double>(episodes_) : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::vector<double> sums_;  // [slots] of the episode under way
  double total_ = 0.0;
  std::int64_t episodes_ = 0;
};

}  // namespace

Result<RunSummary> ActForEngine(const RunConfig& config, WorldLink& link, const std::atomic<bool>& stop) {
  const std::string& name = config.name.empty() ? link.request().model_name : config.name;
  // The engine's word leads to a run, never to a path; our user's may be any.
  if (config.name.empty()) CONSAC_RETURN_IF_ERROR(CheckFolderName("model", name));
  const Result<std::vector<std::string>> files = FindModels(name, config.directory);
  if (!files.ok()) return files.status();
  const EnvSpec& spec = link.spec();
  Result<Actors> actors = Actors::Load(*files, spec);
  if (!actors.ok()) return actors.status();
  RunSummary summary;
  summary.acted_only = true;
  std::vector<MeanReturn> returns;
  for (std::size_t b = 0; b < actors->size(); ++b) {
    summary.models.push_back({spec.behaviours[b].name, actors->file(b)});
    returns.emplace_back(spec.behaviours[b].slots);
  }
  ConsoleOptions options = StandardConsole();
  options.hold_until = config.hold_until;
  Console console(options);
  if (config.table || config.progress)
    console.Line(fmt::format("acting with {} for {}", ModelPaths(summary), link.description()));

  Rng rng(config.seed, StreamId("action_sampling"));
  const double start = Now();
  Status status = link.Reset(config.seed, actors->batches());
  actors->Begin();
  while (status.ok() && !stop.load(std::memory_order_relaxed)) {
    for (std::size_t b = 0; b < actors->size(); ++b) actors->Act(b, link.present(b), ActionMode::kDeterministic, rng);
    status = link.Step(actors->batches(), MoreSteps::kYes);
    for (std::size_t b = 0; status.ok() && b < actors->size(); ++b) {
      summary.steps += static_cast<std::int64_t>(actors->acting(b).size());
      returns[b].Add(actors->batches()[b], actors->acting(b));
    }
  }
  // An engine that has seen enough closes; that is the end of such a session.
  const bool over = status.ok() || status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kCancelled;
  if (!over) return status;
  summary.seconds = Now() - start;
  for (std::size_t b = 0; b < returns.size(); ++b) summary.models[b].mean_episode_reward = returns[b].mean();
  summary.interrupted = stop.load();
  if (config.table || config.progress) console.Line(fmt::format("acted for {} steps", summary.steps));
  return summary;
}

}  // namespace consac::run
