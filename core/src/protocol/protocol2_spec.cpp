// CONFIGURE and SPEC: what an engine offers, what a trainer expects of it, and what a whole SPEC may cost.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "consac/base/budget.h"
#include "consac/base/hash.h"
#include "consac/base/json.h"
#include "consac/base/names.h"
#include "consac/base/text.h"
#include "consac/protocol/protocol2.h"
#include "protocol/protocol2_extras.h"
#include "protocol/protocol2_json.h"
#include "protocol/protocol2_members.h"
#include "space/space_json.h"

namespace consac::protocol2 {
namespace {

constexpr std::string_view kAutoresetNames[] = {"same_step", "next_step", "disabled"};

Json RowJson(const Layout& layout) {
  Json leaves = Json::array();
  for (const Leaf& leaf : layout.leaves) {
    leaves.push_back(
        {{"path", leaf.name}, {"dtype", NameOf(leaf.dtype)}, {"count", leaf.count}, {"offset", leaf.offset}});
  }
  return {{"bytes", layout.row_bytes}, {"leaves", leaves}};
}

Json BehaviourJson(const BehaviourSpec& behaviour) {
  return {{"name", behaviour.name},
          {"agents", behaviour.agents},
          {"observation", SpaceToJson(behaviour.observation_space)},
          {"action", SpaceToJson(behaviour.action_space)},
          {"masks_actions", behaviour.masks_actions},
          {"observation_row", RowJson(behaviour.observation_layout)},
          {"action_row", RowJson(behaviour.action_layout)},
          {"mask_bytes", behaviour.masks_actions ? behaviour.action_layout.mask_bytes : 0}};
}

Json BehavioursToJson(const EnvSpec& env) {
  Json behaviours = Json::array();
  for (const BehaviourSpec& behaviour : env.behaviours) behaviours.push_back(BehaviourJson(behaviour));
  return behaviours;
}

Result<Space> SpaceOf(const Json& behaviour, const char* name, MemoryBudget& budget) {
  const Json* json = Members{behaviour}.Find(name);
  if (json == nullptr) return Fault("MALFORMED", "a behaviour of SPEC has no " + std::string(name));
  Result<Space> space = SpaceFromJson(*json, budget);
  if (!space.ok()) return Fault("MALFORMED", std::string(name) + ": " + space.status().message());
  return space;
}

/// Path and both values where `found` first lacks or differs from `expected`; "" when it has everything.
std::string FirstDifference(const Json& expected, const Json& found, const std::string& path, std::string* text) {
  const auto below = [&](const std::string& name) { return path.empty() ? name : path + "/" + name; };
  if (expected.is_object() && found.is_object()) {
    for (const auto& [key, value] : expected.items()) {
      const auto other = found.find(key);
      if (other == found.end()) {
        *text = Quote(JsonText(value)) + " was expected, the engine offers nothing";
        return below(key);
      }
      const std::string difference = FirstDifference(value, *other, below(key), text);
      if (!difference.empty()) return difference;
    }
    return "";
  }
  if (expected.is_array() && found.is_array() && expected.size() == found.size()) {
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const bool named = expected[i].is_object() && expected[i].contains("space") && expected[i].contains("name");
      const std::string name =
          named && expected[i]["name"].is_string() ? expected[i]["name"].get<std::string>() : std::to_string(i);
      const std::string difference = FirstDifference(expected[i], found[i], below(name), text);
      if (!difference.empty()) return difference;
    }
    return "";
  }
  if (expected == found) return "";
  *text = Quote(JsonText(expected)) + " was expected, the engine offers " +
          Quote(found.is_null() ? "nothing" : JsonText(found));
  return path.empty() ? "/" : path;
}

/// Whether the numbers of a row that equal what they should are written as whole ones (R9): 8.0 is not.
bool SaysWholeNumbers(const Json& row) {
  const Members members{row};
  members.Whole("bytes", 0);
  return members.wrong.empty() && std::all_of(row["leaves"].begin(), row["leaves"].end(), [](const Json& leaf) {
           const Members of_leaf{leaf};
           for (const char* name : {"count", "offset"}) of_leaf.Whole(name, 0);
           return of_leaf.wrong.empty();
         });
}

Status CheckRow(const Json& behaviour, const char* name, const Layout& layout) {
  const Json* row = Members{behaviour}.Find(name);
  std::string difference;
  if (row != nullptr && FirstDifference(RowJson(layout), *row, name, &difference).empty() && SaysWholeNumbers(*row))
    return Status::Ok();
  return Fault("MALFORMED", std::string(name) + " is " + Quote(row == nullptr ? "missing" : JsonText(*row), 200) +
                                ", expected " + Quote(JsonText(RowJson(layout)), 200));
}

Status Malformed(const Status& status) {
  return status.ok() ? status : Fault("MALFORMED", status.message());
}

/// Every name that SPEC gives; those of agents and leaves are looked at with their behaviour.
Status CheckSpecNames(const SpecMessage& spec) {
  CONSAC_RETURN_IF_ERROR(Malformed(CheckOptionalName("environment", spec.env.id)));
  CONSAC_RETURN_IF_ERROR(Malformed(CheckOptionalName("model", spec.model_name)));
  std::vector<std::string_view> behaviours;
  for (const BehaviourSpec& behaviour : spec.env.behaviours) behaviours.emplace_back(behaviour.name);
  return Malformed(CheckNamesTogether("behaviour", behaviours));
}

/// Every name that a client expects: of behaviours, agents, leaves. They are only compared, and end up in errors.
Status CheckExpectedNames(const Json& expect) {
  if (expect.is_array()) {
    for (const Json& entry : expect) CONSAC_RETURN_IF_ERROR(CheckExpectedNames(entry));
  }
  if (!expect.is_object()) return Status::Ok();
  for (const auto& [key, value] : expect.items()) {
    if (key == "name" && value.is_string()) {
      CONSAC_RETURN_IF_ERROR(Malformed(CheckName("expected", value.get_ref<const std::string&>())));
    } else if (key == "agents" && value.is_array()) {
      for (const Json& agent : value) {
        if (agent.is_string())
          CONSAC_RETURN_IF_ERROR(Malformed(CheckName("expected agent", agent.get_ref<const std::string&>())));
      }
    } else {
      CONSAC_RETURN_IF_ERROR(CheckExpectedNames(value));
    }
  }
  return Status::Ok();
}

/// What a whole SPEC may make a trainer hold, all behaviours together (docs/faults.md, Budgets).
struct SpecBudget {
  MemoryBudget spaces{std::uint64_t{256} << 20};   ///< made while SPEC is read
  MemoryBudget frame{kLargestFrame};               ///< the rows and numbers of one STEP and one RESULT
  MemoryBudget batches{std::uint64_t{768} << 20};  ///< made when the session begins
};

/// What a trainer holds of a slot: rows in batches, frames and the watch, features for a network, marks.
std::uint64_t BytesOfSlot(const BehaviourSpec& behaviour) {
  constexpr std::uint64_t kRows = 8, kActions = 4, kBesides = 128;
  return kRows * behaviour.observation_layout.row_bytes + kActions * behaviour.action_layout.row_bytes +
         kActions * static_cast<std::uint64_t>(behaviour.masks_actions ? behaviour.action_layout.mask_bytes : 0) +
         sizeof(float) * static_cast<std::uint64_t>(behaviour.observation_layout.feature_count) + kBesides;
}

Result<BehaviourSpec> BehaviourFromJson(const Json& json, std::int64_t environments, SpecBudget& budget) {
  constexpr std::int64_t kMostSlots = 1 << 20;
  if (!json.is_object()) return Fault("MALFORMED", "a behaviour of SPEC is no object");
  Result<Space> observation = SpaceOf(json, "observation", budget.spaces);
  if (!observation.ok()) return observation.status();
  Result<Space> action = SpaceOf(json, "action", budget.spaces);
  if (!action.ok()) return action.status();
  const Members members{json};
  for (const char* required : {"name", "agents"}) members.Need(required);
  std::vector<std::string> agents = members.Texts("agents");
  if (!members.wrong.empty()) return Fault("MALFORMED", "a behaviour of SPEC: " + members.wrong);
  CONSAC_RETURN_IF_ERROR(Malformed(CheckNamesApart("agent", agents)));
  const bool countable = !agents.empty() && environments >= 1 && environments <= kMostSlots;
  const auto slots = countable ? environments * static_cast<std::int64_t>(agents.size()) : 0;
  if (!countable || slots > kMostSlots) {
    return Fault("MALFORMED", "SPEC offers " + std::to_string(environments) + " environments with " +
                                  std::to_string(agents.size()) + " agents; 1 to 2^20 slots can be taken");
  }
  BehaviourSpec behaviour = BehaviourSpec::Of(members.Text("name"), std::move(*observation), std::move(*action),
                                              static_cast<std::int32_t>(slots));
  behaviour.agents = std::move(agents);
  behaviour.masks_actions = members.Truth("masks_actions") && behaviour.action_layout.mask_bytes > 0;
  const auto count = static_cast<std::uint64_t>(slots);
  const std::uint64_t row_bytes = behaviour.observation_layout.row_bytes + behaviour.action_layout.row_bytes;
  for (const Status& taken : {budget.frame.Take("a frame with the rows of all slots", count, row_bytes),
                              budget.batches.Take("the slots of a behaviour", count, BytesOfSlot(behaviour))}) {
    if (!taken.ok()) return Fault("MALFORMED", taken.message());
  }
  CONSAC_RETURN_IF_ERROR(CheckRow(json, "observation_row", behaviour.observation_layout));
  CONSAC_RETURN_IF_ERROR(CheckRow(json, "action_row", behaviour.action_layout));
  const std::int64_t mask_bytes = behaviour.masks_actions ? behaviour.action_layout.mask_bytes : 0;
  const std::int64_t said = members.Whole("mask_bytes", mask_bytes);
  if (members.wrong.empty() && said != mask_bytes)
    return Fault("MALFORMED", "mask_bytes is " + std::to_string(said) + ", expected " + std::to_string(mask_bytes));
  return members.Checked("a behaviour of SPEC", std::move(behaviour));
}

Json SharedMemoryToJson(const SharedMemorySpec& shared) {
  return {{"path", shared.path},
          {"bytes", shared.bytes},
          {"request_offset", shared.request_offset},
          {"request_bytes", shared.request_bytes},
          {"result_offset", shared.result_offset},
          {"result_bytes", shared.result_bytes},
          {"spin_us", shared.spin_us}};
}

Result<SharedMemorySpec> SharedMemoryFromJson(const Json& json) {
  if (!json.is_object()) return Fault("MALFORMED", "shm is " + Quote(JsonText(json)) + ", expected an object");
  const Members members{json};
  const auto size = [&](const char* name) {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(members.Whole(name), 0));
  };
  const SharedMemorySpec shared = {members.Text("path"),    size("bytes"),         size("request_offset"),
                                   size("request_bytes"),   size("result_offset"), size("result_bytes"),
                                   members.Whole("spin_us")};
  const Json said = SharedMemoryToJson(shared);  // all of which is required
  for (const auto& [name, value] : said.items()) members.Need(name.c_str());
  return members.Checked("shm", shared);
}

}  // namespace

