#include "consac/run/config.h"

#include <algorithm>

#include "config_fields.h"
#include "consac/base/file.h"
#include "consac/base/text.h"
#include "consac/learn/algo/learner.h"
#include "yaml_tree.h"

namespace consac::run {
namespace {

constexpr std::string_view kHyperparameters = "hyperparameters", kEnvironmentParameters = "environment_parameters";

const learn::Hyperparameter* FindHyperparameter(std::span<const learn::Hyperparameter> table, std::string_view name) {
  for (const learn::Hyperparameter& row : table) {
    if (row.name == name || (row.alias[0] != '\0' && row.alias == name)) return &row;
  }
  return nullptr;
}

/// `name` is no key of `algorithm`: what is said of it.
Status UnknownKey(std::string_view name, const learn::Algorithm& algorithm) {
  if (name == kHyperparameters) {
    return {StatusCode::kInvalidArgument,
            "'hyperparameters' is a heading of the file, with 'name: value' lines below it; give each by its own name"};
  }
  if (std::string answer = learn::StableBaselinesAnswer(name); !answer.empty())
    return {StatusCode::kInvalidArgument, std::move(answer)};
  std::vector<std::string_view> others;  // algorithms that have it
  for (const learn::Algorithm& other : learn::Algorithms()) {
    if (FindHyperparameter(other.hyperparameters, name) != nullptr) others.emplace_back(other.name);
  }
  if (!others.empty()) {
    return {StatusCode::kInvalidArgument, "algorithm " + std::string(algorithm.name) + " has no " + Quote(name) + "; " +
                                              Join(others) + (others.size() == 1 ? " has" : " have") +
                                              " (--algo NAME, or algorithm: NAME in a file)"};
  }
  std::vector<std::string_view> known;
  for (const Field& field : Fields()) known.emplace_back(field.name);
  known.push_back(kHyperparameters);
  for (const learn::Hyperparameter& row : algorithm.hyperparameters) {
    known.emplace_back(row.name);
    if (row.alias[0] != '\0') known.emplace_back(row.alias);
  }
  const std::string_view meant = NearestName(name, known);
  return {StatusCode::kInvalidArgument,
          "unknown key " + Quote(name) +
              (meant.empty() ? "; 'consac list hyperparameters " + std::string(algorithm.name) + "' shows all"
                             : Suggestion(name, known))};
}

/// Checks a hyperparameter against the algorithm's table and keeps its text, under the table's own name.
Status SetHyperparameter(std::string_view name, std::string_view text, RunConfig* config) {
  const Result<const learn::Algorithm*> algorithm = learn::FindAlgorithm(config->algorithm);
  if (!algorithm.ok()) return algorithm.status();
  const auto table = (*algorithm)->hyperparameters;
  const learn::Hyperparameter* row = FindHyperparameter(table, name);
  if (row == nullptr) return UnknownKey(name, **algorithm);
  learn::HyperparameterSet checked(table);
  CONSAC_RETURN_IF_ERROR(checked.Set(name, text));
  std::erase_if(config->hyperparameters,
                [row](const auto& given) { return given.first == row->name || given.first == row->alias; });
  config->hyperparameters.emplace_back(row->name, std::string(text));
  return Status::Ok();
}

Status SetKey(std::string_view name, const YamlNode& node, RunConfig* config) {
  const Field* field = FindField(name);
  if (field == nullptr) return SetHyperparameter(name, FlowText(node), config);
  if (node.kind == YamlNode::Kind::kScalar) return SetField(*field, node.text, config);
  if (node.kind == YamlNode::Kind::kMap && name == kEnvironmentParameters) {  // a line for each, too
    std::string laws;
    for (const YamlNode& child : node.children) laws += (laws.empty() ? "" : ", ") + child.key + "=" + FlowText(child);
    return SetField(*field, laws, config);
  }
  const std::string found = node.kind == YamlNode::Kind::kNull ? "nothing" : FlowText(node);
  return {StatusCode::kInvalidArgument, std::string(name) + " is " + found + "; expected a " + FieldType(*field)};
}

Status AtLine(std::string_view origin, const YamlNode& node, const Status& status) {
  if (status.ok()) return status;
  return {status.code(), std::string(origin) + ":" + std::to_string(node.line) + ": " + status.message()};
}

Status SetHyperparameters(const YamlNode& map, std::string_view origin, RunConfig* config) {
  if (map.kind == YamlNode::Kind::kNull) return Status::Ok();
  if (map.kind != YamlNode::Kind::kMap) {
    return AtLine(origin, map, {StatusCode::kInvalidArgument, "hyperparameters must be a list of 'name: value'"});
  }
  for (const YamlNode& child : map.children) {
    CONSAC_RETURN_IF_ERROR(AtLine(origin, child, SetHyperparameter(child.key, FlowText(child), config)));
  }
  return Status::Ok();
}

Status ReadTree(const YamlNode& root, std::string_view origin, RunConfig* config) {
  if (root.kind == YamlNode::Kind::kNull) return Status::Ok();
  if (root.kind != YamlNode::Kind::kMap) {
    return AtLine(origin, root, {StatusCode::kInvalidArgument, "expected lines of 'key: value'"});
  }
  // The algorithm first: its table says which other keys there are.
  for (const YamlNode& child : root.children) {
    if (child.key == "algorithm") CONSAC_RETURN_IF_ERROR(AtLine(origin, child, SetKey(child.key, child, config)));
  }
  for (const YamlNode& child : root.children) {
    if (child.key == kHyperparameters) {
      CONSAC_RETURN_IF_ERROR(SetHyperparameters(child, origin, config));
    } else {
      CONSAC_RETURN_IF_ERROR(AtLine(origin, child, SetKey(child.key, child, config)));
    }
  }
  return Status::Ok();
}

/// A double-quoted YAML scalar.
std::string Quoted(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += std::string("\\x") + kHex[byte >> 4] + kHex[byte & 15];
    } else {
      out += c;
    }
  }
  return out + "\"";
}

