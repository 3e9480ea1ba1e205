// Where the world of a run comes from, and how often: in this process, or from an engine, once or for ever.
#include "consac/run/training.h"

#include <fmt/format.h>

#include <algorithm>

#include "config_fields.h"
#include "consac/base/refusals.h"
#include "consac/base/text.h"
#include "consac/learn/algo/learner.h"
#include "consac/run/pause.h"
#include "report/console.h"
#include "resume.h"
#include "session.h"

namespace consac::run {
namespace {

constexpr double kAfterFailure = 1.0;   // s before an engine that broke a session is tried again
constexpr double kLongestPause = 10.0;  // s, when that goes on
constexpr double kBrief = 1.0;          // s: of sessions that are over sooner, one after another, a line tells
constexpr double kFailuresEvery = 60.0;

/// On standard output, unless that is a script's.
std::function<void(const std::string&)> SayerFor(const RunConfig& config) {
  ConsoleOptions options = StandardConsole();
  if (config.quiet) options.stream = stderr;
  return [options](const std::string& line) { Console(options).Line(line); };
}

EngineOptions OptionsFor(const RunConfig& config, const std::string& url, const std::atomic<bool>& stop) {
  EngineOptions options;
  options.url = url;
  options.connect_timeout_s = config.connect_timeout_s;
  options.client.deadline_s = config.deadline_s;
  options.client.quiet_s = config.quiet_s;
  options.client.answer_done = config.answer_done;
  options.client.token = config.token;
  options.client.refuse_non_finite = false;  // the data watch does, or replaces
  options.client.protocol = config.protocol == "text1" ? Protocol::kText1
                            : config.protocol == "2"   ? Protocol::kProtocol2
                                                       : Protocol::kAuto;
  options.client.stop = &stop;
  return options;
}

/// How each engine of the run is reached, for all sessions: who asks to be left alone for a while is.
std::vector<EngineOptions> EnginesOf(const RunConfig& config, const std::atomic<bool>& stop) {
  std::vector<EngineOptions> engines;
  for (const std::string& url : SplitUrls(config.world)) {
    engines.push_back(OptionsFor(config, url, stop));
    engines.back().client.not_before = std::make_shared<std::atomic<double>>(0.0);
  }
  return engines;
}

/// Every one of them, connected, and how it is reached again.
Result<std::vector<WorldSource>> ConnectEngines(const std::vector<EngineOptions>& engines,
                                                const std::function<void(const std::string&)>& say) {
  std::vector<WorldSource> sources;
  for (EngineOptions options : engines) {
    Result<std::unique_ptr<WorldLink>> link = ConnectEngine(options, say);
    if (!link.ok()) return link.status();
    options.connect_timeout_s = 0.0;
    sources.push_back({std::move(*link), [options] { return ConnectEngine(options, [](const std::string&) {}); }});
  }
  return sources;
}

/// Whether anything was learned, or a model has acted.
bool CameToSomething(const RunSummary& summary) {
  if (summary.acted_only) return summary.steps > 0;
  return std::any_of(summary.models.begin(), summary.models.end(),
                     [](const ModelSummary& model) { return model.updates > 0; });
}

std::string InOneLine(std::int64_t session, const RunSummary& summary) {
  return fmt::format("session {}: {} for {} {}, {}", session, summary.acted_only ? "acted" : "trained", summary.steps,
                     summary.steps == 1 ? "step" : "steps", ModelPaths(summary));
}

/// One session after another until `stop`: what breaks one, or keeps it from beginning, is said and the next awaited.
/// An engine that ends them before anything is learned is given more and more time. Where they are brief, their files
/// hold all, and a line now and then tells of them.
RunSummary ServeForever(const RunConfig& config, Length length, const std::atomic<bool>& stop) {
  const auto say = [&config](std::string_view line) { SayerFor(config)(std::string(line)); };
  RunSummary latest;
  std::int64_t sessions = 0;
  double pause = kAfterFailure;
  bool brief = false;  // the latest session
  const std::vector<EngineOptions> engines = EnginesOf(config, stop);
  Refusals waiting(say, kBrief, 1), of_brief_ones(say, kBrief, 1), failures(say, kFailuresEvery, 1);
  RunConfig of_session = config;
  while (!stop.load()) {
    waiting.Look();
    failures.Look();
    Result<std::vector<WorldSource>> worlds =
        ConnectEngines(engines, [&](const std::string& line) { waiting.Say(line); });
    const bool nobody = !worlds.ok() && worlds.status().code() == StatusCode::kUnavailable;
    const double soon = Now() + kBrief;
    of_session.hold_until = brief ? soon : 0.0;
    const Result<RunSummary> ended =
        worlds.ok() ? RunSession(of_session, length, std::move(*worlds), stop) : Result<RunSummary>(worlds.status());
    if (ended.ok()) latest = *ended;
    sessions += worlds.ok() ? 1 : 0;
    if (stop.load()) break;
    const bool unheard = brief;
    brief = worlds.ok() && Now() < soon;
    if (!ended.ok()) failures.Say("error: " + ended.status().message());
    if (ended.ok() && brief && unheard && !config.quiet) of_brief_ones.Say(InOneLine(sessions, *ended));
    if (!brief) of_brief_ones.Look();
    if (ended.ok() && CameToSomething(*ended)) {
      pause = kAfterFailure;
      continue;
    }
    Pause(pause, stop);
    if (!nobody) pause = std::min(2.0 * pause, kLongestPause);
  }
  latest.sessions = sessions;
  latest.interrupted = true;
  return latest;
}

/// As asked.
Result<RunSummary> ServeEngine(const RunConfig& config, Length length, const std::atomic<bool>& stop) {
  if (config.forever) return ServeForever(config, length, stop);
  Result<std::vector<WorldSource>> worlds = ConnectEngines(EnginesOf(config, stop), SayerFor(config));
  return worlds.ok() ? RunSession(config, length, std::move(*worlds), stop) : Result<RunSummary>(worlds.status());
}

/// A name that cannot be had is refused before an engine is disturbed. With --forever an engine may ask for the run to
/// act, and what it trains is given a free name.
Status CheckGivenName(const RunConfig& config) {
  if (config.name.empty()) return Status::Ok();
  return CheckRunName(config.directory, config.name, config.forever ? ExistingRun::kOverwrite : ExistingRunOf(config));
}

/// What no world could make good is said before an engine is waited for.
Status CheckWithoutWorld(const RunConfig& config, const learn::Algorithm& algorithm) {
  const Result<learn::HyperparameterSet> values = HyperparametersOf(config);
  if (!values.ok()) return values.status();
  CONSAC_RETURN_IF_ERROR(learn::CheckTogether(*values));
  const bool text = IsUrl(config.world) && config.protocol == "text1";
  return text && learn::RelabelsGoals(algorithm, *values) ? CannotPrice(config, algorithm, "text protocol 1")
                                                          : Status::Ok();
}

/// What an algorithm that needs no world does: its length is its own.
Result<RunSummary> LearnFromRecorded(RunConfig config, const std::atomic<bool>& stop) {
  const auto refuse = [&](const std::string& why) {
    return Status{StatusCode::kInvalidArgument, Quote(config.algorithm) + " learns from demonstrations alone; " + why};
  };
  if (!config.world.empty()) return refuse("leave the world out");
  if (config.demonstrations.empty()) return refuse("give --set demonstrations=FILE (spec/demonstration.md)");
  if (config.eval_every > 0 && config.eval_world.empty()) return refuse("eval_every needs an eval_world");
  Result<std::unique_ptr<WorldLink>> link = MakeRecordedLink(config.demonstrations);
  if (!link.ok()) return link.status();
  return RunSession(std::move(config), Length::kOfCaller, Only(std::move(*link)), stop);
}

Result<RunSummary> TrainAsAsked(const RunConfig& asked, const std::atomic<bool>& stop) {
  RunConfig config = asked;
  if (!asked.resume && !asked.name.empty()) CONSAC_RETURN_IF_ERROR(FinishOverwriting(asked.directory, asked.name));
  if (asked.resume) {
    Result<RunConfig> resumed = ResumedConfig(asked);
    if (!resumed.ok()) return resumed.status();
    config = std::move(*resumed);
  }
  CONSAC_RETURN_IF_ERROR(CheckGivenName(config));
  if (config.eval_every > 0 && config.eval_world.empty() && IsUrl(config.world))
    return Status{StatusCode::kInvalidArgument,
                  "eval_every needs an eval_world where an engine is trained on: a built-in world, or another engine's "
                  "tcp://host:port"};
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config.algorithm);
  if (!algorithm.ok()) return algorithm.status();
  CONSAC_RETURN_IF_ERROR(CheckWithoutWorld(config, **algorithm));
  if (!(*algorithm)->needs_world) return LearnFromRecorded(std::move(config), stop);
  if (!IsUrl(config.world)) {
    if (config.world.empty())
      return Status{StatusCode::kInvalidArgument,
                    "nothing to train on; name a world (consac list worlds) or tcp://host:port"};
    Result<std::unique_ptr<WorldLink>> link = MakeLocalLink(config.world, config.envs);
    if (!link.ok()) return link.status();
    return RunSession(std::move(config), Length::kOfCaller, Only(std::move(*link)), stop);
  }
  return ServeEngine(config, asked.steps >= 0 ? Length::kOfCaller : Length::kOfEngine, stop);
}

}  // namespace

std::string ModelPaths(const RunSummary& summary) {
  std::string text;
  for (std::size_t i = 0; i < summary.models.size(); ++i)
    text += (i == 0 ? "" : i + 1 == summary.models.size() ? " and " : ", ") + summary.models[i].path;
  return text;
}

// A stop before a run began is an interruption like any other.
Result<RunSummary> Train(const RunConfig& asked, const std::atomic<bool>& stop) {
  Result<RunSummary> summary = TrainAsAsked(asked, stop);
  if (summary.ok() || summary.status().code() != StatusCode::kCancelled || !stop.load()) return summary;
  RunSummary interrupted;
  interrupted.interrupted = true;
  return interrupted;
}

}  // namespace consac::run
