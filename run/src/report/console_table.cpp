#include "report/console_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace consac::run {
namespace {

using TableLine = std::pair<std::string, std::string>;  // key, value, as shown

// Texts longer than `limit` end in "...", `limit` characters in all (Stable Baselines 2: 23, 3: 36).
std::string Truncate(std::string text, std::size_t limit, std::size_t kept) {
  if (text.size() <= limit) return text;
  text.resize(kept);
  return text + "...";
}

std::vector<TableLine> FlatLines(const learn::Row& row) {
  std::vector<TableLine> lines;
  for (const learn::Cell& cell : row)
    lines.emplace_back(Truncate(std::string(cell.key), 23, 20), Truncate(TableText(cell), 23, 20));
  return lines;
}

// "train/loss" stands indented under a line "train/".
std::vector<TableLine> SectionLines(const learn::Row& row) {
  std::vector<TableLine> lines;
  std::string section;
  for (const learn::Cell& cell : row) {
    std::string key(cell.key);
    const std::size_t slash = key.find('/');
    if (slash != std::string::npos && slash > 0 && key.compare(0, slash + 1, section) != 0) {
      section = key.substr(0, slash + 1);
      lines.emplace_back(Truncate(section, 36, 33), "");
    }
    if (!section.empty() && key.starts_with(section)) key = "   " + key.substr(section.size());
    lines.emplace_back(Truncate(std::move(key), 36, 33), Truncate(TableText(cell), 36, 33));
  }
  return lines;
}

}  // namespace

std::string TableText(const learn::Cell& cell) {
  return cell.kind == learn::CellKind::kDouble ? fmt::format("{:<8.3g}", cell.value) : learn::ExactText(cell);
}

std::string FormatTable(learn::LogStyle style, const learn::Row& row) {
  if (row.empty()) return {};
  // Stable Baselines 2 knows no sections, until several behaviours have one each.
  const bool flat =
      style == learn::LogStyle::kStableBaselines2 &&
      std::none_of(row.begin(), row.end(), [](const learn::Cell& cell) { return cell.key.find('/') != cell.key.npos; });
  const std::vector<TableLine> lines = flat ? FlatLines(row) : SectionLines(row);
  std::size_t key_width = 0, value_width = 0;
  for (const auto& [key, value] : lines) {
    key_width = std::max(key_width, key.size());
    value_width = std::max(value_width, value.size());
  }
  const std::string rule(key_width + value_width + 7, '-');
  std::string table = rule + '\n';
  for (const auto& [key, value] : lines)
    table += fmt::format("| {:<{}} | {:<{}} |\n", key, key_width, value, value_width);
  return table + rule + '\n';
}

}  // namespace consac::run
