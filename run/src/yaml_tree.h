#pragma once
// YAML text as a small tree of texts with line numbers: no types guessed, no anchors, no tags, no duplicate keys, and
// limits on size and depth, so that a hostile file costs nothing. Private to run; configuration is its only user.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "consac/base/status.h"

namespace consac::run {

/// A node. Scalars keep their text as written (quotes and escapes undone).
struct YamlNode {
  /// What it is.
  enum class Kind : std::uint8_t { kNull, kScalar, kSequence, kMap };
  Kind kind = Kind::kNull;         ///< null: nothing, or ~
  int line = 1;                    ///< where it begins, from 1; in a map, where its key stands
  std::string key;                 ///< its key, in a map
  std::string text;                ///< kScalar
  std::vector<YamlNode> children;  ///< kSequence and kMap, in order
};

/// Longest text, deepest nesting and most nodes that are read.
inline constexpr std::size_t kMaxYamlBytes = 1 << 20;
inline constexpr int kMaxYamlDepth = 16;
inline constexpr int kMaxYamlNodes = 10000;

/// Reads one document; the error begins with "origin:line: ".
Result<YamlNode> ParseYaml(std::string_view text, std::string_view origin);
/// A node on one line: "[64, {pi: [64], vf: [64]}]"; nothing is "none".
std::string FlowText(const YamlNode& node);

}  // namespace consac::run
