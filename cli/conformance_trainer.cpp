// A trainer before every case: one connection after another, of which this is the engine.
#include <fmt/format.h>

#include <set>

#include "cli/conformance.h"
#include "cli/conformance_engine.h"

namespace consac::cli {
namespace {

using Case = nlohmann::json;

/// A status of the script in the verdict; false where the case is at its end.
bool Take(const Status& status, ConformanceVerdict* verdict) {
  verdict->offered = status.code() != StatusCode::kCancelled;
  if (!verdict->offered) verdict->why_not = status.message();
  verdict->status = verdict->offered ? status : Status::Ok();
  return verdict->offered && status.ok();
}

void RunScript(const Case& entry, EngineScript& script, ConformanceVerdict* verdict) {
  for (const Case& step : entry["steps"]) {
    const bool on = Take(script.Do(step), verdict);
    verdict->Note(step);
    if (!on) return;
  }
}

/// What an answer of results.json is to.
Case RequestOf(const Case& answer, const Case& spec) {
  const Case all(spec["environments"].get<std::size_t>(), 1);
  return {{"moves", answer["to"]}, {"environments", answer.value("environments", all)}};
}

/// The answers of one of results.json; the trainer goes on, or leaves at the one that breaks a rule.
void RunResults(const Case& entry, const Case& spec, EngineScript& script, ConformanceVerdict* verdict) {
  const Case welcome = {{"capabilities", entry.value("agreed", Case::array())}};
  if (!Take(script.Begin({{"begin", "SPEC"}, {"welcome", welcome}}), verdict)) return;
  for (const Case& answer : entry["answers"]) {
    if (!Take(script.DoExpect(RequestOf(answer, spec)), verdict)) return;
    if (!Take(script.Answer(BytesOf(answer["result"])), verdict)) return;
    verdict->Note(answer);
  }
  const Case& last = entry["answers"].back();
  Take(last.contains("may_overlook") ? script.GoesOnOrLeaves()
       : last.contains("breaks")     ? script.DoExpect({{"closed", true}, {"bye", true}})
                                     : script.DoExpect({{"moves", true}}),
       verdict);
}

/// Whether the trainer asks for that way to begin an episode.
bool AsksFor(const Case& autoreset, const std::set<std::string>& asked) {
  return autoreset == "same_step" || asked.contains(autoreset.get<std::string>());
}

}  // namespace

ConformanceCount RunTrainerConformance(Listener& listener, double patience_s,
                                       const std::function<void(const ConformanceVerdict&)>& say) {
  const Case conversations = ReadCase(ConformanceTrainerCases()), results = ReadCase(ConformanceResults());
  ConformanceCount count;
  const auto tell = [&](const ConformanceVerdict& verdict) {
    count.Add(verdict);
    say(verdict);
  };
  const auto comes = [&](EngineScript& script, const Case& entry) {
    const Status status = script.Accept();
    const bool first = count.held + count.failed == 0;
    const std::string left = first ? "" : "the cases from '" + entry["name"].get<std::string>() + "' on were not run: ";
    if (!status.ok()) count.ended = {status.code(), left + status.message()};
    return status.ok();
  };
  std::set<std::string> asked;  // ways to begin an episode
  for (const Case& entry : conversations["cases"]) {
    EngineScript script(listener, patience_s, results["specs"]["two"], conversations["results"]);
    if (!comes(script, entry)) return count;
    ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"])};
    RunScript(entry, script, &verdict);
    asked.insert(script.asked().begin(), script.asked().end());
    tell(verdict);
  }
  for (const Case& entry : results["cases"]) {
    if (entry["answers"].back().value("breaks", "") == "R75") continue;  // which a trainer may overlook (R78)
    ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"])};
    verdict.offered = AsksFor(entry["autoreset"], asked);
    if (!verdict.offered) {
      verdict.why_not = "the trainer never asked for " + entry["autoreset"].get<std::string>();
      tell(verdict);
      continue;
    }
    const Case& spec = results["specs"][entry["spec"].get<std::string>()];
    EngineScript script(listener, patience_s, spec, {}, entry["autoreset"]);
    if (!comes(script, entry)) return count;
    RunResults(entry, spec, script, &verdict);
    tell(verdict);
  }
  return count;
}

}  // namespace consac::cli
