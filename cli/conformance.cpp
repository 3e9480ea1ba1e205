// An engine before every case: one conversation after another.
#include "cli/conformance.h"

#include "cli/conformance_conversation.h"

namespace consac::cli {
namespace {

using Case = nlohmann::json;

void RunCase(const Case& entry, const Endpoint& endpoint, const std::string& token, double patience_s,
             ConformanceVerdict* verdict) {
  Conversation conversation(endpoint, token, patience_s);
  verdict->status = conversation.Connect();
  for (const Case& step : entry["steps"]) {
    if (!verdict->status.ok() || !verdict->offered) return;
    verdict->status = conversation.Do(step);
    verdict->why_not = conversation.over();
    verdict->offered = verdict->why_not.empty();
    verdict->Note(step);
  }
}

}  // namespace

Result<ConformanceCount> RunConformance(const Endpoint& endpoint, const std::string& token, double patience_s,
                                        const std::function<void(const ConformanceVerdict&)>& say) {
  const Result<std::unique_ptr<Transport>> there = ConnectTcp(endpoint, 3.0);
  if (!there.ok()) return there.status();
  (*there)->Close();
  ConformanceCount count;
  for (const Case& entry : ReadCase(ConformanceServerCases())) {
    ConformanceVerdict verdict{entry["name"], RulesText(entry["rules"])};
    RunCase(entry, endpoint, token, patience_s, &verdict);
    count.Add(verdict);
    say(verdict);
  }
  return count;
}

}  // namespace consac::cli
