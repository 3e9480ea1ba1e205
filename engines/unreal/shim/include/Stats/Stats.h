#pragma once
#include "CoreMinimal.h"

namespace Shim {
/// A number on the screen.
struct Stat {
  const TCHAR* name;
  float value = 0.0f;
};
struct StatGroup {
  const TCHAR* name;
};
enum class StatCategory { Advanced };
/// For tests: what was shown last under a name.
float& ShownStat(const TCHAR* name);
}  // namespace Shim

inline constexpr Shim::StatCategory STATCAT_Advanced = Shim::StatCategory::Advanced;
#define DECLARE_STATS_GROUP(text, group, category)           \
  [[maybe_unused]] static const Shim::StatGroup group{text}; \
  static_assert(category == Shim::StatCategory::Advanced)
#define DECLARE_FLOAT_ACCUMULATOR_STAT(text, stat, group) \
  static Shim::Stat stat{text};                           \
  static_assert(sizeof(group) > 0)
#define SET_FLOAT_STAT(stat, number) (Shim::ShownStat(stat.name) = stat.value = (number))
