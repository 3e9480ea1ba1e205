#pragma once
// One table of hyperparameters per algorithm, and values for it. Command line, YAML, checks, documents, engine
// properties and searches are generated from the table; nothing repeats its names.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "consac/base/status.h"

namespace consac::learn {

/// What kind of value a hyperparameter takes.
enum class ParameterType : std::uint8_t {
  kReal,      ///< a number
  kInteger,   ///< a whole number
  kBoolean,   ///< true or false
  kSchedule,  ///< a number, or "lin_X": X times the remaining progress, 1 -> 0
  kChoice,    ///< one of `choices`
  kText,      ///< anything; checked by the algorithm (net_arch)
};

/// Whose definition is meant where the two generations of Stable Baselines differ: 2.10.2 or 3.
enum class Generation : std::uint8_t { kStableBaselines2, kStableBaselines3 };
/// "sb2" or "sb3"; the error names both.
Result<Generation> ParseGeneration(std::string_view name);

/// One row of an algorithm's table. It is made from a row that says which member of the algorithm's options it fills:
/// learn/src/algo/parameter_rows.h.
struct Hyperparameter {
  const char* name;           ///< Stable Baselines' name
  const char* alias;          ///< the other generation's name for the same thing, or ""
  ParameterType type;         ///< what it takes
  const char* default_value;  ///< as text; "none" where a parameter may be absent
  const char* sb2_default;    ///< as text; what Stable Baselines 2.10.2 would have here
  const char* sb3_default;    ///< as text; what Stable Baselines3 would have here
  double low;                 ///< smallest legal number
  double high;                ///< largest legal number
  const char* choices;        ///< kChoice: "a|b|c"; numbers: "none" where the value may be absent; else ""
  const char* meaning;        ///< one line: what it does, unit
  const char* source;         ///< where name and default come from
};

/// What to do about a name of Stable Baselines' that an algorithm's table lacks (`device`, `policy_kwargs`): one
/// sentence;
/// "" where it is none of theirs.
std::string StableBaselinesAnswer(std::string_view name);

/// A constant or linear schedule of progress remaining.
struct Schedule {
  double value = 0.0;   ///< the constant, or the value at the start
  bool linear = false;  ///< times the remaining progress
  bool absent = false;  ///< "none"
  /// The value when `remaining` (1 at the start, 0 at the end) of the training is left.
  double At(double remaining) const { return linear ? value * remaining : value; }
};

/// Values for a table: defaults until set. Setting checks type and range.
class HyperparameterSet {
 public:
  /// All defaults. `table` must outlive this (tables are static).
  explicit HyperparameterSet(std::span<const Hyperparameter> table);
  /// Every value becomes that generation's default.
  void UseDefaultsOf(Generation generation);
  /// The same of a generation's name, sb2 or sb3; an empty one changes nothing.
  Status UsePreset(std::string_view name);
  /// Sets by name or alias from text; an unknown name is an error that names the nearest, or what takes its place.
  Status Set(std::string_view name, std::string_view text);

  /// The table.
  std::span<const Hyperparameter> table() const { return table_; }
  /// The value as text, by name or alias. Asking for a name that the table lacks is a caller's mistake.
  const std::string& Text(std::string_view name) const;
  /// True when the value is "none".
  bool Absent(std::string_view name) const;
  /// As a number.
  double Real(std::string_view name) const;
  /// As a whole number.
  std::int64_t Integer(std::string_view name) const;
  /// As true or false.
  bool Boolean(std::string_view name) const;
  /// As a schedule.
  Schedule AsSchedule(std::string_view name) const;
  /// True when the value differs from the default.
  bool Changed(std::string_view name) const;

 private:
  std::span<const Hyperparameter> table_;
  std::vector<std::string> values_;
};

}  // namespace consac::learn
