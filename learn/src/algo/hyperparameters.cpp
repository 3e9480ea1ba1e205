#include "consac/learn/algo/hyperparameters.h"

#include <cmath>
#include <limits>

#include "consac/base/text.h"

namespace consac::learn {
namespace {

constexpr std::string_view kNone = "none";
constexpr std::string_view kLinearPrefix = "lin_";

Status Unusable(const Hyperparameter& row, std::string_view text, const std::string& expected) {
  return {StatusCode::kInvalidArgument,
          std::string(row.name) + " = " + Quote(text) + " cannot be used; expected " + expected};
}

bool MayBeAbsent(const Hyperparameter& row) {
  return std::string_view(row.choices) == kNone;
}

std::string LowerCase(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return out;
}

std::string RangeText(const Hyperparameter& row) {
  const bool low = std::isfinite(row.low), high = std::isfinite(row.high);
  if (low && high) return "from " + NumberText(row.low) + " to " + NumberText(row.high);
  if (low) return "of at least " + NumberText(row.low);
  return high ? "of at most " + NumberText(row.high) : "";
}

Result<std::string> CanonicalNumber(const Hyperparameter& row, std::string_view text, std::string_view number) {
  double value = 0.0;
  const bool whole = row.type == ParameterType::kInteger;
  const bool fits = ParseHumanNumber(number, &value) && value >= row.low && value <= row.high &&
                    (!whole || value == std::floor(value));
  if (fits) return NumberText(value);
  const std::string range = RangeText(row);
  return Unusable(row, text,
                  std::string(whole ? "a whole number" : "a number") + (range.empty() ? "" : " " + range) +
                      (row.type == ParameterType::kSchedule ? ", or lin_ and a number" : "") +
                      (MayBeAbsent(row) ? ", or none" : ""));
}

Result<std::string> CanonicalChoice(const Hyperparameter& row, std::string_view text) {
  std::string_view left = row.choices;
  while (!left.empty()) {
    const std::size_t bar = left.find('|');
    if (left.substr(0, bar) == text) return std::string(text);
    left = bar == std::string_view::npos ? std::string_view{} : left.substr(bar + 1);
  }
  return Unusable(row, text, "one of " + std::string(row.choices));
}

/// The text in the form that is stored and written back; the error says what was expected.
Result<std::string> Canonical(const Hyperparameter& row, std::string_view text) {
  const std::string lower = LowerCase(text);
  if (lower == kNone || lower == "null" || lower == "~") {
    if (MayBeAbsent(row)) return std::string(kNone);
  }
  switch (row.type) {
    case ParameterType::kReal:
    case ParameterType::kInteger:
      return CanonicalNumber(row, text, text);
    case ParameterType::kSchedule: {
      if (!lower.starts_with(kLinearPrefix)) return CanonicalNumber(row, text, text);
      Result<std::string> number = CanonicalNumber(row, text, text.substr(kLinearPrefix.size()));
      if (!number.ok()) return number;
      return std::string(kLinearPrefix) + *number;
    }
    case ParameterType::kBoolean:
      if (text == "true" || text == "True") return std::string("true");
      if (text == "false" || text == "False") return std::string("false");
      return Unusable(row, text, "true or false");
    case ParameterType::kChoice:
      return CanonicalChoice(row, text);
    case ParameterType::kText:
      break;
  }
  return std::string(text);
}

std::size_t FindRow(std::span<const Hyperparameter> table, std::string_view name) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table[i].name == name || (table[i].alias[0] != '\0' && table[i].alias == name)) return i;
  }
  return table.size();
}

}  // namespace

HyperparameterSet::HyperparameterSet(std::span<const Hyperparameter> table) : table_(table) {
  for (const Hyperparameter& row : table) values_.emplace_back(row.default_value);
}

Result<Generation> ParseGeneration(std::string_view name) {
  if (name == "sb2") return Generation::kStableBaselines2;
  if (name == "sb3") return Generation::kStableBaselines3;
  return Status{StatusCode::kInvalidArgument, "there are no defaults " + Quote(name) + "; expected sb2 or sb3"};
}

Status HyperparameterSet::UsePreset(std::string_view name) {
  if (name.empty()) return Status::Ok();
  const Result<Generation> generation = ParseGeneration(name);
  if (generation.ok()) UseDefaultsOf(*generation);
  return generation.status();
}

void HyperparameterSet::UseDefaultsOf(Generation generation) {
  for (std::size_t i = 0; i < table_.size(); ++i) {
    values_[i] = generation == Generation::kStableBaselines2 ? table_[i].sb2_default : table_[i].sb3_default;
  }
}

Status HyperparameterSet::Set(std::string_view name, std::string_view text) {
  const std::size_t row = FindRow(table_, name);
  if (row == table_.size()) {
    if (std::string answer = StableBaselinesAnswer(name); !answer.empty())
      return {StatusCode::kInvalidArgument, std::move(answer)};
    std::vector<std::string_view> known;
    for (const Hyperparameter& entry : table_) {
      known.emplace_back(entry.name);
      if (entry.alias[0] != '\0') known.emplace_back(entry.alias);
    }
    return {StatusCode::kInvalidArgument, "unknown hyperparameter " + Quote(name) + Suggestion(name, known)};
  }
  Result<std::string> value = Canonical(table_[row], text);
  if (!value.ok()) return value.status();
  values_[row] = std::move(*value);
  return Status::Ok();
}

const std::string& HyperparameterSet::Text(std::string_view name) const {
  static const std::string kUnknown;
  const std::size_t row = FindRow(table_, name);
  CONSAC_ASSERT(row < table_.size());
  return row < table_.size() ? values_[row] : kUnknown;
}

bool HyperparameterSet::Absent(std::string_view name) const {
  return Text(name) == kNone;
}

double HyperparameterSet::Real(std::string_view name) const {
  double value = 0.0;
  return ParseNumber(Text(name), &value) ? value : std::numeric_limits<double>::quiet_NaN();
}

std::int64_t HyperparameterSet::Integer(std::string_view name) const {
  const double value = Real(name);
  return std::isfinite(value) ? static_cast<std::int64_t>(value) : 0;
}

bool HyperparameterSet::Boolean(std::string_view name) const {
  return Text(name) == "true";
}

Schedule HyperparameterSet::AsSchedule(std::string_view name) const {
  std::string_view text = Text(name);
  Schedule schedule;
  schedule.absent = text == kNone;
  schedule.linear = text.starts_with(kLinearPrefix);
  if (schedule.linear) text.remove_prefix(kLinearPrefix.size());
  (void)ParseNumber(text, &schedule.value);
  return schedule;
}

bool HyperparameterSet::Changed(std::string_view name) const {
  const std::size_t row = FindRow(table_, name);
  return row < table_.size() && values_[row] != table_[row].default_value;
}

}  // namespace consac::learn