std::string EncodeConfigure(const Configure& configure) {
  Json json = {{"autoreset", kAutoresetNames[static_cast<std::size_t>(configure.autoreset)]},
               {"transport", configure.shared_memory ? "shm" : "tcp"}};
  if (!configure.expect_json.empty()) {
    const Result<Json> expect = ReadJson<Json>(configure.expect_json);
    json["expect"] = expect.ok() ? *expect : Json();
  }
  return JsonText(json);
}

namespace {

Result<Autoreset> AutoresetOf(const Members& members) {
  const std::string name = members.Text("autoreset");
  if (!members.json.contains("autoreset") || !members.wrong.empty()) return Autoreset::kSameStep;
  for (std::size_t i = 0; i < std::size(kAutoresetNames); ++i) {
    if (kAutoresetNames[i] == name) return static_cast<Autoreset>(i);
  }
  return Fault("UNSUPPORTED", "autoreset " + Quote(name) + " is none of same_step, next_step and disabled");
}

}  // namespace

Result<Configure> ParseConfigure(std::span<const std::byte> payload) {
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  const Result<Autoreset> autoreset = AutoresetOf(members);
  Configure configure;
  if (const Json* expect = members.List("expect"); expect != nullptr) {
    CONSAC_RETURN_IF_ERROR(CheckExpectedNames(*expect));
    configure.expect_json = JsonText(*expect);
  }
  const std::string transport = members.Text("transport");
  if (!members.wrong.empty()) return Fault("MALFORMED", "CONFIGURE: " + members.wrong);  // types come first
  if (!autoreset.ok()) return autoreset.status();
  configure.autoreset = *autoreset;
  configure.shared_memory = transport == "shm";
  if (json->contains("transport") && transport != "tcp" && transport != "shm")
    return Fault("UNSUPPORTED", "transport " + Quote(transport) + " is neither tcp nor shm");
  return configure;
}

