#include "consac/run/config.h"

#include <yaml-cpp/yaml.h>

#include <variant>

#include "consac/base/file.h"
#include "consac/base/text.h"
#include "consac/learn/algo/learner.h"

namespace consac::run {
namespace {

constexpr std::size_t kLargestFile = 1 << 20;

using Member = std::variant<std::string RunConfig::*, std::int64_t RunConfig::*, std::uint64_t RunConfig::*,
                            std::int32_t RunConfig::*, double RunConfig::*, bool RunConfig::*>;

/// One field: its name in YAML and --set, where it lives, the smallest legal number.
struct Field {
  std::string_view name;
  Member member;
  double low = 0;
};

// Reading, writing, --set and messages all come from this table. `name`, `directory`, `resume` and `force` belong to
// one start of a run, not to the run, and are flags only.
const Field kFields[] = {
    {"world", &RunConfig::world},
    {"algorithm", &RunConfig::algorithm},
    {"steps", &RunConfig::steps, -1},
    {"seed", &RunConfig::seed},
    {"envs", &RunConfig::envs, 1},
    {"threads", &RunConfig::threads, 1},
    {"checkpoint_every_s", &RunConfig::checkpoint_every_s},
    {"checkpoint_every_updates", &RunConfig::checkpoint_every_updates},
    {"keep_checkpoints", &RunConfig::keep_checkpoints, 1},
    {"log_interval", &RunConfig::log_interval, 1},
    {"table", &RunConfig::table},
    {"progress", &RunConfig::progress},
    {"tensorboard", &RunConfig::tensorboard},
    {"connect_timeout_s", &RunConfig::connect_timeout_s},
    {"deadline_s", &RunConfig::deadline_s},
    {"quiet_s", &RunConfig::quiet_s},
    {"answer_done", &RunConfig::answer_done},
};
constexpr std::string_view kHyperparameters = "hyperparameters";

const Field* FindField(std::string_view name) {
  for (const Field& field : kFields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

Status BadValue(std::string_view name, std::string_view text, const std::string& expected) {
  return {StatusCode::kInvalidArgument, std::string(name) + " = " + Quote(text) + " cannot be used; expected " + expected};
}

bool ReadBoolean(std::string_view text, bool* value) {
  *value = text == "true" || text == "yes" || text == "on";
  return *value || text == "false" || text == "no" || text == "off";
}

Status SetField(const Field& field, std::string_view text, RunConfig* config) {
  std::string digits;
  for (const char c : text) digits += c == '_' ? "" : std::string(1, c);
  double number = 0.0;
  const bool is_number = ParseNumber(digits, &number) && number >= field.low;
  const bool is_whole = is_number && number == static_cast<double>(static_cast<std::int64_t>(number));
  if (auto* member = std::get_if<std::string RunConfig::*>(&field.member)) config->*(*member) = text;
  if (auto* member = std::get_if<bool RunConfig::*>(&field.member)) {
    if (!ReadBoolean(text, &(config->*(*member)))) return BadValue(field.name, text, "true or false");
  }
  if (auto* member = std::get_if<double RunConfig::*>(&field.member)) {
    if (!is_number) return BadValue(field.name, text, "a number of at least " + NumberText(field.low));
    config->*(*member) = number;
  }
  const std::string whole = "a whole number of at least " + NumberText(field.low);
  if (auto* member = std::get_if<std::int64_t RunConfig::*>(&field.member)) {
    if (!is_whole) return BadValue(field.name, text, whole);
    config->*(*member) = static_cast<std::int64_t>(number);
  }
  if (auto* member = std::get_if<std::uint64_t RunConfig::*>(&field.member)) {
    std::int64_t value = 0;
    if (!ParseNumber(digits, &value) || value < 0) return BadValue(field.name, text, whole);
    config->*(*member) = static_cast<std::uint64_t>(value);
  }
  if (auto* member = std::get_if<std::int32_t RunConfig::*>(&field.member)) {
    if (!is_whole || number > 1 << 20) return BadValue(field.name, text, whole + " and at most 1048576");
    config->*(*member) = static_cast<std::int32_t>(number);
  }
  return Status::Ok();
}

std::string FieldText(const Field& field, const RunConfig& config) {
  return std::visit(
      [&](auto member) -> std::string {
        const auto& value = config.*member;
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, std::string>) return value;
        else if constexpr (std::is_same_v<T, bool>) return value ? "true" : "false";
        else if constexpr (std::is_same_v<T, double>) return NumberText(value);
        else return std::to_string(value);
      },
      field.member);
}

Status UnknownKey(std::string_view name, std::span<const learn::Hyperparameter> table) {
  std::vector<std::string_view> known{kHyperparameters};
  for (const Field& field : kFields) known.push_back(field.name);
  for (const learn::Hyperparameter& row : table) {
    known.emplace_back(row.name);
    if (row.alias[0] != '\0') known.emplace_back(row.alias);
  }
  return {StatusCode::kInvalidArgument, "unknown key " + Quote(name) + Suggestion(name, known)};
}

/// Sets a hyperparameter after a look at its algorithm's table.
Status SetHyperparameter(std::string_view name, std::string_view text, RunConfig* config) {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config->algorithm);
  if (!algorithm.ok()) return algorithm.status();
  learn::HyperparameterSet values((*algorithm)->hyperparameters);
  const Status status = values.Set(name, text);
  if (!status.ok()) return status.message().starts_with("unknown") ? UnknownKey(name, (*algorithm)->hyperparameters) : status;
  config->hyperparameters.emplace_back(name, text);
  return Status::Ok();
}

Status SetKey(std::string_view name, std::string_view text, RunConfig* config) {
  const Field* field = FindField(name);
  return field != nullptr ? SetField(*field, text, config) : SetHyperparameter(name, text, config);
}

Status At(std::string_view origin, const YAML::Mark& mark, const Status& status) {
  return {status.code(), std::string(origin) + ":" + std::to_string(mark.line + 1) + ": " + status.message()};
}

/// A scalar's text as written; lists in flow form are put back together for net_arch.
Result<std::string> ScalarText(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  if (node.IsNull()) return std::string("none");
  YAML::Emitter emitter;
  emitter.SetSeqFormat(YAML::Flow);
  emitter.SetMapFormat(YAML::Flow);
  emitter << node;
  if (!emitter.good()) return Status{StatusCode::kInvalidArgument, "its value cannot be read"};
  return std::string(emitter.c_str());
}

Status ReadEntry(std::string_view origin, const YAML::Node& key, const YAML::Node& value, RunConfig* config) {
  if (!key.IsScalar()) return At(origin, key.Mark(), {StatusCode::kInvalidArgument, "a key must be a word"});
  if (key.Scalar() == kHyperparameters) {
    if (!value.IsMap()) return At(origin, value.Mark(), {StatusCode::kInvalidArgument, "hyperparameters must be a list of 'name: value' lines"});
    for (const auto& entry : value) {
      const Result<std::string> text = ScalarText(entry.second);
      const Status status = !entry.first.IsScalar() ? Status{StatusCode::kInvalidArgument, "a key must be a word"}
                            : !text.ok()            ? text.status()
                                                    : SetHyperparameter(entry.first.Scalar(), *text, config);
      if (!status.ok()) return At(origin, entry.first.Mark(), status);
    }
    return Status::Ok();
  }
  const Result<std::string> text = ScalarText(value);
  const Status status = text.ok() ? SetKey(key.Scalar(), *text, config) : text.status();
  return status.ok() ? status : At(origin, key.Mark(), status);
}

// The algorithm first, because it decides which hyperparameters there are.
Status ReadNode(const YAML::Node& root, std::string_view origin, RunConfig* config) {
  if (root.IsNull()) return Status::Ok();
  if (!root.IsMap()) return At(origin, root.Mark(), {StatusCode::kInvalidArgument, "expected 'key: value' lines"});
  for (const bool algorithm_pass : {true, false}) {
    for (const auto& entry : root) {
      const bool is_algorithm = entry.first.IsScalar() && entry.first.Scalar() == "algorithm";
      if (is_algorithm == algorithm_pass) CONSAC_RETURN_IF_ERROR(ReadEntry(origin, entry.first, entry.second, config));
    }
  }
  return Status::Ok();
}

}  // namespace

Status ReadYaml(std::string_view text, std::string_view origin, RunConfig* config) {
  if (text.size() > kLargestFile) {
    return {StatusCode::kResourceExhausted, std::string(origin) + " is longer than 1 MiB; that is no configuration"};
  }
  RunConfig changed = *config;
  try {
    CONSAC_RETURN_IF_ERROR(ReadNode(YAML::Load(std::string(text)), origin, &changed));
  } catch (const YAML::Exception& error) {
    return At(origin, error.mark, {StatusCode::kInvalidArgument, "not YAML: " + error.msg});
  }
  *config = std::move(changed);
  return Status::Ok();
}

Status ReadYamlFile(const std::string& path, RunConfig* config) {
  const Result<std::vector<std::byte>> bytes = ReadFile(path, kLargestFile);
  if (!bytes.ok()) return bytes.status();
  return ReadYaml({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path, config);
}

Status ApplySetting(std::string_view assignment, RunConfig* config) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    return {StatusCode::kInvalidArgument, "--set " + Quote(assignment) + " is no assignment; write --set key=value"};
  }
  return SetKey(assignment.substr(0, equals), assignment.substr(equals + 1), config);
}

std::string WriteYaml(const RunConfig& config) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  for (const Field& field : kFields) {
    const std::string text = FieldText(field, config);
    out << YAML::Key << std::string(field.name) << YAML::Value;
    if (std::holds_alternative<std::string RunConfig::*>(field.member)) out << YAML::DoubleQuoted << text;
    else out << text;
  }
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config.algorithm);
  if (algorithm.ok()) {
    learn::HyperparameterSet values((*algorithm)->hyperparameters);
    for (const auto& [name, text] : config.hyperparameters) (void)values.Set(name, text);
    out << YAML::Key << std::string(kHyperparameters) << YAML::Value << YAML::BeginMap;
    for (const learn::Hyperparameter& row : (*algorithm)->hyperparameters) {
      out << YAML::Key << row.name << YAML::Value << YAML::DoubleQuoted << values.Text(row.name) << YAML::Comment(row.meaning);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string("# Everything that this run was started with. Start it again: consac train --config THIS_FILE\n") + out.c_str() + "\n";
}

}  // namespace consac::run
