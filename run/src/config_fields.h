#pragma once
// The one table of RunConfig's fields that configure a run: reading, writing, --set, help, documents and "did you mean"
// come from it. Private to run.

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "consac/learn/algo/hyperparameters.h"
#include "consac/run/config.h"

namespace consac::run {

/// Which member a row speaks of, and thereby which values it takes.
using FieldMember = std::variant<std::string RunConfig::*, std::int64_t RunConfig::*, std::uint64_t RunConfig::*,
                                 std::int32_t RunConfig::*, double RunConfig::*, bool RunConfig::*>;

/// The most steps that a run can be given, whoever gives them.
inline constexpr std::int64_t kMostSteps = 9'000'000'000'000'000'000;

/// Whether a resumed run may be given another value than it began with.
enum class OnResume : std::uint8_t { kMayChange, kMustStay };

/// One row.
struct Field {
  const char* name;                         ///< key in YAML and --set
  FieldMember member;                       ///< where the value lives
  double low, high;                         ///< legal numbers
  OnResume on_resume;                       ///< kMustStay: the result depends on it
  Status (*check)(std::string_view value);  ///< of a text, or null
  const char* meaning;                      ///< one line
};

/// Every row, in the order in which they are written.
std::span<const Field> Fields();
/// The row of that name, or null.
const Field* FindField(std::string_view name);
/// Sets a field from text; the error says what was expected.
Status SetField(const Field& field, std::string_view text, RunConfig* config);
/// Whether SetField has set it: a value that was asked for, be it the default.
bool WasGiven(const Field& field, const RunConfig& config);
/// The value as text, without quotes.
std::string FieldText(const Field& field, const RunConfig& config);
/// "whole number", "true or false", ...
const char* FieldType(const Field& field);

/// Every hyperparameter of the configuration's algorithm: its own defaults or the preset's, then what is given. The
/// error is that of the first that cannot be used.
Result<learn::HyperparameterSet> HyperparametersOf(const RunConfig& config);

}  // namespace consac::run
