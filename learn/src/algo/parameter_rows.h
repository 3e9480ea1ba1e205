#pragma once
// One row says everything about a hyperparameter: its name in both generations, the member of the algorithm's options
// that it fills, both defaults, range, meaning and source. From these rows come the table that the program shows and
// the options that the algorithm reads. Private to learn.

#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "consac/learn/algo/hyperparameters.h"
#include "consac/nn/net_arch.h"

namespace consac::learn {

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();
/// Choices of an activation.
inline constexpr const char* kActivationNames = "tanh|relu|sigmoid|elu|leaky_relu|silu|softplus|linear";

/// Who has it. kBoth: named after the generation whose table it stands in.
enum class ParameterSource : std::uint8_t { kBoth, kSb2, kSb3, kVecNormalize, kConsac };

/// Which member of `Options` a row fills, and thereby which values it takes.
template <class Options>
struct ParameterMember {
  ParameterType type;
  Status (*read)(const HyperparameterSet& values, const char* name, const char* choices, Options* options);
};

/// One row. Numbers may be "none" where `choices` says so or a generation's own default is.
template <class Options>
struct ParameterRow {
  const char* sb2_name;             ///< Stable Baselines 2.10.2's, or ours
  const char* sb3_name;             ///< Stable Baselines3's
  ParameterMember<Options> member;  ///< where the value goes
  const char* sb2_default;          ///< as text
  const char* sb3_default;          ///< as text
  double low, high;                 ///< legal numbers
  const char* choices;              ///< as Hyperparameter's
  const char* meaning;              ///< as Hyperparameter's
  ParameterSource source;           ///< who has it

  /// The same with other defaults.
  constexpr ParameterRow WithDefaults(const char* sb2, const char* sb3) const {
    ParameterRow row = *this;
    row.sb2_default = sb2;
    row.sb3_default = sb3;
    return row;
  }
  /// The same where Stable Baselines 2 calls it otherwise.
  constexpr ParameterRow WithSb2Name(const char* name) const {
    ParameterRow row = *this;
    row.sb2_name = name;
    return row;
  }
};

/// What the two generations call the algorithm: "Stable Baselines3, PPO".
struct SourceNames {
  const char* sb2;
  const char* sb3;
};

// One for each type that a member may have. "none" is 0, or an absent Schedule.
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, std::int64_t* out);
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, double* out);
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, float* out);
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, bool* out);
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, Schedule* out);
/// "auto" is absent.
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices,
                     std::optional<nn::NetArch>* out);
Status ReadParameter(const HyperparameterSet& values, const char* name, const char* choices, nn::Activation* out);
/// An enum whose values stand in the order of the choices.
template <class Enum>
requires std::is_enum_v<Enum> Status ReadParameter(const HyperparameterSet& values, const char* name,
                                                   const char* choices, Enum* out) {
  const std::string& text = values.Text(name);
  std::underlying_type_t<Enum> place = 0;
  for (const char* at = choices;
       std::strncmp(at, text.c_str(), text.size()) != 0 || (at[text.size()] != '|' && at[text.size()] != '\0');
       ++place) {
    at = std::strchr(at, '|');
    CONSAC_ASSERT(at != nullptr);
    if (at == nullptr) return Status::Ok();
    ++at;
  }
  *out = static_cast<Enum>(place);
  return Status::Ok();
}

/// A text that the type reads itself: T::Parse(text) is a Result<T>.
template <class T>
requires requires(std::string_view text) {
  T::Parse(text);
}
Status ReadParameter(const HyperparameterSet& values, const char* name, const char*, T* out) {
  auto value = T::Parse(values.Text(name));
  if (value.ok()) {
    *out = *value;
    return Status::Ok();
  }
  return {value.status().code(), std::string(name) + " " + value.status().message()};
}

/// Which kind of value fills a T.
template <class T>
constexpr ParameterType ParameterTypeOf() {
  if constexpr (std::is_same_v<T, std::int64_t>) return ParameterType::kInteger;
  if constexpr (std::is_floating_point_v<T>) return ParameterType::kReal;
  if constexpr (std::is_same_v<T, bool>) return ParameterType::kBoolean;
  if constexpr (std::is_same_v<T, Schedule>) return ParameterType::kSchedule;
  if constexpr (std::is_same_v<T, std::optional<nn::NetArch>>) return ParameterType::kText;
  if constexpr (requires(std::string_view text) { T::Parse(text); }) return ParameterType::kText;
  return ParameterType::kChoice;
}

template <class Options, class Member, class... Further>
constexpr auto& MemberOf(Options& options, Member member, Further... further) {
  if constexpr (sizeof...(further) == 0)
    return options.*member;
  else
    return MemberOf(options.*member, further...);
}

/// The member that `path` leads to: Into<PpoOptions, &PpoOptions::adam, &AdamOptions::epsilon>.
template <class Options, auto... path>
inline constexpr ParameterMember<Options> Into = {
    ParameterTypeOf<std::remove_reference_t<decltype(MemberOf(std::declval<Options&>(), path...))>>(),
    [](const HyperparameterSet& values, const char* name, const char* choices, Options* options) {
      return ReadParameter(values, name, choices, &MemberOf(*options, path...));
    }};

/// The row without its member: what tables are made of, whatever the options.
struct ParameterText {
  const char *sb2_name, *sb3_name;
  ParameterType type;
  const char *sb2_default, *sb3_default;
  double low, high;
  const char *choices, *meaning;
  ParameterSource source;
};
/// The row as a generation's table shows it.
Hyperparameter TableRow(const ParameterText& row, Generation generation, const SourceNames& names);

/// A generation's table from groups of rows (a tuple of spans of ParameterRow).
template <class Groups>
std::vector<Hyperparameter> TableOf(const Groups& groups, Generation generation, const SourceNames& names) {
  std::vector<Hyperparameter> table;
  const auto append = [&](const auto& rows) {
    for (const auto& row : rows) {
      table.push_back(TableRow({row.sb2_name, row.sb3_name, row.member.type, row.sb2_default, row.sb3_default, row.low,
                                row.high, row.choices, row.meaning, row.source},
                               generation, names));
    }
  };
  std::apply([&](const auto&... rows) { (append(rows), ...); }, groups);
  return table;
}

/// Fills the members that the rows of `groups` name; the error names the parameter.
template <class Groups, class Options>
Status ReadRows(const Groups& groups, const HyperparameterSet& values, Options* options) {
  Status status;
  const auto read = [&](const auto& rows) {
    for (const auto& row : rows) {
      if (status.ok()) status = row.member.read(values, row.sb3_name, row.choices, options);
    }
  };
  std::apply([&](const auto&... rows) { (read(rows), ...); }, groups);
  return status;
}

}  // namespace consac::learn
