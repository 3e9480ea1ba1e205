#include "report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "consac/base/text.h"

namespace consac::run {
namespace {

// Source: stable_baselines/logger.py and stable_baselines3/common/logger.py, HumanOutputFormat.
constexpr std::size_t kLongestSb2 = 23;
constexpr std::size_t kLongestSb3 = 36;

std::string Cut(const std::string& text, std::size_t longest) {
  return text.size() > longest ? text.substr(0, longest - 3) + "..." : text;
}

std::string RenderFlat(const Cells& cells) {
  std::vector<std::pair<std::string, std::string>> rows;
  std::size_t key_width = 0, value_width = 0;
  for (const auto& [key, cell] : cells) {
    rows.emplace_back(Cut(key, kLongestSb2), Cut(CellText(cell), kLongestSb2));
    key_width = std::max(key_width, rows.back().first.size());
    value_width = std::max(value_width, rows.back().second.size());
  }
  const std::string rule(key_width + value_width + 7, '-');
  std::string out = rule + "\n";
  for (const auto& [key, value] : rows) out += fmt::format("| {:<{}} | {:<{}} |\n", key, key_width, value, value_width);
  return out + rule + "\n";
}

std::string RenderSections(const Cells& cells) {
  std::vector<std::pair<std::string, std::string>> rows;
  std::string section;
  for (const auto& [key, cell] : cells) {
    const std::size_t slash = key.find('/');
    if (slash != std::string::npos && key.substr(0, slash + 1) != section) {
      section = key.substr(0, slash + 1);
      rows.emplace_back(section, "");
    }
    rows.emplace_back(slash == std::string::npos ? Cut(key, kLongestSb3) : "   " + Cut(key.substr(slash + 1), kLongestSb3 - 3), CellText(cell));
  }
  std::size_t key_width = 0, value_width = 0;
  for (const auto& [key, value] : rows) {
    key_width = std::max(key_width, key.size());
    value_width = std::max(value_width, value.size());
  }
  const std::string rule(key_width + value_width + 7, '-');
  std::string out = rule + "\n";
  for (const auto& [key, value] : rows) out += fmt::format("| {:<{}} | {:<{}} |\n", key, key_width, value, value_width);
  return out + rule + "\n";
}

}  // namespace

std::string CellText(const Cell& cell) {
  if (std::isnan(cell.value)) return "nan";
  if (cell.whole) return std::to_string(static_cast<std::int64_t>(cell.value));
  if (cell.single_precision) {
    char digits[32];
    return std::string(digits, FormatNumber(static_cast<float>(cell.value), std::span<char, 32>(digits)));
  }
  return fmt::format("{:<8}", fmt::format("{:.3g}", cell.value));
}

std::string RenderTable(const Cells& cells, learn::LogStyle style) {
  return style == learn::LogStyle::kStableBaselines2 ? RenderFlat(cells) : RenderSections(cells);
}

}  // namespace consac::run
