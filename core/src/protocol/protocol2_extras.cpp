#include "protocol/protocol2_extras.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "protocol/protocol2_members.h"

namespace consac::protocol2 {
namespace {

constexpr std::size_t kMostParameters = 1024;

}  // namespace

Json ParametersToJson(std::span<const ParameterSpec> parameters) {
  const auto bound = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
  Json list = Json::array();
  for (const ParameterSpec& parameter : parameters) {
    list.push_back({{"name", parameter.name},
                    {"default", parameter.default_value},
                    {"low", bound(parameter.low)},
                    {"high", bound(parameter.high)},
                    {"description", parameter.description}});
  }
  return list;
}

Json GroupsToJson(const EnvSpec& env) {
  Json list = Json::array();
  for (const GroupSpec& group : env.groups) {
    Json agents = Json::array();
    for (const GroupSpec::Member& member : group.members) {
      const BehaviourSpec& behaviour = env.behaviours[member.behaviour];
      agents.push_back({{"behaviour", behaviour.name}, {"agent", behaviour.agents[member.agent]}});
    }
    list.push_back({{"name", group.name}, {"agents", agents}});
  }
  return list;
}

namespace {

Result<GroupSpec::Member> MemberFromJson(const Json& json, const EnvSpec& env) {
  if (!json.is_object()) return Fault("MALFORMED", "an agent of a group of SPEC is no object");
  const Members members{json};
  for (const char* required : {"behaviour", "agent"}) members.Need(required);
  const std::string behaviour = members.Text("behaviour"), agent = members.Text("agent");
  if (!members.wrong.empty()) return Fault("MALFORMED", "an agent of a group of SPEC: " + members.wrong);
  for (std::size_t b = 0; b < env.behaviours.size(); ++b) {
    if (env.behaviours[b].name != behaviour) continue;
    const std::vector<std::string>& agents = env.behaviours[b].agents;
    const auto found = std::find(agents.begin(), agents.end(), agent);
    if (found != agents.end()) return GroupSpec::Member{b, static_cast<std::size_t>(found - agents.begin())};
  }
  return Fault("MALFORMED",
               "a group of SPEC has agent " + Quote(agent) + " of " + Quote(behaviour) + ", which there is not");
}

}  // namespace

Status ReadGroups(const Json& list, EnvSpec* env) {
  if (!list.is_array() || list.empty()) return Fault("MALFORMED", "groups is no list of at least one");
  std::vector<std::string> names;
  std::vector<std::vector<std::uint8_t>> taken;
  for (const BehaviourSpec& behaviour : env->behaviours) taken.emplace_back(behaviour.agents.size());
  for (const Json& json : list) {
    if (!json.is_object()) return Fault("MALFORMED", "a group of SPEC is no object");
    const Members members{json};
    members.Need("name");
    GroupSpec group{members.Text("name"), {}};
    const Json* agents = members.List("agents");
    if (!members.wrong.empty()) return Fault("MALFORMED", "a group of SPEC: " + members.wrong);
    if (agents == nullptr || agents->empty()) return Fault("MALFORMED", "a group of SPEC has no list of agents");
    for (const Json& agent : *agents) {
      const Result<GroupSpec::Member> member = MemberFromJson(agent, *env);
      if (!member.ok()) return member.status();
      if (std::exchange(taken[member->behaviour][member->agent], std::uint8_t{1}) != 0)
        return Fault("MALFORMED", "an agent of group " + Quote(group.name) + " is in a group already");
      group.members.push_back(*member);
    }
    names.push_back(group.name);
    env->groups.push_back(std::move(group));
  }
  const Status apart = CheckNamesApart("group", names);
  return apart.ok() ? apart : Fault("MALFORMED", apart.message());
}

Result<std::vector<ParameterSpec>> ParametersFromJson(const Json& list) {
  if (!list.is_array() || list.empty() || list.size() > kMostParameters)
    return Fault("MALFORMED", "parameters is no list of 1 to " + std::to_string(kMostParameters));
  std::vector<ParameterSpec> parameters;
  for (const Json& json : list) {
    if (!json.is_object()) return Fault("MALFORMED", "a parameter of SPEC is no object");
    const Members members{json};
    for (const char* required : {"name", "default"}) members.Need(required);
    const auto bound = [&](const char* name, double none) {
      const Json* value = members.Find(name);
      return value == nullptr || value->is_null() ? none : members.Number(name, none);
    };
    const ParameterSpec unbounded;
    parameters.push_back({members.Text("name"), members.Number("default", 0.0), bound("low", unbounded.low),
                          bound("high", unbounded.high), members.Text("description")});
    if (!members.wrong.empty()) return Fault("MALFORMED", "a parameter of SPEC: " + members.wrong);
  }
  if (const Status fits = CheckParameters(parameters); !fits.ok()) return Fault("MALFORMED", fits.message());
  return parameters;
}

}  // namespace consac::protocol2