std::string BehavioursJson(const EnvSpec& env) {
  return JsonText(BehavioursToJson(env));
}

Status CompareBehaviours(const std::string& expected, const std::string& found, std::string* path) {
  const Result<Json> wanted = ReadJson<Json>(expected), there = ReadJson<Json>(found);
  if (!wanted.ok() || !wanted->is_array()) return Fault("MALFORMED", "\"expect\" is no list of behaviours");
  if (!there.ok()) return Fault("MALFORMED", there.status().message());
  std::string text;
  *path = FirstDifference({{"behaviours", *wanted}}, {{"behaviours", *there}}, "", &text);
  if (path->empty()) return Status::Ok();
  return Fault("SPEC_MISMATCH", "at " + *path + " " + text);
}

std::string EncodeSpec(const SpecMessage& spec) {
  const Json behaviours = BehavioursToJson(spec.env);
  const std::string canonical = JsonText(behaviours);
  const std::span<const std::byte> pieces[] = {std::as_bytes(std::span(canonical))};
  Json json = {{"id", spec.env.id},
               {"environments", spec.env.environments()},
               {"max_episode_steps", spec.env.max_episode_steps},
               {"autoreset", kAutoresetNames[static_cast<std::size_t>(spec.autoreset)]},
               {"training_length", spec.training_length},
               {"model_name", spec.model_name},
               {"deterministic", spec.env.deterministic},
               {"hash", Sha256Hex(pieces)},
               {"behaviours", behaviours}};
  if (!spec.env.parameters.empty()) json["parameters"] = ParametersToJson(spec.env.parameters);
  if (!spec.env.groups.empty()) json["groups"] = GroupsToJson(spec.env);
  if (!spec.shared_memory.path.empty()) json["shm"] = SharedMemoryToJson(spec.shared_memory);
  return JsonText(json);
}

