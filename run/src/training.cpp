// Where the world of a run comes from, and how often: in this process, or from an engine, once or for ever.
#include "consac/run/training.h"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "report/console.h"
#include "resume.h"
#include "session.h"

namespace consac::run {
namespace {

constexpr double kAfterFailure = 1.0;  // s before an engine that broke a session is tried again

void Say(const std::string& line) {
  Console(StandardConsole()).Print(line + "\n");
}

/// Waits `seconds`, or until `stop`.
void Pause(double seconds, const std::atomic<bool>& stop) {
  for (const double end = Now() + seconds; Now() < end && !stop.load();)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
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

/// Every engine of the run, connected, and how each is reached again.
Result<std::vector<WorldSource>> ConnectEngines(const RunConfig& config, const std::atomic<bool>& stop) {
  std::vector<WorldSource> sources;
  for (const std::string& url : SplitUrls(config.world)) {
    EngineOptions options = OptionsFor(config, url, stop);
    Result<std::unique_ptr<WorldLink>> link = ConnectEngine(options, Say);
    if (!link.ok()) return link.status();
    options.connect_timeout_s = 0.0;
    sources.push_back({std::move(*link), [options] { return ConnectEngine(options, [](const std::string&) {}); }});
  }
  return sources;
}

/// One session with an engine, or one after another until `stop`: then what breaks a session is said and the next
/// awaited.
Result<RunSummary> ServeEngine(const RunConfig& config, Length length, const std::atomic<bool>& stop) {
  Result<RunSummary> last = RunSummary{};
  do {
    Result<std::vector<WorldSource>> worlds = ConnectEngines(config, stop);
    const bool nobody = !worlds.ok() && worlds.status().code() == StatusCode::kUnavailable;
    if (worlds.ok())
      last = RunSession(config, length, std::move(*worlds), stop);
    else
      last = worlds.status();
    if (last.ok() || !config.forever || stop.load()) continue;
    if (!nobody) Say("error: " + last.status().message());
    Pause(kAfterFailure, stop);
  } while (config.forever && !stop.load());
  const bool stopped =
      stop.load() && (config.forever || (!last.ok() && last.status().code() == StatusCode::kCancelled));
  if (!stopped || (last.ok() && last->interrupted)) return last;
  RunSummary summary;
  summary.interrupted = true;
  return summary;
}

}  // namespace

Result<RunSummary> Train(const RunConfig& asked, const std::atomic<bool>& stop) {
  RunConfig config = asked;
  if (asked.resume) {
    Result<RunConfig> resumed = ResumedConfig(asked);
    if (!resumed.ok()) return resumed.status();
    config = std::move(*resumed);
  }
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

}  // namespace consac::run