/// Name, value and what it means for every hyperparameter, resolved; what is given alone where that is impossible.
struct Setting {
  std::string name, value, meaning;
  bool quoted = true;
};

std::vector<Setting> ResolvedHyperparameters(const RunConfig& config) {
  std::vector<Setting> settings;
  const Result<learn::HyperparameterSet> values = HyperparametersOf(config);
  if (!values.ok()) {
    for (const auto& [name, value] : config.hyperparameters) settings.push_back({name, value, "", true});
    return settings;
  }
  for (const learn::Hyperparameter& row : values->table()) {
    const bool text = row.type == learn::ParameterType::kText || row.type == learn::ParameterType::kChoice;
    settings.push_back({row.name, values->Text(row.name), row.meaning, text});
  }
  return settings;
}

void AppendLine(std::string_view indent, const Setting& setting, std::string* out) {
  std::string line =
      std::string(indent) + setting.name + ": " + (setting.quoted ? Quoted(setting.value) : setting.value);
  if (!setting.meaning.empty()) {
    line.resize(std::max<std::size_t>(line.size() + 2, 40), ' ');
    line += "# " + setting.meaning;
  }
  *out += line + "\n";
}

}  // namespace

Status ReadYaml(std::string_view text, std::string_view origin, RunConfig* config) {
  const Result<YamlNode> root = ParseYaml(text, origin);
  if (!root.ok()) return root.status();
  RunConfig next = *config;
  CONSAC_RETURN_IF_ERROR(ReadTree(*root, origin, &next));
  *config = std::move(next);
  return Status::Ok();
}

Status ReadYamlFile(const std::string& path, RunConfig* config) {
  const Result<std::vector<std::byte>> bytes = ReadRegularFile(path, kMaxYamlBytes);
  if (!bytes.ok()) return bytes.status();
  return ReadYaml(std::string_view(reinterpret_cast<const char*>(bytes->data()), bytes->size()), path, config);
}

Status ApplySetting(std::string_view assignment, RunConfig* config) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    return {StatusCode::kInvalidArgument, "setting " + Quote(assignment) + " cannot be used; expected key=value"};
  }
  const std::string_view name = assignment.substr(0, equals), value = assignment.substr(equals + 1);
  const Field* field = FindField(name);
  return field != nullptr ? SetField(*field, value, config) : SetHyperparameter(name, value, config);
}

std::string WriteYaml(const RunConfig& config) {
  std::string out;
  for (const Field& field : Fields()) {
    const bool text = std::holds_alternative<std::string RunConfig::*>(field.member);
    AppendLine("", {field.name, FieldText(field, config), field.meaning, text}, &out);
  }
  const std::vector<Setting> hyperparameters = ResolvedHyperparameters(config);
  if (!hyperparameters.empty()) out += std::string(kHyperparameters) + ":\n";
  for (const Setting& setting : hyperparameters) AppendLine("  ", setting, &out);
  return out;
}

std::vector<ConfigField> ConfigFields() {
  std::vector<ConfigField> rows;
  for (const Field& field : Fields())
    rows.push_back({field.name, FieldType(field), FieldText(field, RunConfig{}), field.meaning});
  return rows;
}

}  // namespace consac::run