Result<SpecMessage> ParseSpec(std::span<const std::byte> payload, const Agreed& agreed) {
  constexpr std::size_t kMostBehaviours = 1024;
  const Result<Json> json = ParseObject(payload);
  if (!json.ok()) return json.status();
  const Members members{*json};
  const Result<Autoreset> autoreset = AutoresetOf(members);
  if (!autoreset.ok()) return autoreset.status();
  SpecMessage spec;
  spec.autoreset = *autoreset;
  spec.env.id = members.Text("id");
  spec.env.max_episode_steps = members.Count("max_episode_steps");
  spec.training_length = members.Count("training_length");
  spec.model_name = members.Text("model_name");
  spec.env.deterministic = members.Truth("deterministic");
  (void)members.Text("hash");  // not looked at, but for its type
  if (const Json* shared = members.Find("shm"); shared != nullptr) {
    Result<SharedMemorySpec> where = SharedMemoryFromJson(*shared);
    if (!where.ok()) return where.status();
    spec.shared_memory = std::move(*where);
  }
  for (const char* required : {"environments", "behaviours"}) members.Need(required);
  const std::int64_t environments = members.Whole("environments");
  const Json* behaviours = members.List("behaviours");
  if (!members.wrong.empty()) return Fault("MALFORMED", "SPEC: " + members.wrong);
  if (behaviours == nullptr || behaviours->empty() || behaviours->size() > kMostBehaviours)
    return Fault("MALFORMED", "SPEC has no list of 1 to " + std::to_string(kMostBehaviours) + " behaviours");
  SpecBudget budget;
  for (const Json& entry : *behaviours) {
    Result<BehaviourSpec> behaviour = BehaviourFromJson(entry, environments, budget);
    if (!behaviour.ok()) return behaviour.status();
    spec.env.behaviours.push_back(std::move(*behaviour));
  }
  if (agreed.parameters) {
    const Json* said = members.Find("parameters");
    if (said == nullptr) return Fault("MALFORMED", "SPEC lacks parameters, the capability that was agreed (R100)");
    Result<std::vector<ParameterSpec>> parameters = ParametersFromJson(*said);
    if (!parameters.ok()) return parameters.status();
    spec.env.parameters = std::move(*parameters);
  }
  if (agreed.groups) {
    const Json* said = members.Find("groups");
    if (said == nullptr) return Fault("MALFORMED", "SPEC lacks groups, the capability that was agreed (R106)");
    CONSAC_RETURN_IF_ERROR(ReadGroups(*said, &spec.env));
  }
  const std::uint64_t numbers = spec.env.parameters.size() + spec.env.groups.size();
  const Status taken = budget.frame.Take("a frame with what all environments have of parameters and groups",
                                         static_cast<std::uint64_t>(environments), numbers * sizeof(double));
  if (!taken.ok()) return Fault("MALFORMED", taken.message());
  CONSAC_RETURN_IF_ERROR(CheckSpecNames(spec));
  return members.Checked("SPEC", std::move(spec));
}

}  // namespace consac::protocol2
