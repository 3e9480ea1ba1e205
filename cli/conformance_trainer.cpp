// A trainer before every case: one connection after another, of which this is the engine.
#include <fmt/format.h>

#include <set>

#include "cli/conformance.h"
#include "cli/conformance_engine.h"

namespace consac::cli {
namespace {

using Case = nlohmann::json;

void RunScript(const Case& entry, Listener& listener, double patience_s, const Case& spec, const Case& results,
               std::set<std::string>* asked, ConformanceVerdict* verdict) {
  EngineScript script(listener, patience_s, spec, results);
  verdict->status = script.Accept();
  for (const Case& step : entry["steps"]) {
    if (!verdict->status.ok()) return;
    verdict->status = script.Do(step);
    verdict->Note(step);
    asked->insert(script.asked().begin(), script.asked().end());
    verdict->offered = verdict->status.code() != StatusCode::kCancelled;
    if (verdict->offered) continue;
    verdict->why_not = verdict->status.message();
    verdict->status = Status::Ok();
    return;
  }
}

/// What a case of results.json answers to, "STEP of 0 1".
std::string AskedBy(const Case& answer) {
  std::string text = answer["to"].get<std::string>() + " of";
  if (!answer.contains("environments")) return text + " all";
  for (const Case& chosen : answer["environments"]) text += fmt::format(" {}", chosen.get<int>());
  return text;
}

/// The answers of one of results.json; the trainer goes on, or leaves at the one that breaks a rule.
void RunResults(const Case& entry, Listener& listener, double patience_s, const Case& spec,
                ConformanceVerdict* verdict) {
  EngineScript script(listener, patience_s, spec, {}, entry["autoreset"]);
  verdict->status = script.Accept();
  if (verdict->status.ok()) verdict->status = script.Begin({{"begin", "SPEC"}});
  bool breaks = false, overlooks = false;
  for (const Case& answer : entry["answers"]) {
    if (!verdict->status.ok()) return;
    const Result<bool> asks = script.Asks(answer);
    verdict->status = asks.status();
    verdict->offered = !asks.ok() || *asks;
    if (!verdict->offered)
      verdict->why_not =
          fmt::format("request {} is {}, the case's {}", verdict->step + 1, script.Asked(), AskedBy(answer));
    if (!verdict->status.ok() || !verdict->offered) return;
    verdict->status = script.DoExpect({{"type", answer["to"]}});
    if (verdict->status.ok()) verdict->status = script.Answer(BytesOf(answer["result"]));
    verdict->Note(answer);
    breaks = answer.contains("breaks");
    overlooks = answer.contains("may_overlook");
  }
  if (!verdict->status.ok()) return;
  verdict->status = overlooks ? script.GoesOnOrLeaves()
                    : breaks  ? script.DoExpect({{"closed", true}, {"bye", true}})
                              : script.GoesOn();
}

/// Whether the trainer asks for that way to begin an episode.
bool AsksFor(const Case& autoreset, const std::set<std::string>& asked) {
  return autoreset == "same_step" || asked.contains(autoreset.get<std::string>());
}

}  // namespace

Result<ConformanceCount> RunTrainerConformance(const Endpoint& endpoint, double patience_s,
                                               const std::function<void(const ConformanceVerdict&)>& say) {
  Result<std::unique_ptr<Listener>> listener = ListenTcp(endpoint);
  if (!listener.ok()) return listener.status();
  const Case conversations = ReadCase(ConformanceTrainerCases()), results = ReadCase(ConformanceResults());
  ConformanceCount count;
  const auto tell = [&](const ConformanceVerdict& verdict) {
    count.Add(verdict);
    say(verdict);
    const Status& status = verdict.status;
    return status.code() != StatusCode::kUnavailable || status.message().find("no trainer") == std::string::npos;
  };
  std::set<std::string> asked;  // ways to begin an episode
  for (const Case& entry : conversations["cases"]) {
    ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"])};
    RunScript(entry, **listener, patience_s, results["specs"]["two"], conversations["results"], &asked, &verdict);
    if (!tell(verdict)) return count;
  }
  for (const Case& entry : results["cases"]) {
    if (entry["answers"].back().value("breaks", "") == "R75") continue;  // which a trainer may overlook (R78)
    const Case& spec = results["specs"][entry["spec"].get<std::string>()];
    ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"])};
    verdict.offered = AsksFor(entry["autoreset"], asked);
    if (!verdict.offered) verdict.why_not = "the trainer never asked for " + entry["autoreset"].get<std::string>();
    if (verdict.offered) RunResults(entry, **listener, patience_s, spec, &verdict);
    if (!tell(verdict)) return count;
  }
  return count;
}

}  // namespace consac::cli
