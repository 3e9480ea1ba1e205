// consac list: what there is, from the tables.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cli/print.h"
#include "cli/verbs.h"
#include "consac/base/json.h"
#include "consac/base/text.h"
#include "consac/learn/algo/learner.h"
#include "worlds/registry.h"

namespace consac::cli {
namespace {

struct ListFlags {
  std::string what = "worlds", algorithm, name, preset;
  bool json = false;
};

using Rows = nlohmann::ordered_json;

std::string_view TypeName(learn::ParameterType type) {
  switch (type) {
    case learn::ParameterType::kReal:
      return "number";
    case learn::ParameterType::kInteger:
      return "whole number";
    case learn::ParameterType::kBoolean:
      return "true/false";
    case learn::ParameterType::kSchedule:
      return "number or lin_";
    case learn::ParameterType::kChoice:
      return "choice";
    case learn::ParameterType::kText:
      return "text";
  }
  return "";
}

std::string RangeOf(const learn::Hyperparameter& row) {
  if (row.type == learn::ParameterType::kChoice) return row.choices;
  if (row.type == learn::ParameterType::kBoolean || row.type == learn::ParameterType::kText) return "";
  const auto side = [](double bound) {
    return std::isinf(bound) ? std::string(bound < 0 ? "-inf" : "inf") : NumberText(bound);
  };
  return side(row.low) + " to " + side(row.high) + (row.choices[0] != '\0' ? std::string(", ") + row.choices : "");
}

Rows WorldRows() {
  Rows rows = Rows::array();
  for (const worlds::World& world : worlds::Worlds()) {
    std::string name = world.id, action = "as its " + std::string(world.argument != nullptr ? world.argument : "");
    std::string observation = action;
    if (world.argument != nullptr) {
      name += ":" + std::string(world.argument);
    } else {
      const std::unique_ptr<VectorEnv> env = world.create(1);
      const BehaviourSpec& behaviour = env->spec().behaviours[0];
      action = behaviour.action_space.ToString(), observation = behaviour.observation_space.ToString();
    }
    rows.push_back({{"world", name},
                    {"what", world.description},
                    {"action", action},
                    {"observation", observation},
                    {"source", world.source}});
  }
  return rows;
}

Rows AlgorithmRows() {
  Rows rows = Rows::array();
  for (const learn::Algorithm& algorithm : learn::Algorithms())
    rows.push_back({{"algorithm", algorithm.name}, {"what", algorithm.description}});
  return rows;
}

/// All of an algorithm's with these defaults, or the one of that name.
Rows HyperparameterRows(const learn::HyperparameterSet& defaults, std::string_view name) {
  Rows rows = Rows::array();
  for (const learn::Hyperparameter& row : defaults.table()) {
    if (!name.empty() && name != row.name && name != row.alias) continue;
    rows.push_back({{"name", row.name},
                    {"alias", row.alias},
                    {"type", TypeName(row.type)},
                    {"default", defaults.Text(row.name)},
                    {"range", RangeOf(row)},
                    {"meaning", row.meaning},
                    {"source", row.source}});
  }
  return rows;
}

// Every policy that some algorithm's table offers.
Rows PolicyRows() {
  Rows rows = Rows::array();
  for (const learn::Algorithm& algorithm : learn::Algorithms()) {
    for (const learn::Hyperparameter& row : algorithm.hyperparameters) {
      if (std::string_view(row.name) == "policy")
        rows.push_back({{"algorithm", algorithm.name}, {"policies", row.choices}, {"meaning", row.meaning}});
    }
  }
  return rows;
}

// Where a row comes from is for tools; on a screen it would only make the lines wrap.
void PrintRows(Rows rows) {
  if (rows.empty()) return;
  for (Rows& row : rows) row.erase("source");
  std::vector<std::size_t> widths;
  for (const auto& [key, value] : rows[0].items()) widths.push_back(key.size());
  for (const Rows& row : rows) {
    std::size_t i = 0;
    for (const auto& [key, value] : row.items()) {
      widths[i] = std::max(widths[i], value.get_ref<const std::string&>().size());
      ++i;
    }
  }
  const auto line = [&](const auto& text_of) {
    std::size_t i = 0;
    std::string out;
    for (const auto& [key, value] : rows[0].items()) {
      out += fmt::format("{:<{}}  ", text_of(key), widths[i]);
      ++i;
    }
    while (!out.empty() && out.back() == ' ') out.pop_back();
    Print("{}\n", out);
  };
  line([](const std::string& key) { return key; });
  for (const Rows& row : rows) line([&](const std::string& key) { return row[key].get<std::string>(); });
}

int List(const ListFlags& flags) {
  constexpr std::string_view kKinds[] = {"worlds", "algorithms", "policies", "hyperparameters"};
  if (!flags.preset.empty() && flags.what != "hyperparameters")
    return Fail("list", {StatusCode::kInvalidArgument, "--preset is for 'list hyperparameters' alone; leave it out"});
  Rows rows;
  if (flags.what == "worlds")
    rows = WorldRows();
  else if (flags.what == "algorithms")
    rows = AlgorithmRows();
  else if (flags.what == "policies")
    rows = PolicyRows();
  else if (flags.what == "hyperparameters") {
    const Result<const learn::Algorithm*> algorithm =
        learn::FindAlgorithm(flags.algorithm.empty() ? "ppo2" : flags.algorithm);
    if (!algorithm.ok()) return Fail("list", algorithm.status());
    learn::HyperparameterSet defaults((*algorithm)->hyperparameters);
    if (const Status preset = defaults.UsePreset(flags.preset); !preset.ok()) return Fail("list", preset);
    rows = HyperparameterRows(defaults, flags.name);
    if (rows.empty()) return Fail("list", defaults.Set(flags.name, ""));  // in the words in which `train` refuses it
  } else {
    return Fail("list", {StatusCode::kInvalidArgument,
                         "there is no list " + Quote(flags.what) + Suggestion(flags.what, kKinds)});
  }
  if (flags.json)
    PrintLines(AsciiJsonText(rows, 2));
  else
    PrintRows(rows);
  return 0;
}

}  // namespace

Action AddList(CLI::App& app) {
  const auto flags = std::make_shared<ListFlags>();
  app.add_option("what", flags->what, "worlds, algorithms, policies or hyperparameters");
  app.add_option("algorithm", flags->algorithm, "whose hyperparameters; ppo2 unless given");
  app.add_option("name", flags->name, "the one hyperparameter that is meant; all unless given");
  app.add_option(
      "--preset", flags->preset,
      "of hyperparameters: whose defaults, sb2 or sb3 of Stable Baselines; the algorithm's own unless given");
  app.add_flag("--json", flags->json, "as JSON");
  return [flags] { return List(*flags); };
}

}  // namespace consac::cli
