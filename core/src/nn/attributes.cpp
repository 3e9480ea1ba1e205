#include "consac/nn/attributes.h"

#include <nlohmann/json.hpp>

#include "consac/base/json.h"
#include "consac/base/text.h"

namespace consac::nn {
namespace {

using AttributeJson = nlohmann::json;

/// The value of that name, or null.
AttributeJson AttributeOf(const std::map<std::string, std::string, std::less<>>& values, std::string_view name) {
  const auto found = values.find(name);
  if (found == values.end()) return {};
  Result<AttributeJson> json = ReadJson<AttributeJson>(found->second);
  return json.ok() ? *std::move(json) : AttributeJson();
}

}  // namespace

void Attributes::SetInteger(std::string name, std::int64_t value) {
  SetJson(std::move(name), std::to_string(value));
}
void Attributes::SetNumber(std::string name, double value) {
  SetJson(std::move(name), NumberText(value));
}
void Attributes::SetText(std::string name, std::string_view value) {
  SetJson(std::move(name), JsonText(AttributeJson(value)));
}
void Attributes::SetIntegers(std::string name, std::span<const std::int64_t> values) {
  SetJson(std::move(name), JsonText(AttributeJson(std::vector<std::int64_t>(values.begin(), values.end()))));
}
void Attributes::SetJson(std::string name, std::string json) {
  json_.insert_or_assign(std::move(name), std::move(json));
}

std::optional<std::int64_t> Attributes::Integer(std::string_view name) const {
  const AttributeJson value = AttributeOf(json_, name);
  if (!value.is_number_integer()) return std::nullopt;
  return value.get<std::int64_t>();
}

std::optional<double> Attributes::Number(std::string_view name) const {
  const AttributeJson value = AttributeOf(json_, name);
  if (!value.is_number()) return std::nullopt;
  return value.get<double>();
}

std::optional<std::string> Attributes::Text(std::string_view name) const {
  const AttributeJson value = AttributeOf(json_, name);
  if (!value.is_string()) return std::nullopt;
  return value.get<std::string>();
}

std::optional<std::vector<std::int64_t>> Attributes::Integers(std::string_view name) const {
  const AttributeJson value = AttributeOf(json_, name);
  if (!value.is_array()) return std::nullopt;
  std::vector<std::int64_t> list;
  for (const AttributeJson& element : value) {
    if (!element.is_number_integer()) return std::nullopt;
    list.push_back(element.get<std::int64_t>());
  }
  return list;
}

}  // namespace consac::nn
